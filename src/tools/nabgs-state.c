/* nabgs-state.c: see nabgs-state.h. */
#include "config.h"
#include "tools/nabgs-state.h"

#include <jansson.h>
#include <stdio.h>

static int pack(struct ct_tensors *t, const void *fit, struct ct_err *e)
{
	return ct_fit_state_pack(t, fit, e);
}

int nabgs_state_save(void *run, const struct ct_fit *f, struct ct_err *e)
{
	return ct_resume_save(run, pack, f, e);
}

int nabgs_state_rescue(struct ct_resume *run, const struct ct_fit *f, struct ct_err *e)
{
	return f->end == CT_FIT_EMPTY ? -1 : ct_resume_rescue(run, pack, f, e);
}

int nabgs_state_load(
	struct ct_fit *f, struct ct_resume *run, const struct ct_env *env, struct ct_err *e)
{
	struct ct_tensors t = {0};
	int rc = ct_resume_load(run, &t, e);

	if (rc == 0 && ct_fit_state_unpack(f, &t, e))
		rc = ct_blame(e, run->path);
	if (rc == 0)
		ct_log(env, CT_INFO, "%s: continuing after iteration %zu", run->path, f->g.step);
	ct_tensors_free(&t);
	return rc < 0 ? -1 : 0;
}

static void print_report(const struct ct_fit *f, size_t pos, size_t neg)
{
	printf("gaussians %zu\npositive %zu\nnegative %zu\ngamma %.6g\nfirst-loss %.6g\n"
	       "last-loss %.6g\nerror %.6g\niterations %zu\nended-by %s\n",
		f->g.n, pos, neg, f->g.gamma, f->first_loss, f->last_loss, f->error, f->g.step,
		ct_fit_end_name(f->end));
	for (size_t i = 0; i < f->points; i++)
		printf("error-with %.0f %.6g\n", (double)f->point[i].gaussians,
			(double)f->point[i].error);
}

int nabgs_report(const struct ct_fit *f, bool json, struct ct_err *e)
{
	size_t pos, neg;
	json_t *o, *curve = NULL;
	int bad = 0;

	ct_fit_signs(&f->g, &pos, &neg);
	if (!json) {
		print_report(f, pos, neg);
		return 0;
	}
	o = json_pack("{sI sI sI sf sf sf sf sI ss so}", "gaussians", (json_int_t)f->g.n,
		"positive", (json_int_t)pos, "negative", (json_int_t)neg, "gamma", f->g.gamma,
		"first-loss", f->first_loss, "last-loss", f->last_loss, "error", f->error,
		"iterations", (json_int_t)f->g.step, "ended-by", ct_fit_end_name(f->end), "curve",
		curve = json_array());
	for (size_t i = 0; o && i < f->points; i++)
		bad |= json_array_append_new(curve,
			json_pack("{sI sf sI}", "gaussians", (json_int_t)f->point[i].gaussians,
				"error", (double)f->point[i].error, "iteration",
				(json_int_t)f->point[i].iteration));
	if (!o || bad) {
		json_decref(o);
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
	putchar('\n'); /* ct_cli_main checks standard output */
	json_decref(o);
	return 0;
}
