/* loss-image.h: the loss of a projection, L1 and SSIM, and its gradient.
 *
 *   l1 mean|x - y| + ssim (1 - SSIM(x, y))
 *
 * x is the predicted and y the wanted projection, both multiplied by `scale`, which brings line
 * integrals to the order of one as the constants of SSIM suppose: 2 / (largest extent of the
 * volume in mm), the normalised scene of R2-Gaussian. The paper (section NAB-GS) has two L1
 * terms, of projections and of residual projections. As x is the base's projection plus the
 * residual's, |x - y| = |x_res - y_res|: they are one term of weight 2.
 * Pixels may have weights, of which `mean_weight` is the mean over all views: mean|x - y| is then
 * mean(w |x - y|) / mean_weight, and SSIM the like of its map.
 */
#ifndef CT_GS_LOSS_IMAGE_H
#define CT_GS_LOSS_IMAGE_H
#include "core/err.h"
#include "core/par.h"
#include "gs/loss.h"
#include "quality/ssim.h"

#include <stddef.h>

/* Scratch for images h x w. */
struct ct_loss_image {
	size_t h, w;
	float *x, *y, *g;
	double *part; /* of every strip: L1, 1 - S */
	struct ct_ssim_rule rule;
};

int ct_loss_image_init(struct ct_loss_image *l, size_t h, size_t w, struct ct_err *e);
void ct_loss_image_free(struct ct_loss_image *l);
/* Sets t->l1, t->dssim, and dimg[h][pitch] = dL/dimg for img[h][pitch] in mm; base (may be NULL: 0)
 * and y h x w; so does weight (NULL: ones). Neither factor need be positive: a term of weight 0 is
 * not computed. Strips of rows in parallel, the same bytes for any number of threads. */
void ct_loss_image_gradient(struct ct_loss_image *l, struct ct_loss_terms *t, float *dimg,
	const float *img, size_t pitch, const float *base, const float *y, const float *weight,
	const struct ct_loss_weights *k, struct ct_par *par);

#endif
