/* ddnm-time.h: how long a network takes, for ct-ddnm --dry-run. */
#ifndef CT_TOOLS_DDNM_TIME_H
#define CT_TOOLS_DDNM_TIME_H
#include "cli/cost.h"
#include "diffusion/prior.h"

/* Calls of a network for each view, and of its derivative. */
struct ddnm_calls {
	size_t each, gradients, views, threads;
};

/* cost->seconds and cost->work, of what was done before and of so many calls of the planned
 * network, by the processor time of some; the first, which is slower, is not timed. Codes of the
 * network, CT_ENOMEM. */
int ddnm_time(struct ct_cost *cost, const struct ct_prior *p, const struct ddnm_calls *n,
	struct ct_err *e);

#endif
