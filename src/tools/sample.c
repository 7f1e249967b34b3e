/* sample.c: see sample.h. */
#include "config.h"
#include "tools/sample.h"

#include <math.h>

void sample_index(double ijk[static 3], const struct ct_vol *v, const double world[static 3])
{
	double mm[3];

	ct_vol_spacing(v, mm);
	for (int j = 0; j < 3; j++) {
		ijk[j] = 0;
		for (int a = 0; a < 3; a++)
			ijk[j] += v->affine[a][j] * (world[a] - v->affine[a][3]) / (mm[j] * mm[j]);
	}
}

double sample_linear(const struct ct_vol *v, const double ijk[static 3])
{
	const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};
	size_t at = 0, next[3];
	double t[3], sum = 0;

	for (int j = 0; j < 3; j++) {
		const double last = (double)v->n[j] - 1, x = fmin(fmax(ijk[j], 0), last);
		const double k = fmin(floor(x), fmax(last - 1, 0));

		if (!(ijk[j] >= ct_cell_index(0) - 1e-6 &&
			    ijk[j] <= ct_cell_index(last + 1) + 1e-6))
			return (double)NAN;
		t[j] = x - k;
		at += (size_t)k * stride[j];
		next[j] = v->n[j] > 1 ? stride[j] : 0;
	}
	for (int c = 0; c < 8; c++) {
		size_t p = at;
		double w = 1;

		for (int j = 0; j < 3; j++) {
			p += c >> j & 1 ? next[j] : 0;
			w *= c >> j & 1 ? t[j] : 1 - t[j];
		}
		if (w > 0) /* one that is not a number counts only where it matters */
			sum += w * (double)v->data[p];
	}
	return sum;
}
