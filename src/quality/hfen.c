/* hfen.c: see hfen.h. L * test - L * ref is L * (test - ref). */
#include "config.h"
#include "quality/hfen.h"
#include "core/mem.h"
#include "resolution/degrade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The second derivative of the Gaussian along an axis. */
static int second_taps(struct ct_taps *t, size_t n, double sigma, struct ct_err *e)
{
	const ptrdiff_t radius = (ptrdiff_t)floor(4 * sigma + 0.5);
	const double square = sigma * sigma;
	double sum = 0;

	if (ct_taps_alloc(t, n, n, 2 * (size_t)radius + 1, e))
		return -1;
	for (ptrdiff_t d = -radius; d <= radius; d++)
		sum += exp(-0.5 * (double)(d * d) / square);
	for (size_t m = 0; m < n; m++) {
		ct_taps_place(t, m, (ptrdiff_t)m - radius);
		for (ptrdiff_t d = -radius; d <= radius; d++) {
			const double r = (double)(d * d) / square;

			ct_taps_add(t, m, ct_taps_reflect((ptrdiff_t)m + d, n),
				(r - 1) / square * exp(-0.5 * r) / sum);
		}
	}
	return 0;
}

/* out <- its second derivative along `axis`, smoothed along the others. */
static int along(float *out, const float *x, const size_t n[3], int axis, struct ct_par *par,
	struct ct_err *e)
{
	struct ct_separable s = {0};
	int rc = -1;

	for (int a = 0; a < 3; a++)
		if (a == axis ? second_taps(&s.t[a], n[a], CT_HFEN_SIGMA, e)
			      : ct_degrade_taps(
					&s.t[a], n[a], 1, CT_HFEN_SIGMA, CT_DECIMATE_SINC, e))
			goto out;
	if (ct_separable_plan(&s, par, e))
		goto out;
	ct_separable_apply(&s, out, x, par);
	rc = 0;
out:
	ct_separable_free(&s);
	return rc;
}

struct hfen_job {
	size_t plane;
	const float *a, *b; /* difference takes b - a; norm the square of a */
	const float *mask;
	float *out;
	double *sum; /* of each plane */
};

static void add_plane(void *arg, size_t k, size_t worker)
{
	const struct hfen_job *j = arg;

	(void)worker;
	for (size_t i = k * j->plane; i < (k + 1) * j->plane; i++)
		j->out[i] += j->a[i];
}

static void difference_plane(void *arg, size_t k, size_t worker)
{
	const struct hfen_job *j = arg;

	(void)worker;
	for (size_t i = k * j->plane; i < (k + 1) * j->plane; i++)
		j->out[i] = j->b[i] - j->a[i];
}

static void norm_plane(void *arg, size_t k, size_t worker)
{
	const struct hfen_job *j = arg;
	double sum = 0;

	(void)worker;
	for (size_t i = k * j->plane; i < (k + 1) * j->plane; i++)
		if (!j->mask || j->mask[i] != 0)
			sum += (double)j->a[i] * (double)j->a[i];
	j->sum[k] = sum;
}

/* The norm of L * x; work is two volumes. */
static int norm(double *out, const float *x, const struct ct_vol *like, float *work,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e)
{
	const size_t *n = like->n, count = ct_vol_count(like);
	struct hfen_job j = {.plane = n[0] * n[1], .a = work + count, .out = work};

	for (int a = 0; a < 3; a++) {
		if (along(a ? work + count : work, x, n, a, env->par, e) || ct_check_stop(env, e))
			return -1;
		if (a)
			ct_par_for(env->par, n[2], add_plane, &j);
	}
	if (ct_alloc(&j.sum, n[2], sizeof *j.sum, e))
		return -1;
	j.a = work;
	j.mask = mask ? mask->data : NULL;
	ct_par_for(env->par, n[2], norm_plane, &j);
	*out = 0;
	for (size_t k = 0; k < n[2]; k++)
		*out += j.sum[k];
	*out = sqrt(*out);
	free(j.sum);
	return 0;
}

int ct_hfen(double *out, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	struct hfen_job j = {.plane = ref->n[0] * ref->n[1], .a = ref->data, .b = test->data};
	double of_ref, of_error;
	float *work;
	int rc = -1;

	if (ct_vol_same_grid(ref, test, e) || (mask && ct_vol_same_grid(ref, mask, e)) ||
		ct_alloc(&work, 3 * n, sizeof *work, e))
		return -1;
	j.out = work + 2 * n;
	if (norm(&of_ref, ref->data, ref, work, mask, env, e))
		goto out;
	ct_par_for(env->par, ref->n[2], difference_plane, &j);
	if (norm(&of_error, j.out, ref, work, mask, env, e))
		goto out;
	*out = of_ref > 0 ? of_error / of_ref : (double)NAN;
	rc = 0;
out:
	free(work);
	return rc;
}
