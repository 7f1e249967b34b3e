/* example.c: see example.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "operator/resample.h"
#include "inverse/upsample.h"
#include "restore/example.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHARP (2.0 / 3)
enum { LEAST_CELLS = 6, ITERATIONS = 300 }; /* cells along an axis; of the solver */
#define STREAM ((uint64_t)1 << 40)
/* HU: the solver stops when an iteration moves less; that of ct-sr, and less. */
#define TOLERANCE_WHOLE 0.1
#define TOLERANCE 0.05

static double uniform(
	const struct ct_example_rule *r, uint64_t index, uint64_t k, double a, double b)
{
	return a + (b - a) * ct_rng_uniform(r->seed, STREAM + index, k);
}

/* The cube: a place and phase at random. 1 if there is no room. */
static int cube(struct ct_vol *out, const struct ct_vol *v, const struct ct_example_rule *r,
	uint64_t index, struct ct_err *e)
{
	const double scale = exp(uniform(r, index, 0, log(r->scale[0]), log(r->scale[1])));
	struct ct_separable s = {0};
	size_t n[3];
	double start[3], step[3];

	for (int a = 0; a < 3; a++) {
		double room = (double)v->n[a] / scale;

		n[a] = room < (double)r->side ? (size_t)room : r->side;
		n[a] = n[a] / r->factor * r->factor;
		if (n[a] < LEAST_CELLS * r->factor)
			return 1;
		step[a] = scale;
		start[a] = 0.5 * (scale - 1) + uniform(r, index, (uint64_t)a + 1, 0,
						       (double)v->n[a] - scale * (double)n[a]);
	}
	if (ct_vol_alloc(out, n, e) ||
		ct_resample_plan(&s, v->n, n, start, step, CT_CUBIC, true, NULL, e))
		return -1;
	ct_separable_apply(&s, out->data, v->data, NULL);
	ct_separable_free(&s);
	if (r->clip[1] > r->clip[0] && uniform(r, index, 7, 0, 1) < 0.5)
		for (size_t i = 0; i < n[0] * n[1] * n[2]; i++)
			out->data[i] =
				fminf(fmaxf(out->data[i], (float)r->clip[0]), (float)r->clip[1]);
	return 0;
}

/* Mean squares of the second differences along an axis over those of the first. */
static double detail(const struct ct_vol *v, int axis)
{
	const size_t step = axis == 0 ? 1 : axis == 1 ? v->n[0] : v->n[0] * v->n[1];
	const size_t count = ct_vol_count(v), n = v->n[axis];
	double first = 0, second = 0;

	for (size_t i = 0; i < count; i++) {
		const size_t at = i / step % n;
		double d, before;

		if (at + 1 >= n || at == 0)
			continue;
		d = (double)v->data[i + step] - (double)v->data[i];
		before = (double)v->data[i] - (double)v->data[i - step];
		first += d * d;
		second += (d - before) * (d - before);
	}
	return first > 0 ? second / first : 0;
}

void ct_example_soft(bool soft[static 3], const struct ct_vol *v)
{
	const double d[3] = {detail(v, 0), detail(v, 1), detail(v, 2)};
	const double most = fmax(d[0], fmax(d[1], d[2]));

	for (int a = 0; a < 3; a++)
		soft[a] = d[a] < SHARP * most;
}

/* Number k of the axes that are not soft. */
static int pick(const bool soft[3], int k)
{
	int a = 0;

	while (soft[a] || k-- > 0)
		a++;
	return a;
}

/* A scanner at random: sampled well, hardly, or by the mean, as thick slices often are; P1 to P3
 * are among them. */
void ct_example_regime(struct ct_example *p, const struct ct_example_rule *r, uint64_t index)
{
	struct ct_regime *g = &p->regime;
	const int axes = 3 - r->soft[0] - r->soft[1] - r->soft[2];
	const int axis = pick(r->soft, (int)uniform(r, index, 8, 0, axes));
	const double kind = uniform(r, index, 4, 0, 1);

	g->decimate = kind < (r->thick ? 0.4 : 0.5)   ? CT_DECIMATE_SINC
		      : kind < (r->thick ? 0.6 : 0.9) ? CT_DECIMATE_POINT
						      : CT_DECIMATE_MEAN;
	g->sigma = g->decimate == CT_DECIMATE_SINC    ? uniform(r, index, 5, 0.22, 0.5)
		   : g->decimate == CT_DECIMATE_POINT ? uniform(r, index, 5, 0.12, 0.35)
						      : uniform(r, index, 5, 0, 0.3);
	g->noise = fmax(uniform(r, index, 6, -r->noise, r->noise), 0);
	for (int a = 0; a < 3; a++)
		p->coarse[a] = !r->thick || a == axis;
}

/* What made the LR scan of that pair. */
static struct ct_degrade degradation(const struct ct_example *p, const struct ct_example_rule *r)
{
	struct ct_degrade d = {.decimate = p->regime.decimate};

	for (int a = 0; a < 3; a++) {
		d.factor[a] = p->coarse[a] ? (double)r->factor : 1;
		d.sigma[a] = p->coarse[a] ? p->regime.sigma * d.factor[a] : 0;
	}
	return d;
}

/* How far what the prior adds to the scan of such a pair, of n voxels, is trusted. *nothing: ct-sr
 * would not ask it. */
static int trust(struct ct_restore_rule *rule, bool *nothing, const struct ct_example *p,
	const struct ct_example_rule *r, const size_t n[3], struct ct_err *e)
{
	size_t m[3];

	*rule = (struct ct_restore_rule){
		.by = degradation(p, r), .noise = p->regime.noise, .axes = {true, true, true}};
	for (int a = 0; a < 3; a++)
		m[a] = p->coarse[a] ? n[a] / r->factor : n[a];
	return ct_restore_confidence(rule, nothing, r->factor, m, e);
}

/* *base <- what the solver makes of a scan of the truth. */
static int solve(struct ct_vol *base, const struct ct_vol *truth, const struct ct_example *p,
	const struct ct_example_rule *r, uint64_t index, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule rule = {.method = CT_UPSAMPLE_AUTO,
		.known = true,
		.by = degradation(p, r),
		.plain = true,
		.noise = p->regime.noise,
		.mirrors = r->whole,
		.iterations = ITERATIONS,
		.tolerance = r->whole ? TOLERANCE_WHOLE : TOLERANCE};
	struct ct_upsample_report report;
	struct ct_vol lo = {0};
	int rc = ct_err_any(
		ct_degrade_volume(&lo, truth, &rule.by, rule.noise, r->seed + index, NULL, e) ||
		ct_upsample(base, &lo, &rule, &report, env, e));

	ct_vol_free(&lo);
	return rc;
}

void ct_example_weigh(struct ct_example *p)
{
	const size_t count = p->n[0] * p->n[1] * p->n[2];
	double square = 0;

	for (size_t i = 0; i < count; i++)
		square += (double)p->rest[i] * (double)p->rest[i];
	p->variance = fmax(square / (double)count, 1);
}

int ct_example_alloc(struct ct_example *p, const struct ct_vol *v,
	const struct ct_example_rule *rule, uint64_t index, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_env alone = {.stop = env->stop};
	struct ct_vol truth = {0}, base = {0};
	struct ct_restore_rule restore;
	bool nothing = false;
	size_t count;
	int rc = cube(&truth, v, rule, index, e);

	if (rc)
		goto out;
	ct_example_regime(p, rule, index);
	rc = rule->whole ? trust(&restore, &nothing, p, rule, truth.n, e) : 0;
	if (rc || nothing) {
		rc = rc ? -1 : 1;
		goto out;
	}
	rc = -1;
	if (solve(&base, &truth, p, rule, index, &alone, e))
		goto out;
	count = ct_vol_count(&truth);
	if (ct_alloc(&p->base, 2 * count, sizeof *p->base, e))
		goto out;
	p->rest = p->base + count;
	memcpy(p->base, base.data, count * sizeof *p->base);
	for (size_t i = 0; i < count; i++)
		p->rest[i] = truth.data[i] - base.data[i];
	memcpy(p->n, truth.n, sizeof p->n);
	ct_example_weigh(p);
	rc = 0;
out:
	ct_vol_free(&truth);
	ct_vol_free(&base);
	return rc;
}

int ct_example_after(struct ct_example *p, const struct ct_example_rule *r, uint64_t index,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t count = p->n[0] * p->n[1] * p->n[2];
	const struct ct_env alone = {.stop = env->stop};
	struct ct_restore_rule rule;
	struct ct_restore_report report;
	struct ct_vol v = {0}, lo = {0};
	bool nothing;
	int rc = -1;

	if (ct_vol_alloc(&v, p->n, e))
		return -1;
	for (size_t i = 0; i < count; i++)
		v.data[i] = p->base[i] + p->rest[i];
	if (trust(&rule, &nothing, p, r, p->n, e) ||
		ct_degrade_volume(&lo, &v, &rule.by, rule.noise, r->seed + index, NULL, e))
		goto out;
	rule.passes = r->whole ? ct_slice_prior_passes(r->after, &rule.by) : 1;
	rule.flat = false; /* of the last pass, which is that of the network in training */
	for (size_t i = 0; i < count; i++) {
		p->rest[i] = v.data[i];
		v.data[i] = p->base[i];
	}
	rc = ct_restore(&v, NULL, &lo, r->after, &rule, &report, &alone, e);
	for (size_t i = 0; i < count && rc == 0; i++) {
		p->base[i] = v.data[i];
		p->rest[i] -= v.data[i];
	}
	ct_example_weigh(p);
	if (r->whole)
		p->regime = ct_restore_regime(&rule.by, rule.noise);
out:
	ct_vol_free(&v);
	ct_vol_free(&lo);
	return rc;
}

void ct_example_free(struct ct_example *p)
{
	free(p->base);
	*p = (struct ct_example){0};
}
