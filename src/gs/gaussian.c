/* gaussian.c: see gaussian.h. */
#include "config.h"
#include "gs/gaussian.h"
#include "gs/activation.h"
#include "gs/wide.h"

#include <math.h>

float *ct_gaussian_field(const struct ct_gauss *g, size_t k)
{
	return k < CT_GS_SCALE ? g->pos[k]
	       : k < CT_GS_ROT ? g->scale[k - CT_GS_SCALE]
	       : k < CT_GS_RAW ? g->rot[k - CT_GS_ROT]
			       : g->raw;
}

#define NUM double
#define MASK int
#define PICK(m, a, b) ((m) ? (a) : (b))
#define SQRT sqrt
#define FN(name) ref_##name
#include "gs/footprint-impl.h"
#undef NUM
#undef MASK
#undef PICK
#undef SQRT
#undef FN
#undef IMPL
#define NUM ct_wide
#define MASK ct_wide_mask
#define PICK ct_wide_pick
#define SQRT ct_wide_sqrt
#define FN(name) wide_##name
#include "gs/footprint-impl.h"

void ct_gaussian_make(struct ct_gaussian *b, const double p[static 3], const double ln_s[static 3],
	const double q[static 4], double rho)
{
	ref_rotation(b->a, q);
	for (int k = 0; k < 3; k++) {
		b->p[k] = p[k];
		b->s[k] = exp(ln_s[k]);
	}
	b->rho = rho;
}

void ct_gaussian_backward(double dln_s[static 3], double dq[static 4], const double n[static 6],
	const struct ct_gaussian *b, const double q[static 4])
{
	ref_gaussian_backward(dln_s, dq, n, b->s, q);
}

struct job {
	struct ct_gaussian *b;
	const struct ct_gauss *g;
};

/* b[first, first + n), n <= 8. */
CT_WIDE_INLINE void eight(struct ct_gaussian *b, const struct ct_gauss *g, size_t first, size_t n)
{
	ct_wide q[4], a[3][3], s[3];

	for (int k = 0; k < 4; k++)
		q[k] = ct_wide_load(g->rot[k] + first, n);
	for (int k = 0; k < 3; k++)
		s[k] = ct_wide_exp(ct_wide_load(g->scale[k] + first, n));
	wide_rotation(a, q);
	for (size_t l = 0; l < n; l++) {
		struct ct_gaussian *o = b + first + l;

		for (int k = 0; k < 3; k++) {
			o->p[k] = (double)g->pos[k][first + l];
			o->s[k] = s[k][l];
			for (int m = 0; m < 3; m++)
				o->a[k][m] = a[k][m][l];
		}
		o->rho = ct_activation_apply(g->activation, g->gamma, (double)g->raw[first + l]);
	}
}

CT_WIDE static void chunk_of(
	struct ct_gaussian *b, const struct ct_gauss *g, size_t first, size_t end)
{
	for (size_t i = first; i < end; i += CT_WIDE_LANES)
		eight(b, g, i, end - i < CT_WIDE_LANES ? end - i : CT_WIDE_LANES);
}

static void some(void *arg, size_t chunk, size_t worker)
{
	const struct job *j = arg;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;

	(void)worker;
	chunk_of(j->b, j->g, first, end < j->g->n ? end : j->g->n);
}

void ct_gaussian_resolve(struct ct_gaussian *b, const struct ct_gauss *g, struct ct_par *par)
{
	struct job j = {b, g};

	ct_par_for(par, (g->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, some, &j);
}

void ct_gaussian_congruence(
	double out[static 6], const double m[static 3][3], const double h[static 6])
{
	const double full[3][3] = {{h[0], h[1], h[2]}, {h[1], h[3], h[4]}, {h[2], h[4], h[5]}};
	double hm[3][3];
	size_t at = 0;

	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++)
			hm[r][c] =
				full[r][0] * m[0][c] + full[r][1] * m[1][c] + full[r][2] * m[2][c];
	for (int r = 0; r < 3; r++)
		for (int c = r; c < 3; c++)
			out[at++] = m[0][r] * hm[0][c] + m[1][r] * hm[1][c] + m[2][r] * hm[2][c];
}
