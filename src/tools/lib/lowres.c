/* lowres.c: see lowres.h. */
#include "config.h"
#include "cli/cli.h"
#include "formats/io.h"
#include "resolution/blur.h"
#include "resolution/noise.h"
#include "tools/lib/lowres.h"

#include <math.h>
#include <string.h>

/* From the voxels of v to those aimed at. Whole numbers come out whole. */
static int factor_to(double x[3], const char *spacing, const struct ct_vol *v, struct ct_err *e)
{
	double mm[3], want[3];

	if (ct_cli_numbers("spacing", spacing, ',', 3, true, want, e))
		return -1;
	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++) {
		if (!(want[a] > 0))
			return ct_fail(e, CT_EUSAGE, "--spacing: %g is not positive", want[a]);
		x[a] = fmax(mm[a] / want[a], 1);
		if (fabs(x[a] - nearbyint(x[a])) < 1e-4 * x[a])
			x[a] = nearbyint(x[a]);
		if (x[a] > 1024)
			return ct_fail(e, CT_EUSAGE,
				"--spacing: %g mm is 1/%.0f of a voxel, below 1/1024", want[a],
				x[a]);
	}
	return 0;
}

/* Those of -x. */
static int factor_said(double x[3], const char *factor, struct ct_err *e)
{
	if (ct_cli_numbers("factor", factor, ',', 3, true, x, e))
		return -1;
	for (int a = 0; a < 3; a++)
		if (!(x[a] >= 1 && x[a] <= 1024))
			return ct_fail(e, CT_EUSAGE, "-x: %g is outside [1, 1024]", x[a]);
	return 0;
}

/* The factors of -x or --spacing, or of the file; a contradiction is an error. */
static int factor_of(struct ct_degrade *d, int known, const struct lowres *p,
	const struct ct_vol *v, struct ct_err *e)
{
	double x[3];

	if (!p->factor && !p->spacing && known > 0)
		return ct_fail(e, CT_EUSAGE, "-x is missing, and %s %s", p->in,
			ct_meta_get(&v->meta, CT_META_UPSAMPLE)
				? "is upsampled already"
				: "does not say by how much it was reduced");
	if (!p->factor && !p->spacing)
		return 0;
	if (p->spacing ? factor_to(x, p->spacing, v, e) : factor_said(x, p->factor, e))
		return -1;
	for (int a = 0; a < 3; a++) {
		if (known == 0 && fabs(x[a] - d->factor[a]) > (p->spacing ? 1e-4 : 1e-6) * x[a])
			return ct_fail(e, CT_EUSAGE,
				"%s %s contradicts %s, which was reduced %g,%g,%g times",
				p->spacing ? "--spacing" : "-x",
				p->spacing ? p->spacing : p->factor, p->in, d->factor[0],
				d->factor[1], d->factor[2]);
		if (known > 0)
			d->factor[a] = x[a];
	}
	return 0;
}

/* The operator: of the file, or of the options; a contradiction is an error. */
static int operator_of(
	struct lowres_is *r, const struct lowres *p, const struct ct_vol *v, struct ct_err *e)
{
	const struct ct_meta *m = &v->meta;
	bool done = ct_meta_get(m, CT_META_UPSAMPLE) != NULL; /* the operator was used up */
	int known = done ? 1 : ct_degrade_get(m, &r->by, e);
	double sigma[3];

	if (known < 0)
		return ct_blame(e, p->in);
	if (factor_of(&r->by, known, p, v, e))
		return -1;
	r->known = known == 0 || p->sigma;
	r->said = known > 0 && p->sigma;
	if (p->decimate >= 0 && known == 0 && r->by.decimate != (enum ct_decimate)p->decimate)
		return ct_fail(
			e, CT_EUSAGE, "--decimate contradicts %s, which says otherwise", p->in);
	if (p->decimate >= 0)
		r->by.decimate = (enum ct_decimate)p->decimate;
	if (!p->sigma)
		return 0;
	if (ct_cli_numbers("sigma", p->sigma, ',', 3, true, sigma, e))
		return -1;
	for (int a = 0; a < 3; a++) {
		if (!(sigma[a] >= 0 && sigma[a] <= 1000))
			return ct_fail(e, CT_EUSAGE, "--sigma: %g is outside [0, 1000]", sigma[a]);
		if (r->by.factor[a] == 1 && !strchr(p->sigma, ','))
			sigma[a] = 0;
		if (known == 0 && fabs(sigma[a] - r->by.sigma[a]) > 1e-6)
			return ct_fail(e, CT_EUSAGE,
				"--sigma %s contradicts %s, which was blurred by %g,%g,%g",
				p->sigma, p->in, r->by.sigma[0], r->by.sigma[1], r->by.sigma[2]);
		r->by.sigma[a] = sigma[a];
	}
	return 0;
}

/* The operator that edges show. Sampling that aliases along one axis counts for all: the operator
 * has one way of decimation. */
static int measure_operator(struct lowres_is *r, const struct ct_vol *in, const struct lowres *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_blur got;

	if (ct_blur_estimate(&got, in, r->by.factor, env->par, e))
		return ct_blame(e, p->in);
	for (int a = 0; a < 3; a++) {
		if (r->by.factor[a] <= 1)
			continue;
		r->by.sigma[a] = got.axis[a].sigma * r->by.factor[a];
		if (got.axis[a].sampling == CT_SAMPLING_ALIASED && p->decimate < 0)
			r->by.decimate = CT_DECIMATE_POINT;
		r->known |= got.axis[a].sampling != CT_SAMPLING_UNKNOWN;
		ct_log(env, CT_INFO,
			"axis %d: blur %.3g, assumed %.3g voxels of OUT, %s, %zu edges", a,
			got.axis[a].measured * r->by.factor[a], r->by.sigma[a],
			ct_sampling_name(got.axis[a].sampling), got.axis[a].edges);
	}
	r->measured = r->known;
	return 0;
}

static bool correlated(const struct lowres_is *is)
{
	return is->alike[0] + is->alike[1] + is->alike[2] >
	       0.3; /* less is what white noise shows */
}

/* Only what is sure: the rest may be texture. */
static int measure_noise(struct lowres_is *r, const struct ct_vol *in, const struct lowres *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_noise got;

	if (ct_noise_measure(&got, in, e))
		return ct_blame(e, p->in);
	r->noise = got.sure;
	memcpy(r->alike, got.alike, sizeof r->alike);
	r->noise_measured = true;
	ct_log(env, CT_INFO, "noise or texture %.3g HU, assumed %.3g", got.common, r->noise);
	if (correlated(r))
		ct_log(env, CT_INFO, "noise of neighbours correlates by %.2g,%.2g,%.2g",
			r->alike[0], r->alike[1], r->alike[2]);
	return 0;
}

int lowres_find(struct lowres_is *r, const struct lowres *p, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	double noise = 0;
	int said;

	*r = (struct lowres_is){.by = {{1, 1, 1}, {0}, CT_DECIMATE_SINC}};
	if (operator_of(r, p, in, e))
		return -1;
	said = ct_meta_numbers(&in->meta, CT_META_NOISE, 1, &noise, e);
	if (said < 0)
		return ct_blame(e, p->in);
	if (noise > 0 && p->noise != noise && !isnan(p->noise))
		return ct_fail(e, CT_EUSAGE, "--noise %g contradicts %s, whose noise is %g HU",
			p->noise, p->in, noise);
	r->noise = fmax(isnan(p->noise) ? noise : p->noise, 0);
	r->noise_of_file = said == 0 && (isnan(p->noise) || p->noise == noise);
	r->noise_said = !isnan(p->noise) && !r->noise_of_file;
	if (p->estimate && !r->known && measure_operator(r, in, p, env, e))
		return -1;
	return said && isnan(p->noise) && !p->skip_noise ? measure_noise(r, in, p, env, e) : 0;
}

static const char *who(bool measured, bool said)
{
	return measured ? "measured" : said ? "given" : "of the file";
}

void lowres_tell(
	const struct lowres_is *is, const struct ct_upsample_report *did, const struct ct_env *env)
{
	const struct ct_degrade *d = &is->by;

	ct_env_tell(env, LOWRES_FACTOR, "%.9g,%.9g,%.9g", d->factor[0], d->factor[1], d->factor[2]);
	if (is->known) {
		ct_env_tell(
			env, LOWRES_SIGMA, "%.9g,%.9g,%.9g", d->sigma[0], d->sigma[1], d->sigma[2]);
		ct_env_tell(env, LOWRES_SAMPLING, "%s", CT_WORD(CT_DECIMATE_LIST, d->decimate));
		ct_env_tell(env, LOWRES_FROM, "%s", who(is->measured, is->said));
	}
	ct_env_tell(env, LOWRES_NOISE, "%.9g", is->noise);
	ct_env_tell(env, LOWRES_NOISE_FROM, "%s",
		is->noise_measured || is->noise_said || is->noise_of_file
			? who(is->noise_measured, is->noise_said)
			: "assumed");
	if (correlated(is))
		ct_env_tell(env, LOWRES_NOISE_ALIKE, "%.2g,%.2g,%.2g", is->alike[0], is->alike[1],
			is->alike[2]);
	ct_env_tell(env, LOWRES_METHOD, "%s", ct_upsample_name(did->method));
	if (is->known && d->decimate == CT_DECIMATE_POINT && did->aliasing > CT_UPSAMPLE_ALIAS)
		ct_env_tell(env, LOWRES_WHY, "points alias");
	else if (is->known && did->aliasing > CT_UPSAMPLE_ALIAS)
		ct_env_tell(env, LOWRES_WHY, "aliased, not points");
	else if (is->known)
		ct_env_tell(env, LOWRES_WHY, "hardly aliased");
	ct_env_tell(env, LOWRES_ITERATIONS, "%zu", did->iterations);
	if (is->known && !isnan(did->residual))
		ct_env_tell(env, LOWRES_RESIDUAL, "%.9g", did->residual);
}
