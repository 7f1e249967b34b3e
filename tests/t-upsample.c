/* A finer grid: what each method does against the parts that it is made of, and what is refused.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "inverse/consistency.h"
#include "operator/resample.h"
#include "inverse/tv.h"
#include "inverse/upsample.h"

#include <stdbool.h>
#include <string.h>

static const size_t coarse[3] = {7, 6, 5};
static const double spacing[3] = {1.5, 2, 6};
static const struct ct_degrade D = {{2, 3, 4}, {0.8, 1.2, 1.7}, CT_DECIMATE_SINC, {0}};
static const struct ct_env quiet = {0};

static void make(struct ct_vol *lo, double scale, double shift)
{
	*lo = (struct ct_vol){0};
	must(ct_vol_alloc(lo, coarse, &err) || ct_meta_set(&lo->meta, "seed", "9", &err));
	for (size_t i = 0; i < ct_vol_count(lo); i++)
		lo->data[i] = (float)(shift + scale * (100 * (double)(i % 7 > 2) +
							      20 * (double)ct_rng_normal(3, 0, i)));
	for (int a = 0; a < 3; a++)
		lo->affine[a][a] = spacing[a];
}

/* Share of what a row of D in the middle has above the m-th of n cosines. */
static double above(const struct ct_taps *t)
{
	const size_t row = t->n_out / 2, n = t->n_in;
	double high = 0, all = 0;

	for (size_t k = 0; k < n; k++) {
		double c = 0;

		for (size_t q = 0; q < t->taps; q++)
			c += t->w[row * t->taps + q] *
			     cos(M_PI * (double)k * ((double)(t->first[row] + q) + 0.5) /
				     (double)n);
		c *= c * (k ? 2 : 1);
		all += c;
		high += k < t->n_out ? 0 : c;
	}
	return high / all;
}

static void test_aliasing(void)
{
	double worst = 0, share, low = 1, high = 0;

	for (int k = 0; k < 3 * 4 * 3; k++) {
		static const double factor[] = {2, 3, 4, 2.5}, sigma[] = {0, 0.15, 0.4};
		const int a = k % 3;
		struct ct_degrade d = {{1, 1, 1}, {0}, (enum ct_decimate)(k / 12), {0}};
		struct ct_taps t = {0};
		size_t n[3] = {7, 7, 7};

		d.factor[a] = factor[k / 3 % 4];
		d.sigma[a] = sigma[k % 3] * d.factor[a];
		n[a] = ct_degrade_cover(11, d.factor[a]);
		must(ct_degrade_taps(&t, n[a], d.factor[a], d.sigma[a], d.decimate, &err) ||
			ct_upsample_aliasing(&share, &d, n, &err));
		worst = fmax(worst, fabs(share - above(&t)));
		low = fmin(low, share);
		high = fmax(high, share);
		ct_taps_free(&t);
	}
	OK(worst < 1e-9 && low < 1e-9 && high > 0.5, "weight above the Nyquist frequency (%.2g)",
		worst);
	OK(ct_upsample_aliasing(&share, &D, (const size_t[]){9, 1, 9}, &err) < 0 &&
			err.code == CT_EGEOM,
		"an axis that is too short");
}

static struct ct_upsample_report up(
	struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule)
{
	struct ct_upsample_report r;

	*hi = (struct ct_vol){0};
	must(ct_upsample(hi, lo, rule, &r, &quiet, &err));
	return r;
}

static void test_interpolation(void)
{
	static const struct {
		enum ct_upsample method;
		enum ct_interp interp;
	} c[] = {{CT_UPSAMPLE_LINEAR, CT_LINEAR}, {CT_UPSAMPLE_CUBIC, CT_CUBIC},
		{CT_UPSAMPLE_BSPLINE, CT_BSPLINE}, {CT_UPSAMPLE_LANCZOS, CT_LANCZOS},
		{CT_UPSAMPLE_AUTO, CT_BSPLINE}};
	struct ct_vol lo, hi;
	bool same = true, report = true;

	make(&lo, 1, -300);
	for (size_t k = 0; k < sizeof c / sizeof *c; k++) {
		const struct ct_upsample_rule rule = {.method = c[k].method, .by = D};
		const struct ct_upsample_report r = up(&hi, &lo, &rule);
		float *x = normals(ct_vol_count(&hi), 1, 0, 1);
		struct ct_separable s;

		must(ct_resample_up_plan(&s, lo.n, D.factor, c[k].interp, NULL, &err));
		ct_separable_apply(&s, x, lo.data, NULL);
		same = same && memcmp(x, hi.data, ct_vol_count(&hi) * sizeof *x) == 0;
		report = report && isnan(r.aliasing) && isnan(r.residual) && isnan(r.condition) &&
			 r.iterations == 0 &&
			 r.method == (k < 4 ? c[k].method : CT_UPSAMPLE_BSPLINE) &&
			 strcmp(ct_meta_get(&hi.meta, CT_META_UPSAMPLE),
				 ct_upsample_name(r.method)) == 0;
		ct_separable_free(&s);
		free(x);
		if (k < 4)
			ct_vol_free(&hi);
	}
	OK(same, "interpolation is that of resample.h");
	OK(report, "and says its name, and nothing of an operator");
	OK(hi.n[0] == 14 && hi.n[1] == 18 && hi.n[2] == 20 && ct_meta_get(&hi.meta, "seed"),
		"on the finer grid, with what was known");
	OK(hi.affine[0][0] == 0.75 && fabs(hi.affine[1][3] + 2 / 3.0) < 1e-12 &&
			hi.affine[2][3] == -2.25,
		"over the same field");
	ct_vol_free(&lo);
	ct_vol_free(&hi);
}

/* Cosines of the coarse grid go over to those of the fine one. */
static void test_sinc(void)
{
	const struct ct_upsample_rule rule = {.method = CT_UPSAMPLE_SINC, .by = D};
	struct ct_vol lo, hi;
	double worst = 0;

	make(&lo, 1, 0);
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		lo.data[i] = (float)(cos(M_PI * 3 * ((double)(i % 7) + 0.5) / 7) *
				     cos(M_PI * 5 * ((double)(i / 7 % 6) + 0.5) / 6) *
				     cos(M_PI * 4 * ((double)(i / 42) + 0.5) / 5));
	up(&hi, &lo, &rule);
	for (size_t i = 0; i < ct_vol_count(&hi); i++)
		worst = fmax(
			worst, fabs((double)hi.data[i] -
				       cos(M_PI * 3 * ((double)(i % 14) + 0.5) / 14) *
					       cos(M_PI * 5 * ((double)(i / 14 % 18) + 0.5) / 18) *
					       cos(M_PI * 4 * ((double)(i / 252) + 0.5) / 20)));
	OK(worst < 1e-6, "sinc: what is band-limited stays so (%.2g)", worst);
	ct_vol_free(&lo);
	ct_vol_free(&hi);
}

/* RMS of D x - y. */
static double misfit(const struct ct_vol *x, const struct ct_vol *y, const struct ct_degrade *d)
{
	float *lo = normals(ct_vol_count(y), 1, 0, 1);
	struct ct_separable s;
	double off;

	must(ct_degrade_plan(&s, d, x->n, NULL, &err));
	ct_separable_apply(&s, lo, x->data, NULL);
	off = rms(ct_vol_count(y), lo, y->data);
	ct_separable_free(&s);
	free(lo);
	return off;
}

static void test_settle(void)
{
	struct ct_vol lo, x;
	struct ct_separable down = {0};
	float before[7 * 6 * 5], after[7 * 6 * 5];
	double residual[2], was, off = 0;
	size_t beyond = 0;

	make(&lo, 1, 0);
	up(&x, &lo, &(struct ct_upsample_rule){.method = CT_UPSAMPLE_LINEAR, .by = D});
	was = misfit(&x, &lo, &D);
	must(ct_upsample_settle(&x, &lo, &D, (double)INFINITY, &residual[0], &quiet, &err));
	OK(was > 1 && fabs(residual[0] - was) < 1e-9 && misfit(&x, &lo, &D) == was,
		"a misfit is told");
	must(ct_upsample_settle(&x, &lo, &D, 0, &residual[1], &quiet, &err));
	OK(residual[1] < 1e-4 && misfit(&x, &lo, &D) == residual[1], "and taken off");
	ct_vol_free(&x);
	up(&x, &lo, &(struct ct_upsample_rule){.method = CT_UPSAMPLE_LINEAR, .by = D});
	must(ct_degrade_plan(&down, &D, x.n, NULL, &err));
	ct_separable_apply(&down, before, x.data, NULL);
	must(ct_upsample_settle(&x, &lo, &D, 5, residual, &quiet, &err));
	ct_separable_apply(&down, after, x.data, NULL);
	for (size_t i = 0; i < ct_vol_count(&lo); i++) {
		const double r = (double)before[i] - (double)lo.data[i];

		off = fmax(off, fabs((double)after[i] - (double)lo.data[i] - fmin(fmax(r, -5), 5)));
		beyond += fabs(r) > 5;
	}
	OK(off < 1e-3 && beyond > 9 && beyond < ct_vol_count(&lo) - 9,
		"or as much as is beyond a bound, voxel by voxel (%.2g, %zu)", off, beyond);
	ct_separable_free(&down);
	lo.affine[1][3] += 0.1;
	OK(ct_upsample_settle(&x, &lo, &D, 0, residual, &quiet, &err) < 0 && err.code == CT_EGEOM &&
			strstr(err.msg, "reduced"),
		"not on another grid");
	ct_vol_free(&lo);
	ct_vol_free(&x);
}

/* The solver from the spline on, with steps of the deviation of lo, for second differences by the
 * largest factor, and weights of the spacings. */
static void by_hand(float *x, const struct ct_vol *lo, const struct ct_degrade *d,
	const size_t n[3], bool tv, double noise, struct ct_tv_report *did)
{
	const double mm[3] = {0.75, 2 / 3.0, 6 / d->factor[2]};
	struct ct_tv_rule rule = {.iterations = 7};
	struct ct_consistency dc = {0};
	struct ct_separable s;
	double mean = 0, square = 0, m = (double)ct_vol_count(lo);

	for (size_t i = 0; i < ct_vol_count(lo); i++)
		mean += (double)lo->data[i] / m;
	for (size_t i = 0; i < ct_vol_count(lo); i++)
		square += pow((double)lo->data[i] - mean, 2) / m;
	rule.step = (tv ? 0.15 : d->factor[2] / 4) * sqrt(square);
	for (int a = 0; a < 3; a++)
		rule.weight[a] = mm[1] / mm[a];
	must(ct_resample_up_plan(&s, lo->n, d->factor, CT_BSPLINE, NULL, &err) ||
		ct_consistency_alloc(&dc, d, n, lo->data, 0.8 * noise, NULL, &err));
	ct_separable_apply(&s, x, lo->data, NULL);
	must((tv ? ct_tv : ct_tv_hessian)(x, &dc, &rule, did, &quiet, &err));
	ct_consistency_free(&dc);
	ct_separable_free(&s);
}

static void test_variation(void)
{
	struct ct_vol lo, hi;

	make(&lo, 1e-3, -0.3);
	for (int k = 0; k < 3; k++) {
		const struct ct_degrade d = {
			{2, 3, k < 2 ? 4 : 8}, {0.8, 1.2, 1.7}, D.decimate, {0}};
		const struct ct_upsample_rule rule = {
			.method = k ? CT_UPSAMPLE_HTV : CT_UPSAMPLE_TV,
			.known = true,
			.by = d,
			.noise = 0.01,
			.iterations = 7};
		const struct ct_upsample_report r = up(&hi, &lo, &rule);
		float *x = normals(ct_vol_count(&hi), 1, 0, 1);
		struct ct_tv_report did;

		by_hand(x, &lo, &d, hi.n, k == 0, 0.01, &did);
		OK(apart(ct_vol_count(&hi), hi.data, x) < 1e-5,
			"%s: steps of the deviation, gradients in mm", ct_upsample_name(r.method));
		OK(r.iterations == 7 && fabs(r.change / did.change - 1) < 1e-3,
			"which is reported");
		NEAR(r.residual, misfit(&hi, &lo, &d), 1e-9, "with the misfit");
		NEAR(r.residual, 0.008, 1e-4, "of 0.8 of the noise");
		OK(r.condition > 1 && r.aliasing < 0.2, "and what the operator is like");
		free(x);
		ct_vol_free(&hi);
	}
	ct_vol_free(&lo);
}

/* HTV of points that are farther apart than 4 voxels goes on until it moves less. */
static void test_rest(void)
{
	static const double least[][2] = {{4, 1}, {8, 0.25}};
	struct ct_upsample_rule rule = {
		.method = CT_UPSAMPLE_HTV, .known = true, .iterations = 2000, .tolerance = 0.3};
	struct ct_vol lo, hi;

	make(&lo, 1, 0);
	for (int k = 0; k < 2; k++) {
		struct ct_upsample_report r;

		for (int a = 0; a < 3; a++)
			rule.by.factor[a] = a == 1 ? 2 : least[k][0];
		ct_degrade_protocol(&rule.by, 3);
		r = up(&hi, &lo, &rule);
		OK(r.change < least[k][1] * 0.3 && r.change > least[k][1] * 0.2 &&
				r.iterations < 2000,
			"%g times: %zu iterations, last moved %.2g HU", least[k][0], r.iterations,
			r.change);
		ct_vol_free(&hi);
	}
	ct_vol_free(&lo);
}

static void test_choice(void)
{
	struct ct_upsample_rule rule = {.known = true, .by = D, .iterations = 3};
	struct ct_upsample_report r;
	struct ct_vol lo, hi, start = {0};
	double share, most = 0;

	make(&lo, 1, 0);
	r = up(&hi, &lo, &rule);
	must(ct_upsample_aliasing(&most, &D, hi.n, &err));
	OK(r.method == CT_UPSAMPLE_TV && r.aliasing == most, "what is well sampled: tv");
	OK(r.residual < 1e-4, "which settles");
	ct_vol_free(&hi);
	rule.by.decimate = CT_DECIMATE_POINT;
	for (int a = 0; a < 3; a++)
		rule.by.sigma[a] = a == 1 ? 0.3 : 2;
	r = up(&hi, &lo, &rule);
	OK(r.method == CT_UPSAMPLE_HTV && r.aliasing > CT_UPSAMPLE_ALIAS,
		"points, one axis aliased: htv");
	ct_vol_free(&hi);
	rule.by.decimate = CT_DECIMATE_MEAN;
	r = up(&hi, &lo, &rule);
	OK(r.method == CT_UPSAMPLE_TV && r.aliasing > CT_UPSAMPLE_ALIAS, "means: tv");
	ct_vol_free(&hi);
	rule = (struct ct_upsample_rule){.method = CT_UPSAMPLE_DC, .known = true, .by = D};
	r = up(&start, &lo, &rule);
	OK(r.residual < 1e-4 && r.residual == misfit(&start, &lo, &D) && isnan(r.condition),
		"dc settles");
	rule.noise = 20;
	r = up(&hi, &lo, &rule);
	OK(memcmp(hi.data, start.data, ct_vol_count(&hi) * sizeof *hi.data) == 0 &&
			r.residual < 1e-4,
		"whatever noise there is");
	ct_vol_free(&hi);
	rule.noise = 0;
	for (size_t i = 0; i < ct_vol_count(&start); i++)
		start.data[i] = (float)i;
	rule.start = &start;
	up(&hi, &lo, &rule);
	must(ct_upsample_settle(&start, &lo, &D, 0, &share, &quiet, &err));
	OK(memcmp(hi.data, start.data, ct_vol_count(&hi) * sizeof *hi.data) == 0,
		"or begins with a volume");
	ct_vol_free(&hi);
	ct_vol_free(&start);
	ct_vol_free(&lo);
}

/* A constant, and an operator that is too wide to undo. */
static void test_lost(void)
{
	struct ct_upsample_rule rule = {
		.method = CT_UPSAMPLE_TV, .known = true, .by = D, .iterations = 3};
	struct ct_consistency dc = {0};
	struct ct_upsample_report r;
	struct ct_vol lo, hi;
	double worst = 0;

	make(&lo, 0, -300);
	r = up(&hi, &lo, &rule);
	for (size_t i = 0; i < ct_vol_count(&hi); i++)
		worst = fmax(worst, fabs((double)hi.data[i] + 300));
	OK(worst < 1e-3 && r.iterations == 0 && isnan(r.condition), "a constant takes no steps");
	ct_vol_free(&hi);
	ct_vol_free(&lo);
	make(&lo, 1, 0);
	rule.by.sigma[0] = 5;
	r = up(&hi, &lo, &rule);
	must(ct_consistency_alloc(&dc, &rule.by, hi.n, lo.data, 0, NULL, &err));
	OK(r.condition == dc.condition, "of what D keeps the condition is said: %.3g", r.condition);
	ct_consistency_free(&dc);
	ct_vol_free(&hi);
	ct_vol_free(&lo);
}

static bool refused(const struct ct_vol *lo, const struct ct_upsample_rule *rule, enum ct_code code,
	const char *word)
{
	struct ct_vol hi = {0};
	struct ct_upsample_report r;
	const bool ok = ct_upsample(&hi, lo, rule, &r, &quiet, &err) < 0 && err.code == code &&
			strstr(err.msg, word);

	ct_vol_free(&hi);
	return ok;
}

static void test_refusals(void)
{
	struct ct_upsample_rule rule = {.by = D};
	struct ct_vol lo, other = {0};
	bool needs = true, begins = true;

	make(&lo, 1, 0);
	for (int m = CT_UPSAMPLE_DC; m < CT_UPSAMPLE_METHODS; m++) {
		rule.method = (enum ct_upsample)m;
		needs = needs && refused(&lo, &rule, CT_EUSAGE, "needs the operator");
	}
	OK(needs, "dc, tv and htv need an operator");
	rule.known = true;
	rule.start = &other;
	for (int m = CT_UPSAMPLE_LINEAR; m < CT_UPSAMPLE_DC; m++) {
		rule.method = (enum ct_upsample)m;
		begins = begins && refused(&lo, &rule, CT_EUSAGE, "does not begin");
	}
	OK(begins, "interpolation does not begin with a volume");
	must(ct_vol_alloc(&other, coarse, &err));
	rule.method = CT_UPSAMPLE_DC;
	OK(refused(&lo, &rule, CT_EGEOM, "to start from"), "nor dc with one on another grid");
	rule.method = CT_UPSAMPLE_AUTO;
	OK(refused(&lo, &rule, CT_EGEOM, "to start from"), "nor the default");
	rule = (struct ct_upsample_rule){.method = CT_UPSAMPLE_LINEAR, .by = D};
	rule.by.factor[1] = 0.9;
	OK(refused(&lo, &rule, CT_EINPUT, "6 voxels cannot be refined 0.9"), "a factor below 1");
	rule.by.factor[1] = 2e8;
	OK(refused(&lo, &rule, CT_EINPUT, "refined 2e+08"), "a factor beyond reason");
	rule.by.factor[1] = 2;
	rule.method = CT_UPSAMPLE_CUBIC;
	for (size_t i = 0; i < ct_vol_count(&lo); i++) /* it overshoots beyond what a float holds */
		lo.data[i] = (i / 2) % 2 ? 3.3e38f : -3.3e38f;
	OK(refused(&lo, &rule, CT_ENUMERIC, "the result: voxel ("), "what is infinite, where");
	ct_vol_free(&other);
	ct_vol_free(&lo);
}

int main(void)
{
	test_aliasing();
	test_interpolation();
	test_sinc();
	test_settle();
	test_variation();
	test_rest();
	test_choice();
	test_lost();
	test_refusals();
	return tap_done();
}
