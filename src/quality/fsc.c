/* fsc.c: see fsc.h. Both volumes are one complex one, ref + i test, of which one transform Z is
 * that of both: F(k) = (Z(k) + Z*(-k))/2, G(k) = (Z(k) - Z*(-k))/2i.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/fsc.h"
#include "core/fourier.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

enum { LINES = 8 };   /* at once */
#define NOTHING 1e-24 /* of the power of the other volume */

struct fsc_job {
	const struct ct_vol *ref, *test;
	const struct ct_env *env;
	size_t n[3];
	double mean[2];
	double *window[3];
	double *z; /* real parts, then imaginary ones */
	struct ct_fourier line[3];
	int axis;
	double *scratch; /* [worker][4 room] */
	size_t room;     /* samples of the lines at once */
	double *plane;   /* [n[2]][4][shells] */
	struct ct_fsc *f;
	double step[3]; /* of frequency */
};

static void fill_plane(void *arg, size_t k, size_t worker)
{
	const struct fsc_job *j = arg;
	double *im = j->z + ct_vol_count(j->ref);

	(void)worker;
	for (size_t y = 0; y < j->n[1]; y++) {
		const double w = j->window[2][k] * j->window[1][y];
		const size_t at = (k * j->n[1] + y) * j->n[0];

		for (size_t x = 0; x < j->n[0]; x++) {
			const double v = w * j->window[0][x];

			j->z[at + x] = v * ((double)j->ref->data[at + x] - j->mean[0]);
			im[at + x] = v * ((double)j->test->data[at + x] - j->mean[1]);
		}
	}
}

/* w lines from place `at` on, `apart` apart, whose samples are `stride` apart. */
static void lines(
	const struct fsc_job *j, size_t at, size_t w, size_t apart, size_t stride, double *scratch)
{
	const struct ct_fourier *f = &j->line[j->axis];
	double *re = scratch, *im = re + f->n * w, *work = im + f->n * w;
	double *z[2] = {j->z + at, j->z + ct_vol_count(j->ref) + at};

	for (size_t t = 0; t < f->n; t++) {
		for (size_t l = 0; l < w; l++) {
			re[t * w + l] = z[0][t * stride + l * apart];
			im[t * w + l] = z[1][t * stride + l * apart];
		}
	}
	CT_SIMD(ct_fourier_apply)(f, w, re, im, work);
	for (size_t t = 0; t < f->n; t++) {
		for (size_t l = 0; l < w; l++) {
			z[0][t * stride + l * apart] = re[t * w + l];
			z[1][t * stride + l * apart] = im[t * w + l];
		}
	}
}

/* A plane across z, or for that axis across y, whose rows are far apart: all of a row at once. */
static void transform(void *arg, size_t k, size_t worker)
{
	const struct fsc_job *j = arg;
	const size_t *n = j->n, stride[3] = {1, n[0], n[0] * n[1]};
	const int a = j->axis, b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
	const size_t most = a == 2 ? n[0] : LINES;

	for (size_t l = 0; l < n[b] && !ct_stopping(j->env); l += most)
		lines(j, k * stride[c] + l * stride[b], n[b] - l < most ? n[b] - l : most,
			stride[b], stride[a], j->scratch + worker * 4 * j->room);
}

/* Cycles per mm of frequency k of an axis; squared. */
static double square(const struct fsc_job *j, int axis, size_t k)
{
	const size_t n = j->n[axis];
	const double f = j->step[axis] * (double)(k <= n / 2 ? k : n - k);

	return f * f;
}

static void shells_of_plane(void *arg, size_t k, size_t worker)
{
	const struct fsc_job *j = arg;
	const size_t *n = j->n, all = ct_vol_count(j->ref), shells = j->f->n;
	const size_t far = (n[2] - k) % n[2];
	double *sum = j->plane + 4 * shells * k;

	(void)worker;
	for (size_t y = 0; y < n[1]; y++) {
		const double rest = square(j, 1, y) + square(j, 2, k);
		const double *z = j->z + (k * n[1] + y) * n[0],
			     *m = j->z + (far * n[1] + (n[1] - y) % n[1]) * n[0];

		for (size_t x = 0; x < n[0]; x++) {
			const size_t s = (size_t)(sqrt(square(j, 0, x) + rest) / j->f->width + 0.5),
				     o = (n[0] - x) % n[0];
			const double a = z[x], b = z[all + x], c = m[o], d = m[all + o];
			const double fr = a + c, fi = b - d, gr = b + d, gi = c - a; /* twice */

			if (s >= shells)
				continue;
			sum[4 * s] += fr * gr + fi * gi;
			sum[4 * s + 1] += fr * fr + fi * fi;
			sum[4 * s + 2] += gr * gr + gi * gi;
			sum[4 * s + 3] += 1;
		}
	}
}

static int set_up(struct fsc_job *j, struct ct_err *e)
{
	double spacing[3], top = 0;

	ct_vol_spacing(j->ref, spacing);
	for (int a = 0; a < 3; a++) {
		const size_t n = j->n[a];

		j->room = LINES * n > j->room ? LINES * n : j->room;
		j->step[a] = n > 1 ? 1 / ((double)n * spacing[a]) : 0;
		j->f->width = fmax(j->f->width, j->step[a]);
		if (n > 1)
			top = fmax(top, 0.5 / spacing[a]);
		if (ct_fourier_plan(&j->line[a], n, e) ||
			ct_alloc(&j->window[a], n, sizeof **j->window, e))
			return -1;
		for (size_t k = 0; k < n; k++)
			j->window[a][k] =
				n > 1 ? pow(sin(M_PI * ct_cell_centre((double)k) / (double)n), 2)
				      : 1;
	}
	if (!(j->f->width > 0))
		return ct_fail(e, CT_EGEOM, "one voxel has no frequencies");
	j->room = j->n[0] * j->n[2] > j->room ? j->n[0] * j->n[2] : j->room;
	j->f->n = (size_t)(top / j->f->width + 0.5) + 1;
	if (ct_alloc0(&j->f->value, j->f->n, sizeof *j->f->value, e) ||
		ct_alloc0(&j->f->count, j->f->n, sizeof *j->f->count, e) ||
		ct_alloc0(&j->plane, 4 * j->f->n * j->n[2], sizeof *j->plane, e) ||
		ct_alloc(&j->scratch, 4 * j->room * ct_par_threads(j->env->par), sizeof *j->scratch,
			e))
		return -1;
	return ct_alloc(&j->z, 2 * ct_vol_count(j->ref), sizeof *j->z, e);
}

static void means(struct fsc_job *j)
{
	const size_t n = ct_vol_count(j->ref), plane = j->n[0] * j->n[1];

	for (size_t at = 0; at < n; at += plane) {
		double sum[2] = {0};

		for (size_t i = at; i < at + plane; i++) {
			sum[0] += (double)j->ref->data[i];
			sum[1] += (double)j->test->data[i];
		}
		j->mean[0] += sum[0];
		j->mean[1] += sum[1];
	}
	j->mean[0] /= (double)n;
	j->mean[1] /= (double)n;
}

static void gather(const struct fsc_job *j)
{
	struct ct_fsc *f = j->f;

	for (size_t s = 0; s < f->n; s++) {
		double sum[4] = {0}, most;

		for (size_t k = 0; k < j->n[2]; k++)
			for (size_t q = 0; q < 4; q++)
				sum[q] += j->plane[4 * (k * f->n + s) + q];
		most = fmax(sum[1], sum[2]);
		f->value[s] = most == 0 ? 1
			      : fmin(sum[1], sum[2]) > NOTHING * most
				      ? sum[0] / (sqrt(sum[1]) * sqrt(sum[2]))
				      : 0;
		f->count[s] = sum[3];
	}
}

int ct_fsc(struct ct_fsc *f, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_env *env, struct ct_err *e)
{
	struct fsc_job j = {.ref = ref,
		.test = test,
		.env = env,
		.n = {ref->n[0], ref->n[1], ref->n[2]},
		.f = f};
	int rc = -1;

	*f = (struct ct_fsc){0};
	if (set_up(&j, e))
		goto out;
	means(&j);
	ct_par_for(env->par, j.n[2], fill_plane, &j);
	for (j.axis = 0; j.axis < 3; j.axis++)
		ct_par_for(env->par, j.n[j.axis == 2 ? 1 : 2], transform, &j);
	if (ct_check_stop(env, e))
		goto out;
	ct_par_for(env->par, j.n[2], shells_of_plane, &j);
	gather(&j);
	rc = 0;
out:
	free(j.z);
	free(j.plane);
	free(j.scratch);
	for (int a = 0; a < 3; a++) {
		free(j.window[a]);
		ct_fourier_free(&j.line[a]);
	}
	return rc;
}

void ct_fsc_free(struct ct_fsc *f)
{
	free(f->value);
	free(f->count);
	*f = (struct ct_fsc){0};
}

double ct_fsc_cross(const struct ct_fsc *f, double level)
{
	double before = 1;

	for (size_t s = 1; s < f->n; s++) {
		if (f->value[s] < level)
			return f->width *
			       ((double)s - (level - f->value[s]) / (before - f->value[s]));
		before = f->value[s];
	}
	return (double)NAN;
}
