/* An iteration of total variation under data consistency (inverse/tv.h) on 256^3, for three
 * operators, against the
 * time to read and write its volume and a dual of half of three once, the least that it moves.
 * A call makes so many of them that what it begins with, above all its first touch of memory,
 * weighs little. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/bench.h"
#include "core/rng.h"
#include "inverse/tv.h"

#include <stdlib.h>
#include <string.h>

enum { N = 256, FACTOR = 4, ITERATIONS = 30, HALVES = 5, BLOCK = 1 << 18 };

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

static const struct {
	const char *name;
	struct ct_degrade d;
} cases[] = {{"sinc 4x4x4",
		     {{FACTOR, FACTOR, FACTOR}, {FACTOR / 2.3548, FACTOR / 2.3548, FACTOR / 2.3548},
			     CT_DECIMATE_SINC, {0}}},
	{"means 4x4x4", {{FACTOR, FACTOR, FACTOR}, {0}, CT_DECIMATE_MEAN, {0}}},
	{"means 1x1x4", {{1, 1, FACTOR}, {0}, CT_DECIMATE_MEAN, {0}}}};

int main(void)
{
	const size_t n[3] = {N, N, N}, count = (size_t)N * N * N;
	struct side s = {.rule = {{1, 1, 1}, 60, ITERATIONS, 0, {0}}};
	struct ct_par *par;
	struct ct_err e;

	s.x = calloc(count, sizeof *s.x);
	s.y = calloc(count / FACTOR, sizeof *s.y);
	s.other = calloc(HALVES * count / 2, sizeof *s.other);
	if (!s.x || !s.y || !s.other || ct_par_alloc(&par, 2, &e))
		return 1;
	s.env.par = par;
	ct_rng_normals(count / FACTOR, s.y, 1, 0, 0);
	for (size_t i = 0; i < count / FACTOR; i++)
		s.y[i] *= 300;
	for (size_t i = 0; i < HALVES * count / 2; i++)
		s.other[i] = 1;
	for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
		char what[80];

		snprintf(what, sizeof what, "tv, %s, 256^3, 2 threads, a call of %d iterations",
			cases[c].name, ITERATIONS);
		memset(s.x, 0, count * sizeof *s.x);
		if (ct_consistency_alloc(&s.dc, &cases[c].d, n, s.y, 0, par, &e))
			return 1;
		bench_against(what, solve, &s, "to read and write 2.5 volumes as often", traffic,
			&s, CLOCK_MONOTONIC, 1e3, "ms");
		ct_consistency_free(&s.dc);
	}
	ct_par_free(par);
	free(s.x);
	free(s.y);
	free(s.other);
	return 0;
}
