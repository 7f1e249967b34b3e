/* How much a solver departs from a noisy scan: what is kept is what is found, what is given is
 * taken, and the sample that tells is where tissue is. */
#include "config.h"
#include "numbers.h"
#include "resolution/multipliers.h"

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
		.by = {{2, 2, 2}, {0.3, 0.3, 0.3}, CT_DECIMATE_POINT},
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

/* Of a scan no larger than a sample. */
static void test_small(void)
{
	const size_t n[3] = {12, 10, 9}, at[3] = {3, 3, 3};
	struct ct_upsample_rule rule = rule_of();
	struct ct_multipliers m = {0}, none = {0};
	struct ct_vol lo, found, given;
	struct ct_upsample_report did[2];

	make(&lo, n, at, 0);
	for (int k = 0; k < 2; k++) {
		rule.method = k ? CT_UPSAMPLE_TV : CT_UPSAMPLE_HTV;
		must(ct_multipliers_find(&none, &lo, &rule, false, &quiet, &err));
		OK(none.n == 0 && none.room == 0, "the whole finds its own");
		must(ct_multipliers_find(&m, &lo, &rule, true, &quiet, &err));
		OK(m.n >= 12 && m.n <= 13 && m.room == 0 && m.mu[m.n - 1] > 0,
			"one for each correction (%zu)", m.n);
		rule.multipliers = NULL;
		did[0] = refine(&found, &lo, &rule);
		rule.multipliers = &m;
		did[1] = refine(&given, &lo, &rule);
		OK(memcmp(found.data, given.data, ct_vol_count(&found) * sizeof(float)) == 0 &&
				did[0].residual == did[1].residual,
			"given, they make what they were found with");
		m.mu[m.n - 3] *= 2;
		ct_vol_free(&given);
		refine(&given, &lo, &rule);
		OK(memcmp(found.data, given.data, ct_vol_count(&found) * sizeof(float)) != 0,
			"each is taken");
		m.mu[1] = m.mu[0] = 1e9;
		m.n = 2;
		ct_vol_free(&given);
		did[1] = refine(&given, &lo, &rule);
		OK(did[1].residual < 0.01, "and after the last the last (%.3g HU)",
			did[1].residual);
		rule.multipliers = NULL;
		ct_multipliers_free(&m);
		ct_vol_free(&found);
		ct_vol_free(&given);
	}
	OK(!m.mu && m.n == 0, "nothing is left");
	ct_vol_free(&lo);
}

/* The multipliers of a scan are those of a part of it from `from` on. */
static bool are_of(
	const struct ct_vol *lo, const size_t from[3], const struct ct_upsample_rule *how)
{
	struct ct_upsample_rule rule = *how;
	struct ct_multipliers of_lo = {0}, of_piece = {0};
	struct ct_vol piece = {0};
	size_t n[3];
	bool same;

	must(!ct_multipliers_sample(n, lo, &rule) || ct_vol_alloc(&piece, n, &err));
	for (size_t i = 0; i < ct_vol_count(&piece); i++)
		piece.data[i] =
			lo->data[from[0] + i % n[0] +
				 lo->n[0] * (from[1] + i / n[0] % n[1] +
						    lo->n[1] * (from[2] + i / n[0] / n[1]))];
	memcpy(piece.affine, lo->affine, sizeof piece.affine);
	rule.spread = ct_upsample_spread(lo);
	must(ct_multipliers_find(&of_piece, &piece, &rule, true, &quiet, &err));
	rule.spread = how->spread;
	must(ct_multipliers_find(&of_lo, lo, &rule, false, &quiet, &err));
	same = of_lo.n > 0 && of_lo.n == of_piece.n &&
	       memcmp(of_lo.mu, of_piece.mu, of_lo.n * sizeof *of_lo.mu) == 0;
	ct_vol_free(&piece);
	ct_multipliers_free(&of_lo);
	ct_multipliers_free(&of_piece);
	return same;
}

static void test_sample(void)
{
	const size_t n[3] = {140, 6, 76}, everywhere[3] = {0}, corner[3] = {100, 0, 50};
	const size_t middle[3] = {38, 0, 6}, end[3] = {76, 0, 12};
	struct ct_upsample_rule rule = rule_of();
	struct ct_vol lo;
	size_t m[3];

	make(&lo, n, everywhere, 0);
	OK(ct_multipliers_sample(m, &lo, &rule) && m[0] == 64 && m[1] == 6 && m[2] == 64,
		"128 fine voxels along each axis");
	OK(are_of(&lo, middle, &rule), "in the middle");
	rule.spread = 50;
	OK(!are_of(&lo, middle, &rule), "in steps of the whole");
	rule.spread = 0;
	ct_vol_free(&lo);
	make(&lo, n, corner, 0);
	OK(are_of(&lo, end, &rule), "or where there is more tissue");
	ct_vol_free(&lo);
	make(&lo, n, corner, -800);
	OK(are_of(&lo, middle, &rule), "which lungs are not");
	ct_vol_free(&lo);
}

static void test_none(void)
{
	const size_t n[3] = {70, 4, 4}, at[3] = {0};
	struct ct_upsample_rule rule = rule_of();
	struct ct_multipliers m = {0};
	struct ct_vol lo;
	size_t s[3];

	make(&lo, n, at, 0);
	rule.method = CT_UPSAMPLE_DC;
	OK(!ct_multipliers_sample(s, &lo, &rule) &&
			ct_multipliers_find(&m, &lo, &rule, true, &quiet, &err) == 0 && !m.mu,
		"none of a method that does not iterate");
	rule = rule_of();
	rule.noise = 0;
	OK(!ct_multipliers_sample(s, &lo, &rule), "of no noise");
	rule = rule_of();
	rule.known = false;
	OK(!ct_multipliers_sample(s, &lo, &rule), "or no operator");
	ct_vol_free(&lo);
}

int main(void)
{
	test_small();
	test_sample();
	test_none();
	return tap_done();
}
