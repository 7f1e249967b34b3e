/* mip.c: see montage.h. */
#include "config.h"
#include "core/mem.h"
#include "picture/montage.h"

#include <math.h>
#include <stdlib.h>

/* The planes k of voxels of a slab: range[0] <= k < range[1]. */
static void planes(size_t range[2], const struct ct_montage_frame *f, double mm, double thickness)
{
	const double at = ct_montage_frame_index(f, mm), half = thickness / 2 / f->mm[0],
		     last = (double)f->n[0] - 1, one = fmin(fmax(floor(at), 0), last),
		     from = ceil(ct_cell_index(at - half) - 1e-9),
		     to = floor(ct_cell_index(at + half) + 1e-9);

	if (thickness <= 0 || from > to) {
		range[0] = thickness <= 0 ? 0 : (size_t)one;
		range[1] = thickness <= 0 ? f->n[0] : (size_t)one + 1;
		return;
	}
	range[0] = (size_t)fmax(from, 0);
	range[1] = (size_t)fmin(to, last) + 1;
}

static void put(double *sum, double x, bool first, enum ct_mip how)
{
	if (first)
		*sum = x;
	else if (how == CT_MIP_MEAN)
		*sum += x;
	else if (isnan(x) || (how == CT_MIP_MAX ? x > *sum : x < *sum))
		*sum = x;
}

int ct_montage_slice_mip(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double mm, double thickness, enum ct_mip how, struct ct_err *e)
{
	struct ct_montage_frame f;
	size_t area, range[2], lo[3] = {0}, hi[3] = {v->n[0], v->n[1], v->n[2]};
	ptrdiff_t start = 0, step[3] = {0};
	double *sum = NULL;

	ct_montage_frame_make(&f, v, plane);
	if (ct_montage_slice_volume(s, v, plane, mm))
		return 1;
	area = s->n[0] * s->n[1];
	if (ct_alloc(&sum, area, sizeof *sum, e) || ct_alloc(own, area, sizeof **own, e)) {
		free(sum);
		return -1;
	}
	planes(range, &f, mm, thickness);
	lo[f.axis[0]] = range[0];
	hi[f.axis[0]] = range[1];
	for (int i = 0; i < 2; i++) { /* row after row, as it will be shown */
		const ptrdiff_t by = i ? 1 : (ptrdiff_t)s->n[1];
		const bool back = f.step[1 + i] > 0;

		step[f.axis[1 + i]] = back ? -by : by;
		start += back ? by * (ptrdiff_t)(s->n[i] - 1) : 0;
	}
	for (size_t k = lo[2]; k < hi[2]; k++) {
		for (size_t j = lo[1]; j < hi[1]; j++)
			for (size_t i = lo[0]; i < hi[0]; i++) {
				const size_t at[3] = {i, j, k};

				put(&sum[start + (ptrdiff_t)i * step[0] + (ptrdiff_t)j * step[1] +
					    (ptrdiff_t)k * step[2]],
					(double)v->data[(k * v->n[1] + j) * v->n[0] + i],
					at[f.axis[0]] == range[0], how);
			}
	}
	for (size_t i = 0; i < area; i++)
		(*own)[i] = (float)(how == CT_MIP_MEAN ? sum[i] / (double)(range[1] - range[0])
						       : sum[i]);
	free(sum);
	s->data = *own;
	s->step[0] = (ptrdiff_t)s->n[1];
	s->step[1] = 1;
	return 0;
}
