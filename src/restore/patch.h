/* patch.h: what a slice shows around one of its cells, in the form that the slice network learns.
 *
 * A cell is a square of `cell` x `cell` fine pixels of a slice: what became one pixel of the LR
 * slice, in `slices` slices. Its patch is the square of `side` pixels about it, in `depth` slices
 * about its own (the border repeated). Patches are made alike before they are looked at:
 *
 *   level    mu, the mean of the cell and the pixels about it, and s, the standard deviation of the
 *            patch: x = (patch - mu) / s. A patch with s <= CT_PATCH_FLAT says nothing
 *   pose     mirrored so that its first moments are positive (over twice the cell, a pixel more if
 *            that is odd), and, where the two axes of the slice are equals, swapped so that the
 *            larger one lies along u
 *
 * What is predicted for the cell is undone the same way.
 *
 * A volume that differs by little gets a prediction that differs by little: a patch whose moment is
 * nearly 0, or whose two are nearly equal, has both poses, each with a share of the cell that goes
 * smoothly to 0 where the other is plain; and all shares of a cell go smoothly from 1 at twice
 * CT_PATCH_FLAT to 0 there. Pure; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_PATCH_H
#define CT_RESTORE_PATCH_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

#define CT_PATCH_FLAT 10.0f /* HU */

enum {
	CT_PATCH_SIDE = 40,
	CT_PATCH_DEPTH = 8,
	CT_PATCH_CELL = 8,
	CT_PATCH_SLICES = 4,
	CT_PATCH_POSES = 16
};
enum {
	CT_PATCH_MOST = CT_PATCH_SIDE * CT_PATCH_SIDE * CT_PATCH_DEPTH,
	CT_PATCH_CELL_MOST = CT_PATCH_CELL * CT_PATCH_CELL * CT_PATCH_SLICES
};

struct ct_patch_shape {
	/* side - cell and depth - slices even, within the limits above */
	size_t cell, side, depth, slices;
	bool swap; /* are the two axes of a slice equals? */
};

/* The slices of a volume across one of its axes: u and v are the other two, u the faster. */
struct ct_slicing {
	const float *x;
	size_t n[3], stride[3]; /* along u, v and across */
};

/* How a patch was made alike. */
struct ct_patch_pose {
	float mu, s, share;
	unsigned turn; /* 1: u mirrored, 2: v, 4: across, 8: swapped */
};

/* Values of a patch. */
static inline size_t ct_patch_count(const struct ct_patch_shape *p)
{
	return p->side * p->side * p->depth;
}

/* Values of a cell. */
static inline size_t ct_patch_cell_count(const struct ct_patch_shape *p)
{
	return p->cell * p->cell * p->slices;
}

/* CT_EINPUT unless it is within these limits. */
int ct_patch_shape_check(const struct ct_patch_shape *shape, struct ct_err *e);
/* Are slices across `axis` such: both of their axes coarse (swap), or one of them? */
bool ct_patch_shape_fits(const struct ct_patch_shape *shape, int axis, const bool coarse[static 3]);
/* Slices across `axis`. If only one of the other two is coarse, it is v. */
void ct_slicing_of(struct ct_slicing *s, const float *x, const size_t n[static 3], int axis,
	const bool coarse[static 3]);
/* The patch, as it lies, about the cell whose first pixel is at[0], at[1] of slice at[2], its
 * first, and its poses, that of the moments' signs first: how many, 0 if it is flat. */
size_t ct_patch_look(float *raw, struct ct_patch_pose pose[static CT_PATCH_POSES],
	const struct ct_slicing *s, const struct ct_patch_shape *shape, const size_t at[static 3]);
/* Made alike in one of them. */
void ct_patch_turn(float *out, const float *raw, const struct ct_patch_shape *shape,
	const struct ct_patch_pose *pose);
/* Both, in the first pose; false if it is flat, and out is then not written. */
bool ct_patch_cut(float *out, struct ct_patch_pose *pose, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3]);
/* The values of a volume (of the same slicing) in the cell there, over s, in the pose. */
void ct_patch_cell(float *out, const struct ct_slicing *s, const struct ct_patch_shape *shape,
	const struct ct_patch_pose *pose, const size_t at[static 3]);
/* Its inverse: add to a cell, as it lies, s times the values in the pose, times its share. */
void ct_patch_back(float *cell, const float *in, const struct ct_patch_shape *shape,
	const struct ct_patch_pose *pose);
/* From 0 at t = 0 to 1 at t = 1, smoothly. */
float ct_patch_rise(float t);
/* What a volume of that slicing holds in a cell, as it lies; 0 beyond its borders. */
void ct_patch_take(float *cell, const float *from, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3]);
/* Add a cell, as it lies, to a volume of that slicing, but for what is beyond its borders; and the
 * squares to another, if it is not NULL. Thread-safe for different cells. */
void ct_patch_put(float *to, float *square, const float *cell, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3]);

#endif
