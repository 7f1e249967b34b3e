/* softmax.c: see softmax.h. */
#include "config.h"
#include "unet/softmax.h"
#include "core/vec-exp.h"

enum { LANES = 16 }; /* partial sums */

void CT_SIMD_HERE(ct_softmax)(size_t rows, size_t n, float *w)
{
	for (size_t i = 0; i < rows; i++) {
		float *row = w + i * n, top = row[0], part[LANES], scale;
		ct_f32 parts[LANES / CT_F32_LANES] = {{0}};
		double sum = 0;
		size_t j = 0;

		for (size_t k = 1; k < n; k++)
			top = row[k] > top ? row[k] : top;
		for (; j + LANES <= n; j += LANES)
			for (size_t q = 0; q < LANES / CT_F32_LANES; q++) {
				float *at = row + j + q * CT_F32_LANES;
				const ct_f32 v = ct_f32_exp(ct_f32_load(at) - top);

				ct_f32_store(at, v);
				parts[q] += v;
			}
		for (; j < n; j++) {
			row[j] = ct_expf(row[j] - top);
			sum += (double)row[j];
		}
		memcpy(part, parts, sizeof part);
		for (size_t l = 0; l < LANES; l++)
			sum += (double)part[l];
		scale = (float)(1.0 / sum);
		for (j = 0; j < n; j++)
			row[j] *= scale;
	}
}

void CT_SIMD_HERE(ct_softmax_back)(
	size_t rows, size_t n, float *restrict dw, const float *restrict w)
{
	for (size_t i = 0; i < rows; i++) {
		float part[LANES] = {0}, mean;
		double sum = 0;
		size_t j = 0;

		for (; j + LANES <= n; j += LANES)
			for (size_t l = 0; l < LANES; l++)
				part[l] += w[i * n + j + l] * dw[i * n + j + l];
		for (; j < n; j++)
			sum += (double)(w[i * n + j] * dw[i * n + j]);
		for (size_t l = 0; l < LANES; l++)
			sum += (double)part[l];
		mean = (float)sum;
		for (j = 0; j < n; j++)
			dw[i * n + j] = w[i * n + j] * (dw[i * n + j] - mean);
	}
}
