/* crop.c: see crop.h. */
#include "config.h"
#include "resolution/crop.h"

#include <math.h>
#include <string.h>

void ct_crop_body(double c[3], const float *in, const size_t n[static 3], float above)
{
	double sum[3] = {0}, count = 0;

	for (size_t k = 0; k < n[2]; k++) {
		for (size_t j = 0; j < n[1]; j++) {
			const float *row = in + (k * n[1] + j) * n[0];
			size_t hits = 0, first = 0;

			for (size_t i = 0; i < n[0]; i++) {
				hits += row[i] > above;
				first += row[i] > above ? i : 0;
			}
			count += (double)hits;
			sum[0] += (double)first;
			sum[1] += (double)(hits * j);
			sum[2] += (double)(hits * k);
		}
	}
	for (int d = 0; d < 3; d++)
		c[d] = count > 0 ? sum[d] / count : ((double)n[d] - 1) / 2;
}

ptrdiff_t ct_crop_start(size_t n, size_t m, double c)
{
	double s = floor(c - ((double)m - 1) / 2 + 0.5);

	if (m >= n)
		return -(ptrdiff_t)((m - n) / 2);
	return (ptrdiff_t)fmin(fmax(s, 0), (double)(n - m));
}

void ct_crop(float *restrict out, const size_t m[static 3], const float *restrict in,
	const size_t n[static 3], const ptrdiff_t start[static 3], float pad)
{
	for (size_t k = 0; k < m[2]; k++) {
		for (size_t j = 0; j < m[1]; j++) {
			const ptrdiff_t z = (ptrdiff_t)k + start[2], y = (ptrdiff_t)j + start[1];
			float *row = out + (k * m[1] + j) * m[0];

			for (size_t i = 0; i < m[0]; i++) {
				const ptrdiff_t x = (ptrdiff_t)i + start[0];

				row[i] = x < 0 || y < 0 || z < 0 || (size_t)x >= n[0] ||
							 (size_t)y >= n[1] || (size_t)z >= n[2]
						 ? pad
						 : in[((size_t)z * n[1] + (size_t)y) * n[0] +
							   (size_t)x];
			}
		}
	}
}

void ct_crop_affine(double a[3][4], const double start[static 3])
{
	for (int r = 0; r < 3; r++)
		for (int d = 0; d < 3; d++)
			a[r][3] += a[r][d] * start[d];
}
