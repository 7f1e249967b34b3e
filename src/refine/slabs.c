/* slabs.c: see slabs.h. */
#include "config.h"
#include "refine/slabs.h"
#include "resolution/crop.h"

#include <math.h>
#include <string.h>

/* Fine voxels about a slab. Those of the inversion reach less far: with 24 the slabs of three CTs
 * are within 0.01 HU RMS of the whole (doc/blocks.md). The prior looks at cells that begin at whole
 * numbers of UNIT. */
enum { ABOUT = 32, UNIT = 16 };

static bool can_cut(const struct ct_degrade *by, int axis)
{
	const double x = by->factor[axis];

	return x == floor(x) && x <= UNIT &&
	       (x == 1 || by->decimate != CT_DECIMATE_SINC ||
		       (by->profile.n > 0 && by->profile.axis == axis));
}

/* Coarse voxels of which slabs are made: whole UNITs of fine ones. */
static size_t unit_of(size_t factor)
{
	size_t n = 1;

	while (n * factor % UNIT != 0)
		n++;
	return n;
}

int ct_slab_axis(const struct ct_degrade *by, const size_t n[static 3])
{
	double longest = 0;
	int axis = -1;

	for (int a = 2; a >= 0; a--) {
		const double fine = (double)n[a] * by->factor[a];

		if (can_cut(by, a) && fine > longest) {
			longest = fine;
			axis = a;
		}
	}
	return axis;
}

size_t ct_slab_most(const struct ct_degrade *by, const size_t n[static 3])
{
	const int axis = ct_slab_axis(by, n);
	const size_t unit = axis < 0 ? 1 : unit_of((size_t)by->factor[axis]);

	return axis < 0 ? 0 : (n[axis] + unit - 1) / unit;
}

struct ct_slab ct_slab_at(const struct ct_degrade *by, const size_t n[static 3], size_t k, size_t m)
{
	const int longest = ct_slab_axis(by, n), axis = longest < 0 ? 2 : longest;
	const size_t factor = (size_t)by->factor[axis], unit = unit_of(factor);
	const size_t units = ct_slab_most(by, n);
	const size_t about = (ABOUT + factor * unit - 1) / (factor * unit) * unit;
	struct ct_slab s = {.axis = axis, .factor = factor, .of = n[axis]};

	s.from = units * k / m * unit;
	s.to = k + 1 == m ? s.of : units * (k + 1) / m * unit;
	s.lo = s.from > about ? s.from - about : 0;
	s.hi = s.to + about < s.of ? s.to + about : s.of;
	return s;
}

int ct_slab_cut(struct ct_vol *part, const struct ct_vol *in, const struct ct_slab *s, bool fine,
	struct ct_err *e)
{
	const size_t times = fine ? s->factor : 1;
	ptrdiff_t start[3] = {0};
	size_t n[3];

	memcpy(n, in->n, sizeof n);
	n[s->axis] = (s->hi - s->lo) * times;
	start[s->axis] = (ptrdiff_t)(s->lo * times);
	return ct_crop(part, in, n, start, 0, e);
}

void ct_slab_put(struct ct_vol *to, const struct ct_vol *part, const struct ct_slab *s)
{
	size_t from[3] = {0}, n[3], at[3] = {0};

	memcpy(n, to->n, sizeof n);
	n[s->axis] = (s->to - s->from) * s->factor;
	from[s->axis] = (s->from - s->lo) * s->factor;
	at[s->axis] = s->from * s->factor;
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			memcpy(to->data + ((at[2] + k) * to->n[1] + at[1] + j) * to->n[0] + at[0],
				part->data +
					((from[2] + k) * part->n[1] + from[1] + j) * part->n[0] +
					from[0],
				n[0] * sizeof *to->data);
}
