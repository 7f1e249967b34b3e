/* texture.h: how much of a CT is textured, before it is refined; what a prior will take. Pure.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_REFINE_TEXTURE_H
#define CT_REFINE_TEXTURE_H
#include "core/vol.h"

/* Cells of slices across the three axes that are textured once v is refined by `factor`, nearly:
 * those about which v, in a square of w x w cells of the slice, has a deviation of more than
 * CT_PATCH_FLAT. Of a large scan from some of them. */
double ct_texture_cells(const struct ct_vol *v, const double factor[3], size_t w);

#endif
