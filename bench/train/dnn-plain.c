/* dnn-plain.c: the matrix products of nn/dnn.h and nn/product.h without oneDNN, for a static
 * program. There are no convolutions: the volume network is refused. A matrix is kept in panels of
 * PANEL rows; a tile of ROWS rows of x meets one panel in registers.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "nn/conv.h"
#include "nn/dnn.h"
#include "nn/product.h"

#include <stdlib.h>
#include <string.h>

enum { PANEL = 16, ROWS = 6 };
typedef float lanes __attribute__((vector_size(PANEL * sizeof(float) / 2)));
typedef float unaligned
	__attribute__((vector_size(PANEL * sizeof(float) / 2), aligned(4), may_alias));

struct ct_product {
	size_t rows, columns, ldy;
	float *panel; /* owned: [rows / PANEL, rounded up][columns][PANEL] */
};

int ct_dnn_enter(void)
{
	return 0;
}

void ct_dnn_leave(int was)
{
	(void)was;
}

static float *panels(const float *b, size_t ldb, bool transposed, size_t n, size_t k)
{
	const size_t count = (n + PANEL - 1) / PANEL;
	float *p = calloc(count * PANEL * k, sizeof *p);

	for (size_t j = 0; j < n && p; j++)
		for (size_t i = 0; i < k; i++)
			p[(j / PANEL * k + i) * PANEL + j % PANEL] =
				transposed ? b[j * ldb + i] : b[i * ldb + j];
	return p;
}

#define LOAD(p) (*(const unaligned *)(const void *)(p))
#define STEP(r)                                                                                    \
	do {                                                                                       \
		const float v = row[r][i];                                                         \
                                                                                                   \
		s##r += v * b;                                                                     \
		t##r += v * c;                                                                     \
	} while (0)
#define STORE(r) (memcpy(y[r], &s##r, sizeof s##r), memcpy(y[r] + PANEL / 2, &t##r, sizeof t##r))

/* y[m][PANEL] = x[m][k] panel, m at most ROWS: all sums in registers. */
static void tile(
	float (*y)[PANEL], const float *x, size_t ldx, size_t m, const float *panel, size_t k)
{
	lanes s0 = {0}, s1 = {0}, s2 = {0}, s3 = {0}, s4 = {0}, s5 = {0};
	lanes t0 = {0}, t1 = {0}, t2 = {0}, t3 = {0}, t4 = {0}, t5 = {0};
	const float *row[ROWS];

	for (size_t r = 0; r < ROWS; r++)
		row[r] = x + (r < m ? r : 0) * ldx;
	for (size_t i = 0; i < k; i++) {
		const lanes b = LOAD(panel + i * PANEL), c = LOAD(panel + i * PANEL + PANEL / 2);

		STEP(0);
		STEP(1);
		STEP(2);
		STEP(3);
		STEP(4);
		STEP(5);
	}
	STORE(0);
	STORE(1);
	STORE(2);
	STORE(3);
	STORE(4);
	STORE(5);
}

static void multiply(float *c, size_t ldc, const float *a, size_t lda, const float *panel, size_t m,
	size_t n, size_t k, float alpha, float beta)
{
	float y[ROWS][PANEL];

	for (size_t j = 0; j < n; j += PANEL)
		for (size_t i = 0; i < m; i += ROWS) {
			const size_t rows = m - i < ROWS ? m - i : ROWS,
				     columns = n - j < PANEL ? n - j : PANEL;

			tile(y, a + i * lda, lda, rows, panel + j * k, k);
			for (size_t r = 0; r < rows; r++)
				for (size_t q = 0; q < columns; q++) {
					float *to = c + (i + r) * ldc + j + q;

					*to = alpha * y[r][q] + (beta == 0 ? 0 : beta * *to);
				}
		}
}

int ct_dnn_sgemm(bool ta, bool tb, size_t m, size_t n, size_t k, float alpha, const float *a,
	size_t lda, const float *b, size_t ldb, float beta, float *c, size_t ldc, struct ct_err *e)
{
	float *panel = panels(b, ldb, tb, n, k), *rows = NULL;
	int rc = -1;

	if (ta && (rows = malloc(m * k * sizeof *rows)))
		for (size_t i = 0; i < m; i++)
			for (size_t q = 0; q < k; q++)
				rows[i * k + q] = a[q * lda + i];
	if (panel && (rows || !ta)) {
		multiply(c, ldc, ta ? rows : a, ta ? k : lda, panel, m, n, k, alpha, beta);
		rc = 0;
	}
	free(panel);
	free(rows);
	return rc ? ct_fail(e, CT_ENOMEM, "no memory for a matrix product") : 0;
}

bool ct_product_orders(void)
{
	return true;
}

int ct_product_alloc(struct ct_product **out, const float *matrix, size_t rows, size_t columns,
	size_t ldy, struct ct_err *e)
{
	if (ct_alloc0(out, 1, sizeof **out, e))
		return -1;
	**out = (struct ct_product){
		rows, columns, ldy, panels(matrix, columns, true, rows, columns)};
	return (*out)->panel ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a matrix");
}

void ct_product_free(struct ct_product *p)
{
	if (p)
		free(p->panel);
	free(p);
}

int ct_product_run(const struct ct_product *p, const float *x, size_t n, float *y, struct ct_err *e)
{
	(void)e;
	multiply(y, p->ldy, x, p->columns, p->panel, n, p->rows, p->columns, 1, 0);
	return 0;
}

int ct_dnn_alloc(struct ct_dnn **out, struct ct_err *e)
{
	(void)out;
	return ct_fail(
		e, CT_EFAIL, "no convolutions in this program: leave the volume network out");
}

void ct_dnn_free(struct ct_dnn *d)
{
	(void)d;
}

int ct_conv_alloc(struct ct_conv **out, struct ct_dnn *d, const struct ct_conv_shape *s, size_t key,
	const float *weight, bool train, struct ct_err *e)
{
	(void)s;
	(void)key;
	(void)weight;
	(void)train;
	*out = NULL;
	return ct_dnn_alloc(&d, e);
}

void ct_conv_free(struct ct_conv *c)
{
	(void)c;
}

size_t ct_conv_scratch(const struct ct_conv *c)
{
	(void)c;
	return 0;
}

int ct_conv_forward(struct ct_conv *c, float *y, const float *x, const float *bias,
	const float *add, void *scratch, struct ct_err *e)
{
	(void)c;
	(void)y;
	(void)x;
	(void)bias;
	(void)add;
	(void)scratch;
	return ct_dnn_alloc(NULL, e);
}
