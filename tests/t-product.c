/* Products with a matrix that stays: against sums in double; any number of rows; two threads on one
 * product. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "core/rng.h"
#include "core/simd.h"
#include "numbers.h"
#include "nn/dnn.h"
#include "nn/product.h"

#include <math.h>
#include <stdlib.h>

enum { ROWS = 21, COLUMNS = 137, WIDE = 24, MOST = 96 };

static double worst_of(const float *y, const float *x, const float *w, size_t n)
{
	double worst = 0;

	for (size_t i = 0; i < n; i++)
		for (size_t k = 0; k < ROWS; k++) {
			double sum = 0;

			for (size_t j = 0; j < COLUMNS; j++)
				sum += (double)x[i * COLUMNS + j] * (double)w[k * COLUMNS + j];
			worst = fmax(worst, fabs(sum - (double)y[i * WIDE + k]));
		}
	return worst;
}

struct job {
	const struct ct_product *p;
	const float *x;
	float (*y)[MOST * WIDE];
};

static void run(void *arg, size_t i, size_t worker)
{
	struct job *j = arg;
	struct ct_err e = {0};
	const int was = ct_dnn_enter();

	(void)worker;
	if (ct_product_run(j->p, j->x, MOST, j->y[i], &e))
		j->y[i][0] = NAN;
	ct_dnn_leave(was);
}

static void product(void)
{
	static float w[ROWS * COLUMNS], x[MOST * COLUMNS], y[MOST * WIDE], two[4][MOST * WIDE];
	const size_t rows[] = {1, 31, 32, 33, MOST};
	struct ct_product *p;
	struct ct_par *par;
	int fit = 0;

	ct_rng_normals(ROWS * COLUMNS, w, 1, 0, 0);
	ct_rng_normals(MOST * COLUMNS, x, 2, 0, 0);
	must(ct_product_alloc(&p, w, ROWS, COLUMNS, WIDE, &err));
	for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
		const int was = ct_dnn_enter();
		double worst;

		for (size_t i = 0; i < MOST * WIDE; i++)
			y[i] = 7;
		must(ct_product_run(p, x, rows[k], y, &err));
		ct_dnn_leave(was);
		worst = worst_of(y, x, w, rows[k]);
		OK(worst < 5e-5 && y[WIDE - 1] == 7, "%zu rows (%g)", rows[k], worst);
	}
	must(ct_par_alloc(&par, 2, &err));
	ct_par_for(par, 4, run, &(struct job){p, x, two});
	for (int k = 0; k < 4; k++) {
		const double worst = worst_of(two[k], x, w, MOST);

		fit += worst < 5e-5;
	}
	OK(fit == 4, "two threads on one");
	ct_par_free(par);
	ct_product_free(p);
}

int main(void)
{
	product();
	for (int level = ct_simd_level(); level > 2; level--) {
		must(ct_simd_use(level == 4 ? "v4" : "v3", &err));
		product();
	}
	return tap_done();
}
