/* blur.c: see blur.h. */
#include "config.h"
#include "resolution/blur.h"
#include "core/mem.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
	HALF = 3,              /* differences to each side of an edge's steepest one */
	WINDOW = 2 * HALF + 1, /* differences of an edge */
	LEAST_EDGES = 12,
	BLOCK = 3, /* side of a block of the noise, voxels */
	MOST_BLOCKS = 1 << 16,
	MOST_VOXELS = 1 << 26, /* looked at along an axis; planes are left out beyond */
};

static const double step_least = 150, step_most = 400, steps_of_noise = 10; /* HU */
static const double padding = -1100, air = -850;                            /* HU */
static const double texture = 6; /* HU that blocks of scans without noise show */
static const double one_way = 0.75, own_blur = 0.6, shrink = 0.64, errors = 2;
static const double well_most = 0.141, sharp_most = 0.292; /* aliasing */

/* Sums over edges of r0 = sum d_k^2, r1 = sum d_k d_(k+1), and |sum d_k e^(-2 pi i 0.4 k)|^2. */
struct sums {
	size_t n;
	double r0, r1, r00, r01, r11, power;
};

struct job {
	const float *x;
	size_t stride[3], lo[3], hi[3]; /* of the places where an edge may be */
	size_t n[3];
	int axis, plane; /* along which, and the axis of the tasks */
	size_t step;     /* every so many planes are looked at */
	double least;    /* step, HU */
	double turn[2][WINDOW];
	struct sums *part;
};

/* Square of the change across the edge's surface's two other directions, over the window. */
static double across(const struct job *j, const float *x)
{
	const size_t along = j->stride[j->axis];
	double square = 0;

	for (int b = 0; b < 3; b++) {
		const size_t s = j->stride[b];
		double sum = 0;

		if (b == j->axis || j->n[b] < 3)
			continue;
		for (size_t k = 0; k < WINDOW - 1; k++) {
			const float *at = x + k * along - (HALF - 1) * along;

			sum += ((double)*(at + s) - (double)*(at - s)) / 2;
		}
		square += sum * sum;
	}
	return square;
}

/* x is the voxel before the steepest difference. */
static void add_edge(struct sums *s, const struct job *j, const float *x)
{
	const size_t along = j->stride[j->axis];
	const float *first = x - HALF * along;
	double d[WINDOW], sum = 0, total = 0, most = 0, r0 = 0, r1 = 0, re = 0, im = 0;
	bool padded = (double)first[0] < padding;

	for (size_t k = 0; k < WINDOW; k++) {
		const double next = (double)first[(k + 1) * along];

		d[k] = next - (double)first[k * along];
		sum += d[k];
		total += fabs(d[k]);
		most = fmax(most, fabs(d[k]));
		padded |= next < padding;
	}
	if (padded || most > fabs(d[HALF]) || fabs(sum) < j->least ||
		fabs(sum) <= one_way * total || across(j, x) >= sum * sum)
		return;
	for (size_t k = 0; k < WINDOW; k++) {
		d[k] /= sum;
		r0 += d[k] * d[k];
		r1 += k ? d[k] * d[k - 1] : 0;
		re += d[k] * j->turn[0][k];
		im += d[k] * j->turn[1][k];
	}
	s->n++;
	s->r0 += r0;
	s->r1 += r1;
	s->r00 += r0 * r0;
	s->r01 += r0 * r1;
	s->r11 += r1 * r1;
	s->power += re * re + im * im;
}

static void scan_plane(void *arg, size_t task, size_t worker)
{
	const struct job *j = arg;
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

static double without(double sigma, double other)
{
	return sigma > other ? sqrt(sigma * sigma - other * other) : 0;
}

static void conclude(struct ct_blur_axis *out, const struct sums *s, double factor)
{
	const double own = own_blur / factor, ratio = s->r1 / s->r0,
		     square = s->r11 - 2 * ratio * s->r01 + ratio * ratio * s->r00,
		     error = sqrt(square > 0 ? square : 0) / s->r0;

	out->edges = s->n;
	if (s->n < LEAST_EDGES)
		return;
	out->measured = sigma_of(ratio);
	out->sigma = shrink * without(sigma_of(ratio - errors * error), own);
	out->aliasing = s->power / (double)s->n;
	out->sampling = out->aliasing < well_most    ? CT_SAMPLING_WELL
			: out->aliasing < sharp_most ? CT_SAMPLING_SHARP
						     : CT_SAMPLING_ALIASED;
}

static int measure_axis(struct ct_blur_axis *out, const struct ct_vol *v, int axis, double factor,
	double least, struct ct_par *par, struct ct_err *e)
{
	struct job j = {.x = v->data,
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
	for (int b = 0; b < 3; b++) { /* neighbours are read across an edge, and HALF along it */
		const size_t before = b == axis ? HALF : v->n[b] < 3 ? 0 : 1;

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
	for (size_t t = 0; t < tasks; t++) {
		const struct sums *s = &j.part[t];

		all.n += s->n;
		all.r0 += s->r0;
		all.r1 += s->r1;
		all.r00 += s->r00;
		all.r01 += s->r01;
		all.r11 += s->r11;
		all.power += s->power;
	}
	free(j.part);
	conclude(out, &all, factor);
	return 0;
}

/* Of a block of m[0] x m[1] x m[2] values that a linear function was fitted to. */
static double free_values(const size_t m[3])
{
	return (double)(m[0] * m[1] * m[2]) - 1 - (m[0] > 1) - (m[1] > 1) - (m[2] > 1);
}

/* Deviation of the m[0] x m[1] x m[2] block at x from its best linear function; -1 if it is air,
 * or constant for the greater part. */
static double block_sd(const float *x, const size_t m[3], const size_t stride[3])
{
	const double first = (double)x[0];
	double sum = 0, square = 0, slope[3] = {0}, last = first;
	size_t count = m[0] * m[1] * m[2], same = 0;

	for (size_t k = 0; k < m[2]; k++)
		for (size_t q = 0; q < m[1]; q++)
			for (size_t i = 0; i < m[0]; i++) {
				const size_t at[3] = {i, q, k};
				const double d = (double)x[i + q * stride[1] + k * stride[2]] -
						 first; /* keeps the squares small */

				for (int a = 0; a < 3; a++)
					slope[a] += d * (2 * (double)at[a] - (double)m[a] + 1) / 2;
				sum += d;
				square += d * d;
				same += d + first == last;
				last = d + first;
			}
	if (first + sum / (double)count < air || 2 * same > count)
		return -1;
	square -= sum * sum / (double)count;
	for (int a = 0; a < 3; a++) {
		const double n = (double)m[a]; /* sum of (i - (n-1)/2)^2 is n (n^2-1) / 12 */

		if (m[a] < 2)
			continue;
		square -= slope[a] * slope[a] / ((double)count * (n * n - 1) / 12);
	}
	return square > 0 ? sqrt(square / free_values(m)) : -1;
}

static int by_value(const void *a, const void *b)
{
	const float x = *(const float *)a, y = *(const float *)b;

	return (x > y) - (x < y);
}

/* Where n sorted values are densest: the half of them that is narrowest, and the half of it. */
static double densest(const float *x, size_t n)
{
	double sum = 0;

	while (n > 16) {
		const size_t half = (n + 1) / 2;
		size_t best = 0;

		for (size_t i = 1; i + half <= n; i++)
			if (x[i + half - 1] - x[i] < x[best + half - 1] - x[best])
				best = i;
		x += best;
		n = half;
	}
	for (size_t i = 0; i < n; i++)
		sum += (double)x[i];
	return sum / (double)n;
}

/* The deviation of flat tissue: the mode among the quarter of the blocks that is flattest, then the
 * mean square around it. Texture and edges only add to a block's deviation. */
static double common_sd(float *sd, size_t n)
{
	const size_t quarter = n / 4 < 16 ? 16 : n / 4;
	double mode, sum = 0;
	size_t near = 0;

	if (n < 16)
		return 0;
	qsort(sd, n, sizeof *sd, by_value);
	mode = densest(sd, quarter);
	for (size_t i = 0; i < n; i++)
		if ((double)sd[i] > mode / 1.5 && (double)sd[i] < mode * 1.5) {
			sum += (double)sd[i] * (double)sd[i];
			near++;
		}
	return near ? sqrt(sum / (double)near) : 0;
}

/* The deviation of which blocks with so many free values show less once in 50 times, in units of
 * the noise: the root of chi^2 per value, by Wilson and Hilferty. */
static double seldom_less(double free_values)
{
	const double var = 2 / (9 * free_values), cube = 1 - var - 2.0537 * sqrt(var);

	return sqrt(cube * cube * cube);
}

/* Noise is everywhere: there is no more of it than the flattest blocks show. n sorted values. */
static double sure_sd(const float *sd, size_t n, double free_values, double noise)
{
	double most;

	if (n < 16)
		return 0;
	most = fmin((double)sd[n / 50] / seldom_less(free_values), noise);
	return most > texture ? sqrt(most * most - texture * texture) : 0;
}

static size_t places(const struct ct_vol *v, const size_t m[3], size_t step)
{
	size_t n = 1;

	for (int a = 0; a < 3; a++)
		n *= (v->n[a] - m[a]) / step + 1;
	return n;
}

static int measure_noise(struct ct_blur *out, const struct ct_vol *v, struct ct_err *e)
{
	const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};
	size_t m[3], step = 2, n = 0;
	float *sd = NULL;

	for (int a = 0; a < 3; a++)
		m[a] = v->n[a] < BLOCK ? v->n[a] : BLOCK;
	if (m[0] * m[1] * m[2] < BLOCK * BLOCK) /* a line */
		return 0;
	while (places(v, m, step) > MOST_BLOCKS)
		step++;
	if (ct_alloc(&sd, places(v, m, step), sizeof *sd, e))
		return -1;
	for (size_t k = 0; k + m[2] <= v->n[2]; k += step)
		for (size_t q = 0; q + m[1] <= v->n[1]; q += step)
			for (size_t i = 0; i + m[0] <= v->n[0]; i += step) {
				const double s = block_sd(
					&v->data[i + q * stride[1] + k * stride[2]], m, stride);

				if (s > 0)
					sd[n++] = (float)s;
			}
	out->noise = common_sd(sd, n);
	out->sure = sure_sd(sd, n, free_values(m), out->noise);
	free(sd);
	return 0;
}

int ct_blur_estimate(struct ct_blur *out, const struct ct_vol *v, const double factor[static 3],
	struct ct_par *par, struct ct_err *e)
{
	double least;

	*out = (struct ct_blur){0};
	for (int a = 0; a < 3; a++)
		if (!(factor[a] >= 1 && isfinite(factor[a])))
			return ct_fail(e, CT_EINPUT, "a factor of %g along axis %d", factor[a], a);
	if (ct_vol_check_finite(v, e) || measure_noise(out, v, e))
		return -1;
	least = fmin(fmax(step_least, steps_of_noise * out->noise), step_most);
	for (int a = 0; a < 3; a++)
		if (measure_axis(&out->axis[a], v, a, factor[a], least, par, e))
			return -1;
	return 0;
}

const char *ct_sampling_name(enum ct_sampling s)
{
	return CT_WORD(CT_SAMPLING_LIST, s);
}
