/* crop.c: see crop.h. */
#include "config.h"
#include "resolution/crop.h"

#include <math.h>
#include <string.h>

void ct_crop_body(double c[3], const float *in, const size_t n[static 3], float above)
{
	double sum[3] = {0}, count = 0;

	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const double is = *in++ > above;

				count += is;
				sum[0] += is * (double)i;
				sum[1] += is * (double)j;
				sum[2] += is * (double)k;
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

int ct_crop(struct ct_vol *out, const struct ct_vol *in, const size_t n[static 3],
	const ptrdiff_t start[static 3], float pad, struct ct_err *e)
{
	const double first[3] = {(double)start[0], (double)start[1], (double)start[2]};
	float *to;

	if (ct_vol_alloc(out, n, e))
		return -1;
	memcpy(out->affine, in->affine, sizeof out->affine);
	ct_vol_shift_affine(out->affine, first);
	to = out->data;
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++) {
			/* what is before the beginning is beyond the end, too */
			const size_t z = k + (size_t)start[2], y = j + (size_t)start[1];
			const float *row = z < in->n[2] && y < in->n[1]
						   ? in->data + (z * in->n[1] + y) * in->n[0]
						   : NULL;

			for (size_t i = 0; i < n[0]; i++) {
				const size_t x = i + (size_t)start[0];

				*to++ = row && x < in->n[0] ? row[x] : pad;
			}
		}
	return 0;
}
