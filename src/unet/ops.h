/* ops.h: the operations of networks of super-resolution on the images of a plan (plan.c): which
 * layer, of which shape.
 *
 * Thread-safe on different images, between ct_dnn_enter and ct_dnn_leave.
 */
#ifndef CT_UNET_OPS_H
#define CT_UNET_OPS_H
#include "unet/graph.h"

/* One operation: its input, second input, output and parameters, what of them it has. */
struct ct_ops {
	const struct ct_graph_op *op;
	struct ct_image in, out;
	bool one; /* the second input has one pixel */
	const float *x, *b, *param[2];
	float *y;
	/* Backward: gradients of these; those of parameters NULL if not asked for. acc: add. */
	float *dx, *db, *dparam[2];
	const float *dy;
	bool acc, acc_b;
	float *scratch;
};

/* Floats of scratch. */
size_t ct_ops_scratch(const struct ct_graph_op *o, struct ct_image in, struct ct_image out);
/* CT_EFAIL of a matrix product. */
int ct_ops_forward(const struct ct_ops *o, struct ct_err *e);
int ct_ops_back(const struct ct_ops *o, struct ct_err *e);

#endif
