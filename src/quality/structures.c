/* structures.c: see structures.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "operator/degrade.h"
#include "quality/structures.h"

#include <math.h>
#include <stdlib.h>

#define OUTER (10.0 / 3)

/* d <- the difference of Gaussians; soft, if not NULL, <- where both are near water. */
static int band(float *d, float *work, unsigned char *soft, const struct ct_vol *v,
	const double sigma[3], struct ct_par *par, struct ct_err *e)
{
	const double outer[3] = {OUTER * sigma[0], OUTER * sigma[1], OUTER * sigma[2]};
	const size_t n = ct_vol_count(v);

	if (ct_degrade_smooth(d, v->data, v->n, sigma, par, e) ||
		ct_degrade_smooth(work, v->data, v->n, outer, par, e))
		return -1;
	for (size_t i = 0; i < n; i++) {
		if (soft)
			soft[i] = fabsf(d[i]) < CT_STRUCTURES_SOFT &&
				  fabsf(work[i]) < CT_STRUCTURES_SOFT;
		d[i] -= work[i];
	}
	return 0;
}

/* The largest of sign d over the neighbours of voxel (x, y, z) that there are, itself left out. */
static float about(const float *d, const size_t n[static 3], const size_t at[static 3], float sign)
{
	const size_t own = (at[2] * n[1] + at[1]) * n[0] + at[0];
	float most = -INFINITY;

	for (size_t k = at[2] - (at[2] > 0); k <= at[2] + 1 && k < n[2]; k++)
		for (size_t j = at[1] - (at[1] > 0); j <= at[1] + 1 && j < n[1]; j++)
			for (size_t i = at[0] - (at[0] > 0); i <= at[0] + 1 && i < n[0]; i++) {
				const size_t v = (k * n[1] + j) * n[0] + i;

				if (v != own)
					most = fmaxf(most, sign * d[v]);
			}
	return most;
}

/* The structures of a, those of them that b does not have, in the voxels that count. */
static void count(size_t *is, size_t *alone, const float *a, const float *b,
	const unsigned char *soft, const size_t n[static 3], float sign)
{
	const float t = CT_STRUCTURES_LEAST;

	for (size_t k = 0; k < n[2]; k++) {
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const size_t v = (k * n[1] + j) * n[0] + i, at[3] = {i, j, k};

				if (!soft[v] || !(sign * a[v] > t) ||
					!(sign * a[v] > about(a, n, at, sign)))
					continue;
				(*is)++;
				*alone += fmaxf(sign * b[v], about(b, n, at, sign)) < t / 2;
			}
	}
}

/* On a face a structure may be the cut of another. Axes of one or two voxels have nothing else. */
static bool is_face(size_t i, const size_t n[static 3])
{
	const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

	for (int a = 0; a < 3; a++)
		if (n[a] > 2 && (at[a] == 0 || at[a] == n[a] - 1))
			return true;
	return false;
}

int ct_structures(struct ct_structures *s, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const double sigma[static 3], const struct ct_env *env,
	struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	unsigned char *soft = NULL;
	float *d = NULL, *b, *work;
	int rc = -1;

	*s = (struct ct_structures){0};
	if (ct_alloc(&d, 3 * n, sizeof *d, e) || ct_alloc(&soft, n, 1, e))
		goto out;
	b = d + n;
	work = b + n;
	if (band(d, work, soft, ref, sigma, env->par, e) ||
		band(b, work, NULL, test, sigma, env->par, e))
		goto out;
	for (size_t i = 0; i < n; i++) {
		soft[i] = soft[i] && (!mask || mask->data[i] != 0) && !is_face(i, ref->n);
		s->soft += soft[i];
	}
	for (int k = 0; k < 2; k++) {
		const float sign = k ? -1 : 1;
		size_t all = 0;

		count(&s->is[k], &s->missed[k], d, b, soft, ref->n, sign);
		count(&all, &s->falsely[k], b, d, soft, ref->n, sign);
	}
	rc = 0;
out:
	free(soft);
	free(d);
	return rc;
}
