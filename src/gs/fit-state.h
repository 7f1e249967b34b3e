/* fit-state.h: a fit as tensors, to be continued. */
#ifndef CT_GS_FIT_STATE_H
#define CT_GS_FIT_STATE_H
#include "core/tensors.h"
#include "gs/fit.h"

/* State as tensors, exact: all that ct_fit_run changes. `run` names the options, data and seed it
 * belongs to. t must be zero. */
int ct_fit_state_pack(
	struct ct_tensors *t, const struct ct_fit *f, const char *run, struct ct_err *e);
/* Into an initialised fit. CT_EINPUT if `run` differs or the state is not whole. */
int ct_fit_state_unpack(
	struct ct_fit *f, const struct ct_tensors *t, const char *run, struct ct_err *e);

#endif
