/* mirror.c: see mirror.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/mirror.h"

#include <string.h>

struct mirror_job {
	void *x;
	size_t n[3], size; /* bytes of a voxel */
	unsigned axes;
	int axis; /* of a component of a dual */
};

/* A plane and the one that it becomes: each pair of voxels once. */
static inline void mirror_plane(const struct mirror_job *t, size_t k, const size_t size)
{
	const size_t *n = t->n, c = t->axes & 4 ? n[2] - 1 - k : k;
	char voxel[sizeof(float)];

	for (size_t j = 0; j < n[1]; j++) {
		const size_t b = t->axes & 2 ? n[1] - 1 - j : j;
		char *from = (char *)t->x + (k * n[1] + j) * n[0] * size;
		char *row = (char *)t->x + (c * n[1] + b) * n[0] * size;

		for (size_t i = 0; i < n[0]; i++, from += size) {
			char *to = row + (t->axes & 1 ? n[0] - 1 - i : i) * size;

			if (from < to) {
				memcpy(voxel, from, size);
				memcpy(from, to, size);
				memcpy(to, voxel, size);
			}
		}
	}
}

/* Each with a size that is known. */
static void mirror(void *arg, size_t k, size_t worker)
{
	const struct mirror_job *t = arg;

	(void)worker;
	if (t->size == sizeof(float))
		mirror_plane(t, k, sizeof(float));
	else
		mirror_plane(t, k, sizeof(int16_t));
}

void ct_mirror_volume(float *x, const size_t n[static 3], unsigned axes, struct ct_par *par)
{
	struct mirror_job t = {x, {n[0], n[1], n[2]}, sizeof *x, axes, 0};

	if (axes)
		ct_par_for(par, n[2], mirror, &t);
}

void ct_mirror(struct ct_vol *v, unsigned axes, struct ct_par *par)
{
	ct_mirror_volume(v->data, v->n, axes, par);
	for (int a = 0; a < 3; a++)
		for (int r = 0; axes >> a & 1 && r < 3; r++) {
			v->affine[r][3] += ((double)v->n[a] - 1) * v->affine[r][a];
			v->affine[r][a] = -v->affine[r][a];
		}
}

/* Each voxel of a plane takes the value of the next one along the axis, with the other sign. */
static void move(void *arg, size_t across, size_t worker)
{
	const struct mirror_job *t = arg;
	const size_t *n = t->n, stride[3] = {1, n[0], n[0] * n[1]};
	const int up = t->axis == 2 ? 2 : 1;
	int16_t *p = (int16_t *)t->x + across * stride[3 - up];

	(void)worker;
	for (size_t q = 0; q < n[up]; q++)
		for (size_t i = 0; i < n[0]; i++) {
			const size_t at = t->axis == 0 ? i : q;
			int16_t *to = p + q * stride[up] + i;

			*to = at + 1 < n[t->axis] ? (int16_t)-to[stride[t->axis]] : 0;
		}
}

void ct_mirror_dual(int16_t *p, const size_t n[static 3], unsigned axes, struct ct_par *par)
{
	for (int a = 0; a < 3 && axes; a++, p += n[0] * n[1] * n[2]) {
		struct mirror_job t = {p, {n[0], n[1], n[2]}, sizeof *p, axes, a};

		ct_par_for(par, n[2], mirror, &t);
		if (axes >> a & 1)
			ct_par_for(par, n[a == 2 ? 1 : 2], move, &t);
	}
}
