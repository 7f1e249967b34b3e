/* expect.c: see expect.h. */
#include "config.h"
#include "cli/memory.h"
#include "core/clock.h"
#include "resolution/crop.h"
#include "tools/lib/brick.h"
#include "tools/lib/expect.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMALL = 96, LONG = 1024, THIN = 32, LARGE = 256, STEPS = 9 };
static const double middle[3] = {0.5, 0.5, 0.5};

double expect_fine(const struct ct_vol *in, const double factor[3])
{
	double n = 1;

	for (int a = 0; a < 3; a++)
		n *= (double)ct_degrade_cover(in->n[a], factor[a]);
	return n;
}

double expect_most(const struct ct_vol *in, const double factor[3])
{
	const struct ct_degrade by = {.factor = {factor[0], factor[1], factor[2]}};
	struct ct_err why;
	size_t n[3];
	double bytes;

	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(in->n[a], factor[a]);
	if (ct_upsample_bytes(&bytes, CT_UPSAMPLE_HTV, &by, true, n, &why))
		return (double)INFINITY;
	return CT_MEMORY_BASE + EXPECT_PRIOR + bytes + 12 * (double)ct_vol_count(in);
}

/* As expect_piece, of fine[] voxels along the axes. */
static int cut(struct ct_vol *piece, const struct ct_vol *in, const double factor[3],
	const size_t fine[3], const double at[3], struct ct_err *e)
{
	ptrdiff_t start[3];
	size_t n[3];

	for (int a = 0; a < 3; a++) {
		const double most = fmax(ceil((double)fine[a] / factor[a]), 1);

		n[a] = (double)in->n[a] < most ? in->n[a] : (size_t)most;
		start[a] = (ptrdiff_t)(at[a] * (double)(in->n[a] - n[a]));
	}
	if (ct_vol_alloc(piece, n, e))
		return -1;
	memcpy(piece->affine, in->affine, sizeof piece->affine);
	ct_crop(piece->data, n, in->data, in->n, start, 0);
	return 0;
}

int expect_piece(struct ct_vol *piece, const struct ct_vol *in, const double factor[3], size_t fine,
	const double at[3], struct ct_err *e)
{
	return cut(piece, in, factor, (const size_t[]){fine, fine, fine}, at, e);
}

/* One refinement of a piece. */
static int try(double *cpu, struct ct_upsample_report *did, const struct ct_vol *piece,
	const struct ct_upsample_rule *rule, const struct ct_env *env, struct ct_err *e)
{
	const double begin = ct_clock_cpu();
	struct ct_vol out = {0};
	const int rc = ct_upsample(&out, piece, rule, did, env, e);

	*cpu = ct_clock_cpu() - begin;
	ct_vol_free(&out);
	return rc;
}

/* When each iteration of a piece began. */
struct ticks {
	double at[STEPS + 1];
	size_t n;
};

static void tick(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct ticks *t = env->ctx;

	(void)what, (void)total, (void)likely;
	if (done == t->n && t->n <= STEPS)
		t->at[t->n++] = ct_clock_cpu();
}

static int compare(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

/* Seconds before and after the iterations, and of each of them, of a large piece: the median, which
 * other work on the machine moves least. */
static int time_steps(double *once, double *each, const struct ct_vol *piece,
	const struct ct_upsample_rule *rule, const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule some = *rule;
	struct ct_upsample_report did;
	struct ct_env own = *env;
	struct ticks t = {0};
	double step[STEPS];

	own.log = NULL; /* what has another context */
	own.progress = tick;
	own.ctx = &t;
	some.tolerance = 0;
	some.iterations = STEPS;
	if (try(once, &did, piece, &some, &own, e))
		return -1;
	*each = 0;
	if (did.iterations < STEPS || t.n <= STEPS)
		return 0;
	for (size_t k = 0; k < STEPS; k++)
		step[k] = t.at[k + 1] - t.at[k];
	qsort(step, STEPS, sizeof *step, compare);
	*each = step[STEPS / 2];
	*once = fmax(*once - (t.at[STEPS] - t.at[0]), 0);
	return 0;
}

/* Of a scan that can be cut: those of its pilot, which is all of a small one. */
static int try_pilot(struct expect *x, const struct ct_vol *in, const size_t n[3],
	const struct ct_upsample_rule *rule, const struct ct_env *env, struct ct_err *e)
{
	const double begin = ct_clock_cpu();
	struct ct_pilot pilot = {0};
	const int rc = ct_pilot_run(&pilot, in, rule, true, env, e);

	x->cpu = x->pilot = ct_clock_cpu() - begin;
	x->whole = memcmp(n, in->n, sizeof in->n) == 0;
	x->iterations = pilot.iterations ? pilot.iterations : rule->iterations;
	ct_pilot_free(&pilot);
	return rc;
}

/* Of another one: of all of a small scan, or the most of three bars through the middle of a larger
 * one. */
static int try_bars(struct expect *x, const struct ct_vol *in, const struct ct_upsample_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_report did;

	x->whole = x->fine <= (double)SMALL * SMALL * SMALL;
	if (!x->whole && rule->tolerance == 0 && x->method >= CT_UPSAMPLE_TV) {
		x->iterations = rule->iterations;
		return 0;
	}
	for (int a = 0; a < (x->whole ? 1 : 3); a++) {
		size_t size[3] = {THIN, THIN, THIN};
		struct ct_vol piece = {0};
		int rc;

		size[a] = LONG;
		rc = x->whole ? try(&x->cpu, &did, in, rule, env, e)
			      : cut(&piece, in, rule->by.factor, size, middle, e) ||
					try(&x->cpu, &did, &piece, rule, env, e);
		ct_vol_free(&piece);
		if (rc)
			return -1;
		x->iterations = did.iterations > x->iterations ? did.iterations : x->iterations;
	}
	return 0;
}

int expect_solver(struct expect *x, const struct ct_vol *in, const struct ct_upsample_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule alone = *rule;
	struct ct_vol large = {0};
	struct ct_upsample_report r;
	double once = 0, each = 0;
	size_t n[3];
	int rc = -1;

	alone.start = NULL;
	*x = (struct expect){.fine = expect_fine(in, rule->by.factor)};
	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(in->n[a], rule->by.factor[a]);
	if (ct_upsample_choose(&r, rule, n, e))
		return -1;
	x->method = r.method;
	if (brick_axis(&rule->by, in->n) >= 0 && ct_pilot_size(n, in, &alone)
			? try_pilot(x, in, n, &alone, env, e)
			: try_bars(x, in, &alone, env, e))
		goto out;
	if (!x->whole) {
		if (expect_piece(&large, in, rule->by.factor, LARGE, middle, e) ||
			time_steps(&once, &each, &large, &alone, env, e))
			goto out;
		x->cpu = x->pilot + (once + each * (double)x->iterations) *
					    (double)ct_vol_count(in) / (double)ct_vol_count(&large);
	}
	rc = 0;
out:
	ct_vol_free(&large);
	return rc;
}

void expect_tell(struct ct_cost *cost, const struct expect *x, const struct ct_vol *in,
	const struct ct_degrade *by, double need, double fixed)
{
	const int axis = brick_axis(by, in->n);
	const double base = CT_MEMORY_BASE + 4 * (double)ct_vol_count(in);
	const struct ct_cost_more more[] = {
		{EXPECT_ITERATIONS, (double)x->iterations},
		{EXPECT_NEED, base + need},
		{EXPECT_FIXED, base + fixed},
		{EXPECT_FREE, ct_memory_free("")},
		{EXPECT_AXIS, axis},
		{EXPECT_FACTOR, axis < 0 ? 1 : by->factor[axis]},
		{EXPECT_VOXELS, axis < 0 ? 0 : (double)in->n[axis]},
	};

	memcpy(cost->more, more, sizeof more);
}
