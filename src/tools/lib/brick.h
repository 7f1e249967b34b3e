/* brick.h: one of M slabs of a scan, refined on its own, with so much about it that the rest does
 * not matter.
 *
 * That holds along an axis that is not refined, or that was sampled by points or means: there a
 * voxel depends on what is near. Sampling after the ideal low-pass (sinc) makes every voxel of a
 * row depend on all others. What lies about the slabs is done twice: of the axes that can be cut
 * the one with most fine voxels is, of equal ones the last. */
#ifndef CT_TOOLS_LIB_BRICK_H
#define CT_TOOLS_LIB_BRICK_H
#include "cli/part.h"
#include "core/vol.h"
#include "resolution/pilot.h"

#define BRICK(S, f)                                                                                     \
	CT_OPT(S, f, 0, "brick", "N/M", 0, 0,                                                           \
		"make slab N of M alone, for ct-merge to join, of a scan that has an axis that is not " \
		"refined, or that was sampled by points or means")

struct brick {
	int axis;
	size_t factor;
	size_t from, to, of; /* coarse voxels of the axis, to not included */
	size_t lo, hi;       /* with those about it */
};

/* The axis along which a scan of n voxels is cut; -1 if none can be. */
int brick_axis(const struct ct_degrade *by, const size_t n[static 3]);
/* The most slabs of b->of coarse voxels by b->factor. */
size_t brick_most(const struct brick *b);
/* Slab n of m, from 1, no more than there are: where it is, by b->of and b->factor. */
void brick_slab(struct brick *b, size_t n, size_t m);
/* Slab N of M of `text` "N/M". CT_EUSAGE for another text, and more slabs than there are places to
 * cut; CT_EGEOM if no axis can be cut. */
int brick_find(struct brick *b, const char *text, const struct ct_vol *in,
	const struct ct_degrade *by, struct ct_err *e);
/* In place: of the scan the slab and what is about it. CT_ENOMEM. */
int brick_cut(struct ct_vol *in, const struct brick *b, struct ct_err *e);
/* ... and of a volume on the grid of the result of `in`, which is not cut yet. CT_EGEOM. */
int brick_cut_fine(
	struct ct_vol *fine, const struct ct_vol *in, const struct brick *b, struct ct_err *e);
/* What the whole and slabs of a scan have in common (pilot.h), for the caller to free, if the scan
 * is one that can be cut; before it is, if `part`. As ct_upsample. */
int brick_pilot(struct ct_pilot *p, const struct ct_upsample_rule *rule, bool part,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);
/* The rule of the whole, or of a slab, after that. */
void brick_follow(struct ct_upsample_rule *rule, struct ct_pilot *p);
/* Of the result the slab; and note in its metadata which part it is, of what run. CT_ENOMEM. */
int brick_finish(
	struct ct_vol *out, const struct brick *b, const struct ct_resume *run, struct ct_err *e);

#endif
