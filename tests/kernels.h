/* kernels.h: runs a kernel (core/simd.h) at every level of this processor on the same numbers, and
 * its plain twin where it has one, in buffers that end, or begin, at a page that nobody may touch.
 *
 * A row of the table is a function of a size n. It takes its buffers from the harness in a fixed
 * order, filled with numbers that depend on n and on the place only, and says KERNEL(call, twin):
 * the harness runs it once for the twin, in double, and once for each level.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TESTS_KERNELS_H
#define CT_TESTS_KERNELS_H
#include "core/clock.h"
#include "tests/tap.h"

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum {
	KERNEL_SIZES = 70,
	KERNEL_BUFFERS = 32,
	KERNEL_SLOT = 1 << 20, /* bytes of a buffer, at most */
	KERNEL_PAGE = 1 << 16,
	KERNEL_MARGIN = 256, /* bytes of canaries */
	CANARY = 0xa5
};

enum kernel_type { KERNEL_FLOAT, KERNEL_DOUBLE, KERNEL_I16, KERNEL_SCRATCH };

struct kernel_buffer {
	unsigned char *at, *from, *end; /* from, end: with the canaries before and after it */
	size_t bytes;
	enum kernel_type type;
};

/* What a run was given, and left. */
static struct kernel {
	struct kernel_buffer b[KERNEL_BUFFERS];
	size_t count, n;
	int level;  /* 0: the twin */
	bool front; /* buffers begin at a page that nobody may touch; else they end there */
	bool alone; /* there is no twin here */
	double sum; /* what the kernel returned */
	int turns;  /* how often it is called: once, but to be timed */
	uint64_t ticks;
} kernel;

struct kernel_row {
	const char *name;
	void (*run)(size_t n);
	double near; /* to the twin, of the largest number of a buffer */
	bool fused;  /* by ct_f32_fma: v2 rounds twice */
};

#define EACH(i, n) for (size_t i = 0; i < (n); i++)
#define F(x) ((float)(x))

static inline uint64_t kernel_clock(void)
{
#if defined(__x86_64__)
	return __builtin_ia32_rdtsc();
#else
	return (uint64_t)(1e9 * ct_clock_wall());
#endif
}

/* The kernel at this level, or what stands for it in plain C. */
#define KERNEL(call, ...)                                                                          \
	do {                                                                                       \
		if (!kernel.level) {                                                               \
			__VA_ARGS__;                                                               \
		} else {                                                                           \
			kernel.ticks = kernel_clock();                                             \
			for (int turn_ = 0; turn_ < kernel.turns; turn_++)                         \
				call;                                                              \
			kernel.ticks = kernel_clock() - kernel.ticks;                              \
		}                                                                                  \
	} while (0)
/* Its twin is in another test. */
#define ALONE kernel.alone = true

static void *kernel_buffer(size_t bytes, enum kernel_type type, size_t align)
{
	static unsigned char *slots;
	struct kernel_buffer *b = &kernel.b[kernel.count];
	const size_t stride = KERNEL_SLOT + KERNEL_PAGE;
	unsigned char *slot;
	size_t room, front;

	if (!slots) {
		slots = mmap(NULL, KERNEL_BUFFERS * stride + KERNEL_PAGE, PROT_NONE,
			MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
		if (slots == MAP_FAILED)
			exit(99);
		EACH(i, KERNEL_BUFFERS)
		if (mprotect(slots + KERNEL_PAGE + i * stride, KERNEL_SLOT, PROT_READ | PROT_WRITE))
			exit(99);
	}
	if (kernel.count == KERNEL_BUFFERS || bytes > KERNEL_SLOT) {
		printf("Bail out! too many buffers, or one of %zu bytes\n", bytes);
		exit(99);
	}
	slot = slots + KERNEL_PAGE + kernel.count * stride;
	room = KERNEL_SLOT - bytes;
	front = kernel.front ? 0 : room / align * align;
	b->at = slot + front;
	b->from = b->at - (front < KERNEL_MARGIN ? front : KERNEL_MARGIN);
	b->end = b->at + bytes + (room - front < KERNEL_MARGIN ? room - front : KERNEL_MARGIN);
	memset(b->from, CANARY, (size_t)(b->end - b->from));
	b->bytes = bytes;
	b->type = type;
	kernel.count++;
	return b->at;
}

/* Number i of the next buffer, in [-1.5, 1.5). */
static double kernel_number(size_t i)
{
	uint64_t x = (i + 1) * 0x9e3779b97f4a7c15u +
		     (kernel.count * 131 + kernel.n) * 0xbf58476d1ce4e5b9u;

	x = (x ^ x >> 31) * 0x94d049bb133111ebu;
	return 3 * ldexp((double)(x >> 40), -24) - 1.5;
}

static float *floats(size_t n)
{
	float *p = kernel_buffer(n * sizeof *p, KERNEL_FLOAT, sizeof *p);

	EACH(i, n) p[i] = F(kernel_number(i));
	return p;
}

/* Numbers in (0, 1.5]. */
__attribute__((unused)) static float *positives(size_t n)
{
	float *p = floats(n);

	EACH(i, n) p[i] = fabsf(p[i]) + 1e-3f;
	return p;
}

__attribute__((unused)) static double *doubles(size_t n)
{
	double *p = kernel_buffer(n * sizeof *p, KERNEL_DOUBLE, sizeof *p);

	EACH(i, n) p[i] = kernel_number(i);
	return p;
}

__attribute__((unused)) static int16_t *shorts(size_t n)
{
	int16_t *p = kernel_buffer(n * sizeof *p, KERNEL_I16, sizeof *p);

	EACH(i, n) p[i] = (int16_t)(20000 * kernel_number(i) / 1.5);
	return p;
}

/* Bytes that nobody looks at afterwards, and of any value before. */
__attribute__((unused)) static void *scratch(size_t bytes)
{
	return kernel_buffer(bytes, KERNEL_SCRATCH, 64);
}

/* As scratch, of floats that are compared. */
__attribute__((unused)) static float *aligned(size_t n)
{
	float *p = kernel_buffer(n * sizeof *p, KERNEL_FLOAT, 64);

	EACH(i, n) p[i] = F(kernel_number(i));
	return p;
}

/* Are the bytes before and after each buffer what they were? */
static bool kernel_canaries(void)
{
	bool whole = true;

	EACH(i, kernel.count)
	{
		const struct kernel_buffer *b = &kernel.b[i];

		for (const unsigned char *p = b->from; p < b->end; p++)
			whole = whole && ((p >= b->at && p < b->at + b->bytes) || *p == CANARY);
	}
	return whole;
}

static const char *kernel_name = "";

static void kernel_fault(int signal)
{
	char line[200];
	const int length = snprintf(line, sizeof line,
		"not ok - %s of size %zu at level %d reads or writes beyond a buffer (signal %d)\n",
		kernel_name, kernel.n, kernel.level, signal);

	if (write(1, line, (size_t)length) < 0)
		_exit(98);
	_exit(1);
}

/* Use level l, 2 to 4 (1: the only one); false if the processor lacks it. */
static bool kernel_use(int l)
{
	struct ct_err e;
	const char word[3] = {'v', (char)('0' + l), 0};

	kernel.level = l;
	return l == 0 || (l == 1 ? ct_simd_level() == 1 : ct_simd_use(word, &e) == 0);
}

static void kernel_run(const struct kernel_row *row, size_t n)
{
	kernel.n = n;
	kernel.count = 0;
	kernel.sum = 0;
	kernel.alone = false;
	kernel_name = row->name;
	row->run(n);
}

/* What a run left, to be compared with. */
struct kernel_left {
	unsigned char *bytes;
	size_t count;
	double sum;
};

static void kernel_keep(struct kernel_left *k)
{
	size_t at = 0;

	if (!k->bytes && !(k->bytes = malloc((size_t)KERNEL_BUFFERS * KERNEL_SLOT)))
		exit(99);
	EACH(i, kernel.count)
	{
		if (kernel.b[i].type == KERNEL_SCRATCH)
			continue;
		memcpy(k->bytes + at, kernel.b[i].at, kernel.b[i].bytes);
		at += kernel.b[i].bytes;
	}
	k->count = kernel.count;
	k->sum = kernel.sum;
}

static double kernel_get(const unsigned char *p, enum kernel_type t, size_t i)
{
	union {
		float f;
		double d;
		int16_t s;
	} x;

	if (t == KERNEL_FLOAT)
		return (double)(memcpy(&x.f, p + i * sizeof x.f, sizeof x.f), x.f);
	if (t == KERNEL_DOUBLE)
		return memcpy(&x.d, p + i * sizeof x.d, sizeof x.d), x.d;
	return memcpy(&x.s, p + i * sizeof x.s, sizeof x.s), x.s;
}

/* The largest difference of a buffer, as a part of its largest number, or of 1. */
static double kernel_apart(const struct kernel_buffer *b, const unsigned char *want)
{
	const size_t size = b->type == KERNEL_FLOAT ? 4 : b->type == KERNEL_DOUBLE ? 8 : 2;
	double worst = 0, most = 1;

	EACH(i, b->bytes / size)
	{
		const double w = kernel_get(want, b->type, i);
		const double d = fabs(kernel_get(b->at, b->type, i) - w);

		worst = d <= worst ? worst : d; /* NaN stays */
		most = fmax(most, fabs(w));
	}
	return worst / most;
}

/* How far the run is from what is kept; exact: 0 or infinity. */
static double kernel_compare(const struct kernel_left *k, bool exact)
{
	double worst = 0;
	size_t at = 0;

	if (k->count != kernel.count)
		return HUGE_VAL;
	EACH(i, kernel.count)
	{
		const struct kernel_buffer *b = &kernel.b[i];
		double d;

		if (b->type == KERNEL_SCRATCH)
			continue;
		d = exact ? (memcmp(k->bytes + at, b->at, b->bytes) ? HUGE_VAL : 0)
			  : kernel_apart(b, k->bytes + at);
		worst = d <= worst ? worst : d;
		at += b->bytes;
	}
	if (exact)
		return memcmp(&k->sum, &kernel.sum, sizeof k->sum) ? HUGE_VAL : worst;
	return fmax(worst, fabs(k->sum - kernel.sum) / fmax(1, fabs(k->sum)));
}

/* One row: sizes 1 to 70, buffers at either end of their pages, all levels. */
static void kernel_test(const struct kernel_row *row)
{
	static struct kernel_left twin, first;
	bool same = true, whole = true, has_twin = false;
	double worst = 0;

	for (size_t n = 1; n <= KERNEL_SIZES; n++) {
		kernel.front = false;
		kernel_use(0);
		kernel_run(row, n);
		has_twin = !kernel.alone;
		kernel_keep(&twin);
		first.count = 0;
		for (int run = 0; run < 8; run++) {
			const int level = run / 2 + 1;
			double apart;

			kernel.front = run % 2;
			if (!kernel_use(level))
				continue;
			kernel_run(row, n);
			whole = whole && kernel_canaries();
			if (first.count == 0)
				kernel_keep(&first);
			same = same && kernel_compare(&first, true) == 0;
			if (row->fused && level == 2 && run % 2)
				first.count = 0;
			apart = has_twin ? kernel_compare(&twin, false) : 0;
			worst = apart <= worst ? worst : apart;
		}
	}
	OK(same, "%s gives the same bytes at every level", row->name);
	OK(whole, "%s writes within its buffers only", row->name);
	if (has_twin && !OK(worst <= row->near, "%s is as near to its plain twin", row->name))
		printf("# %.3g of the largest number, %.3g allowed\n", worst, row->near);
}

enum { KERNEL_TIMED = 256, KERNEL_TURNS = 16, KERNEL_ROUNDS = 9 };

/* Ticks of a call of size KERNEL_TIMED at each level: the least of some rounds. */
static void kernel_time(const struct kernel_row *row)
{
	uint64_t least[5] = {0};

	kernel.turns = KERNEL_TURNS;
	for (int round = 0; round < KERNEL_ROUNDS; round++)
		for (int level = 1; level <= 4; level++) {
			if (!kernel_use(level))
				continue;
			kernel_run(row, KERNEL_TIMED);
			if (round == 0 || kernel.ticks < least[level])
				least[level] = kernel.ticks;
		}
	printf("%-28s", row->name);
	for (int level = 1; level <= 4; level++)
		if (least[level])
			printf("  v%d %8.0f", level, (double)least[level] / KERNEL_TURNS);
	printf("\n");
}

static int kernel_main(size_t n, const struct kernel_row *row, bool timed)
{
	if (timed)
		printf("ticks of a call of size %d, %s\n", KERNEL_TIMED,
			ct_simd_level() > 1 ? "of the counter of the processor" : "ns");
	kernel.turns = 1;
	signal(SIGSEGV, kernel_fault);
	signal(SIGBUS, kernel_fault);
	EACH(i, n)(timed ? kernel_time : kernel_test)(row + i);
	return timed ? 0 : tap_done();
}

#endif
