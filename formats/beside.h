/* beside.h: the JSON sidecar of a NIfTI file, as dcm2niix and ct-convert write them.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_BESIDE_H
#define CT_FORMATS_BESIDE_H
#include "core/env.h"
#include "core/vol.h"

/* What x.json says of the scanner becomes metadata of v (core/acquired.h), read from x.nii or
 * x.nii.gz, unless v has them already. No sidecar, or one that says nothing of a CT as it was
 * scanned, is nothing; a damaged one is a warning that names file and field, and nothing of it is
 * used. CT_ENOMEM. */
int ct_beside_read(struct ct_vol *v, const char *path, const struct ct_env *env, struct ct_err *e);
/* Its name, there or not, to be freed; NULL of what is not called .nii or .nii.gz, or no memory. */
char *ct_beside_name(const char *path);
/* The text of a sidecar of slices so many mm apart, 0 if that is not known: 0, or 1 if it is none
 * of a CT. CT_EINPUT naming the field. */
int ct_beside_parse(struct ct_meta *m, double apart, const char *text, size_t n, struct ct_err *e);

#endif
