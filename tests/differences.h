/* differences.h: a fast layer against a plain one in double: its values, and its backward against
 * central differences of the plain one. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_DIFFERENCES_H
#define CT_TESTS_DIFFERENCES_H
#include "core/rng.h"
#include "nn/attention.h"
#include "nn/conv.h"
#include "nn/norm.h"
#include "nn/window-attention.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 6000, INPUTS = 5 };

/* y[ny] from the inputs, each of n[i] numbers. */
struct layer {
	const char *name;
	size_t ny, inputs, n[INPUTS];
	void (*plain)(const struct layer *l, double *y, double *const *in);
	struct ct_norm norm;
	struct ct_attn attn;
	struct ct_conv_shape conv;
	struct ct_window window;
	size_t h, w, c, ca; /* and what a layer means by them */
};

static double *in_d[INPUTS], y_d[MOST], y2_d[MOST], weight_d[MOST];
static float *in_f[INPUTS], *grad_f[INPUTS], y_f[MOST], dy_f[MOST];

static double worst; /* relative to the largest entry */

__attribute__((unused)) static void compare(
	size_t n, const double *want, const float *got, double *most)
{
	double top = 1e-30;

	for (size_t i = 0; i < n; i++)
		top = fmax(top, fabs(want[i]));
	for (size_t i = 0; i < n; i++) {
		double d = fabs(want[i] - (double)got[i]) / top;

		*most = d <= *most ? *most : d;
	}
}

__attribute__((unused)) static void draw(const struct layer *l)
{
	for (size_t i = 0; i < l->inputs; i++) {
		if (l->n[i] > MOST || l->ny > MOST)
			abort();
		for (size_t k = 0; k < l->n[i]; k++) {
			in_f[i][k] = ct_rng_normal(1, i, k);
			in_d[i][k] = (double)in_f[i][k];
			grad_f[i][k] = 0;
		}
	}
	for (size_t k = 0; k < l->ny; k++) {
		dy_f[k] = ct_rng_normal(2, 0, k);
		weight_d[k] = (double)dy_f[k];
	}
	l->plain(l, y_d, in_d);
}

/* Central differences of sum(weight y) against the gradients in grad_f. */
__attribute__((unused)) static void differences(const struct layer *l)
{
	const double h = 1e-5;

	worst = 0;
	for (size_t i = 0; i < l->inputs; i++) {
		double want[MOST];

		for (size_t k = 0; k < l->n[i]; k++) {
			const double was = in_d[i][k];
			double sum = 0;

			in_d[i][k] = was + h;
			l->plain(l, y_d, in_d);
			in_d[i][k] = was - h;
			l->plain(l, y2_d, in_d);
			in_d[i][k] = was;
			for (size_t j = 0; j < l->ny; j++)
				sum += weight_d[j] * (y_d[j] - y2_d[j]);
			want[k] = sum / (2 * h);
		}
		compare(l->n[i], want, grad_f[i], &worst);
	}
}

__attribute__((unused)) static void check_forward(const struct layer *l)
{
	double most = 0;

	compare(l->ny, y_d, y_f, &most);
	OK(most < 2e-6, "%s: forward", l->name);
	if (!(most < 2e-6))
		printf("# off by %g\n", most);
}

__attribute__((unused)) static void check_back(const struct layer *l)
{
	differences(l);
	OK(worst < 2e-5, "%s: backward is the derivative", l->name);
	if (!(worst < 2e-5))
		printf("# off by %g\n", worst);
}

static void begin(void)
{
	for (size_t i = 0; i < INPUTS; i++) {
		in_d[i] = calloc(MOST, sizeof **in_d);
		in_f[i] = aligned_alloc(64, (size_t)MOST * 64);
		grad_f[i] = aligned_alloc(64, (size_t)MOST * 64);
		if (!in_d[i] || !in_f[i] || !grad_f[i])
			exit(99);
	}
}

static void end(void)
{
	for (size_t i = 0; i < INPUTS; i++) {
		free(in_d[i]);
		free(in_f[i]);
		free(grad_f[i]);
	}
}

#endif
