/* expect.h: what refining a scan will take, from the work that pieces of it take: processor time,
 * so that other work on the machine does not count. */
#ifndef CT_TOOLS_LIB_EXPECT_H
#define CT_TOOLS_LIB_EXPECT_H
#include "cli/cost.h"
#include "resolution/upsample.h"

/* What --dry-run --json tells besides: the iterations of the solver; the bytes of memory if all
 * were held in it, and those of them that each slab takes too; those that are free, 0 if nothing
 * tells; the axis along which slabs are cut, -1 none, the factor and the coarse voxels of it. */
#define EXPECT_ITERATIONS "iterations"
#define EXPECT_NEED "need-bytes"
#define EXPECT_FIXED "fixed-bytes"
#define EXPECT_FREE "free-bytes"
#define EXPECT_AXIS "slab-axis"
#define EXPECT_FACTOR "slab-factor"
#define EXPECT_VOXELS "slab-voxels"
/* And ct-ddnm: 0 if OUT will be what it is added to. */
#define EXPECT_ADDS "adds"

#define EXPECT_PRIOR 67108864.0 /* bytes, of the nets of slices and what looks through them */
#define EXPECT_LONG 5e7         /* voxels of a result that is long in coming */

struct expect {
	enum ct_upsample method;
	double cpu;   /* seconds of all threads together */
	double pilot; /* of them, of a pilot (pilot.h) */
	double fine;  /* voxels of the result */
	size_t iterations;
	bool whole; /* the scan is so small that all of it was refined */
};

/* Of ct_upsample. A small scan is refined as a whole; of a larger one its pilot, where slabs can be
 * cut, or else three bars through its middle, along the axes, to the end, for the number of
 * iterations, and a piece that is too large for any cache for the time of each. */
int expect_solver(struct expect *x, const struct ct_vol *in, const struct ct_upsample_rule *rule,
	const struct ct_env *env, struct ct_err *e);
/* Those, in cost->more. */
void expect_tell(struct ct_cost *cost, const struct expect *x, const struct ct_vol *in,
	const struct ct_degrade *by, double need, double fixed);
/* The coarse voxels of a piece about the place `at`, each in [0, 1], of the axes, of as many as
 * make `fine` voxels along an axis, or fewer. The rest of *piece but the affine is empty. */
int expect_piece(struct ct_vol *piece, const struct ct_vol *in, const double factor[3], size_t fine,
	const double at[3], struct ct_err *e);
/* Of so many voxels altogether. */
double expect_fine(const struct ct_vol *in, const double factor[3]);
/* Bytes that refining takes at the most, in memory, whatever the operator. */
double expect_most(const struct ct_vol *in, const double factor[3]);

#endif
