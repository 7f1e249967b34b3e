/* rdn.h: the residual dense network (Zhang, Tian, Kong, Zhong, Fu: Residual dense network for image
 * super-resolution, CVPR 2018).
 *
 * Two 3x3 convolutions; `blocks` residual dense blocks of `layers` 3x3 convolutions with ReLU, each
 * of which sees all before it in the block and adds `growth` channels, then 1x1 to `features` and
 * the block's input; 1x1 and 3x3 of all blocks' results, and the result of the first convolution;
 * for every prime of the factor 3x3 and a pixel shuffle; 3x3 to the picture. Published: 16, 8, 64,
 * 64.
 *
 * Names of tensors are those of the PyTorch programs of its users (SFENet1, RDBs.0.convs.0.conv.0,
 * UPNet.0), from memory; no published checkpoint was read.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_RDN_H
#define CT_NN_RDN_H
#include "nn/build.h"

/* The image of the result; image 0 is the input. */
size_t ct_rdn_build(struct ct_build *b);
/* The architecture of such tensors; false if they are of another network. */
bool ct_rdn_of(struct ct_unet_arch *a, const struct ct_tensors *w);

#endif
