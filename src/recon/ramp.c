/* ramp.c: see ramp.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/ramp.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* f in cycles a sample of the cutoff. */
static double window_at(enum ct_ramp_kind kind, double f)
{
	if (f > 0.5 && kind != CT_RAMP_NONE)
		return 0;
	switch (kind) {
	case CT_RAMP_SHEPP_LOGAN: return f == 0 ? 1 : sin(M_PI * f) / (M_PI * f);
	case CT_RAMP_COSINE: return cos(M_PI * f);
	case CT_RAMP_HAMMING: return 0.54 + 0.46 * cos(2 * M_PI * f);
	case CT_RAMP_HANN: return 0.5 + 0.5 * cos(2 * M_PI * f);
	case CT_RAMP_RAM_LAK:
	case CT_RAMP_NONE: break;
	}
	return 1;
}

/* The ramp's samples through the transform, times the window. x: scratch. */
static void respond(struct ct_ramp *f, enum ct_ramp_kind kind, double cutoff, double *x)
{
	size_t n = f->n;

	memset(x, 0, 4 * n * sizeof *x);
	x[0] = kind == CT_RAMP_NONE ? 1 : 0.25;
	for (size_t m = 1; m <= n / 2 && kind != CT_RAMP_NONE; m += 2) {
		double h = -1 / (M_PI * M_PI * (double)m * (double)m);

		x[m] = h;
		x[n - m] = h;
	}
	CT_SIMD(ct_fourier_apply)(&f->fourier, 1, x, x + n, x + 2 * n);
	for (size_t j = 0; j < n; j++) {
		double cycles = (double)(j <= n / 2 ? j : n - j) / (double)n;

		f->response[j] = x[j] * window_at(kind, cycles / cutoff) / (double)n;
	}
}

int ct_ramp_alloc(
	struct ct_ramp *f, enum ct_ramp_kind kind, double cutoff, size_t w, struct ct_err *e)
{
	double *x = NULL;

	if (!(cutoff > 0 && cutoff <= 1))
		return ct_fail(
			e, CT_EINPUT, "a filter cut off at %g of the Nyquist frequency", cutoff);
	if (w < 1 || w > (size_t)1 << 24)
		return ct_fail(e, CT_EINPUT, "a detector row of %zu pixels cannot be filtered", w);
	f->w = w;
	for (f->n = 4; f->n < 2 * w;)
		f->n *= 2;
	if (ct_alloc(&f->response, f->n, sizeof *f->response, e) ||
		ct_fourier_plan(&f->fourier, f->n, e) || ct_alloc(&x, f->n, 4 * sizeof *x, e)) {
		ct_ramp_free(f);
		return -1;
	}
	respond(f, kind, cutoff, x);
	free(x);
	return 0;
}

void ct_ramp_free(struct ct_ramp *f)
{
	free(f->response);
	ct_fourier_free(&f->fourier);
	*f = (struct ct_ramp){0};
}

size_t ct_ramp_scratch(const struct ct_ramp *f)
{
	return 2 * f->n * CT_RAMP_ROWS;
}
