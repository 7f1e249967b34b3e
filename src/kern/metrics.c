/* metrics.c: see metrics.h. */
#include "config.h"
#include "kern/metrics.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

enum { SLAB = 16 }; /* slices across i that are read together: a cache line of neighbours */

struct sums {
	double square, mapped, abs, diff;
	size_t count;
};

struct job {
	const struct ct_vol *ref, *test, *mask;
	const struct ct_metrics_rule *rule;
	struct sums *sums; /* of each slice */
	/* SSIM */
	struct ct_ssim_rule ssim;
	enum ct_ssim_kind kind;
	int axis;
	size_t slab, h, w;
	double *value; /* of each slice, NaN if it does not count */
	float *image;  /* scratch: a worker's slabs of ref, test, mask */
	size_t images; /* floats of it a worker */
	double *rows;
	size_t nrows;
};

static double map(const struct ct_metrics_rule *r, float v)
{
	if (!r->window)
		return (double)v;
	return (fmin(fmax((double)v, r->lo), r->hi) - r->lo) / (r->hi - r->lo);
}

static void difference(void *arg, size_t k, size_t worker)
{
	const struct job *j = arg;
	size_t slice = j->ref->n[0] * j->ref->n[1], end = (k + 1) * slice;
	struct sums s = {0};

	(void)worker;
	for (size_t i = k * slice; i < end; i++) {
		double d = (double)j->test->data[i] - (double)j->ref->data[i];
		double f = map(j->rule, j->test->data[i]) - map(j->rule, j->ref->data[i]);

		if (j->mask && j->mask->data[i] == 0.0f)
			continue;
		s.square += d * d;
		s.mapped += f * f;
		s.abs += fabs(d);
		s.diff += d;
		s.count++;
	}
	j->sums[k] = s;
}

static int differences(
	struct ct_metrics *m, struct job *j, const struct ct_env *env, struct ct_err *e)
{
	struct sums t = {0};
	double n, peak = j->rule->window ? 1.0 : j->rule->range;

	if (ct_alloc(&j->sums, j->ref->n[2], sizeof *j->sums, e))
		return -1;
	ct_par_for(env->par, j->ref->n[2], difference, j);
	for (size_t k = 0; k < j->ref->n[2]; k++) {
		t.square += j->sums[k].square;
		t.mapped += j->sums[k].mapped;
		t.abs += j->sums[k].abs;
		t.diff += j->sums[k].diff;
		t.count += j->sums[k].count;
	}
	free(j->sums);
	if (t.count == 0)
		return ct_fail(e, CT_EINPUT, "the mask is empty");
	n = (double)t.count;
	m->voxels = t.count;
	m->psnr = 10 * log10(peak * peak / (t.mapped / n));
	m->mae = t.abs / n;
	m->rmse = sqrt(t.square / n);
	m->bias = t.diff / n;
	return 0;
}

/* Copy `slices` slices from `at` on, as images of h rows of w; ref and test mapped. */
static void load(const struct job *j, float *x, float *y, float *weight, size_t at, size_t slices)
{
	const size_t *n = j->ref->n;
	const size_t step[3] = {1, n[0], n[0] * n[1]};
	size_t row = j->axis == 2 ? step[1] : step[2], col = j->axis == 0 ? step[1] : step[0];

	for (size_t r = 0; r < j->h; r++)
		for (size_t c = 0; c < j->w; c++)
			for (size_t s = 0; s < slices; s++) {
				size_t from = (at + s) * step[j->axis] + r * row + c * col;
				size_t to = (s * j->h + r) * j->w + c;

				x[to] = (float)map(j->rule, j->ref->data[from]);
				y[to] = (float)map(j->rule, j->test->data[from]);
				if (j->mask)
					weight[to] = j->mask->data[from] != 0.0f;
			}
}

static void slab_ssim(void *arg, size_t task, size_t worker)
{
	const struct job *j = arg;
	size_t at = task * j->slab, pixels = j->h * j->w, n = j->ref->n[j->axis];
	size_t slices = n - at < j->slab ? n - at : j->slab;
	float *x = j->image + worker * j->images, *y = x + j->slab * pixels;
	float *weight = j->mask ? y + j->slab * pixels : NULL;

	load(j, x, y, weight, at, slices);
	for (size_t s = 0; s < slices; s++) {
		const float *image = x + s * pixels;
		float top = image[0];

		for (size_t i = 1; i < pixels; i++)
			top = image[i] > top ? image[i] : top;
		j->value[at + s] = j->kind == CT_SSIM_R2 && !(top > 0)
					   ? (double)NAN
					   : ct_ssim(&j->ssim, j->h, j->w, image, y + s * pixels,
						     weight ? weight + s * pixels : NULL,
						     j->rows + worker * j->nrows);
	}
}

/* Mean over the slices across j->axis that count. */
static int axis_ssim(double *mean, struct job *j, const struct ct_env *env, struct ct_err *e)
{
	const size_t *n = j->ref->n;
	size_t threads = ct_par_threads(env->par), count = 0;
	double sum = 0;
	int rc = -1;

	j->h = j->axis == 2 ? n[1] : n[2];
	j->w = j->axis == 0 ? n[1] : n[0];
	if (j->h <= 2 * j->ssim.crop || j->w <= 2 * j->ssim.crop)
		return ct_fail(e, CT_EGEOM, "slices of %zux%zu are smaller than the SSIM window",
			j->w, j->h);
	j->slab = j->axis == 0 ? SLAB : 1;
	j->images = (j->mask ? 3 : 2) * j->slab * j->h * j->w;
	j->nrows = ct_ssim_scratch(j->w);
	j->rows = NULL;
	j->image = NULL;
	if (ct_alloc(&j->value, n[j->axis], sizeof *j->value, e) ||
		ct_alloc(&j->image, j->images * threads, sizeof *j->image, e) ||
		ct_alloc(&j->rows, j->nrows * threads, sizeof *j->rows, e))
		goto out;
	ct_par_for(env->par, (n[j->axis] + j->slab - 1) / j->slab, slab_ssim, j);
	for (size_t k = 0; k < n[j->axis]; k++)
		if (!isnan(j->value[k])) {
			sum += j->value[k];
			count++;
		}
	*mean = sum / (double)count;
	rc = count ? 0 : ct_fail(e, CT_EINPUT, "no slice across axis %d counts for SSIM", j->axis);
out:
	free(j->value);
	free(j->image);
	free(j->rows);
	j->value = NULL;
	return rc;
}

static int all_ssim(struct ct_metrics *m, struct job *j, const struct ct_env *env, struct ct_err *e)
{
	double range = j->rule->window ? 1.0 : j->rule->range;

	for (int kind = 0; kind < CT_SSIM_KINDS; kind++) {
		int first = kind == CT_SSIM_R2 ? 0 : 2;
		double sum = 0, mean = 0;

		m->ssim[kind] = (double)NAN;
		if (!j->rule->ssim[kind])
			continue;
		j->kind = (enum ct_ssim_kind)kind;
		ct_ssim_rule(&j->ssim, j->kind, range);
		for (j->axis = first; j->axis < 3; j->axis++) {
			if (ct_check_stop(env, e) || axis_ssim(&mean, j, env, e))
				return -1;
			sum += mean;
		}
		m->ssim[kind] = sum / (3 - first);
	}
	return 0;
}

int ct_metrics(struct ct_metrics *m, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_metrics_rule *rule, const struct ct_env *env,
	struct ct_err *e)
{
	struct job j = {.ref = ref, .test = test, .mask = mask, .rule = rule};

	if (ct_vol_same_grid(ref, test, e))
		return -1;
	if (mask && ct_vol_same_grid(ref, mask, e))
		return ct_blame(e, "mask");
	if (differences(m, &j, env, e))
		return -1;
	return all_ssim(m, &j, env, e);
}
