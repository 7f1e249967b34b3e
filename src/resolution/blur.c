/* blur.c: see blur.h. */
#include "config.h"
#include "resolution/blur.h"
#include "core/mem.h"
#include "resolution/noise.h"
#include "resolution/padding.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
	HALF_WINDOW = 3,              /* differences to each side of an edge's steepest one */
	WINDOW = 2 * HALF_WINDOW + 1, /* differences of an edge */
	LEAST_EDGES = 12,
	MOST_VOXELS = 1 << 26, /* looked at along an axis; planes are left out beyond */
};

static const double step_least = 150, step_most = 400, steps_of_noise = 10; /* HU */
static const double one_way = 0.75, own_blur = 0.6, shrink = 0.64, errors = 2;
static const double well_most = 0.141, sharp_most = 0.292; /* aliasing */

/* Sums over edges of r0 = sum d_k^2, r1 = sum d_k d_(k+1), their products, and
 * |sum d_k e^(-2 pi i 0.4 k)|^2. */
enum { R0, R1, R00, R01, R11, POWER, SUMS };
struct sums {
	size_t n;
	double of[SUMS];
};

static void add(struct sums *s, size_t n, const double of[SUMS])
{
	s->n += n;
	for (int k = 0; k < SUMS; k++)
		s->of[k] += of[k];
}

struct blur_job {
	const float *x;
	const unsigned char *padding;   /* or NULL */
	size_t stride[3], lo[3], hi[3]; /* of the places where an edge may be */
	size_t n[3];
	int axis, plane; /* along which, and the axis of the tasks */
	size_t step;     /* every so many planes are looked at */
	double least;    /* step, HU */
	double turn[2][WINDOW];
	struct sums *part;
};

/* Square of the change across the edge's surface's two other directions, over the window. */
static double across(const struct blur_job *j, const float *x)
{
	const size_t along = j->stride[j->axis];
	double square = 0;

	for (int b = 0; b < 3; b++) {
		const size_t s = j->stride[b];
		double sum = 0;

		if (b == j->axis || j->n[b] < 3)
			continue;
		for (size_t k = 0; k < WINDOW - 1; k++) {
			const float *at = x + k * along - (HALF_WINDOW - 1) * along;

			sum += ((double)*(at + s) - (double)*(at - s)) / 2;
		}
		square += sum * sum;
	}
	return square;
}

/* Is one of the 8 voxels padding? */
static bool is_cut(const struct blur_job *j, const float *first)
{
	const unsigned char *is = j->padding ? j->padding + (first - j->x) : NULL;

	for (size_t k = 0; is && k <= WINDOW; k++)
		if (is[k * j->stride[j->axis]])
			return true;
	return false;
}

/* x is the voxel before the steepest difference. */
static void add_edge(struct sums *s, const struct blur_job *j, const float *x)
{
	const size_t along = j->stride[j->axis];
	const float *first = x - HALF_WINDOW * along;
	double d[WINDOW], sum = 0, total = 0, most = 0, r0 = 0, r1 = 0, re = 0, im = 0;
	bool padded = (double)first[0] < CT_NOISE_PADDING;

	for (size_t k = 0; k < WINDOW; k++) {
		const double next = (double)first[(k + 1) * along];

		d[k] = next - (double)first[k * along];
		sum += d[k];
		total += fabs(d[k]);
		most = fmax(most, fabs(d[k]));
		padded |= next < CT_NOISE_PADDING;
	}
	if (padded || is_cut(j, first) || most > fabs(d[HALF_WINDOW]) || fabs(sum) < j->least ||
		fabs(sum) <= one_way * total || across(j, x) >= sum * sum)
		return;
	for (size_t k = 0; k < WINDOW; k++) {
		d[k] /= sum;
		r0 += d[k] * d[k];
		r1 += k ? d[k] * d[k - 1] : 0;
		re += d[k] * j->turn[0][k];
		im += d[k] * j->turn[1][k];
	}
	add(s, 1, (const double[SUMS]){r0, r1, r0 * r0, r0 * r1, r1 * r1, re * re + im * im});
}

static void scan_plane(void *arg, size_t task, size_t worker)
{
	const struct blur_job *j = arg;
	const size_t along = j->stride[j->axis];
	const float steep = (float)(j->least / WINDOW);
	const int outer = 3 - j->plane; /* i is the innermost, whatever the axis */
	struct sums *s = &j->part[task];

	(void)worker;
	for (size_t o = j->lo[outer]; o < j->hi[outer]; o++) {
		const float *row = j->x + (j->lo[j->plane] + task * j->step) * j->stride[j->plane] +
				   o * j->stride[outer];

		for (size_t i = j->lo[0]; i < j->hi[0]; i++) {
			const float *x = row + i;
			const float d = fabsf(*(x + along) - *x);

			if (d >= steep && d >= fabsf(*x - *(x - along)) &&
				d > fabsf(*(x + 2 * along) - *(x + along)))
				add_edge(s, j, x);
		}
	}
}

/* r(1)/r(0) of a step edge under a Gaussian of sigma voxels. Midpoint rule: the integrand is smooth
 * and 64 points leave 1e-5. */
static double ratio_of(double sigma)
{
	double r0 = 0, r1 = 0;

	for (int i = 0; i < 64; i++) {
		const double f = (i + 0.5) / 128, t = M_PI * f, sinc = sin(t) / t,
			     s = sinc * sinc * exp(-4 * t * t * sigma * sigma);

		r0 += s;
		r1 += s * cos(2 * t);
	}
	return r1 / r0;
}

/* The sigma in [0, 1] of a ratio, by bisection: ratio_of grows. */
static double sigma_of(double ratio)
{
	double lo = 0, hi = 1;

	if (ratio <= ratio_of(lo))
		return 0;
	for (int i = 0; i < 40; i++) {
		const double mid = (lo + hi) / 2;

		if (ratio_of(mid) < ratio)
			lo = mid;
		else
			hi = mid;
	}
	return lo;
}

static void conclude(struct ct_blur_axis *out, const struct sums *s, double factor)
{
	const double own = own_blur / factor, ratio = s->of[R1] / s->of[R0],
		     square = s->of[R11] - 2 * ratio * s->of[R01] + ratio * ratio * s->of[R00],
		     error = sqrt(square > 0 ? square : 0) / s->of[R0];
	double low;

	out->edges = s->n;
	if (s->n < LEAST_EDGES)
		return;
	out->measured = sigma_of(ratio);
	low = sigma_of(ratio - errors * error);
	out->sigma = low > own ? shrink * sqrt(low * low - own * own) : 0;
	out->aliasing = s->of[POWER] / (double)s->n;
	out->sampling = out->aliasing < well_most    ? CT_SAMPLING_WELL
			: out->aliasing < sharp_most ? CT_SAMPLING_SHARP
						     : CT_SAMPLING_ALIASED;
}

static int measure_axis(struct ct_blur_axis *out, const struct ct_vol *v,
	const struct ct_padding *padding, int axis, double factor, double least, struct ct_par *par,
	struct ct_err *e)
{
	struct blur_job j = {.x = v->data,
		.padding = padding->is,
		.stride = {1, v->n[0], v->n[0] * v->n[1]},
		.axis = axis,
		.plane = axis == 2 ? 1 : 2,
		.least = least};
	struct sums all = {0};
	size_t tasks;

	*out = (struct ct_blur_axis){.measured = (double)NAN, .aliasing = (double)NAN};
	if (v->n[axis] < WINDOW + 1)
		return 0;
	memcpy(j.n, v->n, sizeof j.n);
	/* neighbours are read across an edge, and HALF_WINDOW along it */
	for (int b = 0; b < 3; b++) {
		const size_t before = b == axis ? HALF_WINDOW : v->n[b] < 3 ? 0 : 1;

		j.lo[b] = before;
		j.hi[b] = v->n[b] - before - (b == axis);
	}
	for (int k = 0; k < WINDOW; k++) {
		j.turn[0][k] = cos(2 * M_PI * 0.4 * k);
		j.turn[1][k] = sin(2 * M_PI * 0.4 * k);
	}
	j.step = ct_vol_count(v) / MOST_VOXELS + 1;
	tasks = (j.hi[j.plane] - j.lo[j.plane] + j.step - 1) / j.step;
	if (ct_alloc0(&j.part, tasks, sizeof *j.part, e))
		return -1;
	ct_par_for(par, tasks, scan_plane, &j);
	for (size_t t = 0; t < tasks; t++)
		add(&all, j.part[t].n, j.part[t].of);
	free(j.part);
	conclude(out, &all, factor);
	return 0;
}

int ct_blur_estimate(struct ct_blur *out, const struct ct_vol *v, const double factor[static 3],
	struct ct_par *par, struct ct_err *e)
{
	struct ct_padding padding;
	struct ct_noise noise;
	double least;
	int rc = 0;

	*out = (struct ct_blur){0};
	for (int a = 0; a < 3; a++)
		if (!(factor[a] >= 1 && isfinite(factor[a])))
			return ct_fail(e, CT_EINPUT, "a factor of %g along axis %d", factor[a], a);
	if (ct_noise_measure(&noise, v, e) || ct_padding_find(&padding, v->data, v->n, e))
		return -1;
	out->noise = noise.common;
	out->sure = noise.sure;
	least = fmin(fmax(step_least, steps_of_noise * out->noise), step_most);
	for (int a = 0; a < 3 && rc == 0; a++)
		rc = measure_axis(&out->axis[a], v, &padding, a, factor[a], least, par, e);
	ct_padding_free(&padding);
	return rc;
}
