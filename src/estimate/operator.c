/* operator.c: see operator.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/assumed.h"
#include "estimate/scanner.h"
#include "estimate/noise.h"
#include "estimate/soft.h"

#include <math.h>
#include <string.h>

/* From the voxels of v to those aimed at. Whole numbers come out whole. */
static int factor_to(double x[3], const double want[3], const struct ct_vol *v, struct ct_err *e)
{
	double mm[3];

	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++) {
		x[a] = fmax(mm[a] / want[a], 1);
		if (fabs(x[a] - nearbyint(x[a])) < 1e-4 * x[a])
			x[a] = nearbyint(x[a]);
		if (x[a] > CT_SAID_TIMES)
			return ct_fail(e, CT_EUSAGE,
				"the spacing %g mm is 1/%g of a voxel, below 1/%d", want[a], x[a],
				CT_SAID_TIMES);
	}
	return 0;
}

/* An axis that is coarser than the finest by so much holds thick slices. */
#define THICK 1.5

/* What most people want: thick slices as thin as voxels are wide, and otherwise twice as fine.
 * Whole numbers, so that a CT that does not fit into memory can be cut into slabs. */
static void choose_factor(double x[3], const struct ct_vol *v)
{
	double mm[3], finest = (double)INFINITY;
	bool thick = false;

	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++)
		finest = fmin(finest, mm[a]);
	for (int a = 0; a < 3; a++)
		thick = thick || mm[a] >= THICK * finest;
	for (int a = 0; a < 3; a++)
		x[a] = thick ? fmin(fmax(round(mm[a] / finest), 1), CT_CHOSEN_TIMES) : 2;
}

/* The factors: from the caller, from the file, or chosen; a contradiction is an error. */
static int factor_of(struct ct_degrade *d, int known, const struct ct_said *said,
	const struct ct_vol *v, struct ct_err *e)
{
	const bool by_factor = said->factor[0] != 0, by_spacing = said->spacing[0] != 0;
	char want[CT_ASSUMED_STORED], was[CT_ASSUMED_STORED];
	double x[3];

	if (!by_factor && !by_spacing && ct_meta_get(&v->meta, CT_META_UPSAMPLE))
		return ct_fail(e, CT_EUSAGE, "was upsampled already: give the factor, -x");
	if (!by_factor && !by_spacing) {
		if (known > 0)
			choose_factor(d->factor, v);
		return 0;
	}
	memcpy(x, said->factor, sizeof x);
	if (by_spacing && factor_to(x, said->spacing, v, e))
		return -1;
	for (int a = 0; a < 3; a++) {
		if (!(x[a] >= 1 && x[a] <= CT_SAID_TIMES))
			return ct_fail(e, CT_EUSAGE, "the factor %g is outside [1, %d]", x[a],
				CT_SAID_TIMES);
		if (known == 0 && fabs(x[a] - d->factor[a]) > (by_spacing ? 1e-4 : 1e-6) * x[a])
			return ct_fail(e, CT_EUSAGE,
				"the factor %s contradicts the file, which was reduced %s times",
				ct_assumed_stored(want, said, x),
				ct_assumed_stored(was, said, d->factor));
		if (known > 0)
			d->factor[a] = x[a];
	}
	return 0;
}

static int sigma_of(struct ct_operator *r, int known, const struct ct_said *said, struct ct_err *e)
{
	char was[CT_ASSUMED_STORED];

	for (int a = 0; a < 3; a++) {
		double sigma = said->sigma[a];

		if (!(sigma >= 0 && sigma <= CT_SAID_SIGMA))
			return ct_fail(e, CT_EUSAGE, "the blur sigma %g is outside [0, %d]", sigma,
				CT_SAID_SIGMA);
		if (r->operator.factor[a] == 1 && said->sigma_for_all)
			sigma = 0;
		if (known == 0 && fabs(sigma - r->operator.sigma[a]) > 1e-6)
			return ct_fail(e, CT_EUSAGE,
				"sigma %g contradicts the file, which was blurred by %s", sigma,
				ct_assumed_stored(was, said, r->operator.sigma));
		r->operator.sigma[a] = sigma;
	}
	return 0;
}

/* The operator: of the file, or of the caller; a contradiction is an error. */
static int operator_of(
	struct ct_operator *r, const struct ct_said *said, const struct ct_vol *v, struct ct_err *e)
{
	const struct ct_meta *m = &v->meta;
	const bool done = ct_meta_get(m, CT_META_UPSAMPLE) != NULL; /* the operator is used up */
	const int known = done ? 1 : ct_degrade_get(m, &r->operator, e);
	const bool sigma = !isnan(said->sigma[0]);

	if (known < 0 || factor_of(&r->operator, known, said, v, e))
		return -1;
	r->known = known == 0 || sigma;
	r->from = known == 0 ? CT_BY_FILE : sigma ? CT_BY_CALLER : CT_BY_NOBODY;
	if (said->decimate >= 0 && known == 0 &&
		r->operator.decimate !=(enum ct_decimate) said->decimate)
		return ct_fail(e, CT_EUSAGE, "the sampling %s contradicts the file, which says %s",
			CT_WORD(CT_DECIMATE_LIST, said->decimate),
			CT_WORD(CT_DECIMATE_LIST, r->operator.decimate));
	if (said->decimate >= 0)
		r->operator.decimate =(enum ct_decimate) said->decimate;
	return sigma ? sigma_of(r, known, said, e) : 0;
}

/* The slice profile that the caller says, once all else is known. */
static int slice_of(struct ct_operator *r, const struct ct_said *said, const struct ct_vol *in,
	struct ct_err *e)
{
	const int axis = ct_slice_profile_axis(r->operator.factor, said->third);
	const bool alone = ct_slice_profile_is_alone(r->operator.factor, axis);
	const struct ct_degrade had = r->operator;
	double mm[3];

	if (!ct_slice_profile_is_said(&said->slice))
		return 0;
	ct_vol_spacing(in, mm);
	if (ct_slice_profile_twice(&said->slice, said->axis[axis],
		    !isnan(said->sigma[axis]) &&
			    (said->sigma_for_all ? alone : said->sigma[axis] > 0),
		    said->decimate >= 0 && alone, e) ||
		ct_slice_profile_set(&r->operator, axis, &said->slice, mm[axis], e))
		return -1;
	if (r->from == CT_BY_FILE &&
		(had.decimate != r->operator.decimate || had.profile.n != r->operator.profile.n ||
					 fabs(had.sigma[axis] - r->operator.sigma[axis]) >
					 1e-4 * fmax(had.sigma[axis], r->operator.sigma[axis])))
		return ct_fail(e, CT_EUSAGE,
			"--profile and --slice-thickness contradict the file, which says its "
			"operator");
	r->by_slices = true;
	r->slices = axis;
	r->known = r->known || alone;
	if (alone && r->from != CT_BY_FILE)
		r->from = CT_BY_CALLER;
	return 0;
}

/* Spread of the mean over a voxel, squared, and the widest profile that is taken for points. */
#define MEAN_SQUARE (1. / 12)
#define POINTS 0.25
#define SLICES_POINTS 0.26 /* of slices: doc/blur-estimate.md, "Slices with gaps" */

/* Before anything is measured: kernels of reconstruction cut off frequencies, and a band-limited CT
 * that is taken for means rings. */
#define BAND_LIMITED 2.0
/* Slices taken for band-limited lose up to 3 dB if they alias, and a third of that the other way.
 */
#define SLICES_ALIAS 3.0

/* How an axis that aliases was sampled: slices that edges show to be thin are points. */
static enum ct_decimate sampling_of(
	double *sure, const struct ct_profile got[3], const double factor[3])
{
	const int coarse = (factor[0] > 1) + (factor[1] > 1) + (factor[2] > 1);
	double odds = coarse > 1 ? -log(BAND_LIMITED) : log(SLICES_ALIAS), spread = 0;

	for (int a = 0; a < 3; a++)
		if (factor[a] > 1 && !isnan(got[a].spread)) {
			odds += log(got[a].aliases / (1 - got[a].aliases));
			spread = fmax(spread, got[a].spread);
		}
	*sure = 1 / (1 + exp(-fabs(odds)));
	if (odds <= 0)
		return CT_DECIMATE_SINC;
	return spread < (coarse > 1 ? POINTS : SLICES_POINTS) ? CT_DECIMATE_POINT
							      : CT_DECIMATE_MEAN;
}

/* The axes in plane have one spread. */
static void join_planes(struct ct_profile *x, struct ct_profile *y)
{
	double wx, wy;

	if (isnan(x->spread) || isnan(y->spread))
		return;
	wx = 1 / pow(x->deviation, 2);
	wy = 1 / pow(y->deviation, 2);
	x->spread = y->spread = exp((wx * log(x->spread) + wy * log(y->spread)) / (wx + wy));
}

/* What DICOM lets expect along the axes x; nothing of slices that are others by now. */
static int expect(struct ct_operator *r, const struct ct_vol *in, const double x[3],
	const struct ct_env *env, struct ct_err *e)
{
	const int known = ct_acquired_get(&r->scanner, &in->meta, e);
	double mm[3];

	if (known)
		return known < 0 ? -1 : 0;
	ct_vol_spacing(in, mm);
	if (!ct_scanner_expect(r->told, &r->scanner, mm))
		ct_log(env, CT_WARN,
			"what DICOM says of slices of %.4g mm is not used: it does not say that "
			"they were %.4g,%.4g,%.4g mm apart, as the voxels are",
			ct_scanner_thickness(&r->scanner), mm[0], mm[1], mm[2]);
	for (int a = 0; a < 3; a++)
		if (!(x[a] > 1))
			r->told[a].spread = (double)NAN;
	return 0;
}

/* Gaussian of an axis, voxels of the result: of the spread what its sampling leaves. */
static double sigma_left(double spread, struct ct_degrade d, int axis)
{
	d.sigma[axis] = 0;
	return d.factor[axis] *
	       sqrt(fmax(spread * spread - pow(ct_degrade_spread(&d, axis), 2), 0));
}

/* Slices of which DICOM says nothing are as thick as far apart: so are those of too few edges, and
 * what edges show to be thinner is joined with that. */
static void assume_slices(struct ct_operator *r, const double x[3])
{
	const struct ct_profile whole = {
		.spread = sqrt(MEAN_SQUARE), .deviation = 0.3, .aliases = 0.5};
	const int coarse = (x[0] > 1) + (x[1] > 1) + (x[2] > 1);

	for (int a = 0; a < 3; a++)
		if (coarse == 1 && x[a] > 1 && isnan(r->told[a].spread) &&
			!(r->joint[a].spread >= (r->trusted ? 0 : whole.spread)))
			ct_scanner_join(&r->joint[a], &whole);
}

/* What is known by now, and who said it. */
static void settle(struct ct_operator *r, const double x[3], const struct ct_env *env)
{
	bool some = false, seen = false, told = false;

	for (int a = 0; a < 3; a++) {
		const struct ct_profile *p = &r->joint[a];

		if (!(x[a] > 1))
			continue;
		if (isnan(p->spread)) {
			ct_log(env, CT_INFO, "axis %d: too few edges", a);
			continue;
		}
		some = true;
		seen = seen || !isnan(r->seen[a].spread);
		told = told || (!isnan(r->told[a].spread) && !r->apart[a]);
		r->operator.sigma[a] = sigma_left(ct_operator_aim(r, p), r->operator, a);
		if (!isnan(r->told[a].spread))
			ct_log(env, CT_INFO,
				"axis %d: DICOM expects a spread of %.3g +- %.2g voxels, edges show "
				"%.3g +- %.2g",
				a, r->told[a].spread, r->told[a].spread * r->told[a].deviation,
				r->seen[a].spread, r->seen[a].spread * r->seen[a].deviation);
		ct_log(env, CT_INFO,
			"axis %d: spread %.3g +- %.2g voxels, aliases with %.0f %%, assumed blur "
			"%.3g voxels of OUT, %zu edges",
			a, p->spread, p->spread * p->deviation, 100 * p->aliases,
			r->operator.sigma[a], r->seen[a].edges);
	}
	r->known = r->known || some;
	if (seen || told)
		r->from = !told ? CT_BY_MEASURE : seen ? CT_BY_BOTH : CT_BY_SCANNER;
}

/* Axes that are refined too little to be inverted: x becomes 1. */
static void leave_small(struct ct_operator *r, double x[3])
{
	for (int a = 0; a < 3; a++) {
		r->cubic[a] = x[a] > 1 && x[a] < CT_SMALL;
		if (r->cubic[a])
			x[a] = 1;
	}
}

/* Texture has no clean edges: slices of it are taken to be no wider than means. */
static int leave_texture(
	struct ct_profile p[3], const struct ct_vol *in, const double x[3], struct ct_err *e)
{
	double busy;

	if ((x[0] > 1) + (x[1] > 1) + (x[2] > 1) != 1)
		return 0;
	if (ct_noise_busy(&busy, in, x, 0, e))
		return -1;
	for (int a = 0; a < 3; a++)
		if (x[a] > 1 && busy > CT_NOISE_BUSY && p[a].spread > sqrt(MEAN_SQUARE))
			p[a].spread = sqrt(MEAN_SQUARE);
	return 0;
}

/* Planes of patients show a softness, squared, of 0 to .05; the networks of the profile learned
 * from such. What is beyond that they take for the profile. Some spread is left to slices. */
#define USUAL 0.05
#define LEAST 0.1

/* What edges show of slices, without what their planes show too (soft.h). */
static int leave_softness(struct ct_profile got[3], const struct ct_vol *in, const double x[3],
	const struct ct_env *env, struct ct_err *e)
{
	double square;

	if ((x[0] > 1) + (x[1] > 1) + (x[2] > 1) != 1)
		return 0;
	for (int a = 0; a < 3; a++) {
		const double had = got[a].spread;

		if (!(x[a] > 1) || isnan(had))
			continue;
		if (ct_soft_planes(&square, in, a, env->par, e))
			return -1;
		square -= USUAL;
		if (square > 0) {
			got[a].spread = fmin(had, sqrt(fmax(had * had - square, LEAST * LEAST)));
			ct_log(env, CT_INFO,
				"axis %d: edges show %.3g voxels, %.3g without what the planes show",
				a, had, got[a].spread);
		}
	}
	return 0;
}

/* The operator that DICOM and edges show: a Gaussian of the spread that its sampling leaves. */
static int estimate_operator(struct ct_operator *r, const struct ct_vol *in,
	const struct ct_said *said, const struct ct_env *env, struct ct_err *e)
{
	const bool slice = ct_slice_profile_is_said(&said->slice);
	const int given = slice ? ct_slice_profile_axis(r->operator.factor, said->third) : -1;
	double x[3] = {r->operator.factor[0], r->operator.factor[1], r->operator.factor[2] };
	struct ct_profile *got = r->seen;
	bool scanner = false;

	if (given >= 0)
		x[given] = 1;
	leave_small(r, x);
	if (!(x[0] > 1 || x[1] > 1 || x[2] > 1))
		return 0;
	if (ct_profile_measure(got, in, x, env->par, e) ||
		(!said->trust && leave_softness(got, in, x, env, e)) || expect(r, in, x, env, e))
		return -1;
	for (int a = 0; a < 3; a++)
		if (a == given || r->cubic[a])
			got[a].spread = (double)NAN;
	join_planes(&got[0], &got[1]);
	memcpy(r->joint, got, sizeof r->joint);
	for (int a = 0; a < 3; a++) {
		r->apart[a] = ct_scanner_join(&r->joint[a], &r->told[a]);
		scanner = scanner || !isnan(r->told[a].spread);
	}
	r->soft = !scanner && !said->trust && ct_soft_leave(r->joint, x);
	if (!scanner && !said->trust && leave_texture(r->joint, in, x, e))
		return -1;
	assume_slices(r, x);
	if (said->decimate < 0)
		r->operator.decimate = sampling_of(&r->sure, r->joint, x);
	settle(r, x, env);
	return 0;
}

/* Are slices of a known operator softer than it explains? */
static int compare_known(
	struct ct_operator *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_degrade *by = &r->operator;
	const int a = ct_soft_axis(by->factor);
	struct ct_profile got[3];
	double known;

	if (a < 0 || by->factor[a] < CT_SMALL)
		return 0;
	if (ct_profile_measure(got, in, by->factor, env->par, e))
		return -1;
	known = ct_degrade_spread(by, a);
	r->soft = ct_soft_beyond(&got[a], known);
	ct_log(env, CT_INFO, "axis %d: a spread of %.3g voxels is known, edges show %.3g", a, known,
		got[a].spread);
	return 0;
}

/* Only what is certainly noise: the rest may be texture. */
static int measure_noise(
	struct ct_operator *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	struct ct_noise got;

	if (ct_noise_measure(&got, in, e))
		return -1;
	r->noise = got.sure;
	r->texture = got;
	memcpy(r->alike, got.alike, sizeof r->alike);
	r->correlated = r->alike[0] + r->alike[1] + r->alike[2] > 0;
	r->noise_from = CT_BY_MEASURE;
	ct_log(env, CT_INFO, "noise or texture %.3g HU, assumed %.3g", got.common, r->noise);
	if (r->correlated)
		ct_log(env, CT_INFO, "noise of neighbours correlates by %.2g,%.2g,%.2g",
			r->alike[0], r->alike[1], r->alike[2]);
	return 0;
}

bool ct_operator_is_estimated(const struct ct_operator *r)
{
	return r->from != CT_BY_FILE && r->from != CT_BY_CALLER;
}

double ct_operator_aim(const struct ct_operator *r, const struct ct_profile *p)
{
	const double *x = r->operator.factor;
	const bool slices = (x[0] > 1) + (x[1] > 1) + (x[2] > 1) == 1;

	return r->trusted ? p->spread : ct_scanner_aim(p, slices);
}

void ct_operator_narrow(struct ct_operator *r, double most, const struct ct_env *env)
{
	for (int a = 0; a < 3; a++) {
		const double x = r->operator.factor[a];
		struct ct_profile *p = &r->joint[a];

		if (!(x > 1) || isnan(p->spread) || p->spread <= most)
			continue;
		ct_log(env, CT_INFO, "axis %d: a spread of %.3g voxels counts as %.3g", a,
			p->spread, most);
		p->spread = most;
		r->operator.sigma[a] = sigma_left(ct_operator_aim(r, p), r->operator, a);
	}
}

bool ct_operator_is_cubic(const struct ct_operator *r)
{
	bool some = false, other = false;

	for (int a = 0; a < 3; a++) {
		some = some || r->cubic[a];
		other = other || (r->operator.factor[a]> 1 && !r->cubic[a]);
	}
	return some && !other;
}

int ct_operator_find(struct ct_operator *r, const struct ct_said *said, bool need_noise,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const bool by_caller = !isnan(said->noise);
	bool settled; /* the slice profile says all that there is to say */
	double noise = 0;
	int none, axis;

	*r = (struct ct_operator){.operator= {{1, 1, 1}, {0}, CT_DECIMATE_SINC, {0}}, .sure = 1};
	r->trusted = said->trust;
	for (int a = 0; a < 3; a++)
		r->seen[a].spread = r->told[a].spread = r->joint[a].spread = (double)NAN;
	if (operator_of(r, said, in, e))
		return -1;
	none = ct_meta_noise(&in->meta, &noise, e);
	if (none < 0)
		return -1;
	if (noise > 0 && by_caller && said->noise != noise)
		return ct_fail(e, CT_EUSAGE,
			"the noise %g contradicts the file, whose noise is %g HU", said->noise,
			noise);
	r->noise = fmax(by_caller ? said->noise : noise, 0);
	r->noise_from = none == 0 && (!by_caller || said->noise == noise) ? CT_BY_FILE
			: by_caller                                       ? CT_BY_CALLER
									  : CT_BY_NOBODY;
	axis = ct_soft_axis(r->operator.factor);
	settled = ct_slice_profile_is_said(&said->slice) &&
		  ct_slice_profile_is_alone(
			  r->operator.factor, ct_slice_profile_axis(r->operator.factor, 2));
	if ((said->estimate && !r->known && !settled && estimate_operator(r, in, said, env, e)) ||
		slice_of(r, said, in, e))
		return -1;
	if (need_noise && r->known && !said->trust && !ct_operator_is_estimated(r) &&
		compare_known(r, in, env, e))
		return -1;
	if (!none || by_caller || !need_noise)
		return 0;
	if (measure_noise(r, in, env, e))
		return -1;
	if (axis >= 0 && ct_operator_is_estimated(r) && !r->trusted && r->noise > 0)
		r->soft = r->soft || ct_soft_noise(&r->joint[axis], r->alike[axis]);
	return 0;
}
