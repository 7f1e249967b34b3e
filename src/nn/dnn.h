/* dnn.h: oneDNN 2.6 or 3.x, and its matrix products; its convolutions are in conv.h.
 *
 * The only doors to that library. It wants weights in orders of its own: ct_dnn keeps one copy of
 * each in the order that each direction likes, shared by every convolution made with the same
 * weights. It uses no instructions above ct_simd_level (core/simd.h).
 *
 * Threads: everything here runs on the calling thread between ct_dnn_enter and ct_dnn_leave, so
 * that the sums do not depend on the number of threads; images are what is run in parallel. A
 * ct_conv belongs to one thread at a time; ct_conv_alloc and ct_dnn_refresh of one ct_dnn are not
 * to be called at the same time.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_DNN_H
#define CT_NN_DNN_H
#include "core/err.h"
#include "core/par.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_dnn;

/* One thread for the library on this thread from here; the value to hand to ct_dnn_leave. */
int ct_dnn_enter(void);
void ct_dnn_leave(int was);

int ct_dnn_alloc(struct ct_dnn **out, struct ct_err *e);
void ct_dnn_free(struct ct_dnn *d);
/* The weights that the convolutions were made with have changed: order them anew. */
void ct_dnn_refresh(struct ct_dnn *d, struct ct_par *par);

/* C[m][n] = alpha op(A) op(B) + beta C, rows of lda, ldb, ldc floats; op transposes if asked.
 * CT_EFAIL. */
int ct_dnn_sgemm(bool ta, bool tb, size_t m, size_t n, size_t k, float alpha, const float *a,
	size_t lda, const float *b, size_t ldb, float beta, float *c, size_t ldc, struct ct_err *e);

#endif
