/* cosine.h: products with a basis of even and odd functions, at half the cost of a dense product.
 *
 * The rows of V (m,n), n samples long, are alternately symmetric and antisymmetric about the
 * middle, as cosines are: V[k][n-1-j] = (-1)^k V[k][j]. So V x needs only the sums and the
 * differences of the two halves of x. Coefficients are kept in the order 0, 2, 4 ... 1, 3, 5 ...,
 * in a row the odd ones from a multiple of CT_DENSE_WIDTH on, with zeros between. Float;
 * thread-safe.
 */
#ifndef CT_RESOLUTION_COSINE_H
#define CT_RESOLUTION_COSINE_H
#include "core/err.h"
#include "resolution/dense.h"

struct ct_basis {
	size_t n, m, half;   /* half: (n+1)/2 */
	size_t count[2];     /* even and odd functions */
	size_t odd, row;     /* where the odd ones begin in a row of coefficients; its length */
	float *v[2], *vt[2]; /* (count, half) and (half, count), rows padded; one block at v[0] */
};

/* From v (m,n). Allocates *b, which must be zero. CT_ENOMEM, CT_EINPUT for absurd sizes. */
int ct_basis_alloc(struct ct_basis *b, const double *v, size_t m, size_t n, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_basis_free(struct ct_basis *b);
/* Place of coefficient k in a column of m, and in a row of b->row. */
size_t ct_basis_place(const struct ct_basis *b, size_t k);
size_t ct_basis_row_place(const struct ct_basis *b, size_t k);

/* c (m,w; ldc) = V x (n,w; ldx); x is destroyed. Rows readable to whole blocks. */
void ct_basis_analyse(
	const struct ct_basis *b, float *c, size_t ldc, float *x, size_t ldx, size_t w);
/* x (n,w; ldx) = V^T c (m,w; ldc). */
void ct_basis_synthesise(
	const struct ct_basis *b, float *x, size_t ldx, const float *c, size_t ldc, size_t w);

/* Floats of scratch of the next two. */
size_t ct_basis_scratch(const struct ct_basis *b);
/* c (h, b->row) = x (h,n) V^T: along rows. */
void ct_basis_analyse_rows(
	const struct ct_basis *b, float *c, const float *x, size_t h, float *scratch);
/* out (h,n) = x + c (h, b->row) V; out may be x. */
void ct_basis_synthesise_rows(const struct ct_basis *b, float *out, const float *x, const float *c,
	size_t h, float *scratch);

#endif
