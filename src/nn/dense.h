/* dense.h: dense layers of many points, forward and backward: of neural fields, of ArSSR and of the
 * slice network.
 *
 * ct_dense: activations are feature-major: row f of `ld` floats holds feature f of all points;
 * `cols` columns count, a multiple of CT_DENSE_LANES. Narrow layers run in kernels of their own,
 * wide ones in oneDNN's sgemm (nn/dnn.h), on the calling thread between ct_dnn_enter and
 * ct_dnn_leave. Which of both depends on the shape alone. ct_dense_rows: a row of activations is a
 * point, all by oneDNN. CT_EFAIL of oneDNN. Thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_DENSE_H
#define CT_NN_DENSE_H
#include "core/err.h"
#include "nn/dense-kernels.h"

/* A layer of W (out,in), rows of `stride` floats, and b (out), or NULL: on columns of activations.
 */
struct ct_dense {
	size_t in, out, stride;
	const float *w, *b;
	size_t cols, ld;
};

/* y = a(W x + b), a(t) = t, or slope t where t is negative. */
int ct_dense_forward(
	const struct ct_dense *s, float *y, const float *x, float slope, struct ct_err *e);
/* dx (+)= W^T d; times `slope` where `mask`, the activation that x is, is not positive (NULL:
 * nowhere). */
int ct_dense_back(const struct ct_dense *s, float *dx, const float *d, const float *mask,
	float slope, bool add, struct ct_err *e);
/* dw (rows of stride) += d x^T, db += the sum of d's columns (db NULL: not). */
int ct_dense_gradient(const struct ct_dense *s, float *dw, float *db, const float *d,
	const float *x, struct ct_err *e);

/* A layer of W (out,in), rows of `stride` floats, on n rows of ldx and, of its results, ldy floats.
 */
struct ct_dense_rows {
	size_t in, out, stride;
	const float *w;
	size_t n, ldx, ldy;
};

/* y (+)= x W^T. */
int ct_dense_rows_forward(
	const struct ct_dense_rows *s, float *y, const float *x, bool add, struct ct_err *e);
/* dx (+)= d W. */
int ct_dense_rows_back(
	const struct ct_dense_rows *s, float *dx, const float *d, bool add, struct ct_err *e);
/* dw (rows of stride) (+)= d^T x. */
int ct_dense_rows_gradient(const struct ct_dense_rows *s, float *dw, const float *d, const float *x,
	bool add, struct ct_err *e);

#endif
