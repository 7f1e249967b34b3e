/* Errors, sizes, metadata, numbers in text, random numbers, threads, grids.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/progress.h"
#include "core/clock.h"
#include "core/env.h"
#include "core/mem.h"
#include "core/meta.h"
#include "core/number.h"
#include "core/rng.h"
#include "core/stack.h"
#include "core/vol.h"
#include "core/words.h"
#include "tap.h"

#include <errno.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

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

/* What is not linear in its own words: sizes at their limits, and arrays that grow. */
static void test_arrays(void)
{
	struct ct_err e = {0};
	int *a = NULL;
	size_t cap = 0, size = 0;
	char *p = NULL;
	bool kept = true;

	OK(ct_size_mul(&size, 6, 7, "x", &e) == 0 && size == 42, "a product of sizes");
	OK(ct_size_mul(&size, SIZE_MAX / 2 + 1, 2, "this", &e) < 0 && strstr(e.msg, "this: size"),
		"one that overflows is named");
	OK(ct_alloc(&p, CT_MAX_BYTES / 8 + 1, 8, &e) < 0 && e.code == CT_EINPUT && !p,
		"an array larger than any is refused");
	OK(ct_alloc(&p, SIZE_MAX / 8 + 2, 8, &e) < 0 && e.code == CT_EINPUT && !p,
		"and one whose size overflows");
	for (size_t n = 0; n < 300; n++) {
		must(ct_alloc0(&p, n, 1, &e));
		kept = kept && (uintptr_t)p % 64 == 0;
		for (size_t i = 0; i < n; i++)
			kept = kept && p[i] == 0;
		free(p);
	}
	OK(kept, "arrays begin at whole cache lines, with zeroes if asked for");
	must(ct_grow(&a, &cap, 5, sizeof *a, &e));
	OK(cap == 5, "room for five");
	for (int i = 0; i < 5; i++)
		a[i] = 3 * i;
	must(ct_grow(&a, &cap, 6, sizeof *a, &e));
	OK(cap == 7, "it grows by half");
	must(ct_grow(&a, &cap, 7, sizeof *a, &e) || ct_grow(&a, &cap, 2, sizeof *a, &e));
	OK(cap == 7, "not while there is room");
	must(ct_grow(&a, &cap, 1000, sizeof *a, &e));
	for (int i = 0; i < 5; i++)
		kept = kept && a[i] == 3 * i;
	OK(cap == 1000 && kept, "or by more, and keeps what was there");
	OK(ct_grow(&a, &cap, CT_MAX_BYTES / sizeof *a + 1, sizeof *a, &e) < 0 &&
			e.code == CT_EINPUT && cap == 1000,
		"within the limit");
	free(a);
	OK(ct_mem_room(1 << 20, &e) == 0, "a mebibyte is to be had");
}

static void test_errors(void)
{
	struct ct_err e = {0};
	char many[700];

	OK(ct_fail(&e, CT_EGEOM, "%d\x1b[7m\t \x1f~\x7f\xc3\xa4", 5) == -1 && e.code == CT_EGEOM &&
			strcmp(e.msg, "5?[7m? ?~?\xc3\xa4") == 0,
		"nothing in a message steers a terminal");
	memset(many, 'x', sizeof many - 1);
	many[sizeof many - 1] = 0;
	ct_fail(&e, CT_EINPUT, "why");
	OK(ct_blame(&e, "what") == -1 && strcmp(e.msg, "what: why") == 0 && e.code == CT_EINPUT,
		"blame stands in front");
	ct_fail(&e, CT_EINPUT, "%s", many);
	ct_blame(&e, many);
	OK(strlen(e.msg) == 200 + 2 + 290 && e.msg[200] == ':',
		"as much of it as there is room for");
	memcpy(many + sizeof many - 10, "/name.nii", 10);
	ct_fail(&e, CT_EINPUT, "why");
	ct_blame(&e, many);
	OK(strlen(e.msg) == 205 && memcmp(e.msg, "...xx", 5) == 0 &&
			strcmp(e.msg + 191, "/name.nii: why") == 0,
		"of a long path its end");
}

static char heard[200];
static volatile sig_atomic_t stop;

static void hear(const struct ct_env *env, enum ct_level level, const char *text)
{
	snprintf(heard, sizeof heard, "%d %d %s", env->verbose, (int)level, text);
}

static void watch(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	snprintf(heard, sizeof heard, "%d %s %zu of %zu, %zu", env->verbose, what, done, total,
		likely);
}

/* What a resumed run had done is no measure of its speed. */
static void test_resumed(void)
{
	struct ct_progress p = {.how = CT_PROGRESS_PIPE};
	struct ct_env env = {.ctx = &p};

	ct_progress_draw(&env, "work", 5, 100, 0);
	ct_progress_draw(&env, "work", 60, 100, 0);
	OK(p.first == 0.05 && p.share == 0.6, "a run is timed from where it began");
	ct_progress_draw(&env, "work", 0, 0, 0);
	ct_progress_draw(&env, "work", 60, 100, 0);
	OK(p.first == 0.6 && p.share == 0.6, "after a total of 0 from there on");
}

static void test_env(void)
{
	struct ct_env env = {.log = hear, .progress = watch, .stop = &stop}, own;
	struct ct_env_part part = {.env = &env, .from = 0.2, .to = 0.4};
	struct ct_err e = {0};
	bool right = true;

	for (env.verbose = -1; env.verbose <= 3; env.verbose++)
		for (int level = CT_WARN; level <= CT_DEBUG; level++) {
			char want[40] = "";

			heard[0] = 0;
			ct_log(&env, (enum ct_level)level, "%s %d", "x", 7);
			if (level <= env.verbose || level == CT_WARN)
				snprintf(want, sizeof want, "%d %d x 7", env.verbose, level);
			right = right && strcmp(heard, want) == 0;
		}
	OK(right, "words are heard up to their level, warnings always");
	ct_progress(&env, "work", 3, 9);
	OK(strcmp(heard, "4 work 3 of 9, 0") == 0, "progress is passed on");
	ct_progress_until(&env, "work", 3, 9, 5);
	OK(strcmp(heard, "4 work 3 of 9, 5") == 0, "and where it may end");
	ct_env_part(&own, &part);
	ct_progress(&own, "work", 3, 6);
	OK(strcmp(heard, "4 % 3000 of 10000, 0") == 0, "half of a part from .2 to .4 of a run");
	ct_progress(&own, "work", 0, 0);
	OK(strcmp(heard, "4 % 3000 of 0, 0") == 0, "a total of 0 is passed on");
	test_resumed();
	OK(!ct_stopping(&env) && ct_check_stop(&env, &e) == 0, "nobody asks to stop");
	stop = 1;
	OK(ct_stopping(&env) && ct_check_stop(&env, &e) < 0 && e.code == CT_ESTOP, "somebody does");
	env = (struct ct_env){0};
	ct_log(&env, CT_WARN, "to nobody");
	ct_log(NULL, CT_WARN, "to nobody");
	ct_progress(&env, "work", 1, 2);
	ct_progress(NULL, "work", 1, 2);
	OK(!ct_stopping(&env) && !ct_stopping(NULL), "and without ears nothing happens");
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
	OK(strcmp(ct_meta_get(&m, "sigma"), "nan") == 0 &&
			strcmp(ct_meta_get(&m, "input"), "a.nii xxh3:00") == 0,
		"the others stay");
	ct_meta_drop(&m, "none");
	OK(m.n == 2, "what is not there is not dropped");
	OK(ct_meta_set(&m, "", "x", &e) < 0 && e.code == CT_EINPUT, "a key has a name");
	OK(ct_meta_setf(&m, &e, "seed", "%d %s", 5, "x") == 0 &&
			strcmp(ct_meta_get(&m, "seed"), "5 x") == 0 && m.n == 3 &&
			ct_meta_setf(&m, &e, "seed", "6") == 0 && m.n == 3 &&
			strcmp(ct_meta_get(&m, "seed"), "6") == 0,
		"a value is replaced");
	ct_meta_free(&m);
	ct_meta_free(&copy);
}

/* What is a list of three numbers? */
static void test_numbers(void)
{
	static const struct {
		const char *text;
		int rc;
	} c[] = {{"1,2,3", 0}, {"7", 0}, {"-1e3,.5,+4", 0}, {"1,2", -1}, {"1,2,3,", -1},
		{"1,2,3,4", -1}, {"1,,3", -1}, {"", -1}, {",", -1}, {"7,", -1}, {"7 ", -1},
		{"1,2,x", -1}, {"1,2,3x", -1}, {"1;2;3", -1}, {"inf", -1}, {"1,1e999,2", -1},
		{"x", -1}};
	struct ct_err e = {0};
	struct ct_meta m = {0};

	for (size_t k = 0; k < sizeof c / sizeof *c; k++) {
		double v[3] = {0};

		must(ct_meta_set(&m, "sigma", c[k].text, &e));
		OK(ct_meta_numbers(&m, "sigma", 3, v, &e) == c[k].rc &&
				(c[k].rc == 0 || e.code == CT_EINPUT),
			"'%s' is %s list of three numbers", c[k].text, c[k].rc ? "no" : "a");
	}
	ct_meta_free(&m);
}

static const char *history(size_t n, const struct ct_meta *const *in, const char *command)
{
	static struct ct_meta m;
	const struct ct_env env = {.history = command};
	struct ct_err e = {0};

	must(ct_meta_step(&m, &env, n, in, &e));
	return ct_meta_get(&m, CT_META_HISTORY);
}

static void test_history(void)
{
	struct ct_err e = {0};
	struct ct_meta a = {0}, b = {0}, none = {0};

	must(ct_meta_set(&a, CT_META_INPUT, "a.nii xxh3:0a", &e) ||
		ct_meta_set(&b, CT_META_INPUT, "b.nii xxh3:0b", &e));
	OK(strcmp(history(0, NULL, "ct-phantom 1"), "ct-phantom 1") == 0, "the first command");
	OK(strcmp(history(2, (const struct ct_meta *const[]){&a, &b}, "ct-y"),
		   "ct-phantom 1\nct-y # a.nii xxh3:0a b.nii xxh3:0b") == 0,
		"a line each, inputs behind a #");
	OK(strcmp(history(4, (const struct ct_meta *const[]){NULL, &none, &b, &a}, NULL),
		   "ct-phantom 1\nct-y # a.nii xxh3:0a b.nii xxh3:0b\n"
		   "ctsr # b.nii xxh3:0b a.nii xxh3:0a") == 0,
		"also if the first has no name");
	ct_meta_free(&a);
	ct_meta_free(&b);
}

/* By their definition, from blocks of Philox, with words that are all different. */
static void test_uniform(void)
{
	const uint64_t seed = 0x123456789abcdef1, stream = 0xfedcba9876543212;
	bool reals = true, below = true, normal = true;

	for (uint64_t i = 0xffffffff; i < 0x10000000fu; i++) {
		const uint32_t in[4] = {(uint32_t)i, (uint32_t)(i >> 32), 0x76543212, 0xfedcba98},
			       key[2] = {0x9abcdef1, 0x12345678};
		uint32_t r[4];
		double x;

		ct_philox(r, in, key);
		x = ((double)r[0] / 0x1p32 + (double)r[1]) / 0x1p32;
		for (uint64_t h = 0; h < 2; h++) { /* Box and Muller */
			const double y = ((double)r[2] / 0x1p32 + (double)r[3]) / 0x1p32;
			const double z = sqrt(-2 * log(x)) * cos(2 * M_PI * (y - 0.25 * (double)h));

			normal = normal &&
				 fabs((double)ct_rng_normal(seed, stream, 2 * i + h) - z) < 1e-6;
		}
		reals = reals && fabs(ct_rng_uniform(seed, stream, i) - x) <= 0x1p-53;
		for (uint64_t n = 1; n < 1000; n *= 3)
			below = below &&
				(double)ct_rng_below(seed, stream, i, n) == floor(x * (double)n);
	}
	OK(normal, "normal numbers, two of a block");
	OK(reals && below, "numbers below 1 and below n");
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

/* Which thread a worker is, as far as is known. */
struct faces {
	pthread_t thread[4];
	bool known[4], other[4], beyond;
};

static void look(void *arg, size_t i, size_t worker)
{
	struct faces *f = arg;

	(void)i;
	if (worker >= 4) {
		f->beyond = true;
		return;
	}
	if (f->known[worker] && !pthread_equal(f->thread[worker], pthread_self()))
		f->other[worker] = true;
	f->thread[worker] = pthread_self();
	f->known[worker] = true;
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
	struct faces f = {0};
	void *both[2];
	size_t bad = 0;

	OK(ct_par_alloc(&p, 4, &e) == 0 && ct_par_threads(p) == 4, "a pool of four");
	for (int round = 0; round < 100; round++)
		ct_par_for(p, N, square, a);
	for (size_t i = 0; i < N; i++)
		bad += a[i] != 100 * (uint64_t)i * i;
	OK(bad == 0, "every index ran once a loop");
	/* on a busy machine others may be quicker than the caller, but not always */
	for (int round = 0; round < 200 || (!f.known[0] && round < 200000); round++)
		ct_par_for(p, 100, look, &f);
	OK(f.known[0] && !f.beyond && !f.other[0] && !f.other[1] && !f.other[2] && !f.other[3],
		"a worker is one thread, the caller the first");
	OK(pthread_equal(f.thread[0], pthread_self()), "who works, too");
	both[0] = p;
	both[1] = sums;
	ct_par_for(p, 10, nested, both);
	for (size_t i = 0; i < 100; i++)
		bad += sums[i] != (uint64_t)(i % 10) * (i % 10);
	OK(bad == 0, "a loop inside a task runs");
	ct_par_free(p);
	ct_par_for(NULL, N, square, a);
	OK(a[3] == 909, "no pool runs on the caller");
	must(ct_par_alloc(&p, 0, &e));
	OK(ct_par_threads(p) == 1 && ct_par_threads(NULL) == 1, "one thread at least");
	ct_par_free(p);
}

static void test_grids(void)
{
	struct ct_err e = {0};
	struct ct_vol v = {0}, w = {0};
	const size_t n[3] = {2, 3, 4};
	const double f[3] = {4, 2, 1}, back[3] = {0.25, 0.5, 1}, first[3] = {0, 0, 0};
	double p[3], q[3], lr[3];
	int axis[3] = {9, 9, 9}, sign[3];

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
	v.affine[1][2] = (double)NAN;
	ct_vol_axes(&v, axis, sign);
	OK(axis[0] == 0 && axis[1] == 1 && axis[2] == 2, "axes of an affine of NaN are in order");
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

/* Seconds of the processor, as the system counts them for another purpose. */
static double used(void)
{
	struct rusage r;

	getrusage(RUSAGE_SELF, &r);
	return (double)(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
	       (double)(r.ru_utime.tv_usec + r.ru_stime.tv_usec) / 1e6;
}

static void test_seconds(void)
{
	while (used() < 0.1)
		;
	NEAR(ct_clock_cpu(), used(), 0.03, "seconds are seconds");
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

/* Numbers in text: whole, or none. */
static void test_number_text(void)
{
	static const struct {
		const char *text;
		double is;
	} good[] = {{"0", 0}, {"-0", 0}, {"+12.5", 12.5}, {".5", .5}, {"5.", 5}, {"1e3", 1000},
		{"-1.25E-2", -.0125}, {" 7 ", 7}, {"\t7", 7}, {"1e-400", 0},
		{"000000000000000000000000000001", 1}, {"0.1", .1}};
	static const char *const bad[] = {"", " ", "+", "-", ".", "-.", "e5", "1e", "1e+", "1,5",
		"1.5.", "1.x0", "0x10", "0x1p3", "nan", "NAN", "inf", "-inf", "infinity", "1 2",
		"1;", "--1", "+-1", "- 1", "1e999", "-1e999", "1_000", "1.5f", "1\n"};
	double x = 0;

	for (size_t i = 0; i < sizeof good / sizeof *good; i++)
		OK(ct_number_read(&x, good[i].text) && x == good[i].is, "'%s' is %g", good[i].text,
			good[i].is);
	x = 3;
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(!ct_number_read(&x, bad[i]) && x == 3, "'%s' is no number", bad[i]);
}

static void test_number_begin(void)
{
	const char *end, *text = "2.5mm";

	OK(ct_number_begin(text, &end) == 2.5 && strcmp(end, "mm") == 0, "a number and its unit");
	text = "1e5e5";
	OK(ct_number_begin(text, &end) == 1e5 && strcmp(end, "e5") == 0, "one exponent");
	text = " 1";
	OK(isnan(ct_number_begin(text, &end)) && end == text, "it begins with the number");
	text = "x";
	OK(isnan(ct_number_begin(text, &end)) && end == text, "or there is none");
}

static void test_number_fields(void)
{
	double x = 0;

	OK(ct_number_field(&x, "1.5 \0\0", 6) && x == 1.5, "blanks and zeros end a field");
	OK(!ct_number_field(&x, "-102\0.123", 9), "a zero within makes it none");
	OK(ct_number_field(&x, "12345", 3) && x == 123, "it is as long as it is");
	OK(!ct_number_field(&x, "   ", 3) && !ct_number_field(&x, "", 0), "one of blanks is empty");
}

static void test_number_whole(void)
{
	long long x = 0;
	uint64_t u = 0;

	OK(ct_number_whole(&x, "-12", -20, 20) && x == -12, "a whole number");
	OK(ct_number_whole(&x, "+7", 0, 20) && x == 7, "with its sign");
	for (const char *const *t = (const char *const[]){"", "-", "1.0", "1e1", "21", "-21", " 1",
		     "1 ", "0x1", "99999999999999999999", NULL};
		*t; t++)
		OK(!ct_number_whole(&x, *t, -20, 20) && x == 7, "'%s' is none from -20 to 20", *t);
	OK(!ct_number_whole(&x, "-1", 0, 9), "no sign below 0");
	OK(ct_number_u64(&u, "18446744073709551615") && u == UINT64_MAX, "64 bits");
	OK(!ct_number_u64(&u, "18446744073709551616") && !ct_number_u64(&u, "-1") &&
			!ct_number_u64(&u, "+1") && !ct_number_u64(&u, "") &&
			!ct_number_u64(&u, "1x"),
		"and no more");
	errno = ENOMEM;
	OK(ct_number_u64(&u, "7") && !ct_number_u64(&u, "18446744073709551616") &&
			ct_number_whole(&x, "7", 0, 9) && errno == ENOMEM,
		"that memory was short stays known");
}

static void test_number_lists(void)
{
	double v[3];

	OK(ct_words_numbers("1,2.5, -3e1", ',', 3, false, v) && v[0] == 1 && v[1] == 2.5 &&
			v[2] == -30,
		"a list of numbers");
	OK(!ct_words_numbers("1,2,0x3", ',', 3, false, v) &&
			!ct_words_numbers("1,nan,3", ',', 3, false, v) &&
			!ct_words_numbers("1,2,3,", ',', 3, false, v) &&
			!ct_words_numbers("1,2.5.,3", ',', 3, false, v),
		"each of them whole");
}

static void test_number_exact(void)
{
	const char *end;
	double x = 0;

	OK(ct_number_exact(&x, "0x1.8p+1 0x1p+0", &end) && x == 3 && strcmp(end, " 0x1p+0") == 0,
		"a number in hexadecimal, as states have it");
	OK(!ct_number_exact(&x, "inf ", &end) && !ct_number_exact(&x, "nan", &end) &&
			!ct_number_exact(&x, "1,5", &end) && !ct_number_exact(&x, "", &end),
		"finite and whole");
}

int main(void)
{
	test_clock();
	test_seconds();
	test_words();
	test_sizes();
	test_arrays();
	test_errors();
	test_env();
	test_meta();
	test_numbers();
	test_history();
	test_uniform();
	test_rng();
	test_par();
	test_grids();
	test_stack();
	test_number_text();
	test_number_begin();
	test_number_fields();
	test_number_whole();
	test_number_lists();
	test_number_exact();
	return tap_done();
}
