/* densify.c: see densify.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/densify.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/gaussian.h"

#include <math.h>

#define SHRINK 1.6 /* of a child's axes */

void ct_densify_note(struct ct_gs_adam *a, size_t n, const struct ct_gradient *grad)
{
	for (size_t i = 0; i < n; i++)
		if (grad->screen[i] >= 0) {
			a->screen[i] += grad->screen[i];
			a->seen[i] += 1;
		}
}

static void copy(struct ct_gauss *g, size_t to, size_t from)
{
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		g->column[k][to] = g->column[k][from];
}

static void halve(struct ct_gauss *g, size_t i)
{
	double rho = ct_activation_apply(g->activation, g->gamma, (double)g->raw[i]);

	g->raw[i] = (float)ct_activation_inverse(g->activation, g->gamma, rho / 2);
}

/* i and `twin` become children of i: centres drawn from it. */
static void split(
	struct ct_gauss *g, size_t i, size_t twin, double ln_least, uint64_t seed, size_t iteration)
{
	const size_t child[2] = {i, twin};
	struct ct_gaussian b;
	double p[3], l[3], q[4];

	for (int k = 0; k < 3; k++) {
		p[k] = (double)g->pos[k][i];
		l[k] = (double)g->scale[k][i];
	}
	for (int k = 0; k < 4; k++)
		q[k] = (double)g->rot[k][i];
	ct_gaussian_make(&b, p, l, q, 0);
	for (size_t c = 0; c < 2; c++)
		for (int a = 0; a < 3; a++) {
			double at = b.p[a];

			for (size_t k = 0; k < 3; k++)
				at += b.a[a][k] * b.s[k] *
				      (double)ct_rng_normal(
					      seed, CT_STREAM_SPLIT + iteration, i * 6 + c * 3 + k);
			g->pos[a][child[c]] = (float)at;
			g->scale[a][child[c]] = (float)fmax(l[a] - log(SHRINK), ln_least);
		}
}

static bool keep(const struct ct_gauss *g, size_t i, const struct ct_densify_rule *r)
{
	const struct ct_block *box = &r->box;
	double z = (double)g->raw[i];

	if (r->by_density || g->activation == CT_SOFTPLUS || g->activation == CT_RELU)
		z = ct_activation_apply(g->activation, g->gamma, z);
	if (fabs(z) < r->least)
		return false;
	for (int k = 0; k < 3; k++) {
		double at = 0;

		for (int a = 0; a < 3; a++)
			at += box->inv[k][a] * ((double)g->pos[a][i] - box->world[a]);
		if (!(at >= -0.5 && at <= (double)box->n[k] - 0.5))
			return false;
	}
	return true;
}

static size_t prune(struct ct_gauss *g, struct ct_gs_adam *a, const struct ct_densify_rule *r)
{
	size_t to = 0, pruned;

	for (size_t i = 0; i < g->n; i++) {
		if (!keep(g, i, r))
			continue;
		if (to != i) {
			copy(g, to, i);
			ct_gs_adam_move(a, to, i);
		}
		to++;
	}
	pruned = g->n - to;
	g->n = to;
	return pruned;
}

/* Does its mean screen gradient reach the threshold? */
static bool pulls(const struct ct_gs_adam *a, size_t i, double threshold)
{
	double seen = (double)a->seen[i];

	return seen > 0 && (double)a->screen[i] >= threshold * seen;
}

int ct_densify_control(struct ct_gauss *g, struct ct_gs_adam *a, const struct ct_densify_rule *r,
	struct ct_densify_count *count, uint64_t seed, size_t iteration, struct ct_err *e)
{
	size_t old = g->n, born = 0, at = old;

	*count = (struct ct_densify_count){0};
	for (size_t i = 0; i < old; i++)
		born += pulls(a, i, r->grad);
	if (old >= r->most)
		born = 0;
	else if (born > r->most - old)
		born = r->most - old;
	if (ct_gauss_reserve(g, old + born, e) || ct_gs_adam_reserve(a, old, old + born, e))
		return -1;
	for (size_t i = 0; i < old && at < old + born; i++) {
		double longest = fmax((double)g->scale[0][i],
			fmax((double)g->scale[1][i], (double)g->scale[2][i]));

		if (!pulls(a, i, r->grad))
			continue;
		halve(g, i);
		copy(g, at, i);
		if (exp(longest) > r->large) {
			split(g, i, at, r->ln_least, seed, iteration);
			ct_gs_adam_reset(a, i);
			count->split++;
		} else
			count->cloned++;
		at++;
	}
	g->n = at;
	count->pruned = prune(g, a, r);
	for (size_t i = 0; i < g->n; i++) {
		a->screen[i] = 0;
		a->seen[i] = 0;
	}
	return g->n ? 0
		    : ct_fail(e, CT_ENUMERIC, "no Gaussian is left at iteration %zu", iteration);
}
