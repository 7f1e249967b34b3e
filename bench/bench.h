/* bench.h: timing for `make bench`.
 *
 * Machines are shared and drift, so every figure is a ratio: the two sides of a comparison run
 * alternately, A B A B, and the medians of their times are compared. Lines read
 *
 *   what: OURS unit, THEIRS unit NAME, ratio R [min..max]
 *
 * with the ratio theirs/ours, so that larger is better; where the other side is a limit of the
 * machine the ratio is the share of it that is reached.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_BENCH_H
#define CT_BENCH_H
#include "core/clock.h"
#include "core/simd.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { BENCH_ROUNDS = 7 };

typedef void bench_fn(void *arg);

/* CTSR_CPU forces a lower level here as it does in the commands. */
__attribute__((constructor)) static void bench_level(void)
{
	struct ct_err e = {0};

	if (ct_simd_use(getenv("CTSR_CPU"), &e) == 0)
		return;
	fprintf(stderr, "%s\n", e.msg);
	exit(2);
}

/* Seconds of the wall clock, or of CPU time of all threads of this process. */
static inline double bench_clock(clockid_t id)
{
	return id == CLOCK_MONOTONIC ? ct_clock_wall() : ct_clock_cpu();
}

static inline double bench_time(clockid_t id, bench_fn *fn, void *arg)
{
	double t = bench_clock(id);

	fn(arg);
	return bench_clock(id) - t;
}

static inline int bench_order(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static inline double bench_median(double *x, size_t n)
{
	qsort(x, n, sizeof *x, bench_order);
	return n % 2 ? x[n / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

/* Run both alternately, after one round that does not count, and print the line; times are
 * multiplied by `scale` to give `unit`. Returns the median ratio. */
static inline double bench_against(const char *what, bench_fn *ours, void *arg, const char *name,
	bench_fn *theirs, void *their_arg, clockid_t clock, double scale, const char *unit)
{
	double a[BENCH_ROUNDS], b[BENCH_ROUNDS], r[BENCH_ROUNDS], ratio;

	ours(arg);
	theirs(their_arg);
	for (int i = 0; i < BENCH_ROUNDS; i++) {
		a[i] = bench_time(clock, ours, arg);
		b[i] = bench_time(clock, theirs, their_arg);
		r[i] = b[i] / a[i];
	}
	ratio = bench_median(r, BENCH_ROUNDS);
	printf("%s: %.4g %s, %.4g %s %s, ratio %.3g [%.3g..%.3g]\n", what,
		scale * bench_median(a, BENCH_ROUNDS), unit, scale * bench_median(b, BENCH_ROUNDS),
		unit, name, ratio, r[0], r[BENCH_ROUNDS - 1]);
	fflush(stdout);
	return ratio;
}

#endif
