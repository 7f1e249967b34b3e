/* dense.c: see dense.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/dense.h"
#include "nn/dnn.h"

enum { NARROW = 64 };

static bool narrow(const struct ct_dense *s)
{
	return s->out <= NARROW || s->in <= NARROW;
}

int ct_dense_forward(
	const struct ct_dense *s, float *y, const float *x, float slope, struct ct_err *e)
{
	const struct ct_dense_product p = {.rows = s->out,
		.depth = s->in,
		.cols = s->cols,
		.ld = s->ld,
		.y = y,
		.w = s->w,
		.x = x,
		.b = s->b,
		.wr = s->stride,
		.wk = 1,
		.slope = slope};

	if (narrow(s)) {
		CT_SIMD(ct_dense_kernels_product)(&p);
		return 0;
	}
	if (ct_dnn_sgemm(false, false, s->out, s->cols, s->in, 1, s->w, s->stride, x, s->ld, 0, y,
		    s->ld, e))
		return -1;
	CT_SIMD(ct_dense_kernels_finish)(&p);
	return 0;
}

int ct_dense_back(const struct ct_dense *s, float *dx, const float *d, const float *mask,
	float slope, bool add, struct ct_err *e)
{
	const struct ct_dense_product p = {.rows = s->in,
		.depth = s->out,
		.cols = s->cols,
		.ld = s->ld,
		.y = dx,
		.w = s->w,
		.x = d,
		.mask = mask,
		.wr = 1,
		.wk = s->stride,
		.slope = mask ? slope : 1.0f,
		.add = add};

	if (narrow(s)) {
		CT_SIMD(ct_dense_kernels_product)(&p);
		return 0;
	}
	if (ct_dnn_sgemm(true, false, s->in, s->cols, s->out, 1, s->w, s->stride, d, s->ld,
		    add ? 1 : 0, dx, s->ld, e))
		return -1;
	if (mask)
		CT_SIMD(ct_dense_kernels_finish)(&p);
	return 0;
}

int ct_dense_gradient(const struct ct_dense *s, float *dw, float *db, const float *d,
	const float *x, struct ct_err *e)
{
	if (db)
		CT_SIMD(ct_dense_kernels_sums)(s->out, s->cols, s->ld, db, d, NULL);
	if (narrow(s)) {
		CT_SIMD(ct_dense_kernels_gradient)
		(s->out, s->in, s->cols, s->ld, dw, s->stride, d, x);
		return 0;
	}
	return ct_dnn_sgemm(
		false, true, s->out, s->in, s->cols, 1, d, s->ld, x, s->ld, 1, dw, s->stride, e);
}

int ct_dense_rows_forward(
	const struct ct_dense_rows *s, float *y, const float *x, bool add, struct ct_err *e)
{
	return ct_dnn_sgemm(false, true, s->n, s->out, s->in, 1, x, s->ldx, s->w, s->stride,
		add ? 1 : 0, y, s->ldy, e);
}

int ct_dense_rows_back(
	const struct ct_dense_rows *s, float *dx, const float *d, bool add, struct ct_err *e)
{
	return ct_dnn_sgemm(false, false, s->n, s->in, s->out, 1, d, s->ldy, s->w, s->stride,
		add ? 1 : 0, dx, s->ldx, e);
}

int ct_dense_rows_gradient(const struct ct_dense_rows *s, float *dw, const float *d, const float *x,
	bool add, struct ct_err *e)
{
	return ct_dnn_sgemm(true, false, s->out, s->in, s->n, 1, d, s->ldy, x, s->ldx, add ? 1 : 0,
		dw, s->stride, e);
}
