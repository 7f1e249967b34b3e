/* radiograph.h: the one picture of X rays on a detector that a DICOM file holds. */
#ifndef CT_DICOM_RADIOGRAPH_H
#define CT_DICOM_RADIOGRAPH_H
#include "core/vol.h"

/* Grey values from 0, black, to 1, white, row 0 on top: the range of the stored bits, turned where
 * the file says that the lowest is white, or its slope is negative; padding is black. No window is
 * applied. *v, which must be zero, gets its numbers and sizes; mm those between columns and rows of
 * the detector, or NaN if the file does not say. CT_EGEOM for several pictures; CT_EINPUT for what
 * is no radiograph, or not grey. */
int radiograph_read(struct ct_vol *v, double mm[2], const char *path, struct ct_err *e);

#endif
