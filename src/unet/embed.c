/* embed.c: see embed.h. */
#include "config.h"
#include "unet/embed.h"

#include <math.h>

void ct_embed(size_t dim, float *emb, double t)
{
	const size_t half = dim / 2;

	for (size_t i = 0; i < half; i++) {
		double f = exp(-log(10000.0) * (double)i / (double)half);

		emb[i] = (float)cos(t * f);
		emb[half + i] = (float)sin(t * f);
	}
	if (dim % 2)
		emb[dim - 1] = 0.0f;
}
