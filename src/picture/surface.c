/* surface.c: see montage.h. */
#include "config.h"
#include "core/mem.h"
#include "picture/montage.h"

#include <math.h>

#define AMBIENT 0.15
enum { MOST_SIDE = 32768 };

/* Trilinear between voxel middles. The outer half of an edge voxel has the value of its middle. NaN
 * outside of the volume. */
static double linear(const struct ct_vol *v, const double ijk[static 3])
{
	const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};
	size_t at = 0, next[3];
	double t[3], sum = 0;

	for (int j = 0; j < 3; j++) {
		const double last = (double)v->n[j] - 1, x = fmin(fmax(ijk[j], 0), last);
		const double k = fmin(floor(x), fmax(last - 1, 0));

		if (!(ijk[j] >= ct_cell_index(0) - 1e-6 &&
			    ijk[j] <= ct_cell_index(last + 1) + 1e-6))
			return (double)NAN;
		t[j] = x - k;
		at += (size_t)k * stride[j];
		next[j] = v->n[j] > 1 ? stride[j] : 0;
	}
	for (int c = 0; c < 8; c++) {
		size_t p = at;
		double w = 1;

		for (int j = 0; j < 3; j++) {
			p += c >> j & 1 ? next[j] : 0;
			w *= c >> j & 1 ? t[j] : 1 - t[j];
		}
		if (w > 0) /* one that is not a number counts only where it matters */
			sum += w * (double)v->data[p];
	}
	return sum;
}

struct surface_job {
	const struct ct_vol *v;
	const struct ct_montage_slice *s;
	struct ct_montage_frame f;
	double level;
	int along; /* +1 or -1: how the index across the plane runs along a ray */
	float *out;
};

/* Index of a pixel's middle along the voxels of the picture's rows (i = 0) or columns. */
static double index_of(const struct surface_job *j, int i, size_t k)
{
	const double cell = ct_cell_centre((double)k) * (double)j->f.n[1 + i] / (double)j->s->n[i];

	return ct_cell_index(j->f.step[1 + i] > 0 ? (double)j->f.n[1 + i] - cell : cell);
}

/* The plane met at k >= 0 along a ray. */
static double plane(const struct surface_job *j, size_t k)
{
	return (double)(j->along > 0 ? k : j->f.n[0] - 1 - k);
}

/* Where the ray through ijk first rises to the level, into ijk: 1; 0 nowhere; -1 from the
 * beginning. */
static int meet(double ijk[3], const struct surface_job *j)
{
	double last = (double)NAN;

	for (size_t k = 0; k < j->f.n[0]; k++) {
		double x;

		ijk[j->f.axis[0]] = plane(j, k);
		x = linear(j->v, ijk);
		if (x >= j->level) {
			if (!isnan(last))
				ijk[j->f.axis[0]] -= j->along * (x - j->level) / (x - last);
			return k ? 1 : -1;
		}
		last = x;
	}
	return 0;
}

/* Cosine of the angle between the ray and the gradient, which points inwards. */
static double cosine(const struct surface_job *j, const double ijk[3])
{
	double g[3], length = 0;

	for (int i = 0; i < 3; i++) {
		const int a = j->f.axis[i];
		double lo[3] = {ijk[0], ijk[1], ijk[2]}, hi[3] = {ijk[0], ijk[1], ijk[2]};

		lo[a] = fmax(ijk[a] - 1, 0);
		hi[a] = fmin(ijk[a] + 1, (double)j->v->n[a] - 1);
		g[i] = hi[a] > lo[a] ? (linear(j->v, hi) - linear(j->v, lo)) /
					       ((hi[a] - lo[a]) * j->f.mm[i])
				     : 0;
		length = hypot(length, g[i]);
	}
	return length > 0 ? fmax(j->along * g[0] / length, 0) : 0;
}

static void row(void *arg, size_t r, size_t worker)
{
	const struct surface_job *j = arg;

	(void)worker;
	for (size_t c = 0; c < j->s->n[1]; c++) {
		double ijk[3];
		int met;

		ijk[j->f.axis[1]] = index_of(j, 0, r);
		ijk[j->f.axis[2]] = index_of(j, 1, c);
		met = meet(ijk, j);
		j->out[r * j->s->n[1] + c] =
			(float)(met == 0  ? 0
				: met < 0 ? 1
					  : AMBIENT + (1 - AMBIENT) * cosine(j, ijk));
	}
}

int ct_montage_slice_surface(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double level, double pixel, struct ct_par *par,
	struct ct_err *e)
{
	/* how the world coordinate across a plane runs away from the eye */
	static const int away[CT_MONTAGE_PLANES] = {1, -1, 1};
	struct surface_job j = {.v = v, .s = s, .level = level};

	ct_montage_frame_make(&j.f, v, plane);
	j.along = (j.f.step[0] > 0 ? 1 : -1) * away[plane];
	for (int i = 0; i < 2; i++) {
		const double side = (double)j.f.n[1 + i] * j.f.mm[1 + i];

		if (side / pixel > MOST_SIDE)
			return ct_fail(
				e, CT_EINPUT, "a picture of more than %d pixels a side", MOST_SIDE);
		s->n[i] = (size_t)fmax(rint(side / pixel), 1);
		s->mm[i] = side / (double)s->n[i];
		s->origin[i] = -j.f.centre[1 + i] - side / 2;
	}
	if (ct_alloc(own, s->n[0] * s->n[1], sizeof **own, e))
		return -1;
	j.out = *own;
	ct_par_for(par, s->n[0], row, &j);
	s->data = *own;
	s->step[0] = (ptrdiff_t)s->n[1];
	s->step[1] = 1;
	return 0;
}
