/* passes.c: see passes.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/passes.h"

#include <math.h>

enum { PIECE = 1 << 16, BATCH = 1024 }; /* floats of a task; tasks whose sums are kept at once */

struct pass {
	ct_vector_fn *kernel;
	size_t n;
	struct ct_vector v;
	double sum[BATCH];
};

static struct ct_vector skip(const struct ct_vector *v, size_t n)
{
	return (struct ct_vector){
		v->y ? v->y + n : NULL, v->x ? v->x + n : NULL, v->w ? v->w + n : NULL, v->c, v->b};
}

static void piece(void *arg, size_t i, size_t worker)
{
	struct pass *p = arg;
	size_t at = i * PIECE, n = p->n - at < PIECE ? p->n - at : PIECE;
	struct ct_vector v = skip(&p->v, at);

	(void)worker;
	p->sum[i] = p->kernel(n, &v);
}

double ct_passes_run(ct_vector_fn *kernel, size_t n, const struct ct_vector *v, struct ct_par *par)
{
	const size_t batch = (size_t)BATCH * PIECE;
	struct pass p = {.kernel = kernel};
	double sum = 0;

	for (size_t at = 0; at < n; at += batch) {
		size_t tasks;

		p.n = n - at < batch ? n - at : batch;
		p.v = skip(v, at);
		tasks = (p.n + PIECE - 1) / PIECE;
		ct_par_for(par, tasks, piece, &p);
		for (size_t i = 0; i < tasks; i++)
			sum += p.sum[i];
	}
	return sum;
}

double ct_passes_dot(size_t n, const float *x, const float *w, struct ct_par *par)
{
	return ct_passes_run(CT_SIMD(ct_vector_dot), n, &(struct ct_vector){.x = x, .w = w}, par);
}

void ct_passes_scale(size_t n, float *y, double c, struct ct_par *par)
{
	ct_passes_run(CT_SIMD(ct_vector_scale), n, &(struct ct_vector){.y = y, .c = c}, par);
}

void ct_passes_add(size_t n, float *y, double c, const float *x, struct ct_par *par)
{
	ct_passes_run(CT_SIMD(ct_vector_mix), n, &(struct ct_vector){y, x, NULL, 1, c}, par);
}

void ct_passes_advance(size_t n, float *y, const float *x, double c, struct ct_par *par)
{
	ct_passes_run(CT_SIMD(ct_vector_mix), n, &(struct ct_vector){y, x, NULL, c, 1}, par);
}

double ct_passes_lead(size_t n, float *y, const float *x, double c, struct ct_par *par)
{
	const struct ct_vector v = {.y = y, .x = x, .c = c};

	return sqrt(ct_passes_run(CT_SIMD(ct_vector_lead), n, &v, par) / (double)n);
}
