/* evidence.h: what a base volume is corrected by, from the files of ct-nabgs and ct-fuse. */
#ifndef CT_TOOLS_LIB_EVIDENCE_H
#define CT_TOOLS_LIB_EVIDENCE_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"
#include "resolution/degrade.h"

#include <stdbool.h>

/* Paths; NULL: not given. */
struct ct_evidence_files {
	const char *in, *base, *projections, *std, *lr, *window;
};

struct ct_evidence {
	struct ct_stack in;        /* density mm */
	struct ct_stack base_proj; /* likewise, of the base */
	struct ct_stack weight;    /* of each pixel, in (0, 1]; none without std */
	struct ct_vol base;        /* as the file has it: HU, or density if there is no lr */
	struct ct_vol lr;     /* what D of the residual must be: density (LR - D base); or none */
	struct ct_degrade by; /* D, of lr */
	double window[2];     /* HU */
};

/* Read and check all that is given; *d must be zero. Codes of the readers; CT_EINPUT, CT_EGEOM
 * naming the file; CT_EUSAGE for a window that is none. */
int ct_evidence_read(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e);
/* The base to density, in [0, 1], and its projections if `project` and there are none yet.
 * CT_EGEOM, CT_ENOMEM, CT_ESTOP. */
int ct_evidence_density(struct ct_evidence *d, const struct ct_evidence_files *f, bool project,
	const struct ct_env *env, struct ct_err *e);
void ct_evidence_free(struct ct_evidence *d);

/* CT_EINPUT, naming the file, if its quantity is another than `want`; one that is not said may be.
 */
int ct_evidence_quantity(
	const struct ct_meta *m, const char *want, const char *path, struct ct_err *e);
/* Projections of a geometry that makes sense, all finite; quantity NULL: any. *s must be zero. */
int ct_evidence_stack(struct ct_stack *s, const char *path, const char *quantity, struct ct_err *e);
/* The low-resolution CT in HU, and the operator that it names, or else the base. *lr must be zero.
 */
int ct_evidence_lr(struct ct_vol *lr, struct ct_degrade *by, const char *path,
	const struct ct_meta *base, const char *base_path, const struct ct_env *env,
	struct ct_err *e);
/* A base volume in HU: finite, with axes at right angles. */
int ct_evidence_base(
	struct ct_vol *base, const char *path, const struct ct_env *env, struct ct_err *e);

#endif
