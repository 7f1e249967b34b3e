/* montage.h: slices and projections side by side in one picture. Pure; thread-safe.
 *
 * A slice of a volume is drawn as a radiologist looks at it: axial from below (the patient's
 * left on the right, anterior on top), coronal from the front (left on the right, superior on top),
 * sagittal from the left (anterior on the left, superior on top). It lies along the voxel axes
 * nearest to the patient's; nothing is resampled: a pixel shows the voxel it falls into, and all
 * tiles have the same millimetres a pixel.
 */
#ifndef CT_TOOLS_MONTAGE_H
#define CT_TOOLS_MONTAGE_H
#include "core/stack.h"
#include "core/vol.h"
#include "core/words.h"

#include <stdbool.h>
#include <stddef.h>

#define MONTAGE_PLANE_LIST(X)                                                                      \
	X(MONTAGE_AXIAL, "axial")                                                                  \
	X(MONTAGE_CORONAL, "coronal")                                                              \
	X(MONTAGE_SAGITTAL, "sagittal")
enum montage_plane { MONTAGE_PLANE_LIST(CT_WORD_VALUE) MONTAGE_PLANES };

/* Value of row r and column c: data[r step[0] + c step[1]], r < n[0], c < n[1]. Borrowed. */
struct montage_slice {
	const float *data;
	ptrdiff_t step[2];
	size_t n[2];
	double mm[2];     /* between rows and between columns */
	double origin[2]; /* where the first row and column begin, mm down and to the right */
};

/* World coordinate across the plane, mm, at `at` of [0, 1] of the volume: 0 is the most inferior,
 * posterior or left slice, 1 the most superior, anterior or right one. */
double montage_position(const struct ct_vol *v, enum montage_plane plane, double at);
/* Slice of v across the axis of the plane at that world coordinate, for a rotated volume at that
 * of its middle. -1 if it misses the volume. */
int montage_slice_volume(
	struct montage_slice *s, const struct ct_vol *v, enum montage_plane plane, double mm);
/* View k of a stack, row 0 on top; origin from the middle of the detector. */
void montage_slice_view(struct montage_slice *s, const struct ct_stack *p, size_t k);
/* Range of the finite values: range[0] > range[1] if there are none. Call with {INFINITY,
 * -INFINITY}, or with the range so far. */
void montage_slice_range(double range[static 2], const struct montage_slice *s);
/* Do the two share at least half of the height and width of the smaller one? */
bool montage_slice_overlap(const struct montage_slice *a, const struct montage_slice *b);

/* A slice in grey from window[0] (black) to window[1] (white); with `minus`, |slice - minus| from
 * black over red and yellow to white, black where minus does not reach. NaN is blue. */
struct montage_tile {
	struct montage_slice slice; /* data NULL: an empty place */
	struct montage_slice minus; /* data NULL: none */
	double window[2];
};

/* Size of the picture of rows x cols tiles (row after row) at `mm` a pixel, `gap` pixels between
 * them. CT_EINPUT if it is larger than 32768 a side. */
int montage_size(size_t *h, size_t *w, size_t rows, size_t cols, const struct montage_tile *tile,
	double mm, size_t gap, struct ct_err *e);
/* rgb[(y*w + x)*3 + c], sRGB; h and w of montage_size. */
void montage_draw(unsigned char *rgb, size_t h, size_t w, size_t rows, size_t cols,
	const struct montage_tile *tile, double mm, size_t gap);

#endif
