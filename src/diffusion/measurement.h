/* measurement.h: a measurement operator A, fine picture x (s h, s w) -> coarse picture y (h, w),
 * given by its singular value decomposition A = U^T S V. What a diffusion sampler needs of A is
 * here once for both kinds:
 *
 *   CT_MEASUREMENT_MEAN     s-by-s block mean (block-mean.h): U = I, S = 1/s, V = the normalised
 * blocks CT_MEASUREMENT_MATCHED  Gaussian and sinc decimation (matched.h): S[i,j] = g_i g_j / s
 *
 * Functions do not change the operator and are thread-safe; t is scratch of
 * ct_measurement_scratch() values.
 */
#ifndef CT_DIFFUSION_MEASUREMENT_H
#define CT_DIFFUSION_MEASUREMENT_H
#include "core/words.h"
#include "diffusion/matched.h"

#define CT_MEASUREMENT_LIST(X)                                                                     \
	X(CT_MEASUREMENT_MEAN, "mean")                                                             \
	X(CT_MEASUREMENT_MATCHED, "matched")
enum ct_measurement_kind { CT_MEASUREMENT_LIST(CT_WORD_VALUE) };

/* What a coarse pixel is of the fine ones under it: a ray through its centre, which is no function
 * of them, their mean, or they cut at its Nyquist frequency. */
#define CT_PIXEL_LIST(X)                                                                           \
	X(CT_PIXEL_POINT, "point")                                                                 \
	X(CT_PIXEL_MEAN, "mean")                                                                   \
	X(CT_PIXEL_SINC, "sinc")
enum ct_pixel { CT_PIXEL_LIST(CT_WORD_VALUE) };

/* The operator that makes such pixels; of a ray the mean, which is taken for it. */
static inline enum ct_measurement_kind ct_pixel_measures(enum ct_pixel pixel)
{
	return pixel == CT_PIXEL_SINC ? CT_MEASUREMENT_MATCHED : CT_MEASUREMENT_MEAN;
}

struct ct_measurement {
	enum ct_measurement_kind kind;
	size_t h, w, s, high, wide; /* s of a band 1 */
	struct ct_axis rows, cols;  /* matched only */
};

/* sigma: Gaussian of the matched kind, fine pixels. CT_EGEOM for a size that is refused. *op zero.
 */
int ct_measurement_alloc(struct ct_measurement *op, enum ct_measurement_kind kind, size_t h,
	size_t w, size_t s, double sigma, struct ct_err *e);
/* The h w lowest of the cosines of a picture (high, wide), h <= high, w <= wide: matched, without a
 * blur, and A^T A the projection on them. CT_EGEOM as above. */
int ct_measurement_band(
	struct ct_measurement *op, size_t h, size_t w, size_t high, size_t wide, struct ct_err *e);
void ct_measurement_free(struct ct_measurement *op);
size_t ct_measurement_scratch(const struct ct_measurement *op);
/* Singular value of coefficient (i, j); 0 where nothing is measured. */
double ct_measurement_singular(const struct ct_measurement *op, size_t i, size_t j);
/* c = V x, c (h, w) */
void ct_measurement_analyse(const struct ct_measurement *op, double *restrict c,
	const float *restrict x, double *restrict t);
/* x <- x + V^T c */
void ct_measurement_synth_add(const struct ct_measurement *op, float *restrict x,
	const double *restrict c, double *restrict t);
/* c = S+ U y: the coefficients of A+ y */
void ct_measurement_data(const struct ct_measurement *op, double *restrict c,
	const float *restrict y, double *restrict t);
/* y = A x */
void ct_measurement_forward(const struct ct_measurement *op, float *restrict y,
	const float *restrict x, double *restrict t);
/* x = A^T y */
void ct_measurement_adjoint(const struct ct_measurement *op, float *restrict x,
	const float *restrict y, double *restrict t);

#endif
