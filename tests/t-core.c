/* Errors, sizes, metadata, random numbers, threads, grids. */
#include "config.h"
#include "core/clock.h"
#include "core/env.h"
#include "core/mem.h"
#include "core/meta.h"
#include "core/rng.h"
#include "core/stack.h"
#include "core/vol.h"
#include "core/words.h"
#include "tap.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static void test_sizes(void)
{
	struct ct_err e = {0};
	struct ct_vol v = {0};
	const size_t huge[3] = {SIZE_MAX / 2, 3, 1}, big[3] = {1 << 20, 1 << 20, 1 << 10},
		     none[3] = {4, 0, 4};

	OK(ct_vol_alloc(&v, huge, &e) && e.code == CT_EINPUT, "an overflowing volume is refused");
	OK(ct_vol_alloc(&v, big, &e) && e.code == CT_EINPUT, "a petabyte is refused");
	OK(ct_vol_alloc(&v, none, &e) && e.code == CT_EINPUT, "an empty volume is refused");
	OK(v.data == NULL, "nothing was allocated");
}

static void test_meta(void)
{
	struct ct_err e = {0};
	struct ct_meta m = {0}, copy = {0};
	struct ct_env env = {.history = "ct-x 1 a b"};
	const struct ct_meta *in[1] = {&m};
	double v[3] = {0};

	ct_meta_set(&m, "factor", "4", &e);
	ct_meta_set(&m, "sigma", "1,2.5,3", &e);
	OK(ct_meta_numbers(&m, "factor", 3, v, &e) == 0 && v[2] == 4,
		"one number stands for three");
	OK(ct_meta_numbers(&m, "sigma", 3, v, &e) == 0 && v[1] == 2.5, "three numbers");
	OK(ct_meta_numbers(&m, "sigma", 2, v, &e) < 0, "a number too many is an error");
	OK(ct_meta_numbers(&m, "none", 2, v, &e) == 1, "a missing key is told apart");
	ct_meta_set(&m, "sigma", "nan", &e);
	OK(ct_meta_numbers(&m, "sigma", 1, v, &e) < 0, "NaN is not a number here");
	ct_meta_set(&m, "input", "a.nii xxh3:00", &e);
	OK(ct_meta_copy(&copy, &m, &e) == 0 && copy.n == m.n, "copy");
	OK(ct_meta_step(&copy, &env, 1, in, &e) == 0 &&
			strcmp(ct_meta_get(&copy, "history"), "ct-x 1 a b # a.nii xxh3:00") == 0,
		"a step names command and input");
	OK(ct_meta_get(&copy, "input") == NULL, "the step's own input key is gone");
	ct_meta_drop(&m, "factor");
	OK(ct_meta_get(&m, "factor") == NULL && m.n == 2, "drop");
	ct_meta_free(&m);
	ct_meta_free(&copy);
}

static void test_rng(void)
{
	/* Known answers of the reference implementation (Random123, philox4x32x10). */
	static const uint32_t in[3][6] = {{0, 0, 0, 0, 0, 0}, {~0u, ~0u, ~0u, ~0u, ~0u, ~0u},
		{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0}};
	static const uint32_t want[3][4] = {{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8},
		{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd},
		{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}};
	enum { N = 200000 };
	static float z[N];
	double sum = 0, sum2 = 0, sum4 = 0;
	size_t differ = 0;

	for (int k = 0; k < 3; k++) {
		uint32_t r[4];

		ct_philox(r, in[k], in[k] + 4);
		OK(memcmp(r, want[k], sizeof r) == 0, "Philox known answer %d", k);
	}
	ct_rng_normals(N, z, 7, 3, 11);
	for (size_t i = 0; i < N; i++) {
		double x = (double)z[i];

		differ += z[i] != ct_rng_normal(7, 3, 11 + i);
		sum += x;
		sum2 += x * x;
		sum4 += x * x * x * x;
	}
	OK(differ == 0, "an array of normals is the single ones");
	NEAR(sum / N, 0, 0.01, "mean");
	NEAR(sum2 / N, 1, 0.015, "variance");
	NEAR(sum4 / N, 3, 0.12, "kurtosis");
}

static void square(void *arg, size_t i, size_t worker)
{
	(void)worker;
	((uint64_t *)arg)[i] += (uint64_t)i * i;
}

static void nested(void *arg, size_t i, size_t worker)
{
	(void)worker;
	ct_par_for(((void **)arg)[0], 10, square, (uint64_t *)((void **)arg)[1] + 10 * i);
}

static void test_par(void)
{
	enum { N = 10000 };
	static uint64_t a[N], sums[100];
	struct ct_err e = {0};
	struct ct_par *p = NULL;
	void *both[2];
	size_t bad = 0;

	OK(ct_par_alloc(&p, 4, &e) == 0 && ct_par_threads(p) == 4, "a pool of four");
	for (int round = 0; round < 100; round++)
		ct_par_for(p, N, square, a);
	for (size_t i = 0; i < N; i++)
		bad += a[i] != 100 * (uint64_t)i * i;
	OK(bad == 0, "every index ran once a loop");
	both[0] = p;
	both[1] = sums;
	ct_par_for(p, 10, nested, both);
	for (size_t i = 0; i < 100; i++)
		bad += sums[i] != (uint64_t)(i % 10) * (i % 10);
	OK(bad == 0, "a loop inside a task runs");
	ct_par_free(p);
	ct_par_for(NULL, N, square, a);
	OK(a[3] == 909, "no pool runs on the caller");
}

static void test_grids(void)
{
	struct ct_err e = {0};
	struct ct_vol v = {0}, w = {0};
	const size_t n[3] = {2, 3, 4};
	const double f[3] = {4, 2, 1}, back[3] = {0.25, 0.5, 1}, first[3] = {0, 0, 0};
	double p[3], q[3], lr[3];

	if (ct_vol_alloc(&v, n, &e) || ct_vol_alloc(&w, n, &e))
		exit(99);
	memcpy(v.affine, (double[3][4]){{0, -2, 0, 5}, {3, 0, 0, 6}, {0, 0, 4, 7}},
		sizeof v.affine);
	memcpy(w.affine, v.affine, sizeof w.affine);
	ct_vol_rescale_affine(w.affine, v.affine, f);
	ct_vol_world(&w, first, p); /* HR voxel 0 has its centre at LR index 0.5/s - 0.5 */
	for (int a = 0; a < 3; a++)
		lr[a] = 0.5 / f[a] - 0.5;
	ct_vol_world(&v, lr, q);
	NEAR(fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]), 0, 1e-12,
		"cell-centred refinement");
	ct_vol_rescale_affine(w.affine, w.affine, back);
	OK(ct_vol_same_grid(&v, &w, &e) == 0, "coarsening undoes refining");
	OK(ct_vol_check_grid(&v, &e) == 0, "a rotated grid is fine");
	w.affine[0][3] += 0.1;
	OK(ct_vol_same_grid(&v, &w, &e) && e.code == CT_EGEOM, "a shifted grid is another grid");
	w.affine[0][0] = 1;
	OK(ct_vol_check_grid(&w, &e) && e.code == CT_EGEOM, "a sheared grid is refused");
	memset(w.affine, 0, sizeof w.affine);
	OK(ct_vol_check_grid(&w, &e) && e.code == CT_EGEOM, "zero spacing is refused");
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 0;
	OK(ct_vol_check_finite(&v, &e) == 0, "finite");
	v.data[9] = NAN;
	OK(ct_vol_check_finite(&v, &e) && strcmp(e.msg, "voxel (1,1,1) is NaN") == 0,
		"NaN is named");
	ct_vol_free(&v);
	ct_vol_free(&w);
}

static void test_stack(void)
{
	struct ct_err e = {0};
	struct ct_stack s = {0}, fine = {0};

	if (ct_stack_alloc(&s, 1, 4, 6, &e))
		exit(99);
	s.view[0] = (struct ct_view){
		.source = {100, 0, 0}, .centre = {-50, 0, 0}, .u = {0, 2, 0}, .v = {0, 0, -2}};
	OK(ct_stack_check(&s, &e) == 0, "a plain view is fine");
	OK(ct_stack_like(&fine, &s, 4, &e) == 0 && fine.h == 16 && fine.w == 24 &&
			fine.view[0].u[1] == 0.5,
		"a finer detector covers the same area");
	OK(ct_stack_same(&s, &fine, &e) && e.code == CT_EGEOM, "and is another geometry");
	s.view[0].source[0] = -50;
	OK(ct_stack_check(&s, &e) && e.code == CT_EGEOM,
		"a source in the detector plane is refused");
	ct_stack_free(&s);
	ct_stack_free(&fine);
}

#define SOME(X) X(SOME_A, "a") X(SOME_AB, "a-b")
#define MORE(X) X(SOME_C, "c")
enum some { SOME(CT_WORD_VALUE) SOMES };
enum { SOME_C = SOMES };

static void test_words(void)
{
	OK(strcmp(CT_WORDS(SOME), "a|a-b") == 0, "the words of a list");
	OK(strcmp(CT_WORDS_TWO(SOME, MORE), "a|a-b|c") == 0, "and of two");
	OK(strcmp("of" SOME(CT_WORD_SPACE), "of a a-b") == 0, "in prose");
	OK(strcmp(CT_WORD(SOME, SOME_AB), "a-b") == 0, "the word of a value");
	OK(ct_words_find(CT_WORDS(SOME), "a-b") == SOME_AB, "the value of a word");
	OK(ct_words_find(CT_WORDS_TWO(SOME, MORE), "c") == SOME_C, "of the second list");
	OK(ct_words_find(CT_WORDS(SOME), "a-") == -1 && ct_words_find(CT_WORDS(SOME), "") == -1 &&
			ct_words_find(CT_WORDS(SOME), "a|a-b") == -1,
		"no part of one");
}

static void test_clock(void)
{
	double wall = ct_clock_wall(), cpu = ct_clock_cpu(), before;

	ct_clock_sleep(0.05);
	OK(ct_clock_wall() - wall >= 0.05, "a sleep takes its time");
	OK(ct_clock_cpu() - cpu < 0.04, "and none of the processor");
	before = ct_clock_cpu();
	while (ct_clock_cpu() - before < 0.01)
		;
	OK(ct_clock_wall() - wall < 60, "work counts as CPU time");
}

int main(void)
{
	test_clock();
	test_words();
	test_sizes();
	test_meta();
	test_rng();
	test_par();
	test_grids();
	test_stack();
	return tap_done();
}
