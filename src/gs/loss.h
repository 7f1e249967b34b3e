/* loss.h: the loss that a fit minimises, and its gradient.
 *
 *   L = l1 mean|x - y| + ssim (1 - SSIM(x, y)) + tv TV + lr mean|D r - l|
 *
 * The first two terms are of a view, the third is the mean absolute difference of neighbours in a
 * block of the volume; the last is of the low-resolution CT (loss-lowres.h); loss-total.h brings
 * them together.
 *
 * x is the predicted and y the wanted projection, both multiplied by `scale`, which brings line
 * integrals to the order of one as the constants of SSIM suppose: 2 / (largest extent of the
 * volume in mm), the normalised scene of R2-Gaussian. The paper (section NAB-GS) has two L1
 * terms, of projections and of residual projections. As x is the base's projection plus the
 * residual's, |x - y| = |x_res - y_res|: they are one term of weight 2.
 * Pixels may have weights, of which `mean_weight` is the mean over all views: mean|x - y| is then
 * mean(w |x - y|) / mean_weight, and SSIM the like of its map.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_LOSS_H
#define CT_GS_LOSS_H
#include "core/err.h"
#include "core/par.h"
#include "core/simd.h"
#include "quality/ms-ssim.h"
#include "quality/ssim.h"

#include <stdbool.h>
#include <stddef.h>

/* As the published program has them: with `clamp` x is max(x, 0) in one of the two L1 terms, that
 * of projections, and in MS-SSIM (quality/ms-ssim.h), which may be in the place of SSIM.
 *
 * A view: its gradient dimg[h][pitch], which is set, img[h][pitch] in mm, base (NULL: 0), y and
 * weight (NULL: ones) h x w. */
struct ct_loss_view {
	float *dimg;
	const float *img, *base, *y, *weight;
	size_t pitch;
	double l1, ssim;    /* weights of the terms; neither need be positive */
	double scale;       /* 1/mm, of projections */
	double mean_weight; /* 1 without weights */
	bool clamp;
};

/* Terms without their weights. */
struct ct_loss_terms {
	double l1, dssim, tv, lr;
};

/* Scratch for images h x w. */
struct ct_loss_image {
	size_t h, w;
	float *x, *y, *g; /* one block at x */
	double *part;     /* of every strip: L1, 1 - S */
	struct ct_ssim_rule rule;
	struct ct_ms_ssim multi; /* n is 0: SSIM */
};

/* Free it in any case. `multi`: with MS-SSIM, which knows no weights. CT_EGEOM, CT_ENOMEM. */
int ct_loss_image_init(struct ct_loss_image *l, size_t h, size_t w, bool multi, struct ct_err *e);
void ct_loss_image_free(struct ct_loss_image *l);
/* Sets t->l1, t->dssim and v->dimg. A term of weight 0 is not computed. Strips of rows in parallel,
 * the same bytes for any number of threads. */
void ct_loss_image_gradient(struct ct_loss_image *l, struct ct_loss_terms *t,
	const struct ct_loss_view *v, struct ct_par *par);

/* Mean |difference| along the three axes of f + base and df[n2][n1][pitch] = weight times its
 * gradient; f of the same layout, base the first of these voxels in a volume of grid[], or NULL. 0
 * for a single voxel. part[n2] is scratch; slices in parallel, the same bytes for any number of
 * threads. */
double ct_loss_tv_gradient(float *df, double *part, const float *f, size_t pitch, const float *base,
	const size_t grid[static 3], const size_t n[static 3], double weight, struct ct_par *par);

/* Their kernels (loss-row.c). A row of an image: out, both images scaled and the gradient; in, the
 * prediction (img + base, base may be NULL: 0), what is wanted and the weights (may be NULL: 1). */
struct ct_loss_row {
	float *x, *y, *g;
	const float *img, *base, *want, *weight;
};

/* x = scale (img + base), y = scale want, g = step weight sign(x - y); returns the sum of
 * weight |x - y|. */
CT_SIMD_DECLARE(double, ct_loss_row_l1,
	(const struct ct_loss_row *row, size_t columns, float scale, float step));
/* n differences of neighbours b - a (ab, bb: what is to be added to them, or NULL): their signs
 * times w go to db and from da, which may overlap or be NULL; returns the sum of their sizes. */
CT_SIMD_DECLARE(double, ct_loss_row_tv,
	(float *da, float *db, const float *a, const float *b, const float *ab, const float *bb,
		size_t n, float w));

#endif
