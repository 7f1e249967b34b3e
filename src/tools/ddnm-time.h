/* ddnm-time.h: how long a network takes, for ct-ddnm --dry-run. */
#ifndef CT_TOOLS_DDNM_TIME_H
#define CT_TOOLS_DDNM_TIME_H
#include "diffusion/prior.h"

/* Seconds of one call of the planned network and, if `back`, of its derivative, else 0; the first
 * call, which is slower, is not timed. Codes of the network, CT_ENOMEM. */
int ddnm_time(const struct ct_prior *p, bool back, double *once, double *slope, struct ct_err *e);

#endif
