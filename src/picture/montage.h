/* montage.h: slices and projections side by side in one picture. Pure; thread-safe.
 *
 * A slice of a volume is drawn as a radiologist looks at it: axial from below (the patient's
 * left on the right, anterior on top), coronal from the front (left on the right, superior on top),
 * sagittal from the left (anterior on the left, superior on top). It lies along the voxel axes
 * nearest to the patient's; nothing is resampled: a pixel shows the voxel it falls into, and all
 * tiles have the same millimetres a pixel.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_PICTURE_MONTAGE_H
#define CT_PICTURE_MONTAGE_H
#include "core/stack.h"
#include "core/vol.h"
#include "core/words.h"

#include <stdbool.h>
#include <stddef.h>

/* From values to colours, of errors: black over red and yellow to white, and two more.
 *
 * inferno rises evenly in lightness from black: eight places, evenly spaced, of the map of that
 * name by N. Smith and S. van der Walt (BIDS/colormap, CC0), straight lines between them. signed is
 * the diverging map of K. Moreland, "Diverging Color Maps for Scientific Visualization" (2009):
 * nine places of its table, from blue over light grey in the middle to red. */
#define CT_COLOUR_ERROR_LIST(X)                                                                    \
	X(CT_COLOUR_HOT, "hot")                                                                    \
	X(CT_COLOUR_INFERNO, "inferno")                                                            \
	X(CT_COLOUR_SIGNED, "signed")
enum ct_colour_map { CT_COLOUR_ERROR_LIST(CT_WORD_VALUE) CT_COLOUR_GREY };

/* The colour of t, 0 to 1 and what lies beyond as its ends; NaN is blue. */
void ct_colour_map_of(unsigned char rgb[static 3], double t, enum ct_colour_map map);

#define CT_MONTAGE_PLANE_LIST(X)                                                                   \
	X(CT_MONTAGE_AXIAL, "axial")                                                               \
	X(CT_MONTAGE_CORONAL, "coronal")                                                           \
	X(CT_MONTAGE_SAGITTAL, "sagittal")
enum ct_montage_plane { CT_MONTAGE_PLANE_LIST(CT_WORD_VALUE) CT_MONTAGE_PLANES };

/* Value of row r and column c: data[r step[0] + c step[1]], r < n[0], c < n[1]. Borrowed. */
struct ct_montage_slice {
	const float *data;
	ptrdiff_t step[2];
	size_t n[2];
	double mm[2];     /* between rows and between columns */
	double origin[2]; /* where the first row and column begin, mm down and to the right */
};

/* World coordinate across the plane, mm, at `at` of [0, 1] of the volume: 0 is the most inferior,
 * posterior or left slice, 1 the most superior, anterior or right one. */
double ct_montage_position(const struct ct_vol *v, enum ct_montage_plane plane, double at);
/* Slice of v across the axis of the plane at that world coordinate, for a rotated volume at that
 * of its middle. 1 if it misses the volume. */
int ct_montage_slice_volume(
	struct ct_montage_slice *s, const struct ct_vol *v, enum ct_montage_plane plane, double mm);

/* Projections of a slab: the largest, least or mean value along each ray across a plane. */
#define CT_MIP_LIST(X)                                                                             \
	X(CT_MIP_NONE, "none")                                                                     \
	X(CT_MIP_MAX, "max")                                                                       \
	X(CT_MIP_MIN, "min")                                                                       \
	X(CT_MIP_MEAN, "mean")
enum ct_mip { CT_MIP_LIST(CT_WORD_VALUE) };

/* Slice of v as of ct_montage_slice_volume, of all planes of voxels whose middles are within
 * thickness / 2 mm of that coordinate, and of the one there if there are none; of all of them if
 * thickness is 0. NaN where one of them is. *own, to be freed, holds it. 1 if it misses the
 * volume. */
int ct_montage_slice_mip(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double mm, double thickness, enum ct_mip how,
	struct ct_err *e);
/* View k of a stack, row 0 on top; origin from the middle of the detector. */
void ct_montage_slice_view(struct ct_montage_slice *s, const struct ct_stack *p, size_t k);
/* Range of the finite values: range[0] > range[1] if there are none. Call with {INFINITY,
 * -INFINITY}, or with the range so far. */
void ct_montage_slice_range(double range[static 2], const struct ct_montage_slice *s);
/* Its rows (i = 0) or columns (i = 1) of pixels, at mm a pixel: 0 of an empty place, else 1 or
 * more. */
size_t ct_montage_slice_pixels(const struct ct_montage_slice *s, int i, double mm);
/* Do the two share at least half of the height and width of the smaller one? */
bool ct_montage_slice_overlap(const struct ct_montage_slice *a, const struct ct_montage_slice *b);

/* A slice in grey from window[0] (black) to window[1] (white); with `minus`, |slice - minus|, or of
 * CT_COLOUR_SIGNED slice - minus, in the colours of `error`, black where minus does not reach. NaN
 * is blue. */
struct ct_montage_tile {
	struct ct_montage_slice slice; /* data NULL: an empty place */
	struct ct_montage_slice minus; /* data NULL: none */
	double window[2];
	enum ct_colour_map error;
};

/* Tiles row after row, `gap` pixels between them, at `mm` a pixel. */
struct ct_montage {
	size_t rows, cols, gap;
	struct ct_montage_tile *tile; /* [rows][cols] */
	double mm;
};

/* Size of the picture. CT_EINPUT if it is larger than 32768 a side. */
int ct_montage_size(size_t *h, size_t *w, const struct ct_montage *m, struct ct_err *e);
/* Where the tile in row r and column c begins, pixels down and to the right, and the size of its
 * place: that of the largest tile in its row and in its column. */
void ct_montage_place(
	size_t at[static 2], size_t size[static 2], const struct ct_montage *m, size_t r, size_t c);
/* World coordinate across the plane of the middle of the voxels that ct_montage_slice_volume takes.
 */
double ct_montage_centre(const struct ct_vol *v, enum ct_montage_plane plane, double mm);
/* rgb[(y*w + x)*3 + c], sRGB: zeroes at first, w at least that of ct_montage_size. */
void ct_montage_draw(unsigned char *rgb, size_t w, const struct ct_montage *m);

#endif
