/* omni.h: Omni-SR (Wang, Chen, Ni, Tian, Wang: Omni aggregation networks for lightweight image
 * super-resolution, CVPR 2023).
 *
 * A 3x3 convolution to the features; `blocks` groups; 3x3, plus what the first one gave; 3x3 and a
 * pixel shuffle. A group is `layers` blocks, 1x1, plus its input, and an attention over space (ESA,
 * of a quarter of the features, 16 at least). A block is
 *
 *   local convolution: 1x1, GELU, 3x3 of every channel, GELU, squeeze and excite, 1x1
 *   attention of pixels in windows, gated convolution
 *   attention of channels in windows, gated convolution
 *   attention of pixels of a grid of as many pixels as a window, gated convolution
 *   attention of channels of the grids of pixels a window apart, gated convolution
 *
 * each plus its input, and all but the first after a normalisation over channels. Published: 5
 * groups, 1 block, 64 features, 4 heads, windows of 8.
 *
 * Names and shapes of tensors are those of the authors' PyTorch program, from memory; no published
 * checkpoint was read.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_OMNI_H
#define CT_NN_OMNI_H
#include "nn/build.h"

/* The image of the result; image 0 is the input, of multiples of the window. */
size_t ct_omni_build(struct ct_build *b);
/* The architecture of such tensors; false if they are of another network. */
bool ct_omni_of(struct ct_unet_arch *a, const struct ct_tensors *w);

#endif
