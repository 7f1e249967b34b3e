/* window.c: see window.h. */
#include "config.h"
#include "xray/window.h"

void ct_window_density(size_t n, float *dst, const float *src, const double window[static 2])
{
	double lo = window[0], width = window[1] - window[0];

	for (size_t i = 0; i < n; i++) {
		double d = ((double)src[i] - lo) / width;

		d = d > 0 ? d : 0;
		dst[i] = (float)(d < 1 ? d : 1);
	}
}

void ct_window_density_open(size_t n, float *dst, const float *src, const double window[static 2])
{
	double lo = window[0], width = window[1] - window[0];

	for (size_t i = 0; i < n; i++)
		dst[i] = (float)(((double)src[i] - lo) / width);
}

void ct_window_hu(size_t n, float *dst, const float *src, const double window[static 2])
{
	double lo = window[0], width = window[1] - window[0];

	for (size_t i = 0; i < n; i++)
		dst[i] = (float)(lo + (double)src[i] * width);
}
