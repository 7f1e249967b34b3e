/* sidecar.h: what is known of a volume beside its numbers, as JSON with the names of BIDS.
 *
 * Nothing in it tells who the patient is: no name, number, date, UID or free text of the header,
 * and no name of a file in which the patient's stands.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DICOM_SIDECAR_H
#define CT_DICOM_SIDECAR_H
#include "core/env.h"
#include "core/vol.h"
#include "series/layout.h"

#include <jansson.h>

/* The header of the first of the slices, and SourceSlices: which planes of the volume each is in,
 * by what part. CT_ENOMEM. */
int sidecar_series(
	json_t *o, const struct ct_slice *s, const struct ct_layout *l, struct ct_err *e);
/* The grid as it was read, and of one file without slices its name. CT_ENOMEM. */
int sidecar_volume(json_t *o, const struct ct_vol *v, const char *path, struct ct_err *e);
/* The names of files go; o may be NULL. */
void sidecar_forget_files(json_t *o);
/* `v` was refined from what the sidecar says: the image is derived, what was said of its sampling
 * no longer holds, and SuperResolution has the operator and method of `v`. CT_ENOMEM. */
int sidecar_refined(json_t *o, const struct ct_vol *v, struct ct_err *e);
/* Close with the units of `v` and the software, and write it. CT_EOUTPUT, CT_ENOMEM. */
int sidecar_write(const char *path, json_t *o, const struct ct_vol *v, const struct ct_env *env,
	struct ct_err *e);

#endif
