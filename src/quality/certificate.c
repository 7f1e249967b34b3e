/* certificate.c: see certificate.h. */
#include "config.h"
#include "quality/certificate.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Hoare's selection with the median of three: afterwards v[k] is where sorting would put it. */
static void select_nth(float *v, size_t n, size_t k)
{
	size_t lo = 0, hi = n - 1;

	while (lo < hi) {
		float a = v[lo], b = v[lo + (hi - lo) / 2], c = v[hi];
		float pivot = a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
		size_t i = lo, j = hi;

		while (i <= j) {
			while (v[i] < pivot)
				i++;
			while (v[j] > pivot)
				j--;
			if (i > j)
				break;
			a = v[i];
			v[i++] = v[j];
			v[j] = a;
			if (j == 0)
				break;
			j--;
		}
		if (k <= j && j < hi)
			hi = j;
		else if (k >= i)
			lo = i;
		else
			return;
	}
}

double ct_certificate_quantile(float *v, size_t n, double q)
{
	double at = q * (double)(n - 1);
	size_t k = (size_t)at;
	float next;

	select_nth(v, n, k);
	if (k + 1 == n)
		return (double)v[k];
	next = v[k + 1]; /* the least of those behind */
	for (size_t i = k + 2; i < n; i++)
		next = v[i] < next ? v[i] : next;
	return (double)v[k] + (at - (double)k) * ((double)next - (double)v[k]);
}

/* Slice by slice, so that sums stay exact enough for any size. */
static void summarise(struct ct_certificate *c, float *abs, const struct ct_vol *map)
{
	size_t slice = map->n[0] * map->n[1], n = ct_vol_count(map);
	double square = 0, sum = 0;

	*c = (struct ct_certificate){.voxels = n};
	for (size_t k = 0; k < map->n[2]; k++) {
		double s2 = 0, s = 0;

		for (size_t i = k * slice; i < (k + 1) * slice; i++) {
			double r = (double)map->data[i];

			s2 += r * r;
			s += r;
			abs[i] = fabsf(map->data[i]);
			c->max = fmax(c->max, fabs(r));
		}
		square += s2;
		sum += s;
	}
	c->rms = sqrt(square / (double)n);
	c->mean = sum / (double)n;
	c->p95 = ct_certificate_quantile(abs, n, 0.95);
}

int ct_certificate(struct ct_certificate *c, struct ct_vol *map, const struct ct_vol *lr,
	const struct ct_vol *test, const struct ct_degrade *d, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_separable s = {0};
	float *abs = NULL;
	size_t n[3];
	int rc = -1;

	if (ct_degrade_plan(&s, d, test->n, env->par, e))
		return -1;
	for (int a = 0; a < 3; a++)
		n[a] = s.t[a].n_out;
	if (ct_vol_alloc(map, n, e))
		goto out;
	ct_degrade_affine(map->affine, test->affine, test->n, d);
	if (ct_vol_same_grid(map, lr, e)) {
		ct_blame(e, "degraded");
		goto out;
	}
	ct_separable_apply(&s, map->data, test->data, env->par);
	ct_separable_free(&s);
	if (ct_alloc(&abs, ct_vol_count(map), sizeof *abs, e))
		goto out;
	for (size_t i = 0; i < ct_vol_count(map); i++)
		map->data[i] -= lr->data[i];
	memcpy(map->affine, lr->affine, sizeof map->affine);
	summarise(c, abs, map);
	rc = 0;
out:
	ct_separable_free(&s);
	free(abs);
	return rc;
}
