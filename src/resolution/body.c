/* body.c: see crop.h. Regions are joined run by run: a run is what of a row lies above, and joins
 * those that it touches in the row before and in the slice before. */
#include "config.h"
#include "core/mem.h"
#include "resolution/crop.h"

#include <stdlib.h>
#include <string.h>

/* What is joined; a root is its own parent and holds the count and the box of all. */
struct region {
	size_t parent, count, from[3], to[3];
};

struct run {
	size_t from, to, region;
};

/* The runs of a slice, row j's from first[j] to first[j + 1]. */
struct slice {
	struct run *run;
	size_t n, *first;
};

struct search {
	const float *in;
	const size_t *n;
	float above;
	struct region *region;
	size_t regions, room;
	struct slice slice, before;
};

static size_t root(struct search *s, size_t i)
{
	while (s->region[i].parent != i) {
		s->region[i].parent = s->region[s->region[i].parent].parent;
		i = s->region[i].parent;
	}
	return i;
}

static void join(struct search *s, size_t a, size_t b)
{
	a = root(s, a);
	b = root(s, b);
	if (a == b)
		return;
	if (a > b) {
		const size_t c = a;

		a = b;
		b = c;
	}
	s->region[b].parent = a;
	s->region[a].count += s->region[b].count;
	for (int d = 0; d < 3; d++) {
		if (s->region[b].from[d] < s->region[a].from[d])
			s->region[a].from[d] = s->region[b].from[d];
		if (s->region[b].to[d] > s->region[a].to[d])
			s->region[a].to[d] = s->region[b].to[d];
	}
}

static int add(struct search *s, size_t from, size_t to, size_t j, size_t k, struct ct_err *e)
{
	const struct region is = {s->regions, to - from, {from, j, k}, {to, j + 1, k + 1}};

	if (s->regions == s->room) {
		const size_t more = s->room ? 2 * s->room : 1024;
		struct region *now = realloc(s->region, more * sizeof *now);

		if (!now)
			return ct_fail(e, CT_ENOMEM, "no memory for %zu regions", more);
		s->region = now;
		s->room = more;
	}
	s->slice.run[s->slice.n++] = (struct run){from, to, s->regions};
	s->region[s->regions++] = is;
	return 0;
}

/* Join the runs of a row with those of another, both in order. */
static void meet(struct search *s, const struct run *a, size_t as, const struct run *b, size_t bs)
{
	for (size_t i = 0, j = 0; i < as && j < bs;) {
		if (a[i].from < b[j].to && b[j].from < a[i].to)
			join(s, a[i].region, b[j].region);
		if (a[i].to < b[j].to)
			i++;
		else
			j++;
	}
}

static int look(struct search *s, size_t k, struct ct_err *e)
{
	const size_t w = s->n[0], h = s->n[1];
	struct slice *now = &s->slice, *last = &s->before;

	now->n = 0;
	for (size_t j = 0; j < h; j++) {
		const float *row = s->in + (k * h + j) * w;

		now->first[j] = now->n;
		for (size_t i = 0; i < w; i++) {
			const size_t from = i;

			while (i < w && row[i] > s->above)
				i++;
			if (i > from && add(s, from, i, j, k, e))
				return -1;
		}
		now->first[j + 1] = now->n;
		if (j > 0)
			meet(s, now->run + now->first[j], now->n - now->first[j],
				now->run + now->first[j - 1], now->first[j] - now->first[j - 1]);
		if (k > 0)
			meet(s, now->run + now->first[j], now->n - now->first[j],
				last->run + last->first[j], last->first[j + 1] - last->first[j]);
	}
	return 0;
}

static int slice_alloc(struct slice *s, const size_t *n, struct ct_err *e)
{
	return ct_alloc(&s->run, n[1] * ((n[0] + 1) / 2), sizeof *s->run, e) ||
			       ct_alloc(&s->first, n[1] + 1, sizeof *s->first, e)
		       ? -1
		       : 0;
}

int ct_crop_region(size_t from[3], size_t to[3], const float *in, const size_t n[static 3],
	float above, struct ct_err *e)
{
	struct search s = {.in = in, .n = n, .above = above};
	size_t most = 0;
	int rc = -1;

	if (slice_alloc(&s.slice, n, e) || slice_alloc(&s.before, n, e))
		goto out;
	for (size_t k = 0; k < n[2]; k++) {
		const struct slice was = s.before;

		if (look(&s, k, e))
			goto out;
		s.before = s.slice;
		s.slice = was;
	}
	for (int d = 0; d < 3; d++) {
		from[d] = 0;
		to[d] = n[d];
	}
	for (size_t i = 0; i < s.regions; i++)
		if (s.region[i].parent == i && s.region[i].count > most) {
			most = s.region[i].count;
			memcpy(from, s.region[i].from, sizeof s.region[i].from);
			memcpy(to, s.region[i].to, sizeof s.region[i].to);
		}
	rc = 0;
out:
	free(s.region);
	free(s.slice.run);
	free(s.slice.first);
	free(s.before.run);
	free(s.before.first);
	return rc;
}
