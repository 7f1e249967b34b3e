/* expect-prior.h: what a prior of slices will take, from what pieces of the scan take. */
#ifndef CT_TOOLS_LIB_EXPECT_PRIOR_H
#define CT_TOOLS_LIB_EXPECT_PRIOR_H
#include "restore/restore.h"

/* *cpu += seconds, of all threads together, that the prior, by the rule, takes to add to IN,
 * refined; if IN is small, `whole`, those that it took. It takes most of them of cells that are not
 * flat: of 27 pieces the eight that have most of these tell how long a cell takes, a flat one what
 * the rest does, and IN, not refined, how many there are. */
int expect_prior(double *cpu, const struct ct_vol *in, bool whole,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	const struct ct_env *env, struct ct_err *e);

#endif
