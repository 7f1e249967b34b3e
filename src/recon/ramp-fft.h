/* ramp-fft.h: the discrete Fourier transform of CT_RAMP_ROWS detector rows at once, for ramp.c.
 *
 * x[n][CT_RAMP_ROWS]: point k of eight complex rows, first their real parts, which are rows 0 to
 * 7 of the detector, then the imaginary parts, rows 8 to 15. n is a power of two, at least 4;
 * tw[n/2][2] the cosine and sine of -2 pi k/n. Frequencies are in bit-reversed order. The same
 * arithmetic, operation by operation, at every level. Pure kernels (core/simd.h). */
#ifndef CT_RECON_RAMP_FFT_H
#define CT_RECON_RAMP_FFT_H
#include "core/simd.h"
#include "recon/ramp.h"

/* x becomes its transform. */
CT_SIMD_DECLARE(void, ct_ramp_fft_forward, (size_t n, double *restrict x, const double *tw));
/* x becomes n times its convolution with the row whose transform is response[n], which is real. */
CT_SIMD_DECLARE(void, ct_ramp_fft_filter,
	(size_t n, double *restrict x, const double *restrict response, const double *tw));
/* Point at + c of row r is in[r*count + c] times weight[r*count + c], the others 0. */
CT_SIMD_DECLARE(void, ct_ramp_fft_load,
	(size_t n, double *restrict x, const float *restrict in, const float *restrict weight,
		size_t rows, size_t at, size_t count));
/* out[c*pitch + r]: point c of row r, of w points. */
CT_SIMD_DECLARE(void, ct_ramp_fft_store,
	(size_t w, float *restrict out, size_t pitch, const double *restrict x, size_t rows));

#endif
