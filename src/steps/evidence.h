/* evidence.h: what a base volume is corrected by: projections, and what is known besides them. The
 * data belong together when they are of one patient in one place, in one window, of the quantity
 * that is wanted. In memory; the readers are tools/lib/evidence-files.h and src/ctsr.
 *
 * The residual of the paper is what the projections have beyond those of the base,
 *   y - P base,   base = density in the window, cut at its ends;
 * where the projections hold overshoots (metadata overshoot, ct-project) the base is not cut.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_EVIDENCE_H
#define CT_STEPS_EVIDENCE_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"
#include "operator/degrade.h"
#include "steps/window-rule.h"

#include <stdbool.h>

/* What is asked: what the messages call the data, NULL for what is not given, and the window. */
struct ct_evidence_rule {
	const char *in, *base, *projections, *std, *lr;
	struct ct_window_rule window;
};

struct ct_evidence {
	struct ct_evidence_rule is; /* its strings are borrowed */
	struct ct_stack in;         /* density mm */
	struct ct_stack base_proj;  /* likewise, of the base */
	struct ct_stack weight; /* deviation of each pixel of `in`, and once checked its weight, in
				 * (0, 1]; without std what `in` carries, or none */
	struct ct_vol base;     /* HU, or density if there is no lr */
	struct ct_vol lr; /* HU, and once checked what D of the residual must be: density (LR - D
			   * base); or none */
	struct ct_degrade by; /* D, of lr */
	double window[2];     /* HU; once checked */
};

/* The data belong together: checked, the window chosen, weights and what the base leaves of lr
 * computed, in place. CT_EINPUT, CT_EGEOM, CT_ENUMERIC naming what is wrong; CT_EUSAGE for a window
 * that is none; CT_ENOMEM. The same bytes for any number of threads. */
int ct_evidence_check(struct ct_evidence *d, const struct ct_evidence_rule *r,
	const struct ct_env *env, struct ct_err *e);
/* The base to density, in [0, 1], and its projections if `project` and there are none yet. After
 * ct_evidence_check. CT_EGEOM, CT_ENOMEM, CT_ESTOP. */
int ct_evidence_density(
	struct ct_evidence *d, bool project, const struct ct_env *env, struct ct_err *e);
void ct_evidence_free(struct ct_evidence *d);

/* CT_EINPUT, naming it, if its quantity is another than `want`; one that is not said may be. */
int ct_evidence_quantity(
	const struct ct_meta *m, const char *want, const char *name, struct ct_err *e);
/* Projections of a geometry that makes sense, all finite, of a quantity, or with NULL of any. */
int ct_evidence_rays(
	const struct ct_stack *s, const char *name, const char *quantity, struct ct_err *e);
/* The operator that a low-resolution CT names, which is in HU, or else the base. */
int ct_evidence_operator(struct ct_degrade *by, const struct ct_meta *lr, const char *name,
	const struct ct_meta *base, const char *base_name, struct ct_err *e);
/* A volume, finite, with axes at right angles. */
int ct_evidence_volume(const struct ct_vol *v, const char *name, struct ct_err *e);

#endif
