/* ms-ssim.h: structural similarity at several resolutions (Wang, Simoncelli and Bovik, Asilomar
 * 2003), and its gradient, as pytorch_msssim has it.
 *
 *   MS = prod_{l < L-1} cs_l^w_l * S_{L-1}^w_{L-1}     cs = (2 sxy + C2) / (sx^2 + sy^2 + C2)
 *
 * cs_l and S_l (ssim.h) are means over the places where the 11x11 Gaussian of sigma 1.5 lies whole
 * in the image, biased, 0 if below; C1 = .01^2 and C2 = .03^2, of images in [0, 1]. From one
 * resolution to the next pixels become means of 2x2; a side that is odd begins with half a cell of
 * zeros. Five resolutions weigh .0448, .2856, .3001, .2363, .1333. An image of a side of at most
 * 160, which pytorch_msssim refuses, has as many as leave more than ten pixels, and their weights
 * are divided by their sum. In double. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_MS_SSIM_H
#define CT_QUALITY_MS_SSIM_H
#include "core/err.h"
#include "core/par.h"

#include <stddef.h>

enum { CT_MS_SSIM_MOST = 5 };

struct ct_ms_ssim_level {
	size_t h, w;
	double weight, value, *x, *y; /* images; they become the gradient of `value`, and waste */
};

struct ct_ms_ssim {
	size_t n; /* resolutions */
	struct ct_ms_ssim_level level[CT_MS_SSIM_MOST];
	double *all;                       /* owned: images, and maps of a resolution */
	double *across[5], *map[3], *part; /* of all rows; of the places; of each row of places */
};

/* For images of h rows of w. CT_EGEOM below 11 pixels, CT_ENOMEM. Free it in any case. */
int ct_ms_ssim_alloc(struct ct_ms_ssim *s, size_t h, size_t w, struct ct_err *e);
void ct_ms_ssim_free(struct ct_ms_ssim *s);
/* MS of x and y; its gradient by x is left in s->level[0].x. The same bytes for any number of
 * threads. */
double ct_ms_ssim_gradient(
	struct ct_ms_ssim *s, const float *x, const float *y, struct ct_par *par);

#endif
