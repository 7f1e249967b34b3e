/* An iteration of total variation under data consistency (resolution/tv.h) on 256^3, against the
 * time to read and write its volume and a dual of half of three once, the least that it moves.
 * A call makes so many of them that what it begins with, above all its first touch of memory,
 * weighs little. */
#include "config.h"
#include "bench/bench.h"
#include "core/rng.h"
#include "resolution/tv.h"

#include <stdlib.h>
#include <string.h>

enum { N = 256, FACTOR = 4, M = N / FACTOR, ITERATIONS = 30, HALVES = 5, BLOCK = 1 << 18 };

struct side {
	float *x, *y, *other;
	struct ct_consistency dc;
	struct ct_env env;
	struct ct_tv_rule rule;
};

static void solve(void *arg)
{
	struct side *s = arg;
	struct ct_tv_report r;
	struct ct_err e;

	if (ct_tv(s->x, &s->dc, &s->rule, &r, &s->env, &e))
		exit(1);
}

static void touch(void *arg, size_t block, size_t worker)
{
	struct side *s = arg;
	float *p = s->other + block * BLOCK;

	(void)worker;
	for (size_t i = 0; i < BLOCK; i++)
		p[i] = 0.5f * p[i] + 1.0f;
}

/* As many volumes read and written in place as the iterations must. */
static void traffic(void *arg)
{
	struct side *s = arg;

	for (int it = 0; it < ITERATIONS; it++)
		ct_par_for(s->env.par, HALVES * ((size_t)N * N * N / BLOCK) / 2, touch, s);
}

int main(void)
{
	const struct ct_degrade d = {{FACTOR, FACTOR, FACTOR},
		{FACTOR / 2.3548, FACTOR / 2.3548, FACTOR / 2.3548}, CT_DECIMATE_SINC};
	const size_t n[3] = {N, N, N}, count = (size_t)N * N * N;
	struct side s = {.rule = {{1, 1, 1}, 60, ITERATIONS, 0}};
	struct ct_par *par;
	struct ct_err e;

	s.x = calloc(count, sizeof *s.x);
	s.y = calloc((size_t)M * M * M, sizeof *s.y);
	s.other = calloc(HALVES * count / 2, sizeof *s.other);
	if (!s.x || !s.y || !s.other || ct_par_alloc(&par, 2, &e))
		return 1;
	s.env.par = par;
	ct_rng_normals((size_t)M * M * M, s.y, 1, 0, 0);
	for (size_t i = 0; i < (size_t)M * M * M; i++)
		s.y[i] *= 300;
	for (size_t i = 0; i < HALVES * count / 2; i++)
		s.other[i] = 1;
	if (ct_consistency_alloc(&s.dc, &d, n, s.y, 0, par, &e))
		return 1;
	bench_against("tv, 256^3, 2 threads, a call of 30 iterations", solve, &s,
		"to read and write 2.5 volumes 30 times", traffic, &s, CLOCK_MONOTONIC, 1e3, "ms");
	ct_consistency_free(&s.dc);
	ct_par_free(par);
	free(s.x);
	free(s.y);
	free(s.other);
	return 0;
}
