/* window-rule.h: which window from HU to density holds (xray/window.h): what was asked for and what
 * the data say must agree. HU; no threads. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_WINDOW_RULE_H
#define CT_STEPS_WINDOW_RULE_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"

/* A window that is asked for. */
struct ct_window_rule {
	double range[2]; /* LO, HI in HU */
	char words[64];  /* what messages call it, "--window 0:1000"; "": none is asked for */
};

/* The window of the metadata, else the one asked for, else -1024 to 3071 HU. m, r may be NULL.
 * CT_EUSAGE for one that float32 does not hold, and if both are there and differ. */
int ct_window_rule_choose(double window[static 2], const struct ct_window_rule *r,
	const struct ct_meta *m, struct ct_err *e);
/* Say how much of a volume in HU, called `name`, is above the window, where its density ends. */
void ct_window_rule_warn(const struct ct_vol *v, const char *name, const double window[static 2],
	const struct ct_env *env);
/* A volume of density that was reconstructed from a stack gets its metadata, and becomes HU by its
 * window unless it is to stay density. */
int ct_window_rule_reconstructed(struct ct_vol *out, const struct ct_stack *in,
	const struct ct_window_rule *r, bool density, struct ct_err *e);

#endif
