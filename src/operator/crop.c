/* crop.c: see crop.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "operator/crop.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void ct_crop_body(double c[3], const float *in, const size_t n[static 3], float above)
{
	double sum[3] = {0}, count = 0;

	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const double is = *in++ > above;

				count += is;
				sum[0] += is * (double)i;
				sum[1] += is * (double)j;
				sum[2] += is * (double)k;
			}
	for (int d = 0; d < 3; d++)
		c[d] = count > 0 ? sum[d] / count : ((double)n[d] - 1) / 2;
}

/* Voxels are joined with those before them along each axis, slice by slice. A root is its own
 * parent and holds the count and the box of all. */
struct region {
	size_t parent, count, from[3], to[3];
};

struct search {
	struct region *region;
	size_t regions, room;
	size_t *label; /* of the last plane of voxels seen: the region of each, or NONE */
};

#define NONE SIZE_MAX

static size_t root(struct search *s, size_t i)
{
	while (s->region[i].parent != i) {
		s->region[i].parent = s->region[s->region[i].parent].parent;
		i = s->region[i].parent;
	}
	return i;
}

/* One region of two, either of which may be none; the older becomes the root. */
static size_t join(struct search *s, size_t a, size_t b)
{
	struct region *to, *of;

	if (a == NONE || b == NONE)
		return a == NONE ? b : a;
	a = root(s, a);
	b = root(s, b);
	if (a == b)
		return a;
	to = &s->region[a < b ? a : b];
	of = &s->region[a < b ? b : a];
	of->parent = to->parent;
	to->count += of->count;
	for (int d = 0; d < 3; d++) {
		to->from[d] = of->from[d] < to->from[d] ? of->from[d] : to->from[d];
		to->to[d] = of->to[d] > to->to[d] ? of->to[d] : to->to[d];
	}
	return to->parent;
}

/* Of a voxel that lies above, whose neighbours before it have labels. */
static int add(struct search *s, const size_t at[3], const size_t n[3], struct ct_err *e)
{
	size_t *label = s->label + at[1] * n[0] + at[0], r = *label; /* of the slice before */
	struct region *is;

	if (at[1] > 0)
		r = join(s, r, *(label - n[0]));
	if (at[0] > 0)
		r = join(s, r, *(label - 1));
	if (r == NONE) {
		if (ct_grow(&s->region, &s->room, s->regions + 1, sizeof *s->region, e))
			return -1;
		r = s->regions++;
		s->region[r] = (struct region){.parent = r, .from = {at[0], at[1], at[2]}};
	}
	*label = r;
	is = &s->region[root(s, r)];
	is->count++;
	for (int d = 0; d < 3; d++) {
		is->from[d] = at[d] < is->from[d] ? at[d] : is->from[d];
		is->to[d] = at[d] >= is->to[d] ? at[d] + 1 : is->to[d];
	}
	return 0;
}

int ct_crop_region(size_t from[3], size_t to[3], const float *in, const size_t n[static 3],
	float above, struct ct_err *e)
{
	struct search s = {0};
	size_t at[3], most = 0;
	int rc = -1;

	if (ct_alloc(&s.label, n[0] * n[1], sizeof *s.label, e))
		return -1;
	for (size_t i = 0; i < n[0] * n[1]; i++)
		s.label[i] = NONE;
	for (at[2] = 0; at[2] < n[2]; at[2]++)
		for (at[1] = 0; at[1] < n[1]; at[1]++)
			for (at[0] = 0; at[0] < n[0]; at[0]++)
				if (!(*in++ > above))
					s.label[at[1] * n[0] + at[0]] = NONE;
				else if (add(&s, at, n, e))
					goto out;
	memset(from, 0, 3 * sizeof *from);
	memcpy(to, n, 3 * sizeof *to);
	for (size_t i = 0; i < s.regions; i++)
		if (s.region[i].parent == i && s.region[i].count > most) {
			most = s.region[i].count;
			memcpy(from, s.region[i].from, sizeof s.region[i].from);
			memcpy(to, s.region[i].to, sizeof s.region[i].to);
		}
	rc = 0;
out:
	free(s.region);
	free(s.label);
	return rc;
}

ptrdiff_t ct_crop_start(size_t n, size_t m, double c)
{
	double s = floor(c - ((double)m - 1) / 2 + 0.5);

	if (m >= n)
		return -(ptrdiff_t)((m - n) / 2);
	return (ptrdiff_t)fmin(fmax(s, 0), (double)(n - m));
}

void ct_crop_place(ptrdiff_t start[3], const size_t n[static 3], const size_t m[static 3], int k)
{
	for (int a = 0; a < 3; a++, k /= 3)
		start[a] = (ptrdiff_t)((n[a] - m[a]) * (size_t)(k % 3) / 2);
}

int ct_crop(struct ct_vol *out, const struct ct_vol *in, const size_t n[static 3],
	const ptrdiff_t start[static 3], float pad, struct ct_err *e)
{
	const double first[3] = {(double)start[0], (double)start[1], (double)start[2]};
	float *to;

	if (ct_vol_alloc(out, n, e))
		return -1;
	memcpy(out->affine, in->affine, sizeof out->affine);
	ct_vol_shift_affine(out->affine, first);
	to = out->data;
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++) {
			/* what is before the beginning is beyond the end, too */
			const size_t z = k + (size_t)start[2], y = j + (size_t)start[1];
			const float *row = z < in->n[2] && y < in->n[1]
						   ? in->data + (z * in->n[1] + y) * in->n[0]
						   : NULL;

			for (size_t i = 0; i < n[0]; i++) {
				const size_t x = i + (size_t)start[0];

				*to++ = row && x < in->n[0] ? row[x] : pad;
			}
		}
	return 0;
}
