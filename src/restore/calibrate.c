/* calibrate.c: ct_learn_calibrate (learn.h): what the error of a voxel is, of what the slices say.
 * Least squares of the square of the error, over all voxels of the pairs, each relative to what is
 * said there; no part is negative. */
#include "config.h"
#include "core/mem.h"
#include "restore/learn.h"
#include "restore/predict.h"

#include <math.h>
#include <stdlib.h>

enum { N = CT_SPREADS, ROUNDS = 2000 };
#define LEAST_VARIANCE 25.0 /* HU^2: the least predicted variance */

/* Sums over the voxels of a pair. */
static void gather(
	double a[N][N], double b[N], const struct ct_example *p, const struct ct_guess *g)
{
	const size_t n = p->n[0] * p->n[1] * p->n[2];

	for (size_t i = 0; i < n; i++) {
		const double axes = (double)g->axes, v = (double)g->v[i] / axes;
		const double miss = (double)p->rest[i] - (double)g->h[i] / axes;
		const double w = 1 / (v + LEAST_VARIANCE);
		const double x[N] = {w * v, w, w * p->regime.noise * p->regime.noise};

		for (int j = 0; j < N; j++) {
			for (int k = 0; k < N; k++)
				a[j][k] += x[j] * x[k];
			b[j] += w * miss * miss * x[j];
		}
	}
}

/* x >= 0 of least x.a.x / 2 - b.x, one coordinate after the other. */
static void solve(float x[N], double a[N][N], const double b[N])
{
	double at[N] = {0};

	for (int round = 0; round < ROUNDS; round++)
		for (int j = 0; j < N; j++) {
			double rest = b[j];

			for (int k = 0; k < N; k++)
				rest -= k == j ? 0 : a[j][k] * at[k];
			at[j] = a[j][j] > 0 ? fmax(rest / a[j][j], 0) : 0;
		}
	for (int j = 0; j < N; j++)
		x[j] = (float)at[j];
}

int ct_learn_calibrate(struct ct_slice_network *r, const struct ct_example *pairs, size_t n,
	const struct ct_env *asked, struct ct_err *e)
{
	static const bool all[3] = {true, true, true};
	const struct ct_env env = {.par = asked->par, .stop = asked->stop};
	double a[N][N] = {{0}}, b[N] = {0};
	size_t textured, cells;

	r->spread[0] = 1;
	for (size_t i = 0; i < n; i++) {
		const struct ct_example *p = &pairs[i];
		const struct ct_scene s = {.x = p->base,
			.n = {p->n[0], p->n[1], p->n[2]},
			.coarse = {p->coarse[0], p->coarse[1], p->coarse[2]},
			.regime = p->regime};
		const size_t count = p->n[0] * p->n[1] * p->n[2];
		struct ct_guess g = {0};
		int rc;

		if (ct_alloc0(&g.h, 2 * count, sizeof *g.h, e))
			return -1;
		g.v = g.h + count;
		rc = ct_predict(&g, &s, r, all, &textured, &cells, &env, e);
		if (rc == 0)
			gather(a, b, p, &g);
		free(g.h);
		if (rc)
			return -1;
	}
	solve(r->spread, a, b);
	return 0;
}
