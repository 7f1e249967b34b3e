/* gaussian-kernels.c: see gaussian-kernels.h. */
#include "config.h"
#include "core/vec-exp.h"
#include "gs/gaussian-kernels.h"
#include "gs/gaussian-vec.h"

/* b[first, first + n), n at most a vector. */
CT_INLINE void some(struct ct_gaussian *b, const struct ct_gauss *g, size_t first, size_t n)
{
	ct_f64 q[4], a[3][3], s[3];

	for (int k = 0; k < 4; k++)
		q[k] = vec_widen(g->rot[k] + first, n);
	for (int k = 0; k < 3; k++)
		s[k] = ct_f64_exp(vec_widen(g->scale[k] + first, n));
	vec_rotation(a, q);
	for (size_t l = 0; l < n; l++) {
		struct ct_gaussian *o = b + first + l;

		for (int k = 0; k < 3; k++) {
			o->p[k] = (double)g->pos[k][first + l];
			o->s[k] = s[k][l];
			for (int m = 0; m < 3; m++)
				o->a[k][m] = a[k][m][l];
		}
	}
}

void CT_SIMD_HERE(ct_gaussian_kernels_resolve)(
	struct ct_gaussian *b, const struct ct_gauss *g, size_t first, size_t end)
{
	for (size_t i = first; i < end; i += CT_F64_LANES)
		some(b, g, i, end - i < CT_F64_LANES ? end - i : CT_F64_LANES);
}
