/* body.c: see crop.h. Voxels are joined with those before them along each axis, slice by slice. */
#include "config.h"
#include "core/mem.h"
#include "resolution/crop.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* What is joined; a root is its own parent and holds the count and the box of all. */
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

/* A new region, of no voxels yet. */
static int begin(struct search *s, const size_t at[3], struct ct_err *e)
{
	if (s->regions == s->room) {
		const size_t more = s->room ? 2 * s->room : 1024;
		struct region *now = realloc(s->region, more * sizeof *now);

		if (!now)
			return ct_fail(e, CT_ENOMEM, "no memory for %zu regions", more);
		s->region = now;
		s->room = more;
	}
	s->region[s->regions] = (struct region){.parent = s->regions};
	memcpy(s->region[s->regions].from, at, sizeof s->region->from);
	s->regions++;
	return 0;
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
		r = s->regions;
		if (begin(s, at, e))
			return -1;
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
