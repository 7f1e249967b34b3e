/* banded.h: a table along one axis (separable.h) and its transpose, in float, for planes that are
 * in the cache: a few weights a row, whatever the length of the axis.
 *
 * D (m,n) makes m samples of n. Kernels allocate nothing.
 */
#ifndef CT_RESOLUTION_BANDED_H
#define CT_RESOLUTION_BANDED_H
#include "core/simd.h"
#include "resolution/separable.h"

struct ct_banded {
	struct ct_banded_rows {
		size_t n, taps; /* rows, and weights of each, which apply from first[] on */
		size_t *first;
		float *w; /* (n,taps) */
	} down, up;       /* D, D^T */
};

/* From the table of D. Allocates *b, which must be zero. CT_ENOMEM. */
int ct_banded_alloc(struct ct_banded *b, const struct ct_taps *d, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_banded_free(struct ct_banded *b);
/* Floats of scratch of the kernels that turn. */
size_t ct_banded_scratch(const struct ct_banded *b);

/* out (t->n,w; ldo) = add (alike; NULL is 0) + t in (.,w; ldi); out may be add, but not in. */
CT_SIMD_DECLARE(void, ct_banded_across,
	(const struct ct_banded_rows *t, float *out, size_t ldo, const float *add, const float *in,
		size_t ldi, size_t w));
/* out (m,w; ldo) = D in, whose w rows (ldi) of n samples are the columns. */
CT_SIMD_DECLARE(void, ct_banded_down,
	(const struct ct_banded *b, float *out, size_t ldo, const float *in, size_t ldi, size_t w,
		float *scratch));
/* out, w rows (ldo) of n samples, = D^T in (m,w; ldi), turned. */
CT_SIMD_DECLARE(void, ct_banded_up,
	(const struct ct_banded *b, float *out, size_t ldo, const float *in, size_t ldi, size_t w,
		float *scratch));

#endif
