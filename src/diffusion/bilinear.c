/* bilinear.c: see bilinear.h. */
#include "config.h"
#include "diffusion/bilinear.h"
#include "core/vol.h"

#include <math.h>

/* The two neighbours of fine pixel k in a line of n, and the weight of the second. */
static double neighbours(size_t k, size_t n, size_t s, size_t at[static 2])
{
	double index = ct_cell_index(ct_cell_centre((double)k) / (double)s),
	       within = fmin(fmax(index, 0.0), (double)(n - 1));

	at[0] = (size_t)within;
	at[1] = at[0] + 1 < n ? at[0] + 1 : at[0];
	return within - (double)at[0];
}

void ct_bilinear(size_t h, size_t w, size_t s, float *restrict x, const float *restrict y)
{
	size_t row[2], col[2];

	for (size_t i = 0; i < h * s; i++) {
		double b = neighbours(i, h, s, row);

		for (size_t j = 0; j < w * s; j++) {
			double a = neighbours(j, w, s, col);
			const float *up = y + row[0] * w, *down = y + row[1] * w;

			x[i * w * s + j] = (float)((1 - b) * ((1 - a) * (double)up[col[0]] +
								     a * (double)up[col[1]]) +
						   b * ((1 - a) * (double)down[col[0]] +
							       a * (double)down[col[1]]));
		}
	}
}
