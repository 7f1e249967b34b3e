/* fourier.h: the discrete Fourier transform of any length, of many lines at once, in double.
 *
 *   X_k = sum_t x_t exp(-2 pi i k t / n)
 *
 * by Stockham's ordering for the prime factors p of n: time goes as n times their sum, so that 512
 * is quick and a prime is as slow as direct sums. Real and imaginary parts change places in both
 * directions for the inverse, times n: apply(f, w, im, re, work). The same bytes at every level
 * (core/simd.h). Thread-safe with work of its own.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_FOURIER_H
#define CT_CORE_FOURIER_H
#include "core/err.h"
#include "core/simd.h"

#include <stddef.h>

enum { CT_FOURIER_FACTORS = 64 };

struct ct_fourier {
	size_t n, factors;
	size_t factor[CT_FOURIER_FACTORS];
	double *root; /* cos, then -sin, of 2 pi k/n; owned */
};

/* For lines of n >= 1. Allocates. CT_ENOMEM. */
int ct_fourier_plan(struct ct_fourier *f, size_t n, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_fourier_free(struct ct_fourier *f);
/* The transforms of w lines, in place: sample t of line l is re[t w + l] + i im[t w + l]. work
 * holds 2 n w doubles. Pure. */
CT_SIMD_DECLARE(void, ct_fourier_apply,
	(const struct ct_fourier *f, size_t w, double *restrict re, double *restrict im,
		double *restrict work));

#endif
