/* acquired.h: what DICOM says of how a CT was acquired, in the metadata as dicom.*.
 *
 * The reader of DICOM writes it, or a JSON sidecar says it (formats/beside.h). It is of use as long
 * as the voxels are where they were: who uses it compares their spacing. Nothing in it tells who
 * the patient is.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_ACQUIRED_H
#define CT_CORE_ACQUIRED_H
#include "core/meta.h"

/* mm; and how many of their distances slices are thick at the most: then they overlap by 5/6 */
enum { CT_ACQUIRED_TEXT = 24, CT_ACQUIRED_WIDEST = 1000, CT_ACQUIRED_OVERLAP = 6 };

struct ct_acquired {
	char maker[CT_ACQUIRED_TEXT], kernel[CT_ACQUIRED_TEXT]; /* printable; empty: not said */
	double thickness[3]; /* mm: of the slices, along their axis; 0 along others, or not said */
	double spacing[3];   /* mm between the voxels that were read; 0: not said */
	double collimation;  /* mm: one row of the detector; 0: not said */
};

/* Printable ASCII of a text of any origin; what is longer is cut. */
void ct_acquired_text(char to[static CT_ACQUIRED_TEXT], const char *from);
/* Why that cannot be, or NULL: "thickness" says which key. */
const char *ct_acquired_wrong(const struct ct_acquired *a);
/* CT_ENOMEM. */
int ct_acquired_put(struct ct_meta *m, const struct ct_acquired *a, struct ct_err *e);
/* 0; 1 if the metadata say nothing of it; CT_EINPUT naming the key. */
int ct_acquired_get(struct ct_acquired *a, const struct ct_meta *m, struct ct_err *e);
/* These keys, and no others. CT_ENOMEM. */
int ct_acquired_copy(struct ct_meta *to, const struct ct_meta *from, struct ct_err *e);

#endif
