/* ramp.h: the ramp filter of filtered back-projection, along detector rows.
 *
 * The ramp |f| band-limited to half a cycle a sample has the samples (Kak and Slaney, Principles of
 * Computerized Tomographic Imaging, 1988, eq. 3.61), for unit pitch,
 *
 *   h[0] = 1/4,  h[m] = -1/(pi m)^2 for odd m,  0 for even m
 *
 * and the response is their transform: sampling |f| itself instead would be a circular convolution
 * and shift the mean of the picture. For rows of w samples it is computed with n = 2^k >= 2w
 * points, so nothing wraps around. A window multiplies the response at f = j/(n cutoff) cycles a
 * sample, and is 0 where |f| > 1/2:
 *
 *   ram-lak 1   shepp-logan sinc(f)   cosine cos(pi f)   hamming .54 + .46 cos(2 pi f)
 *   hann (1 + cos(2 pi f))/2          none: no filter at all, response 1 at any frequency
 *
 * The response is real and even, so two real rows go through as one complex row (core/fourier.h).
 * Doubles inside.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_RAMP_H
#define CT_RECON_RAMP_H
#include "core/fourier.h"
#include "core/words.h"

#include <stddef.h>

#define CT_RAMP_LIST(X)                                                                            \
	X(CT_RAMP_RAM_LAK, "ram-lak")                                                              \
	X(CT_RAMP_SHEPP_LOGAN, "shepp-logan")                                                      \
	X(CT_RAMP_COSINE, "cosine")                                                                \
	X(CT_RAMP_HAMMING, "hamming")                                                              \
	X(CT_RAMP_HANN, "hann")                                                                    \
	X(CT_RAMP_NONE, "none")
enum ct_ramp_kind { CT_RAMP_LIST(CT_WORD_VALUE) };

struct ct_ramp {
	size_t w, n;
	double *response; /* owned, [n], divided by n */
	struct ct_fourier fourier;
};

enum { CT_RAMP_ROWS = 16 }; /* rows that go through together */

/* For rows of w samples, 1 <= w <= 2^24; cutoff in (0, 1], of the Nyquist frequency. *f must be
 * zero. CT_EINPUT, CT_ENOMEM. */
int ct_ramp_alloc(
	struct ct_ramp *f, enum ct_ramp_kind kind, double cutoff, size_t w, struct ct_err *e);
void ct_ramp_free(struct ct_ramp *f);
/* Doubles of scratch for ct_ramp_rows, 64-byte aligned. */
size_t ct_ramp_scratch(const struct ct_ramp *f);
/* out[col*pitch + row] = (h * in[row])[col] for `rows` <= CT_RAMP_ROWS rows: filtered and
 * transposed. Of the w samples of a row the `count` from `at` on are in[row*count + k] times
 * weight[row*count + k], the others zero; at + count <= w. Thread-safe with scratch of its own. */
CT_SIMD_DECLARE(void, ct_ramp_rows,
	(const struct ct_ramp *f, size_t rows, float *restrict out, size_t pitch,
		const float *restrict in, const float *restrict weight, size_t at, size_t count,
		double *restrict scratch));

#endif
