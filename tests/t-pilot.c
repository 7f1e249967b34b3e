/* What a part of a scan tells of the whole: how many iterations, and how much a solver departs from
 * a noisy scan. What is kept is what is found, what is given is taken, and it is where there is as
 * much tissue.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "numbers.h"
#include "inverse/pilot.h"
#include "refine/refine.h"
#include "inverse/trial.h"

#include <string.h>

static const struct ct_env quiet = {0};

/* Air, and noise of 15 HU about `tissue` HU from voxel at[] on. */
static void make(struct ct_vol *lo, const size_t n[3], const size_t at[3], double tissue)
{
	*lo = (struct ct_vol){0};
	must(ct_vol_alloc(lo, n, &err));
	for (size_t i = 0; i < ct_vol_count(lo); i++) {
		const size_t x[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
		const bool in = x[0] >= at[0] && x[1] >= at[1] && x[2] >= at[2];

		lo->data[i] = (float)((in ? tissue + 200 * (double)(x[0] % 5 > 1) : -1000) +
				      15 * (double)ct_rng_normal(4, 0, i));
	}
	for (int a = 0; a < 3; a++)
		lo->affine[a][a] = 1;
}

static struct ct_upsample_rule rule_of(void)
{
	return (struct ct_upsample_rule){.known = true,
		.by = {{2, 2, 2}, {0.3, 0.3, 0.3}, CT_DECIMATE_POINT, {0}},
		.noise = 15,
		.iterations = 12};
}

static struct ct_upsample_report refine(
	struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule)
{
	struct ct_upsample_report did;

	*hi = (struct ct_vol){0};
	must(ct_upsample(hi, lo, rule, &did, &quiet, &err));
	return did;
}

/* Multipliers of a scan that is its own pilot. */
static void test_small(void)
{
	const size_t n[3] = {12, 10, 9}, at[3] = {3, 3, 3};
	struct ct_upsample_rule rule = rule_of();
	struct ct_pilot p = {0}, none = {0};
	struct ct_multipliers *m = &p.multipliers;
	struct ct_vol lo, found, given;
	struct ct_upsample_report did[2];

	make(&lo, n, at, 0);
	for (int k = 0; k < 2; k++) {
		rule.method = k ? CT_UPSAMPLE_TV : CT_UPSAMPLE_HTV;
		must(ct_pilot_run(&none, &lo, &rule, false, &quiet, &err));
		OK(none.multipliers.n == 0 && none.multipliers.room == 0 && none.iterations == 0,
			"the whole finds its own");
		must(ct_pilot_run(&p, &lo, &rule, true, &quiet, &err));
		OK(m->n >= 12 && m->n <= 13 && m->room == 0 && m->mu[m->n - 1] > 0,
			"one for each correction (%zu)", m->n);
		OK(p.iterations == 0, "of iterations that are given");
		rule.multipliers = NULL;
		did[0] = refine(&found, &lo, &rule);
		rule.multipliers = m;
		did[1] = refine(&given, &lo, &rule);
		OK(memcmp(found.data, given.data, ct_vol_count(&found) * sizeof(float)) == 0 &&
				did[0].residual == did[1].residual,
			"given, they make what they were found with");
		m->mu[m->n - 3] *= 2;
		ct_vol_free(&given);
		refine(&given, &lo, &rule);
		OK(memcmp(found.data, given.data, ct_vol_count(&found) * sizeof(float)) != 0,
			"each is taken");
		m->mu[1] = m->mu[0] = 1e9;
		m->n = 2;
		ct_vol_free(&given);
		did[1] = refine(&given, &lo, &rule);
		OK(did[1].residual < 0.01, "and after the last the last (%.3g HU)",
			did[1].residual);
		rule.multipliers = NULL;
		ct_pilot_free(&p);
		ct_vol_free(&found);
		ct_vol_free(&given);
	}
	OK(!m->mu && m->n == 0, "nothing is left");
	ct_vol_free(&lo);
}

static void cut(
	struct ct_vol *piece, const struct ct_vol *lo, const size_t from[3], const size_t n[3])
{
	*piece = (struct ct_vol){0};
	must(ct_vol_alloc(piece, n, &err));
	for (size_t i = 0; i < ct_vol_count(piece); i++)
		piece->data[i] =
			lo->data[from[0] + i % n[0] +
				 lo->n[0] * (from[1] + i / n[0] % n[1] +
						    lo->n[1] * (from[2] + i / n[0] / n[1]))];
	memcpy(piece->affine, lo->affine, sizeof piece->affine);
}

/* What the pilot of a scan tells is what a part of it from `from` on does. */
static bool is_of(const struct ct_vol *lo, const size_t from[3], const struct ct_upsample_rule *how)
{
	struct ct_upsample_rule rule = *how;
	struct ct_pilot of_lo = {0}, of_piece = {0};
	const struct ct_multipliers *a = &of_lo.multipliers, *b = &of_piece.multipliers;
	struct ct_vol piece;
	size_t n[3];
	bool same;

	must(!ct_pilot_size(n, lo, &rule));
	cut(&piece, lo, from, n);
	rule.spread = ct_upsample_spread(lo);
	must(ct_pilot_run(&of_piece, &piece, &rule, true, &quiet, &err));
	rule.spread = how->spread;
	must(ct_pilot_run(&of_lo, lo, &rule, false, &quiet, &err));
	same = a->n > 0 && a->n == b->n && memcmp(a->mu, b->mu, a->n * sizeof *a->mu) == 0;
	ct_vol_free(&piece);
	ct_pilot_free(&of_lo);
	ct_pilot_free(&of_piece);
	return same;
}

static void test_place(void)
{
	const size_t n[3] = {140, 24, 80}, everywhere[3] = {0}, corner[3] = {20, 0, 20};
	const size_t middle[3] = {46, 0, 24}, edge[3] = {0, 0, 24};
	struct ct_upsample_rule rule = rule_of();
	struct ct_vol lo;
	size_t m[3];

	make(&lo, n, everywhere, 0);
	OK(ct_pilot_size(m, &lo, &rule) && m[0] == 47 && m[1] == 24 && m[2] == 32,
		"a third of each axis, but 64 fine voxels");
	OK(is_of(&lo, middle, &rule), "in the middle");
	rule.spread = 50;
	OK(!is_of(&lo, middle, &rule), "in steps of the whole");
	rule.spread = 0;
	ct_vol_free(&lo);
	make(&lo, n, corner, 0);
	OK(is_of(&lo, edge, &rule), "or where there is as much tissue as in all");
	ct_vol_free(&lo);
	make(&lo, n, corner, -800);
	OK(is_of(&lo, middle, &rule), "which lungs are not");
	lo.n[0] = 139;
	lo.n[2] = 78;
	OK(ct_pilot_size(m, &lo, &rule) && m[0] == 139 && m[1] == 24 && m[2] == 78,
		"a smaller scan is its own");
	lo.n[0] = lo.n[1] = lo.n[2] = 500;
	OK(ct_pilot_size(m, &lo, &rule) && m[0] == 64 && m[1] == 64 && m[2] == 64,
		"and of a large one 128");
	lo.n[0] = n[0];
	lo.n[1] = n[1];
	lo.n[2] = n[2];
	ct_vol_free(&lo);
}

/* Told by a part, by a whole that slabs follow, by nobody; and where the part is air. */
static void test_iterations(void)
{
	const size_t n[3] = {140, 24, 80}, small[3] = {30, 20, 20}, at[3] = {0};
	const size_t middle[3] = {46, 0, 24}, m[3] = {47, 24, 32};
	struct ct_upsample_rule rule = rule_of(), own;
	struct ct_pilot p = {0};
	struct ct_vol lo, hi, part;
	struct ct_upsample_report did;

	rule.iterations = 200;
	rule.tolerance = 0.02;
	rule.noise = 0;
	make(&lo, n, at, 0);
	cut(&part, &lo, middle, m);
	own = rule;
	own.spread = ct_upsample_spread(&lo);
	did = refine(&hi, &part, &own);
	must(ct_pilot_run(&p, &lo, &rule, false, &quiet, &err));
	OK(p.iterations == did.iterations && p.iterations > CT_PILOT_LEAST && p.iterations < 200,
		"as many as the part makes (%zu, %zu)", p.iterations, did.iterations);
	ct_pilot_free(&p);
	ct_vol_free(&hi);
	rule.tolerance = 1000;
	must(ct_pilot_run(&p, &lo, &rule, false, &quiet, &err));
	OK(p.iterations == CT_PILOT_LEAST, "but not few");
	ct_pilot_free(&p);
	rule.noise = 15;
	must(ct_pilot_run(&p, &lo, &rule, true, &quiet, &err));
	OK(p.iterations == CT_PILOT_LEAST && p.multipliers.n >= CT_PILOT_LEAST,
		"with a multiplier each");
	ct_pilot_free(&p);
	rule.iterations = 20;
	must(ct_pilot_run(&p, &lo, &rule, false, &quiet, &err));
	OK(p.iterations == 20, "unless the rule says so");
	ct_pilot_free(&p);
	rule.start = &part;
	must(ct_pilot_run(&p, &lo, &rule, false, &quiet, &err));
	OK(p.iterations == 20, "whatever it starts from");
	ct_pilot_free(&p);
	ct_vol_free(&lo);
	ct_vol_free(&part);

	rule = own;
	rule.spread = 0;
	make(&lo, small, at, 0);
	did = refine(&hi, &lo, &rule);
	must(ct_pilot_run(&p, &lo, &rule, false, &quiet, &err));
	OK(p.iterations == 0, "a small whole ends by itself");
	must(ct_pilot_run(&p, &lo, &rule, true, &quiet, &err));
	OK(p.iterations == did.iterations, "and its slabs where it does (%zu)", p.iterations);
	ct_pilot_free(&p);
	ct_vol_free(&lo);
	ct_vol_free(&hi);
}

static void test_none(void)
{
	const size_t n[3] = {70, 4, 4}, at[3] = {0};
	struct ct_upsample_rule rule = rule_of();
	struct ct_pilot p = {0};
	struct ct_vol lo;
	size_t s[3];

	make(&lo, n, at, 0);
	rule.method = CT_UPSAMPLE_DC;
	OK(!ct_pilot_size(s, &lo, &rule) && ct_pilot_run(&p, &lo, &rule, true, &quiet, &err) == 0 &&
			!p.multipliers.mu,
		"none of a method that does not iterate");
	rule = rule_of();
	rule.noise = 0;
	OK(!ct_pilot_size(s, &lo, &rule), "of neither noise nor a tolerance");
	rule.tolerance = 1;
	OK(ct_pilot_size(s, &lo, &rule), "one will do");
	rule.known = false;
	OK(!ct_pilot_size(s, &lo, &rule), "or no operator");
	ct_vol_free(&lo);
}

/* Does total variation suit a scan: edges between plateaus it does, waves near the limit of
 * resolution it does not. The roughest part is asked, a scan that is too small is not, and what is
 * then refined. */

static const struct ct_env silent = {0};
static const struct ct_degrade twice = {{2, 2, 2}, {0.7, 0.7, 0.7}, CT_DECIMATE_SINC, {0}};

static double waves(const double x[3])
{
	double sum = 0;

	for (uint64_t w = 0; w < 40; w++) {
		double k[3], norm = 0, phase = 6.28 * (double)ct_rng_uniform(7, 1, w);

		for (int a = 0; a < 3; a++) {
			k[a] = (double)ct_rng_normal(7, 0, 3 * w + (uint64_t)a);
			norm += k[a] * k[a];
		}
		for (int a = 0; a < 3; a++)
			phase += 1.2 / sqrt(norm) * k[a] * x[a];
		sum += cos(phase);
	}
	return 60 * sum;
}

static double blocks(const double x[3])
{
	const double d = hypot(hypot(x[0] - 14, x[1] - 15), x[2] - 13);

	return d < 6 ? 900 : d < 11 ? 40 : -1000;
}

/* A cube of `side`: air, and what `value` says of the voxels from `from` on along each axis. */
static void fill(struct ct_vol *v, size_t side, size_t from, double (*value)(const double x[3]))
{
	const size_t n[3] = {side, side, side};

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % side, i / side % side, i / side / side};
		const double x[3] = {(double)at[0], (double)at[1], (double)at[2]};
		const bool in = at[0] >= from && at[1] >= from && at[2] >= from;

		v->data[i] = (float)(in ? value(x) : -1000);
	}
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1;
}

static struct ct_trial told_of(size_t side, size_t from, double (*value)(const double x[3]))
{
	struct ct_vol v;
	struct ct_trial told;

	fill(&v, side, from, value);
	must(ct_trial_run(&told, &v, &twice, &silent, &err));
	ct_vol_free(&v);
	return told;
}

static void test_gain(void)
{
	const struct ct_trial texture = told_of(28, 0, waves), edges = told_of(28, 0, blocks);
	const struct ct_trial small = told_of(CT_TRIAL_LEAST - 1, 0, waves);
	const struct ct_trial cut = told_of(96, 60, waves);

	OK(texture.gain < -0.15, "waves: tv gains %.2f dB", texture.gain);
	OK(texture.share > 0.8, "waves: the best mean is htv, %.2f of it", texture.share);
	OK(edges.gain > 1, "plateaus: tv gains %.2f dB", edges.gain);
	OK(edges.share < 0.5, "plateaus: the best mean is mostly tv, htv %.2f", edges.share);
	OK(cut.gain < -0.15 && cut.share > 0.8,
		"waves that padding cuts off: tv gains %.2f dB, the best mean is htv, %.2f of it",
		cut.gain, cut.share);
	OK(isinf(small.gain) && small.share == 0, "too small to tell");
	OK(isinf(told_of(96, 97, waves).gain), "nor can air tell");
	OK(isfinite(told_of(96, 72, waves).gain), "of which there is much: a corner is asked");
}

static struct ct_refine plan_of(const struct ct_vol *v, int method, double noise)
{
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_refine r;

	rule.method = method;
	rule.said = (struct ct_said)CT_SAID_NOTHING;
	rule.said.noise = noise;
	must(ct_refine_plan(&r, &rule, v, &silent, &err));
	return r;
}

static void test_plan(void)
{
	struct ct_vol v;
	struct ct_refine r;

	fill(&v, 28, 0, waves);
	must(ct_degrade_put(&v.meta, &twice, &err));
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 0);
	OK(r.textured && r.method == CT_UPSAMPLE_HTV &&
			ct_refine_inversion(&r).first.method == CT_UPSAMPLE_HTV,
		"waves: auto is htv");
	OK(strcmp(ct_refine_why(&r), "texture") == 0, "and says why");
	r = plan_of(&v, CT_UPSAMPLE_TV, 0);
	OK(!r.textured && r.method == CT_UPSAMPLE_TV, "tv stays what it is");
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 20);
	OK(r.textured && r.method == CT_UPSAMPLE_HTV, "waves: auto is htv with noise, too");
	ct_vol_free(&v);
	fill(&v, 28, 0, blocks);
	must(ct_degrade_put(&v.meta, &twice, &err));
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 0);
	OK(!r.textured && r.method == CT_UPSAMPLE_TV, "plateaus: auto is tv");
	ct_vol_free(&v);
}

/* Thin walls, as of spongy bone. */
static double walls(const double x[3])
{
	const double wide[3] = {x[0] / 2.5, x[1] / 2.5, x[2] / 2.5};

	return fabs(waves(wide)) < 90 ? 1100 : -50;
}

/* Spread, voxels of the scan, that is assumed of texture of an operator that nobody said. */
static double spread_of(double reduced, bool trust)
{
	const struct ct_degrade by = {.factor = {2, 2, 2},
		.sigma = {reduced, reduced, reduced},
		.decimate = CT_DECIMATE_SINC};
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_vol fine, coarse = {0};
	struct ct_refine r;

	fill(&fine, 80, 0, walls);
	must(ct_degrade_volume(&coarse, &fine, &by, 0, 0, silent.par, &err));
	ct_meta_free(&coarse.meta); /* which says it */
	rule.method = CT_UPSAMPLE_AUTO;
	rule.said = (struct ct_said)CT_SAID_NOTHING;
	rule.said.estimate = true;
	rule.said.trust = trust;
	rule.said.noise = 0;
	memcpy(rule.said.factor, by.factor, sizeof by.factor);
	must(ct_refine_plan(&r, &rule, &coarse, &silent, &err));
	ct_vol_free(&fine);
	ct_vol_free(&coarse);
	return r.scan.joint[0].spread;
}

static void test_narrow(void)
{
	OK(spread_of(1.6, true) > 0.4, "a wide profile of texture is measured");
	OK(spread_of(1.6, false) <= 0.37, "a profile of texture counts as no wider than .37");
}

static double both(const double x[3])
{
	return blocks(x) + waves(x);
}

/* Share of htv in the mean, of slices `times` as far apart, all of one profile. */
static double second_of(double times)
{
	const struct ct_degrade by = {.factor = {1, 1, times},
		.sigma = {0, 0, 0.2 * times},
		.decimate = CT_DECIMATE_MEAN};
	struct ct_refine r;
	struct ct_vol v;

	fill(&v, 28, 0, both);
	must(ct_degrade_put(&v.meta, &by, &err));
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 0);
	ct_vol_free(&v);
	return r.second;
}

/* Of slices that were interpolated, and are softer than they are known to be: the share of htv
 * beside least squares. */
static double soft_of(double (*value)(const double x[3]))
{
	const struct ct_degrade by = {.factor = {1, 1, 2}, .decimate = CT_DECIMATE_MEAN};
	struct ct_vol fine, coarse = {0};
	struct ct_refine r;

	fill(&fine, 80, 0, value);
	must(ct_degrade_smooth(
		fine.data, fine.data, fine.n, (const double[3]){0.5, 0.5, 2}, silent.par, &err));
	must(ct_degrade_volume(&coarse, &fine, &by, 0, 0, silent.par, &err));
	r = plan_of(&coarse, CT_UPSAMPLE_AUTO, 0);
	ct_vol_free(&fine);
	ct_vol_free(&coarse);
	return r.careful ? r.second : (double)NAN;
}

static void test_shares(void)
{
	const double two = second_of(2), three = second_of(3);

	OK(two > 0.35 && two < 0.9, "slices twice as far apart: %.2f of the mean is htv", two);
	OK(fabs(three - two * two) < 1e-12, "three times as far apart: its square, %.2f", three);
	OK(soft_of(walls) == 0.75, "soft slices of texture: three quarters are htv");
	OK(soft_of(blocks) == 0.5, "soft slices of anything else: half is htv");
}

static void t_trial(void)
{
	test_shares();
	test_gain();
	test_plan();
	test_narrow();
}

int main(void)
{
	test_small();
	test_place();
	test_iterations();
	test_none();
	t_trial();
	return tap_done();
}
