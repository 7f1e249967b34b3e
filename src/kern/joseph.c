/* joseph.c: one ray through a box of voxels by linear interpolation (Joseph, IEEE TMI 1, 1982).
 *
 * Along its dominant axis a the ray is sampled once a slice, in the plane of the voxel centres
 * k + 1/2; there it passes between two voxel centres along b and two along c:
 *
 *   sum += (1-p)(1-q) f[b][c] + p(1-q) f[b+1][c] + (1-p)q f[b][c+1] + pq f[b+1][c+1]
 *
 * times the length from plane to plane. A voxel beyond the box is 0: its weight becomes 0, so sum
 * and spread have the same weights to the last bit.
 */
#include "config.h"
#include "kern/project-impl.h"

#include <math.h>
#include <stdint.h>

enum { LANES = 16 };

/* The four voxels and weights of each of LANES slices. */
struct taps {
	ptrdiff_t at[4][LANES];
	float w[4][LANES];
};

/* Between which voxels of one axis a ray is at slice centre x, and the weights. */
static CT_INLINE void between(ptrdiff_t at[static 2], float w[static 2], double from, double slope,
	double x, ptrdiff_t lo, ptrdiff_t hi)
{
	double y = from + slope * x - 0.5;
	double in = ct_least(ct_most(y, (double)(lo - 1)), (double)hi);
	ptrdiff_t b = (ptrdiff_t)(in - (double)(lo - 1)) + lo - 1;
	float p = (float)(y - (double)b);

	w[0] = b >= lo && b < hi && p < 1 ? 1 - p : 0;
	w[1] = b + 1 >= lo && b + 1 < hi && p > 0 ? p : 0;
	at[0] = b < lo ? lo : b < hi ? b : hi - 1;
	at[1] = b + 1 < lo ? lo : b + 1 < hi ? b + 1 : hi - 1;
}

static CT_INLINE void taps_at(struct taps *restrict t, const struct ct_box *box,
	const struct ct_ray *r, ptrdiff_t k, ptrdiff_t last)
{
	int a = r->axis[0], b = r->axis[1], c = r->axis[2];

	for (ptrdiff_t j = 0; j < LANES; j++) {
		ptrdiff_t i = k + j < last ? k + j : last, p[2], q[2];
		float wp[2], wq[2], on = k + j <= last ? 1 : 0;
		double x = (double)i + 0.5;

		between(p, wp, r->from[0], r->slope[0], x, box->lo[b], box->hi[b]);
		between(q, wq, r->from[1], r->slope[1], x, box->lo[c], box->hi[c]);
		for (int m = 0; m < 4; m++) {
			t->at[m][j] = i * box->stride[a] + p[m & 1] * box->stride[b] +
				      q[m >> 1] * box->stride[c];
			t->w[m][j] = on * wp[m & 1] * wq[m >> 1];
		}
	}
}

/* First and last slice of the ray whose centre is in it. */
static CT_INLINE ptrdiff_t slices(const struct ct_box *box, const struct ct_ray *r, ptrdiff_t *last)
{
	ptrdiff_t lo = box->lo[r->axis[0]], hi = box->hi[r->axis[0]] - 1;
	double first = ceil(r->x0 - 0.5), end = floor(r->x1 - 0.5);

	*last = end < (double)hi ? (ptrdiff_t)end : hi;
	return first > (double)lo ? (ptrdiff_t)first : lo;
}

CT_HOT double ct_joseph_sum(
	const float *restrict vol, const struct ct_box *box, const struct ct_ray *r)
{
	ptrdiff_t last, k = slices(box, r, &last);
	struct taps t;
	double sum = 0;

	for (; k <= last; k += LANES) {
		taps_at(&t, box, r, k, last);
		for (int j = 0; j < LANES; j++)
			sum += (double)(t.w[0][j] * vol[t.at[0][j]] +
					t.w[1][j] * vol[t.at[1][j]] +
					t.w[2][j] * vol[t.at[2][j]] + t.w[3][j] * vol[t.at[3][j]]);
	}
	return sum * r->scale;
}

CT_HOT void ct_joseph_spread(
	float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value)
{
	ptrdiff_t last, k = slices(box, r, &last);
	float x = (float)(value * r->scale);
	struct taps t;

	for (; k <= last; k += LANES) {
		taps_at(&t, box, r, k, last);
		for (int j = 0; j < LANES; j++)
			for (int m = 0; m < 4; m++)
				vol[t.at[m][j]] += t.w[m][j] * x;
	}
}
