/* render.h: from the outputs of a field at samples to the value of a voxel, and back.
 *
 * A field gives density s and colour c, y[n][2], at samples t[n], ascending. With d_i = t[i + 1] -
 * t[i], the last up to `end`,
 *
 *   value = sum w_i c_i     w_i = g_i (1 - exp(-a_i)) exp(-(a_0 + ... + a_{i-1}))
 *   a_i = max(s_i, 0) d_i
 *
 * and g_i = 1 for a line (NeRF), 4 pi r_i^2 for a cube, r the distance from its centre (CuNeRF's
 * isotropic rendering). t is in half edges of the voxel, as in samples.h, and r in the unit in
 * which the sphere that touches the faces has the area 1, so that 4 pi r^2 = t^2: papers leave both
 * open, and values far above 1 drive the density to where nothing is learnt. Sums in double. Pure;
 * thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_RENDER_H
#define CT_FIELD_RENDER_H
#include <stdbool.h>
#include <stddef.h>

/* The value; w[n] are the weights. */
double ct_render(size_t n, float *w, const float *t, double end, bool cube, const float *y);
/* dy[n][2] = dvalue times the derivative of the value; w as ct_render left it. */
void ct_render_back(size_t n, float *dy, const float *w, const float *t, double end, bool cube,
	const float *y, double dvalue);

#endif
