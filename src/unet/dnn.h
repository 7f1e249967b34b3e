/* dnn.h: convolutions, forward and backward, and matrix products from oneDNN 2.6 or 3.x.
 *
 * The only door to that library. Activations are [h][w][c] (channels last) float, one image a
 * call; weights and their gradients are plain [co][ci][k][k], cross-correlation, zero padding
 * k/2. The library wants its weights in another order: ct_dnn keeps one copy of each in the order
 * that each direction likes, shared by every convolution made with the same weights.
 *
 * Threads: everything here runs on the calling thread between ct_dnn_enter and ct_dnn_leave, so
 * that the sums do not depend on the number of threads; images are what is run in parallel. A
 * ct_conv belongs to one thread at a time; ct_conv_alloc and ct_dnn_refresh of one ct_dnn are not
 * to be called at the same time.
 */
#ifndef CT_UNET_DNN_H
#define CT_UNET_DNN_H
#include "core/err.h"
#include "core/par.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_dnn;
struct ct_conv;

struct ct_conv_shape {
	size_t h, w; /* of the input; the output is ceil(h/stride) x ceil(w/stride) */
	size_t ci, co;
	size_t k;      /* 1 or 3 */
	size_t stride; /* 1 or 2 */
	bool add;      /* another image is added to the output */
};

/* One thread for the library on this thread from here; the value to hand to ct_dnn_leave. */
int ct_dnn_enter(void);
void ct_dnn_leave(int was);

int ct_dnn_alloc(struct ct_dnn **out, struct ct_err *e);
void ct_dnn_free(struct ct_dnn *d);
/* The weights that the convolutions were made with have changed: order them anew. */
int ct_dnn_refresh(struct ct_dnn *d, struct ct_par *par, struct ct_err *e);

/* `weight` is borrowed for the life of *d. With `train`, the backward directions too. CT_EFAIL with
 * oneDNN's word for it. */
int ct_conv_alloc(struct ct_conv **out, struct ct_dnn *d, const struct ct_conv_shape *s,
	const float *weight, bool train, struct ct_err *e);
void ct_conv_free(struct ct_conv *c);
/* Bytes of scratch, 64-byte aligned, that the calls below need. */
size_t ct_conv_scratch(const struct ct_conv *c);
/* y[ho][wo][co] = w * x[h][w][ci] + bias[co] (+ add[ho][wo][co] if the shape says so). */
int ct_conv_forward(struct ct_conv *c, float *y, const float *x, const float *bias,
	const float *add, void *scratch, struct ct_err *e);
/* dx = w^T dy. */
int ct_conv_back_data(
	struct ct_conv *c, float *dx, const float *dy, void *scratch, struct ct_err *e);
/* dw[co][ci][k][k] += dy x^T, db[co] += sum dy. */
int ct_conv_back_weights(struct ct_conv *c, float *dw, float *db, const float *x, const float *dy,
	void *scratch, struct ct_err *e);

/* C[m][n] = alpha op(A) op(B) + beta C, rows of lda, ldb, ldc floats; op transposes if asked.
 * CT_EFAIL. */
int ct_sgemm(bool ta, bool tb, size_t m, size_t n, size_t k, float alpha, const float *a,
	size_t lda, const float *b, size_t ldb, float beta, float *c, size_t ldc, struct ct_err *e);

#endif
