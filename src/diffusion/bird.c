/* bird.c: the noise that a chain begins with, fitted to y (sampler.h, CT_SAMPLER_BIRD).
 *
 * x(z) is the result of the deterministic DDIM that begins with noise z; a step of Adam on z
 * against the mean (A x(z) - y)^2, then z is put back on the sphere of radius sqrt(values). The
 * gradient goes through every move of the chain, also back in time, and through the network unless
 * it is frozen.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "diffusion/draw.h"
#include "core/mem.h"
#include "solve/adam.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Move k, forward: x = m.x x' + m.x0 x0, x0 = (x' - b eps(x')) / a. to0, the gradient to x0 of what
 * came after, is used up. */
static int move_back(struct ct_draw *w, size_t k, const float *x, float *g, float *to0,
	float *through, struct ct_err *e)
{
	const struct ct_sampler *s = w->s;
	const struct ct_ddim m = ct_ddim_weights(s, k, false);
	double abar = ct_schedule_abar(s->schedule, s->t[k]), a = sqrt(abar), b = sqrt(1.0 - abar);

	for (size_t i = 0; i < w->all; i++) {
		to0[i] = (float)(((double)to0[i] + m.x0 * (double)g[i]) / a);
		w->eps[i] = (float)(-b * (double)to0[i]);
	}
	if (!s->how.frozen && s->back(s->eps_ctx, (double)s->t[k], x, through, w->eps, e))
		return -1;
	for (size_t i = 0; i < w->all; i++) {
		double by = s->how.frozen ? 0.0 : (double)through[i];

		g[i] = (float)(m.x * (double)g[i] + (double)to0[i] + by);
	}
	memset(to0, 0, w->all * sizeof *to0);
	return 0;
}

int ct_draw_gradient(struct ct_draw *w, const float *trail, bool init, float *g, float *scratch,
	struct ct_err *e)
{
	const struct ct_sampler *s = w->s;
	float *to0 = scratch, *through = scratch + w->all;

	memset(to0, 0, w->all * sizeof *to0);
	for (size_t k = s->nt - 1; k-- > 0;)
		if (s->t[k + 1] > s->t[k]) { /* x = a x0 + noise, and what x was is of no account */
			double a = sqrt(ct_schedule_abar(s->schedule, s->t[k + 1]));

			for (size_t i = 0; i < w->all; i++) {
				to0[i] += (float)(a * (double)g[i]);
				g[i] = 0;
			}
		} else if (move_back(w, k, trail + k * w->all, g, to0, through, e))
			return -1;
	if (init)
		for (size_t i = 0; i < w->all; i++)
			g[i] *= (float)sqrt(1.0 - ct_schedule_abar(s->schedule, s->t[0]));
	return 0;
}

/* g = gradient of the mean (A x - y)^2; r[m] is scratch. */
static void error_gradient(
	const struct ct_draw *w, float *g, float *r, const float *x, const float *y)
{
	const struct ct_measurement *op = w->s->op;
	const double by = 2.0 / (double)(w->s->channels * w->m);

	for (size_t c = 0; c < w->s->channels; c++) {
		ct_measurement_forward(op, r, x + c * w->n, w->t);
		for (size_t i = 0; i < w->m; i++)
			r[i] = (float)(by * ((double)r[i] - (double)y[c * w->m + i]));
		ct_measurement_adjoint(op, g + c * w->n, r, w->t);
	}
}

/* Onto the sphere of radius sqrt(n), where almost all of the noise is. */
static void to_sphere(size_t n, float *z)
{
	double sum = 0.0, by;

	for (size_t i = 0; i < n; i++)
		sum += (double)z[i] * (double)z[i];
	by = sqrt((double)n / sum);
	for (size_t i = 0; i < n; i++)
		z[i] = (float)(by * (double)z[i]);
}

int ct_draw_bird(struct ct_draw *w, float *x, const float *y, const float *init, struct ct_err *e)
{
	const struct ct_sampler *s = w->s;
	const size_t n = w->all, bytes = n * sizeof(float);
	struct ct_adamw adam;
	float *own = NULL, *trail = NULL, *noise, *moment, *g, *scratch, *rest;
	int rc = -1;

	adam = ct_adamw_default();
	adam.lr = s->how.rate;
	if (ct_alloc0(&own, 6 * n + w->m, sizeof *own, e) || ct_alloc(&trail, s->nt, bytes, e))
		goto out;
	noise = own;
	moment = noise + n; /* the first, and the second behind it */
	g = moment + 2 * n;
	scratch = g + n;
	rest = scratch + 2 * n;
	memcpy(noise, w->z, bytes);
	for (size_t step = 1;; step++) {
		memcpy(w->z, noise, bytes);
		ct_draw_begin(w, x, init);
		if (ct_draw_run(w, x, trail, e))
			goto out;
		if (step >= s->how.iterations)
			break;
		error_gradient(w, g, rest, x, y);
		if (ct_draw_gradient(w, trail, init != NULL, g, scratch, e))
			goto out;
		CT_SIMD(ct_adamw_step)(&adam, step, n, noise, moment, moment + n, g);
		to_sphere(n, noise);
	}
	rc = 0;
out:
	free(own);
	free(trail);
	return rc;
}
