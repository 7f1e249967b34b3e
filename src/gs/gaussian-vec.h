/* gaussian-vec.h: CT_F64_LANES Gaussians at a time, in double, for kernels (core/simd.h). */
#ifndef CT_GS_GAUSSIAN_VEC_H
#define CT_GS_GAUSSIAN_VEC_H
#include "core/vec.h"
#include "gs/gaussian.h"

struct vec_gaussian {
	ct_f64 p[3], a[3][3], s[3], rho;
};

#define NUM ct_f64
#define MASK ct_i64
#define PICK ct_f64_pick
#define SQRT ct_f64_sqrt
#define FN(name) vec_##name
#include "gs/gaussian-formulas.h"

/* Floats x[0, n); if n is less than a vector, the last once more for each that is missing. */
CT_INLINE ct_f64 vec_widen(const float *x, size_t n)
{
	float part[CT_F64_LANES];

	if (n >= CT_F64_LANES)
		return ct_f64_widen(x);
	for (size_t l = 0; l < CT_F64_LANES; l++)
		part[l] = x[l < n ? l : n - 1];
	return ct_f64_widen(part);
}

CT_INLINE void vec_narrow(float *x, size_t n, ct_f64 v)
{
	float part[CT_F64_LANES];

	if (n >= CT_F64_LANES) {
		ct_f64_narrow(x, v);
		return;
	}
	ct_f64_narrow(part, v);
	memcpy(x, part, n * sizeof *x);
}

/* b[0, n), likewise. */
CT_INLINE void vec_gaussian_load(struct vec_gaussian *o, const struct ct_gaussian *b, size_t n)
{
	enum { STRIDE = sizeof *b / sizeof(double) };
	struct ct_gaussian part[CT_F64_LANES];

	if (n < CT_F64_LANES) {
		for (size_t l = 0; l < CT_F64_LANES; l++)
			part[l] = b[l < n ? l : n - 1];
		b = part;
	}
	for (int k = 0; k < 3; k++) {
		o->p[k] = ct_f64_gather(&b->p[k], STRIDE);
		o->s[k] = ct_f64_gather(&b->s[k], STRIDE);
		for (int m = 0; m < 3; m++)
			o->a[k][m] = ct_f64_gather(&b->a[k][m], STRIDE);
	}
	o->rho = ct_f64_gather(&b->rho, STRIDE);
}

#endif
