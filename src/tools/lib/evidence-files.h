/* evidence-files.h: what a base volume is corrected by (steps/evidence.h), from the files of
 * ct-nabgs and ct-fuse. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_LIB_EVIDENCE_FILES_H
#define CT_TOOLS_LIB_EVIDENCE_FILES_H
#include "steps/evidence.h"

/* Paths; NULL: not given. */
struct ct_evidence_files {
	const char *in, *base, *projections, *std, *lr, *window;
};

/* Read and check all that is given; *d must be zero. Codes of the readers, of --window and of
 * ct_evidence_check, naming the file. */
int ct_evidence_files_read(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e);

#endif
