/* The same voxels in another frame: axes in another order or direction, and cut or padded.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "core/vol.h"
#include "operator/crop.h"
#include "operator/regrid.h"
#include "tap.h"

#include <stdbool.h>
#include <string.h>

enum { A = 5, B = 4, C = 3, N = A * B * C };

static const size_t size[3] = {A, B, C};
static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

/* A grid of spacings 2, 0.5 and 7 mm, its axes a little off world axes order[] with signs of the
 * bits of `turned`. */
static void grid(double a[3][4], const int order[3], int turned)
{
	static const double mm[3] = {2, 0.5, 7};
	static const double lean[3][3] = {{0.9, 0.3, -0.3}, {-0.3, 0.9, 0.2}, {0.3, -0.2, 0.9}};

	for (int d = 0; d < 3; d++)
		for (int r = 0; r < 3; r++)
			a[order[r]][d] = (turned >> d & 1 ? -1 : 1) * mm[d] * lean[r][d];
	for (int r = 0; r < 3; r++)
		a[r][3] = 10 * r - 7;
}

/* v <- a volume whose voxels hold their number, and the same with other axes. */
static void turned(struct ct_vol *v, const double a[3][4], const int world[3], const int towards[3])
{
	struct ct_err e;

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, size, &e))
		exit(99);
	for (size_t i = 0; i < N; i++)
		v->data[i] = (float)i;
	memcpy(v->affine, a, sizeof v->affine);
	if (ct_regrid_axes(v, world, towards, &e))
		exit(99);
}

/* Every voxel keeps its place in the world. */
static bool stays(const struct ct_vol *is, const double old[3][4])
{
	struct ct_vol was = {.n = {A, B, C}};
	double worst = 0;

	memcpy(was.affine, old, sizeof was.affine);
	for (size_t i = 0; i < N; i++) {
		const size_t j = (size_t)is->data[i];
		double p[3], q[3];

		ct_vol_world(is,
			(const double[3]){(double)(i % is->n[0]), (double)(i / is->n[0] % is->n[1]),
				(double)(i / (is->n[0] * is->n[1]))},
			p);
		ct_vol_world(&was,
			(const double[3]){
				(double)(j % A), (double)(j / A % B), (double)(j / (A * B))},
			q);
		worst = fmax(worst, fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]));
	}
	return worst < 1e-9;
}

static void test_axes(void)
{
	bool closest = true, place = true;

	for (int k = 0; k < 6 * 8 * 8 * 6; k++) {
		const int *world = orders[k / 384];
		struct ct_vol v;
		int towards[3];
		double a[3][4];

		for (int d = 0; d < 3; d++)
			towards[d] = k / 48 % 8 >> d & 1 ? -1 : 1;
		grid(a, orders[k % 6], k / 6 % 8);
		turned(&v, (const double(*)[4])a, world, towards);
		for (int d = 0; d < 3; d++)
			for (int r = 0; r < 3; r++)
				closest = closest && v.affine[world[d]][d] * towards[d] >=
							     fabs(v.affine[r][d]);
		place = place && stays(&v, (const double(*)[4])a);
		ct_vol_free(&v);
	}
	OK(closest, "the axis closest to each of the world's, in the direction that is asked for");
	OK(place, "and no voxel moves");
}

/* Axes between those of the world: the largest sum of cosines of all six orders. */
static void test_between(void)
{
	bool best = true;

	for (uint64_t k = 0; k < 500; k++) {
		const int towards[3] = {1, 1, 1};
		struct ct_vol v;
		double a[3][4] = {{0}}, sum = 0, most = 0;

		for (int i = 0; i < 9; i++)
			a[i / 3][i % 3] = (double)ct_rng_normal(1, k, (uint64_t)i) * pow(3, i % 3);
		turned(&v, (const double(*)[4])a, orders[0], towards);
		for (int p = 0; p < 7; p++) {
			sum = 0;
			for (int d = 0; d < 3; d++) {
				const int o = p < 6 ? orders[p][d] : 5 - (int)v.n[d];

				sum += fabs(a[d][o]) / sqrt(a[0][o] * a[0][o] + a[1][o] * a[1][o] +
							       a[2][o] * a[2][o]);
			}
			most = fmax(most, sum);
		}
		best = best && sum > most - 1e-8;
		for (int d = 0; d < 3; d++)
			best = best && v.affine[d][d] >= 0;
		ct_vol_free(&v);
	}
	OK(best, "oblique axes: the largest sum of cosines");
}

static void test_body(void)
{
	float in[N];
	double c[3], want[3] = {0}, n = 0;

	for (size_t i = 0; i < N; i++) {
		in[i] = (float)ct_rng_below(2, 0, i, 4); /* 0 to 3 */
		if (in[i] > 1) {
			n++;
			want[0] += (double)(i % A);
			want[1] += (double)(i / A % B);
			want[2] += (double)(i / (A * B));
		}
	}
	ct_crop_body(c, in, size, 1);
	OK(fabs(c[0] - want[0] / n) + fabs(c[1] - want[1] / n) + fabs(c[2] - want[2] / n) < 1e-12,
		"the middle of what is above a value");
	ct_crop_body(c, in, size, 3);
	OK(c[0] == 2 && c[1] == 1.5 && c[2] == 1, "of all if nothing is");
}

/* The box of the largest region, by spreading labels until nothing changes. */
static void spread(size_t from[3], size_t to[3], const float *in, const size_t n[3], float above)
{
	const size_t all = n[0] * n[1] * n[2];
	size_t label[5 * 4 * 4], count[5 * 4 * 4] = {0}, best = all;
	bool again = true;

	for (size_t i = 0; i < all; i++)
		label[i] = i;
	while (again) {
		again = false;
		for (size_t i = 0; i < all; i++)
			for (int d = 0; d < 3; d++) {
				const size_t step = d == 0 ? 1 : d == 1 ? n[0] : n[0] * n[1];
				const size_t at = i / step % n[d], j = i + step;

				if (at + 1 == n[d] || !(in[i] > above) || !(in[j] > above) ||
					label[i] == label[j])
					continue;
				if (label[i] < label[j])
					label[j] = label[i];
				else
					label[i] = label[j];
				again = true;
			}
	}
	for (size_t i = 0; i < all; i++)
		count[label[i]] += in[i] > above;
	for (size_t i = 0; i < all; i++)
		if (count[i] > (best < all ? count[best] : 0))
			best = i;
	for (int d = 0; d < 3; d++) {
		from[d] = best < all ? n[d] : 0;
		to[d] = best < all ? 0 : n[d];
	}
	for (size_t i = 0; i < all && best < all; i++)
		for (int d = 0; d < 3 && label[i] == best; d++) {
			const size_t step = d == 0 ? 1 : d == 1 ? n[0] : n[0] * n[1];
			const size_t at = i / step % n[d];

			from[d] = at < from[d] ? at : from[d];
			to[d] = at + 1 > to[d] ? at + 1 : to[d];
		}
}

static void test_region(void)
{
	static const size_t n[3] = {5, 4, 4};
	float in[5 * 4 * 4];
	size_t from[3], to[3], wfrom[3], wto[3];
	bool same = true, inside = true;
	struct ct_err e;

	for (uint64_t t = 0; t < 3000; t++) {
		const uint32_t least = (uint32_t)(t % 5); /* dense to empty */

		for (size_t i = 0; i < 80; i++)
			in[i] = (float)ct_rng_below(3, t, i, 5);
		spread(wfrom, wto, in, n, (float)least);
		same = same && ct_crop_region(from, to, in, n, (float)least, &e) == 0 &&
		       memcmp(from, wfrom, sizeof from) == 0 && memcmp(to, wto, sizeof to) == 0;
		for (int d = 0; d < 3; d++)
			inside = inside && from[d] < to[d] && to[d] <= n[d];
	}
	OK(same, "the box of the largest region that touches by faces");
	OK(inside, "is not empty and in the grid");
}

static void test_start(void)
{
	bool nearest = true, middle = true;

	for (size_t n = 1; n < 9; n++)
		for (size_t m = 1; m < 14; m++)
			for (double c = -3.2; c < 12; c += 0.3) {
				const ptrdiff_t s = ct_crop_start(n, m, c);
				const double off = fabs((double)s + ((double)m - 1) / 2 - c);

				if (m >= n) /* as much before as behind, or one less */
					middle = middle && s <= 0 && (size_t)-s == (m - n) / 2;
				for (ptrdiff_t t = 0; t + (ptrdiff_t)m <= (ptrdiff_t)n; t++)
					nearest = nearest && s >= 0 &&
						  s + (ptrdiff_t)m <= (ptrdiff_t)n &&
						  off <= fabs((double)t + ((double)m - 1) / 2 - c) +
								  1e-9;
			}
	OK(nearest, "a window within the axis, nearest to a place");
	OK(middle, "a wider one has the axis in its middle");
}

static void test_crop(void)
{
	static const size_t m[3] = {4, 7, 2};
	bool same = true, place = true;
	float in[N];

	for (size_t i = 0; i < N; i++)
		in[i] = (float)i + 1;
	for (ptrdiff_t s = -4; s < 6; s++) {
		const ptrdiff_t start[3] = {s, -2, s - 2};
		struct ct_vol was = {.data = in, .n = {A, B, C}}, is = {0};
		struct ct_err e;
		double p[3], q[3];

		grid(was.affine, orders[3], 2);
		if (ct_crop(&is, &was, m, start, -9, &e))
			exit(99);
		for (size_t i = 0; i < 56; i++) {
			const ptrdiff_t x = (ptrdiff_t)(i % 4) + start[0],
					y = (ptrdiff_t)(i / 4 % 7) + start[1],
					z = (ptrdiff_t)(i / 28) + start[2];
			const bool inside = x >= 0 && x < A && y >= 0 && y < B && z >= 0 && z < C;

			same = same &&
			       is.data[i] == (inside ? (float)(x + A * y + A * B * z + 1) : -9);
		}
		ct_vol_world(&is, (const double[3]){1, 2, 3}, p);
		ct_vol_world(&was, (const double[3]){(double)s + 1, 0, (double)s + 1}, q);
		place = place && fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]) < 1e-9;
		ct_vol_free(&is);
	}
	OK(same, "what is there, and padding where nothing is");
	OK(place, "at the same place");
}

int main(void)
{
	test_axes();
	test_between();
	test_body();
	test_region();
	test_start();
	test_crop();
	return tap_done();
}
