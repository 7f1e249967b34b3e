/* slices.h: from the slices of a DICOM series to a grid, by geometry alone.
 *
 * DICOM speaks of the patient in LPS+ millimetres; the grid made here is RAS+. Nothing is
 * resampled: a series that is no uniform grid at right angles is refused, with the numbers.
 */
#ifndef CT_CORE_SLICES_H
#define CT_CORE_SLICES_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

/* What one file says of its picture. */
struct ct_slice {
	char *path; /* owned by whoever made the array */
	char series[72], frame[72],
		patient[72];          /* SeriesInstanceUID, FrameOfReferenceUID, PatientID */
	char modality[20], about[72]; /* SeriesDescription */
	int number, instance;         /* SeriesNumber, InstanceNumber; 0 if none */
	size_t columns, rows, frames;
	bool placed;        /* has position, orientation and pixel spacing */
	double position[3]; /* of the centre of the first pixel, LPS mm */
	double across[3];   /* unit vector along a row: towards the next column */
	double down[3];     /* unit vector along a column: towards the next row */
	double pitch[2];    /* mm between columns, mm between rows */
	bool scaled;        /* has RescaleSlope and RescaleIntercept */
	double slope, intercept;
	bool padded;
	double padding[2];     /* stored values from, to that are no measurement */
	double bytes, claimed; /* of the file; of its pictures, by what it says of them */
};

/* Order by series number, then UID, then instance. */
void ct_slices_group(struct ct_slice *s, size_t n);
/* Slices of the series that begins at `first` of a grouped array. */
size_t ct_slices_count(const struct ct_slice *s, size_t n, size_t first);
/* The series that `which` names in a grouped array: by UID, or by its place in the list of series
 * counted from 1; NULL is the only one. CT_EGEOM if there are several, CT_EUSAGE if there is no
 * such. */
int ct_slices_pick(const struct ct_slice *s, size_t n, const char *which, size_t *first,
	size_t *count, struct ct_err *e);
/* Sort n slices along their normal and give the RAS+ affine of columns x rows x n voxels: i along
 * a row, j down the columns, k from slice to slice. CT_EGEOM unless they are CT of one patient, one
 * orientation, matrix and pixel size, at one spacing (every slice within 5%
 * of it), in a stack at right angles (drift within 0.1 pixel). */
int ct_slices_grid(struct ct_slice *s, size_t n, double affine[3][4], struct ct_err *e);
/* Stored values of a slice to HU; padding becomes -1024. */
void ct_slice_hu(const struct ct_slice *s, float *hu);

#ifdef __cplusplus
}
#endif
#endif
