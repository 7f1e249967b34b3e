/* footprint-vec.h: footprint-impl.h for eight Gaussians. */
#ifndef CT_GS_FOOT_WIDE_H
#define CT_GS_FOOT_WIDE_H
#include "gs/splat.h"
#include "gs/wide.h"

struct vec_gaussian {
	ct_wide p[3], a[3][3], s[3], rho;
};

struct vec_footprint {
	ct_wide m[2], cov[3], cond, slope, mu, j[2][3], row[2][3], delta[3], t[3], z, dist;
};

struct vec_grad {
	ct_wide rho, p[3], shape[6], m[2];
};

#define NUM ct_wide
#define MASK ct_wide_mask
#define PICK ct_wide_pick
#define SQRT ct_wide_sqrt
#define BLOB struct vec_gaussian
#define FOOT struct vec_footprint
#define FGRAD struct vec_grad
#define FN(name) wide_##name
#include "gs/footprint-impl.h"

/* b[0, n), n <= 8; lanes beyond repeat the last. */
CT_WIDE_INLINE void wide_gaussian_load(
	struct vec_gaussian *o, const struct ct_gaussian *b, size_t n)
{
	for (size_t l = 0; l < CT_WIDE_LANES; l++) {
		const struct ct_gaussian *x = b + (l < n ? l : n - 1);

		for (int k = 0; k < 3; k++) {
			o->p[k][l] = x->p[k];
			o->s[k][l] = x->s[k];
			for (int m = 0; m < 3; m++)
				o->a[k][m][l] = x->a[k][m];
		}
		o->rho[l] = x->rho;
	}
}

#endif
