/* splat-gradient.c: gradients of the projections of Gaussians; see splat.h. */
#include "config.h"
#include "core/mem.h"
#include "gs/footprint-vec.h"

#include <math.h>
#include <stdlib.h>

int ct_gradient_reserve(struct ct_gradient *g, size_t n, struct ct_err *e)
{
	size_t cap = g->cap;

	for (size_t k = 0; k < CT_GS_FIELDS; k++) {
		cap = g->cap;
		if (ct_grow(&g->d[k], &cap, n, sizeof(float), e))
			return -1;
	}
	cap = g->cap;
	if (ct_grow(&g->screen, &cap, n, sizeof(float), e))
		return -1;
	g->cap = cap;
	return 0;
}

void ct_gradient_free(struct ct_gradient *g)
{
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		free(g->d[k]);
	free(g->screen);
	*g = (struct ct_gradient){0};
}

struct job {
	struct ct_gradient *grad;
	const struct ct_splat *s;
	const struct ct_gaussian *b;
	const struct ct_gauss *set;
	const float *dimg;
};

/* The gradients of n <= 8 Gaussians from `first` on, of which sums[6][CT_GS_CHUNK] are the sums. */
CT_WIDE_INLINE void eight(const struct job *j, size_t first, size_t n, const double *sums)
{
	const struct ct_camera *c = &j->s->cam;
	const ct_wide zero = {0};
	struct vec_gaussian b;
	struct vec_footprint f;
	struct vec_grad g;
	ct_wide s[6], q[4], dl[3], dq[4], mx, my;
	ct_wide_mask seen = {0};

	for (size_t l = 0; l < n; l++)
		seen[l] = -(int64_t)(j->s->dab[first + l].first < j->s->dab[first + l].end);
	for (size_t k = 0; k < 6; k++)
		memcpy(&s[k], sums + k * CT_GS_CHUNK, sizeof s[k]);
	for (int k = 0; k < 4; k++)
		q[k] = ct_wide_load(j->set->rot[k] + first, n);
	wide_gaussian_load(&b, j->b + first, n);
	wide_footprint_of(&f, c, &b);
	wide_footprint_backward(&g, &f, c, &b, s);
	wide_gaussian_backward(dl, dq, g.shape, b.s, q);
	for (int k = 0; k < 3; k++) {
		ct_wide_store(
			j->grad->d[CT_GS_POS + k] + first, n, ct_wide_pick(seen, g.p[k], zero));
		ct_wide_store(
			j->grad->d[CT_GS_SCALE + k] + first, n, ct_wide_pick(seen, dl[k], zero));
	}
	for (int k = 0; k < 4; k++)
		ct_wide_store(
			j->grad->d[CT_GS_ROT + k] + first, n, ct_wide_pick(seen, dq[k], zero));
	ct_wide_store(j->grad->d[CT_GS_RAW] + first, n, ct_wide_pick(seen, g.rho, zero));
	mx = g.m[0] * ((double)c->w / 2);
	my = g.m[1] * ((double)c->h / 2);
	ct_wide_store(j->grad->screen + first, n,
		ct_wide_pick(seen, ct_wide_sqrt(mx * mx + my * my), zero - 1));
}

CT_WIDE static void chunk_of(const struct job *j, size_t first, size_t end, const double *sums)
{
	for (size_t i = first; i < end; i += CT_WIDE_LANES)
		eight(j, i, end - i < CT_WIDE_LANES ? end - i : CT_WIDE_LANES, sums + (i - first));
}

static void some(void *arg, size_t chunk, size_t worker)
{
	const struct job *j = arg;
	const struct ct_camera *c = &j->s->cam;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;
	double sums[6 * CT_GS_CHUNK]; /* 24 kB */

	(void)worker;
	end = end < j->s->n ? end : j->s->n;
	for (size_t k = 0; k < 6; k++)
		for (size_t i = end - first; i < CT_GS_CHUNK; i++)
			sums[k * CT_GS_CHUNK + i] = 0;
	ct_rasterise_sums(sums, CT_GS_CHUNK, j->dimg, ct_rasterise_pitch(c->w), c->w, end - first,
		j->s->dab + first);
	chunk_of(j, first, end, sums);
}

void ct_splat_backward(struct ct_gradient *grad, const struct ct_splat *s,
	const struct ct_gaussian *b, const struct ct_gauss *set, const float *dimg,
	struct ct_par *par)
{
	struct job j = {grad, s, b, set, dimg};

	ct_par_for(par, (s->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, some, &j);
}
