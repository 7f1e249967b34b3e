/* What a slice network of slices (restore/predict.h) expects of a volume of 96^3, of the shipped
 * prior's size at 4x, against the matrix products that this takes and nothing else.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/bench.h"
#include "core/mem.h"
#include "core/rng.h"
#include "restore/predict.h"
#include "nn/dnn.h"

#include <stdlib.h>
#include <string.h>

enum { N = 96, CELL = 4, SLICES = 4, ROWS = 128, THREADS = 2, COUNT = N * N * N };

struct side {
	struct ct_slice_network r;
	struct ct_scene scene;
	struct ct_guess g;
	struct ct_env env;
	size_t cells;
	struct ct_slice_network_work work[THREADS];
};

static void predict(void *arg)
{
	static const bool all[3] = {true, true, true};
	struct side *s = arg;
	struct ct_err e;
	size_t textured = 0;

	s->cells = s->g.axes = 0;
	memset(s->g.h, 0, COUNT * sizeof *s->g.h);
	if (ct_predict(&s->g, &s->scene, &s->r, all, &textured, &s->cells, &s->env, &e))
		exit(1);
}

/* The products of ROWS patches: components, two layers, and both ways to the output. */
static void products(void *arg, size_t piece, size_t worker)
{
	struct side *s = arg;
	const struct ct_slice_network *r = &s->r;
	struct ct_slice_network_work *w = &s->work[worker];
	const size_t in = ct_patch_count(&r->shape), f = r->inputs, k = r->components;
	const size_t out = r->out, wide = r->width, *at = r->at;
	const int was = ct_dnn_enter();
	struct ct_err e;

	(void)piece;
	if (ct_dnn_sgemm(false, true, ROWS, k, in, 1, w->patch, in, r->basis, in, 0, w->feature, f,
		    &e) ||
		ct_dnn_sgemm(false, true, ROWS, wide, f, 1, w->feature, f, r->all + at[CT_PART_1],
			f, 0, w->a1, wide, &e) ||
		ct_dnn_sgemm(false, true, ROWS, wide, wide, 1, w->h1, wide, r->all + at[CT_PART_2],
			wide, 0, w->a2, wide, &e) ||
		ct_dnn_sgemm(false, true, ROWS, out, f, 1, w->feature, f,
			r->all + at[CT_PART_LINEAR], f, 0, w->out, out, &e) ||
		ct_dnn_sgemm(false, true, ROWS, out, wide, 1, w->h2, wide, r->all + at[CT_PART_3],
			wide, 1, w->out, out, &e))
		exit(1);
	ct_dnn_leave(was);
}

static void bare(void *arg)
{
	struct side *s = arg;

	ct_par_for(s->env.par, 3 * COUNT / (CELL * CELL * SLICES) / ROWS, products, s);
}

int main(void)
{
	struct side s = {
		.r = {.shape = {CELL, 12, 8, SLICES, true}, .components = 448, .width = 1024},
		.scene = {.n = {N, N, N}, .coarse = {true, true, true}, .regime = {.sigma = 0.4}}};
	struct ct_par *par;
	struct ct_err e;
	float *x;

	if (ct_slice_network_alloc(&s.r, &e) || ct_alloc(&x, COUNT, sizeof *x, &e) ||
		ct_alloc(&s.g.h, COUNT, sizeof *x, &e) || ct_par_alloc(&par, THREADS, &e))
		return 1;
	s.env.par = par;
	s.scene.x = x;
	ct_rng_normals(COUNT, x, 1, 0, 0);
	for (size_t i = 0; i < COUNT; i++)
		x[i] *= 200;
	ct_rng_normals(ct_patch_count(&s.r.shape) * s.r.components, s.r.basis, 2, 0, 0);
	ct_rng_normals(s.r.at[CT_PARTS], s.r.all, 3, 0, 0);
	for (size_t i = 0; i < s.r.at[CT_PARTS]; i++)
		s.r.all[i] *= 0.05f;
	for (int t = 0; t < THREADS; t++)
		if (ct_slice_network_work_alloc(&s.work[t], &s.r, ROWS, &e))
			return 1;
	bench_against("slice prior, 96^3, 2 threads", predict, &s, "its matrix products alone",
		bare, &s, CLOCK_MONOTONIC, 1e3, "ms");
	for (int t = 0; t < THREADS; t++)
		ct_slice_network_work_free(&s.work[t]);
	ct_slice_network_free(&s.r);
	ct_par_free(par);
	free(s.g.h);
	free(x);
	return 0;
}
