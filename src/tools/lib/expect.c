/* expect.c: see expect.h. */
#include "config.h"
#include "cli/memory.h"
#include "core/clock.h"
#include "resolution/crop.h"
#include "tools/lib/brick.h"
#include "tools/lib/expect.h"

#include <math.h>
#include <string.h>

enum { SMALL = 96, LARGE = 192, FEW = 3, MORE = 9 };
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
	return CT_MEMORY_BASE + EXPECT_PRIOR +
	       4 * (ct_upsample_volumes(CT_UPSAMPLE_HTV) * expect_fine(in, factor) +
			   2 * (double)ct_vol_count(in));
}

int expect_piece(struct ct_vol *piece, const struct ct_vol *in, const double factor[3], size_t fine,
	const double at[3], struct ct_err *e)
{
	ptrdiff_t start[3];
	size_t n[3];

	for (int a = 0; a < 3; a++) {
		const double most = fmax(ceil((double)fine / factor[a]), 1);

		n[a] = (double)in->n[a] < most ? in->n[a] : (size_t)most;
		start[a] = (ptrdiff_t)(at[a] * (double)(in->n[a] - n[a]));
	}
	if (ct_vol_alloc(piece, n, e))
		return -1;
	memcpy(piece->affine, in->affine, sizeof piece->affine);
	ct_crop(piece->data, n, in->data, in->n, start, 0);
	return 0;
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

/* Seconds before and after the iterations, and of each of them, of a large piece. */
static int time_steps(double *once, double *each, struct ct_upsample_report *did,
	const struct ct_vol *piece, const struct ct_upsample_rule *rule, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_upsample_rule some = *rule;
	double few, more = 0;

	some.tolerance = 0;
	some.iterations = FEW;
	if (try(&few, did, piece, &some, env, e))
		return -1;
	*once = few;
	*each = 0;
	if (did->iterations < FEW)
		return 0;
	some.iterations = MORE;
	if (try(&more, did, piece, &some, env, e))
		return -1;
	*each = fmax(more - few, 0) / (MORE - FEW);
	*once = fmax(few - FEW * *each, 0);
	return 0;
}

int expect_solver(struct expect *x, const struct ct_vol *in, const struct ct_upsample_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule alone = *rule;
	struct ct_upsample_report did;
	struct ct_vol small = {0}, large = {0};
	double once = 0, each = 0;
	int rc = -1;

	alone.start = NULL;
	*x = (struct expect){.fine = expect_fine(in, rule->by.factor)};
	if (expect_piece(&small, in, rule->by.factor, SMALL, middle, e) ||
		try(&x->cpu, &did, &small, &alone, env, e))
		goto out;
	x->method = did.method;
	x->iterations = did.iterations;
	x->whole = ct_vol_count(&small) == ct_vol_count(in);
	if (!x->whole) {
		const double iterations = (double)did.iterations;

		if (expect_piece(&large, in, rule->by.factor, LARGE, middle, e) ||
			time_steps(&once, &each, &did, &large, &alone, env, e))
			goto out;
		x->cpu = (once + each * iterations) * (double)ct_vol_count(in) /
			 (double)ct_vol_count(&large);
	}
	rc = 0;
out:
	ct_vol_free(&small);
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
