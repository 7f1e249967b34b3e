/* patches.h: pictures to train on, and random pieces of them.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_DIFFUSION_PATCHES_H
#define CT_DIFFUSION_PATCHES_H
#include "core/err.h"

#include <stddef.h>
#include <stdint.h>

/* Grey pictures with values in [0, 1]. A zeroed struct is an empty set. */
struct ct_pictures {
	size_t n, cap;
	struct ct_picture {
		size_t h, w;
		float *px; /* owned, [h][w] */
	} * picture;
};

struct ct_patches {
	size_t size;             /* edge of a piece, pixels */
	size_t channels;         /* the piece is repeated */
	size_t scales, scale[8]; /* a piece is cut from the picture reduced by one of these */
};

/* Takes over px[h][w], also when it fails. CT_ENUMERIC unless all values lie in [0, 1]. */
int ct_pictures_add(
	struct ct_pictures *s, size_t h, size_t w, float *px, const char *name, struct ct_err *e);
void ct_pictures_free(struct ct_pictures *s);
/* How many pictures are as large as a piece at one of the scales. */
size_t ct_patches_count(const struct ct_patches *p, const struct ct_pictures *s);
/* CT_EGEOM if no picture is as large as a piece at the smallest scale. */
int ct_patches_check(const struct ct_patches *p, const struct ct_pictures *s, const char *what,
	struct ct_err *e);
/* Piece number `index`: x[channels][size][size] in [-1, 1], a function of
 * the seed and the index. Picture, scale (among those it is large enough for), place and mirroring
 * (left-right) are drawn uniformly; the reduction averages areas. Pictures that are too small are
 * passed over.
 */
void ct_patches_draw(const struct ct_patches *p, const struct ct_pictures *s, float *x,
	uint64_t seed, uint64_t index);

#endif
