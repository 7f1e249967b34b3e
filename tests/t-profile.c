/* The spread and the sampling of a phantom's profiles are found again.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "numbers.h"
#include "operator/degrade.h"
#include "estimate/edge-lines.h"
#include "operator/padding.h"
#include "estimate/profile.h"

#include <stdbool.h>
#include <string.h>

enum { SIDE = 96 };

/* Balls of many sizes and densities in air, with soft edges of `soft` voxels. */
static void make(struct ct_vol *v, double soft)
{
	must(ct_vol_alloc(v, (const size_t[3]){SIDE, SIDE, SIDE}, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = -1000;
	for (uint64_t b = 0; b < 60; b++) {
		const double r = 4 + 10 * ct_rng_uniform(1, b, 0);
		const double hu = 100 + 900 * ct_rng_uniform(1, b, 1);
		double c[3];

		for (int a = 0; a < 3; a++)
			c[a] = SIDE * ct_rng_uniform(1, b, 2 + (uint64_t)a);
		for (size_t i = 0; i < ct_vol_count(v); i++) {
			const double d = sqrt(pow((double)(i % SIDE) - c[0], 2) +
					      pow((double)(i / SIDE % SIDE) - c[1], 2) +
					      pow((double)(i / SIDE / SIDE) - c[2], 2));
			const double in = 0.5 * erfc((d - r) / (sqrt(2) * soft));

			v->data[i] = (float)((1 - in) * (double)v->data[i] + in * hu);
		}
	}
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1;
}

static struct ct_vol reduced(const struct ct_vol *v, const struct ct_degrade *d, double noise)
{
	struct ct_vol lo = {0};

	must(ct_degrade_volume(&lo, v, d, noise, 3, NULL, &err));
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		lo.data[i] = rintf(lo.data[i]);
	return lo;
}

static void found(const struct ct_vol *v)
{
	static const struct {
		struct ct_degrade d;
		double spread; /* LR voxels */
	} cases[] = {{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}}, 0.425},
		{{{3, 3, 3}, {0.4, 0.4, 0.4}, CT_DECIMATE_POINT, {0}}, 0.133},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0.289},
		{{{1, 1, 5}, {0, 0, 1.86}, CT_DECIMATE_POINT, {0}}, 0.372}};

	for (size_t k = 0; k < 8; k++) {
		const struct ct_degrade *d = &cases[k / 2].d;
		struct ct_vol lo = reduced(v, d, k % 2 ? 15 : 0);
		struct ct_profile got[3];

		must(ct_profile_measure(got, &lo, d->factor, NULL, &err));
		for (int a = 0; a < 3; a++) {
			if (d->factor[a] > 1)
				OK(fabs(got[a].spread - cases[k / 2].spread) < 0.05 &&
						got[a].edges > 100 && got[a].deviation > 0 &&
						got[a].deviation < 1,
					"case %zu, axis %d: %.3f for %.3f", k, a, got[a].spread,
					cases[k / 2].spread);
			else
				OK(isnan(got[a].spread), "an axis that stays");
		}
		OK((got[2].aliases > 0.5) == (d->decimate != CT_DECIMATE_SINC),
			"case %zu aliases with %.2f", k, got[2].aliases);
		ct_vol_free(&lo);
	}
}

/* What is soft along another axis too is soft by itself. */
static void soft(void)
{
	const struct ct_degrade d = {{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}};
	struct ct_profile got[3];
	struct ct_vol v = {0}, lo;

	make(&v, 1.5);
	lo = reduced(&v, &d, 0);
	must(ct_profile_measure(got, &lo, d.factor, NULL, &err));
	OK(got[2].spread < 0.45, "soft edges count less: %.3f for .289", got[2].spread);
	ct_vol_free(&lo);
	ct_vol_free(&v);
}

/* Padding is no edge, and neither is too small a scan one. */
static void nothing(const struct ct_vol *v)
{
	const size_t few[3] = {12, 12, 12};
	static float rows[CT_EDGE_PLACES][CT_EDGE_ROW];
	struct ct_vol half = {0};
	struct ct_padding p;
	size_t n;

	must(ct_vol_alloc(&half, v->n, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++)
		half.data[i] = i % SIDE < SIDE / 2 ? -1024 : 500 + 2 * ct_rng_normal(1, 0, i);
	must(ct_padding_find(&p, half.data, half.n, &err));
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, half.data, p.is, half.n, 0, &err));
	OK(n == 0, "the border of padding is no edge");
	ct_padding_free(&p);
	for (size_t i = 0; i < ct_vol_count(v); i++)
		half.data[i] = (i % SIDE < SIDE / 2 ? 40 : 4000) + 2 * ct_rng_normal(1, 0, i);
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, half.data, NULL, half.n, 0, &err));
	OK(n == 0, "metal is no edge");
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, v->data, NULL, few, 2, &err));
	OK(n == 0, "12 voxels are too few");
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, v->data, NULL, v->n, 2, &err));
	OK(n == CT_EDGE_PLACES && fabsf(rows[0][5] + 0.5f) < 1e-5f &&
			fabsf(rows[0][6] - 0.5f) < 1e-5f,
		"a row goes up by one step in its middle");
	ct_vol_free(&half);
}

/* In a synthetic CT air is constant, and so are all shapes of the highest value: what such lines
 * show counts if there is nothing else, and little. */
static void clipped(void)
{
	const struct ct_degrade d = {{4, 4, 4}, {1.2, 1.2, 1.2}, CT_DECIMATE_POINT, {0}};
	static float rows[CT_EDGE_PLACES][CT_EDGE_ROW];
	struct ct_vol v = {0}, lo;
	struct ct_profile got[3];
	bool is = false;
	size_t n;

	must(ct_vol_alloc(&v, (const size_t[3]){SIDE, SIDE, SIDE}, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = i % SIDE + i / SIDE % SIDE < SIDE + 10 ? -1000 : 400;
	lo = reduced(&v, &d, 0);
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, lo.data, NULL, lo.n, 0, &err));
	OK(n == 0, "clipped lines do not count");
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, &is, lo.data, NULL, lo.n, 0, &err));
	OK(n > 0 && is, "but if there are no others: %zu", n);
	must(ct_profile_measure(got, &lo, d.factor, NULL, &err));
	OK(got[0].deviation == 1 && got[0].spread > 0.2 && got[0].spread < 0.55 &&
			isnan(got[2].spread),
		"and then they show a spread that is not sure: %.3f for .325", got[0].spread);
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, &is, v.data, NULL, v.n, 2, &err));
	OK(n == 0, "no edge: nothing");
	ct_vol_free(&lo);
	ct_vol_free(&v);
}

int main(void)
{
	struct ct_vol v = {0};

	make(&v, 0.5);
	found(&v);
	nothing(&v);
	clipped();
	soft();
	ct_vol_free(&v);
	return tap_done();
}
