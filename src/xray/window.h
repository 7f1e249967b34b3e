/* window.h: between HU and the density that is projected.
 *
 *   density = clamp((HU - LO) / (HI - LO), 0, 1)      HU = LO + density (HI - LO)
 *
 * LO < HI in HU. Computed in double, rounded once. dst may be src. Pure; thread-safe.
 */
#ifndef CT_XRAY_WINDOW_H
#define CT_XRAY_WINDOW_H
#include <stddef.h>

void ct_window_density(size_t n, float *dst, const float *src, const double window[static 2]);
/* The same without the clamp: overshoots of a volume that was in the window before its resolution
 * was reduced are densities below 0 and above 1. */
void ct_window_density_open(size_t n, float *dst, const float *src, const double window[static 2]);
void ct_window_hu(size_t n, float *dst, const float *src, const double window[static 2]);

#endif
