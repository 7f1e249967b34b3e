/* ct-upsample: a CT interpolated on a finer grid over the same field of view. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/io.h"
#include "kern/degrade.h"
#include "kern/resample.h"

#include <math.h>

struct params {
	const char *in, *out, *factor;
	int method;
};

static const struct params defaults = {.method = CT_CUBIC};

#define METHODS "linear|cubic|bspline|lanczos"
static const char *const method_name[] = {"linear", "cubic", "bspline", "lanczos"}; /* by enum */

static const struct ct_opt opts[] = {
	CT_ARG(struct params, in, "IN", "low-resolution CT, NIfTI, or -"),
	CT_ARG(struct params, out, "OUT", "the CT on the finer grid, NIfTI, or -"),
	CT_OPT(struct params, factor, 'x', "factor", "S|X,Y,Z", 0, 0,
		"refine every axis S times, or the three axes X, Y, Z times; the factor that IN "
		"says "
		"it was reduced by if not given, and that one if it is"),
	CT_CHOICE(struct params, method, 'm', "method", METHODS, "interpolate so"),
	CT_OPT_END,
};

/* The factors of -x, or of the file; a contradiction is an error. */
static int factor_of(
	size_t factor[3], const struct params *p, const struct ct_meta *m, struct ct_err *e)
{
	struct ct_degrade d = {{0}, {0}, CT_DECIMATE_SINC};
	bool done = ct_meta_get(m, "upsample") != NULL; /* the factor was used up */
	int known = done ? 1 : ct_degrade_get(m, &d, e);
	double x[3];

	if (known < 0)
		return ct_blame(e, p->in);
	if (!p->factor && known > 0)
		return ct_fail(e, CT_EUSAGE, "-x is missing, and %s %s", p->in,
			done ? "is upsampled already" : "does not say by how much it was reduced");
	if (p->factor && ct_parse_numbers("factor", p->factor, ',', 3, true, x, e))
		return -1;
	for (int a = 0; a < 3; a++) {
		if (!p->factor)
			x[a] = (double)d.factor[a];
		if (!(x[a] >= 1 && x[a] <= 1024) || x[a] != floor(x[a]))
			return ct_fail(
				e, CT_EUSAGE, "-x: %g is not a whole number in [1, 1024]", x[a]);
		factor[a] = (size_t)x[a];
		if (known == 0 && factor[a] != d.factor[a])
			return ct_fail(e, CT_EUSAGE,
				"-x %s contradicts %s, which was reduced "
				"%zu,%zu,%zu times",
				p->factor, p->in, d.factor[0], d.factor[1], d.factor[2]);
	}
	return 0;
}

static int upsample(struct ct_vol *hi, const struct ct_vol *lo, const size_t factor[3],
	enum ct_interp method, const struct ct_env *env, struct ct_err *e)
{
	const double finer[3] = {(double)factor[0], (double)factor[1], (double)factor[2]};
	struct ct_separable s = {0};
	size_t n[3];
	int rc = -1;

	if (ct_upsample_plan(&s, lo->n, factor, method, env->par, e))
		return -1;
	for (int a = 0; a < 3; a++)
		n[a] = s.t[a].n_out;
	if (ct_vol_alloc(hi, n, e) || ct_meta_copy(&hi->meta, &lo->meta, e) ||
		ct_meta_set(&hi->meta, "upsample", method_name[method], e))
		goto out;
	ct_separable_apply(&s, hi->data, lo->data, env->par);
	ct_affine_rescale(hi->affine, lo->affine, finer);
	rc = 0;
out:
	ct_separable_free(&s);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol in = {0}, out = {0};
	size_t factor[3];
	int rc = -1;

	if (ct_out_check(p->out, env, e) || ct_vol_read(p->in, &in, e) ||
		factor_of(factor, p, &in.meta, e))
		goto out;
	if (ct_vol_check_finite(&in, e) ||
		upsample(&out, &in, factor, (enum ct_interp)p->method, env, e)) {
		ct_blame(e, p->in);
		goto out;
	}
	ct_log(env, CT_INFO, "%zux%zux%zu to %zux%zux%zu, %s", in.n[0], in.n[1], in.n[2], out.n[0],
		out.n[1], out.n[2], method_name[p->method]);
	if (ct_check_stop(env, e) ||
		ct_meta_step(&out.meta, env, 1, (const struct ct_meta *const[]){&in.meta}, e))
		goto out;
	rc = ct_vol_write(p->out, &out, env, e);
out:
	ct_vol_free(&in);
	ct_vol_free(&out);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-upsample",
	.brief = "Interpolate a CT on a finer grid over the same field of view.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
