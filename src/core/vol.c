/* vol.c: see vol.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vol.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ct_vol_alloc(struct ct_vol *v, const size_t n[static 3], struct ct_err *e)
{
	size_t count;

	if (n[0] == 0 || n[1] == 0 || n[2] == 0)
		return ct_fail(e, CT_EINPUT, "empty volume %zux%zux%zu", n[0], n[1], n[2]);
	if (ct_size_mul(&count, n[0], n[1], "volume", e) ||
		ct_size_mul(&count, count, n[2], "volume", e) ||
		ct_alloc(&v->data, count, sizeof *v->data, e))
		return -1;
	memcpy(v->n, n, sizeof v->n);
	memset(v->affine, 0, sizeof v->affine);
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1.0;
	return 0;
}

int ct_vol_like(struct ct_vol *v, const struct ct_vol *grid, struct ct_err *e)
{
	if (ct_vol_alloc(v, grid->n, e))
		return -1;
	memcpy(v->affine, grid->affine, sizeof v->affine);
	return 0;
}

void ct_vol_free(struct ct_vol *v)
{
	free(v->data);
	ct_meta_free(&v->meta);
	*v = (struct ct_vol){0};
}

size_t ct_vol_count(const struct ct_vol *v)
{
	return v->n[0] * v->n[1] * v->n[2];
}

void ct_vol_spacing(const struct ct_vol *v, double mm[static 3])
{
	for (int a = 0; a < 3; a++)
		mm[a] = hypot(hypot(v->affine[0][a], v->affine[1][a]), v->affine[2][a]);
}

void ct_vol_world(const struct ct_vol *v, const double ijk[static 3], double mm[static 3])
{
	for (int a = 0; a < 3; a++)
		mm[a] = v->affine[a][0] * ijk[0] + v->affine[a][1] * ijk[1] +
			v->affine[a][2] * ijk[2] + v->affine[a][3];
}

void ct_vol_corner(const struct ct_vol *v, unsigned k, double mm[static 3])
{
	double ijk[3];

	ct_cell_corner(ijk, v->n, k, 0.5);
	ct_vol_world(v, ijk, mm);
}

void ct_vol_centre(const struct ct_vol *v, double mm[static 3])
{
	const double mid[3] = {
		((double)v->n[0] - 1) / 2, ((double)v->n[1] - 1) / 2, ((double)v->n[2] - 1) / 2};

	ct_vol_world(v, mid, mm);
}

void ct_vol_axes(const struct ct_vol *v, int axis[static 3], int sign[static 3])
{
	static const int world[3] = {0, 1, 2};

	ct_vec3_axes(axis, (const double(*)[4])v->affine, world);
	for (int d = 0; d < 3; d++)
		sign[d] = v->affine[d][axis[d]] < 0 ? -1 : 1;
}

size_t ct_vol_steps(const struct ct_vol *v, ptrdiff_t step[static 3])
{
	size_t stride = 1, first = 0;
	int axis[3], sign[3];

	ct_vol_axes(v, axis, sign);
	for (int a = 0; a < 3; stride *= v->n[a++]) {
		const bool back = sign[ct_vec3_place(a, axis)] < 0;

		step[a] = back ? -(ptrdiff_t)stride : (ptrdiff_t)stride;
		first += back ? (v->n[a] - 1) * stride : 0;
	}
	return first;
}

int ct_vol_check_grid(const struct ct_vol *v, struct ct_err *e)
{
	double mm[3];

	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 4; b++)
			if (!isfinite(v->affine[a][b]))
				return ct_fail(e, CT_EGEOM, "affine is not finite");
	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++)
		if (!(mm[a] > 1e-9 && mm[a] <= 1e6))
			return ct_fail(e, CT_EGEOM, "voxel size %g mm along axis %d", mm[a], a);
	for (int a = 0; a < 3; a++) {
		int b = (a + 1) % 3;
		double dot = 0;

		for (int r = 0; r < 3; r++)
			dot += v->affine[r][a] * v->affine[r][b];
		if (fabs(dot) > 1e-3 * mm[a] * mm[b])
			return ct_fail(e, CT_EGEOM,
				"axes %d and %d are not at right angles (sheared grid)", a, b);
	}
	return 0;
}

static int same_grid(const struct ct_vol *a, const struct ct_vol *b, struct ct_err *e)
{
	double mm[3];

	if (memcmp(a->n, b->n, sizeof a->n) != 0)
		return ct_fail(e, CT_EGEOM, "grids differ: %zux%zux%zu and %zux%zux%zu", a->n[0],
			a->n[1], a->n[2], b->n[0], b->n[1], b->n[2]);
	ct_vol_spacing(a, mm);
	for (unsigned corner = 0; corner < 8; corner++) {
		double ijk[3], p[3], q[3];

		ct_cell_corner(ijk, a->n, corner, 0);
		ct_vol_world(a, ijk, p);
		ct_vol_world(b, ijk, q);
		for (int d = 0; d < 3; d++)
			if (!(fabs(p[d] - q[d]) <= 1e-3 * fmin(fmin(mm[0], mm[1]), mm[2])))
				return ct_fail(e, CT_EGEOM,
					"grids differ: corner %u is at %g and %g mm along axis %d",
					corner, p[d], q[d], d);
	}
	return 0;
}

/* The grid as it is if it is stored towards RAS; no voxels. */
static struct ct_vol towards_ras(const struct ct_vol *v)
{
	struct ct_vol w = {0};
	int axis[3], sign[3];

	ct_vol_axes(v, axis, sign);
	for (int d = 0; d < 3; d++) {
		w.n[d] = v->n[axis[d]];
		for (int r = 0; r < 3; r++) {
			w.affine[r][d] = sign[d] * v->affine[r][axis[d]];
			w.affine[r][3] +=
				sign[d] < 0 ? v->affine[r][axis[d]] * ((double)w.n[d] - 1) : 0;
		}
	}
	for (int r = 0; r < 3; r++)
		w.affine[r][3] += v->affine[r][3];
	return w;
}

int ct_vol_same_grid(const struct ct_vol *a, const struct ct_vol *b, struct ct_err *e)
{
	const struct ct_vol one = towards_ras(a), other = towards_ras(b);
	struct ct_err none = {0};

	if (same_grid(a, b, e) == 0)
		return 0;
	if (same_grid(&one, &other, &none) == 0)
		return ct_fail(e, CT_EGEOM,
			"grids differ: the same voxels, but the axes are stored in another order or "
			"direction; ct-convert --reorient RAS of both makes them one");
	return -1;
}

/* Voxels x[n], of which the first is number `first` of v. */
static int check_finite(
	const struct ct_vol *v, const float *x, size_t n, size_t first, struct ct_err *e)
{
	enum { BLOCK = 4096, LANES = 32 };
	size_t at = 0;

	/* whole blocks first, lane by lane so that the loop is vectors: NaN and infinity times zero
	 * are NaN */
	for (; n - at >= BLOCK; at += BLOCK) {
		float lane[LANES] = {0}, sum = 0;

		for (size_t i = at; i < at + BLOCK; i += LANES)
			for (size_t k = 0; k < LANES; k++)
				lane[k] += x[i + k] * 0.0f;
		for (size_t k = 0; k < LANES; k++)
			sum += lane[k];
		if (isnan(sum))
			break;
	}
	for (; at < n; at++)
		if (!isfinite(x[at])) {
			const size_t i = first + at;

			return ct_fail(e, CT_ENUMERIC, "voxel (%zu,%zu,%zu) is %s", i % v->n[0],
				i / v->n[0] % v->n[1], i / v->n[0] / v->n[1],
				isnan(x[at]) ? "NaN" : "infinite");
		}
	return 0;
}

int ct_vol_check_finite(const struct ct_vol *v, struct ct_err *e)
{
	return check_finite(v, v->data, ct_vol_count(v), 0, e);
}

int ct_vol_check_plane(const struct ct_vol *v, size_t k, const float *x, struct ct_err *e)
{
	const size_t area = v->n[0] * v->n[1];

	return check_finite(v, x, area, k * area, e);
}

void ct_vol_rescale_affine(double dst[3][4], const double src[3][4], const double factor[static 3])
{
	for (int r = 0; r < 3; r++) {
		double shift = src[r][3];

		for (int a = 0; a < 3; a++) {
			shift += src[r][a] * ct_cell_index(ct_cell_centre(0) / factor[a]);
			dst[r][a] = src[r][a] / factor[a];
		}
		dst[r][3] = shift;
	}
}

void ct_vol_shift_affine(double affine[3][4], const double start[static 3])
{
	for (int r = 0; r < 3; r++)
		for (int a = 0; a < 3; a++)
			affine[r][3] += affine[r][a] * start[a];
}

void ct_vol_rotate(struct ct_vol *v, const double deg[static 3])
{
	double centre[3], after[3];

	ct_vol_centre(v, centre);
	for (int axis = 0; axis < 3; axis++) {
		int a = (axis + 1) % 3, b = (axis + 2) % 3;
		double c = cos(deg[axis] * (M_PI / 180)), s = sin(deg[axis] * (M_PI / 180));

		for (int k = 0; k < 4; k++) {
			double x = v->affine[a][k], y = v->affine[b][k];

			v->affine[a][k] = c * x - s * y;
			v->affine[b][k] = s * x + c * y;
		}
	}
	ct_vol_centre(v, after);
	for (int k = 0; k < 3; k++)
		v->affine[k][3] += centre[k] - after[k];
}
