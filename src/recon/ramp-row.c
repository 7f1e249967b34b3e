/* ramp-row.c: rows of ramp.h through the discrete Fourier transform.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/ramp.h"
#include "core/vec.h"

#include <string.h>

enum { ROWS = CT_RAMP_ROWS, LINES = ROWS / 2 /* complex ones */ };

/* Rows [0, rows) <= LINES of a plane of lines, and back. */
CT_INLINE void load_rows(double *restrict x, const float *restrict in, const float *restrict weight,
	size_t rows, size_t count)
{
	for (size_t c = 0; c < count; c++)
		for (size_t r = 0; r < rows; r++)
			x[c * LINES + r] =
				(double)in[r * count + c] * (double)weight[r * count + c];
}

CT_INLINE void store_rows(
	size_t w, float *restrict out, size_t pitch, const double *restrict x, const size_t rows)
{
	for (size_t c = 0; c < w; c++)
		for (size_t r = 0; r < rows; r++)
			out[c * pitch + r] = (float)x[c * LINES + r];
}

void CT_SIMD_HERE(ct_ramp_rows)(const struct ct_ramp *f, size_t rows, float *restrict out,
	size_t pitch, const float *restrict in, const float *restrict weight, size_t at,
	size_t count, double *restrict scratch)
{
	const double *restrict response = f->response;
	const size_t n = f->n * LINES;
	/* rows 0 to 7 are real parts, the others imaginary ones */
	double *plane[2] = {scratch, scratch + n};

	memset(scratch, 0, 2 * n * sizeof *scratch);
	for (size_t p = 0; p < 2; p++) {
		const size_t first = p * LINES, left = rows > first ? rows - first : 0;
		const size_t some = left < LINES ? left : LINES, from = first * count;

		if (some == LINES) /* a known length */
			load_rows(plane[p] + at * LINES, in + from, weight + from, LINES, count);
		else
			load_rows(plane[p] + at * LINES, in + from, weight + from, some, count);
	}
	CT_SIMD_HERE(ct_fourier_apply)(&f->fourier, LINES, plane[0], plane[1], scratch + 2 * n);
	for (size_t p = 0; p < 2; p++)
		for (size_t i = 0; i < f->n; i++)
			for (size_t l = 0; l < LINES; l++)
				plane[p][i * LINES + l] *= response[i];
	CT_SIMD_HERE(ct_fourier_apply)(&f->fourier, LINES, plane[1], plane[0], scratch + 2 * n);
	for (size_t p = 0; p < 2; p++) {
		const size_t first = p * LINES, left = rows > first ? rows - first : 0;
		const size_t some = left < LINES ? left : LINES;

		if (some == LINES)
			store_rows(f->w, out + first, pitch, plane[p], LINES);
		else
			store_rows(f->w, out + first, pitch, plane[p], some);
	}
}
