/* bilinear.h: a view on a finer grid without any prior: the start picture of CT_SAMPLER_NONE. */
#ifndef CT_DIFFUSION_BILINEAR_H
#define CT_DIFFUSION_BILINEAR_H
#include <stddef.h>

/* x[s h][s w] from y[h][w], linear along both axes between the centres of pixels that are cells (s
 * x s fine ones in a coarse one), constant beyond the outermost. */
void ct_bilinear(size_t h, size_t w, size_t s, float *restrict x, const float *restrict y);

#endif
