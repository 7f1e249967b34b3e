/* loss.h: the total loss that a fit minimises.
 *
 *   L = l1 mean|x - y| + ssim (1 - SSIM(x, y)) + tv TV + lr mean|D r - l|
 *
 * The first two terms are of a view (loss-image.h), the third of a block of the volume (loss-tv.h),
 * the last of the low-resolution CT (loss-lowres.h); loss-total.h brings them together.
 */
#ifndef CT_GS_LOSS_H
#define CT_GS_LOSS_H

struct ct_loss_weights {
	double l1, ssim, tv, lr;
	double scale;       /* 1/mm, of projections: loss-image.h */
	double mean_weight; /* 1 without weights */
};

/* Terms without their weights; total with. */
struct ct_loss_terms {
	double l1, dssim, tv, lr, total;
};

#endif
