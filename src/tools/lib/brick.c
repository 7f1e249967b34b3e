/* brick.c: see brick.h. */
#include "config.h"
#include "resolution/crop.h"
#include "core/room.h"
#include "tools/lib/brick.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Fine voxels about a slab. Those of the solver reach less far: with 24 the slabs of three dev
 * scans are within 0.01 HU RMS of the whole (doc/blocks.md). The prior looks at cells that begin at
 * whole numbers of UNIT. */
enum { ABOUT = 32, UNIT = 16 };

static bool can_cut(const struct ct_degrade *by, int axis)
{
	const double x = by->factor[axis];

	return x == floor(x) && x <= UNIT && (x == 1 || by->decimate != CT_DECIMATE_SINC);
}

/* Coarse voxels of which slabs are made: whole UNITs of fine ones. */
static size_t unit_of(size_t factor)
{
	size_t n = 1;

	while (n * factor % UNIT != 0)
		n++;
	return n;
}

int brick_axis(const struct ct_degrade *by, const size_t n[static 3])
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

size_t brick_most(const struct brick *b)
{
	const size_t unit = unit_of(b->factor);

	return (b->of + unit - 1) / unit;
}

void brick_slab(struct brick *b, size_t n, size_t m)
{
	const size_t unit = unit_of(b->factor), units = brick_most(b);
	const size_t about = (ABOUT + b->factor * unit - 1) / (b->factor * unit) * unit;

	b->from = units * (n - 1) / m * unit;
	b->to = n == m ? b->of : units * n / m * unit;
	b->lo = b->from > about ? b->from - about : 0;
	b->hi = b->to + about < b->of ? b->to + about : b->of;
}

int brick_find(struct brick *b, const char *text, const struct ct_vol *in,
	const struct ct_degrade *by, struct ct_err *e)
{
	const int axis = brick_axis(by, in->n);
	size_t part, parts;
	int end = 0;

	if (sscanf(text, "%zu/%zu%n", &part, &parts, &end) != 2 || text[end] || part < 1 ||
		part > parts || parts > 100000)
		return ct_fail(e, CT_EUSAGE, "--brick: '%.80s' is not N/M, N from 1 to M", text);
	if (axis < 0)
		return ct_fail(e, CT_EGEOM,
			"--brick: every voxel depends on all others: the scan was sampled by sinc, or "
			"by a factor that is not whole, along all axes");
	*b = (struct brick){.axis = axis, .factor = (size_t)by->factor[axis], .of = in->n[axis]};
	if (parts > brick_most(b))
		return ct_fail(e, CT_EUSAGE, "--brick: %zu slabs of axis %d there are, not %zu",
			brick_most(b), axis, parts);
	brick_slab(b, part, parts);
	return 0;
}

/* In place: voxels from .. to, not included, of an axis. */
static int keep(struct ct_vol *v, int axis, size_t from, size_t to, struct ct_err *e)
{
	struct ct_vol w = {0};
	ptrdiff_t start[3] = {0};
	double first[3] = {0};
	size_t n[3];

	memcpy(n, v->n, sizeof n);
	n[axis] = to - from;
	start[axis] = (ptrdiff_t)from;
	first[axis] = (double)from;
	if (from == 0 && to == v->n[axis])
		return 0;
	if (ct_vol_alloc(&w, n, e))
		return -1;
	ct_crop(w.data, n, v->data, v->n, start, 0);
	ct_crop_affine(v->affine, first);
	ct_room_free(v->data);
	v->data = w.data;
	memcpy(v->n, n, sizeof n);
	return 0;
}

int brick_cut(struct ct_vol *in, const struct brick *b, struct ct_err *e)
{
	return keep(in, b->axis, b->lo, b->hi, e);
}

int brick_cut_fine(
	struct ct_vol *fine, const struct ct_vol *in, const struct brick *b, struct ct_err *e)
{
	if (fine->n[b->axis] != in->n[b->axis] * b->factor)
		return ct_fail(e, CT_EGEOM, "%zu voxels along axis %d, not %zu", fine->n[b->axis],
			b->axis, in->n[b->axis] * b->factor);
	return keep(fine, b->axis, b->lo * b->factor, b->hi * b->factor, e);
}

int brick_pilot(struct ct_pilot *p, const struct ct_upsample_rule *rule, bool part,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	return rule->known && brick_axis(&rule->by, in->n) >= 0
		       ? ct_pilot_run(p, in, rule, part, env, e)
		       : 0;
}

void brick_follow(struct ct_upsample_rule *rule, struct ct_pilot *p)
{
	rule->multipliers = &p->multipliers;
	if (p->iterations == 0)
		return;
	rule->iterations = p->iterations;
	rule->tolerance = 0;
}

int brick_finish(
	struct ct_vol *out, const struct brick *b, const struct ct_resume *run, struct ct_err *e)
{
	const struct ct_part p = {
		b->axis, b->from * b->factor, b->to * b->factor, b->of * b->factor};

	if (keep(out, b->axis, (b->from - b->lo) * b->factor, (b->to - b->lo) * b->factor, e))
		return -1;
	return ct_part_put(&out->meta, &p, run, out->data, ct_vol_count(out), e);
}
