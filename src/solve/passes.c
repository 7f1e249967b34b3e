/* passes.c: see passes.h. */
#include "config.h"
#include "solve/passes.h"

#include <math.h>

enum { PIECE = 1 << 16, BATCH = 1024 }; /* floats of a task; tasks whose sums are kept at once */

struct pass {
	ct_vector_fn *kernel;
	size_t n;
	float *y;
	const float *x, *w;
	double c, sum[BATCH];
};

static void piece(void *arg, size_t i, size_t worker)
{
	struct pass *p = arg;
	size_t at = i * PIECE, n = p->n - at < PIECE ? p->n - at : PIECE;

	(void)worker;
	p->sum[i] = p->kernel(
		n, p->y ? p->y + at : NULL, p->x ? p->x + at : NULL, p->w ? p->w + at : NULL, p->c);
}

double ct_passes_run(ct_vector_fn *kernel, size_t n, float *y, const float *x, const float *w,
	double c, struct ct_par *par)
{
	const size_t batch = (size_t)BATCH * PIECE;
	struct pass p = {.kernel = kernel, .c = c};
	double sum = 0;

	for (size_t at = 0; at < n; at += batch) {
		size_t tasks;

		p.n = n - at < batch ? n - at : batch;
		p.y = y ? y + at : NULL;
		p.x = x ? x + at : NULL;
		p.w = w ? w + at : NULL;
		tasks = (p.n + PIECE - 1) / PIECE;
		ct_par_for(par, tasks, piece, &p);
		for (size_t i = 0; i < tasks; i++)
			sum += p.sum[i];
	}
	return sum;
}

double ct_passes_dot(size_t n, const float *x, const float *w, struct ct_par *par)
{
	return ct_passes_run(CT_SIMD(ct_vector_dot), n, NULL, x, w, 0, par);
}

void ct_passes_scale(size_t n, float *y, double c, struct ct_par *par)
{
	ct_passes_run(CT_SIMD(ct_vector_scale), n, y, NULL, NULL, c, par);
}

void ct_passes_add(size_t n, float *y, double c, const float *x, struct ct_par *par)
{
	ct_passes_run(CT_SIMD(ct_vector_add), n, y, x, NULL, c, par);
}

void ct_passes_advance(size_t n, float *y, const float *x, double c, struct ct_par *par)
{
	ct_passes_run(CT_SIMD(ct_vector_advance), n, y, x, NULL, c, par);
}

double ct_passes_lead(size_t n, float *y, const float *x, double c, struct ct_par *par)
{
	return sqrt(ct_passes_run(CT_SIMD(ct_vector_lead), n, y, x, NULL, c, par) / (double)n);
}
