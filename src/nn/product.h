/* product.h: y = x W^T with a matrix W that stays, for many x.
 *
 * Where the processor has AVX-512 (ct_simd_level), oneDNN keeps W in an order of its own, once.
 * Elsewhere it is ct_dnn_sgemm.
 *
 * Threads: any may run one product, at the same time, each between ct_dnn_enter and ct_dnn_leave.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_PRODUCT_H
#define CT_NN_PRODUCT_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_PRODUCT_ROWS = 32 };

struct ct_product;

/* Does a product keep its matrix in another order? */
bool ct_product_orders(void);

/* W (rows,columns), borrowed. y has rows of ldy floats. CT_EFAIL, CT_ENOMEM. */
int ct_product_alloc(struct ct_product **out, const float *matrix, size_t rows, size_t columns,
	size_t ldy, struct ct_err *e);
void ct_product_free(struct ct_product *p);

/* y = x W^T, of n rows. Both have room for n rounded up to CT_PRODUCT_ROWS; what is in these rows
 * of x is read and does not matter. CT_EFAIL, CT_ENOMEM. */
int ct_product_run(
	const struct ct_product *p, const float *x, size_t n, float *y, struct ct_err *e);

#endif
