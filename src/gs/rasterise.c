/* rasterise.c: see rasterise.h. */
#include "config.h"
#include "gs/rasterise.h"

#include <math.h>

size_t ct_rasterise_pitch(size_t w)
{
	const size_t b = CT_RASTERISE_PADDING;

	return (w + b - 1) / b * b + b;
}

void ct_rasterise_prepare(struct ct_pixel_gaussian *d)
{
	double s = (double)d->slope, kx = (double)d->kx, ky = (double)d->ky;

	d->bend = (float)exp(-2 * (kx * s * s + ky));
	d->y_right = (float)(s * sqrt((double)d->cut * kx / (ky * (ky + kx * s * s))));
}
