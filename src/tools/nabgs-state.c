/* nabgs-state.c: see nabgs-state.h. */
#include "config.h"
#include "tools/nabgs-state.h"
#include "formats/format.h"
#include "formats/io.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <stdio.h>
#include <unistd.h>

void nabgs_state_free(struct nabgs_state *s)
{
	free(s->path);
	free(s->run);
}

static const char *input_of(const struct ct_meta *m)
{
	const char *s = ct_meta_get(m, "input");

	return s ? s : "-";
}

/* What a state belongs to: all that can change the result. */
int nabgs_state_name(struct nabgs_state *s, const struct ct_evidence *d,
	const struct ct_fit_options *o, const struct ct_env *env, struct ct_err *e)
{
	s->env = env;
	if (asprintf(&s->run,
		    "%s %s %s %s %s; window %.17g:%.17g; seed %llu; %zu iterations, %zu to %zu "
		    "Gaussians until %zu, %s, %s, L1 %.17g, SSIM %.17g, TV %.17g, begin %.17g, "
		    "scaling %.17g, tolerance %.17g, LR %.17g, begin %d, refit %zu, "
		    "compat %d, rate_factor %.17g",
		    input_of(&d->in.meta), input_of(&d->base.meta), input_of(&d->base_proj.meta),
		    input_of(&d->weight.meta), input_of(&d->lr.meta), d->window[0], d->window[1],
		    (unsigned long long)env->seed, o->iterations, o->gaussians, o->max_gaussians,
		    o->densify_until, ct_activation_name(o->activation),
		    o->full ? "full" : "residual", o->l1 + o->res, o->ssim, o->tv, o->start_density,
		    o->scaling.first, o->tolerance, o->lr, (int)o->place, o->refit, (int)o->compat,
		    o->rate_factor) < 0) {
		s->run = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	return 0;
}

int nabgs_state_save(void *ctx, const struct ct_fit *f, struct ct_err *e)
{
	const struct nabgs_state *s = ctx;
	struct ct_env env = *s->env;
	struct ct_tensors t = {0};
	int rc = -1;

	env.force = true; /* over the state before */
	if (ct_fit_state_pack(&t, f, s->run, e) == 0)
		rc = ct_tensors_write(s->path, &t, false, &env, e);
	ct_tensors_free(&t);
	return rc;
}

int nabgs_state_resume(struct ct_fit *f, const struct nabgs_state *s, struct ct_err *e)
{
	struct ct_tensors t = {0};
	int rc = -1;

	if (access(s->path, F_OK) != 0 && errno == ENOENT)
		return 0;
	if (ct_tensors_read(s->path, &t, e) == 0) {
		rc = ct_fit_state_unpack(f, &t, s->run, e);
		if (rc)
			ct_blame(e, s->path);
		else
			ct_log(s->env, CT_INFO, "%s: continuing after iteration %zu", s->path,
				f->g.step);
	}
	ct_tensors_free(&t);
	return rc;
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
