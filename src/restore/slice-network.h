/* slice-network.h: the network of the slice prior. From a patch of a slice it predicts the detail
 * that the patch lacks.
 *
 * A patch x (patch.h) becomes F features: its K whitened principal components z = B (x - mean), and
 * CT_SLICE_NETWORK_FEATURES features of it (ct_slice_network_describe). The network is
 *
 *   h1 = a(W1 f + b1), h2 = a(W2 h1 + b2), h3 = h2 + a(W2' h2 + b2'), ...,   a(t) = t / (1 + e^-t)
 *   out = W f + b + W3 h + b3,   h the last of them
 *
 * It is the mean of (truth - base) / s over what such a cell may hold: a conditional expectation,
 * not a sample; and, last, the logarithm of the mean square that is then still missing, over s^2.
 * Weights are learned by learn.h. Rows are patches; matrices by oneDNN (nn/dnn.h), on the calling
 * thread: between ct_dnn_enter and ct_dnn_leave.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_SLICE_NETWORK_H
#define CT_RESTORE_SLICE_NETWORK_H
#include "core/tensors.h"
#include "operator/degrade.h"
#include "restore/patch.h"
#include "nn/dense.h"
#include "nn/product.h"

enum { CT_SLICE_NETWORK_FEATURES = 8, CT_SLICE_NETWORK_MORE = 8 };

/* What made the LR scan, along the coarse axes of a slice. */
struct ct_regime {
	double sigma; /* of the blur, in cells */
	double noise; /* HU of the LR scan */
	enum ct_decimate decimate;
};

/* One block of weights, `all`, holds every matrix; offsets by ct_slice_network_part. */
enum ct_slice_network_part {
	CT_PART_LINEAR, /* (out,F) */
	CT_PART_LINEAR_BIAS,
	CT_PART_1, /* (width,F) */
	CT_PART_1_BIAS,
	CT_PART_2, /* (1 + more)(width,width) */
	CT_PART_2_BIAS,
	CT_PART_3, /* (out,width) */
	CT_PART_3_BIAS,
	CT_PARTS
};

/* The square of the expected error of a voxel, HU^2: spread[0] v + spread[1] + spread[2] noise^2, v
 * the mean over the axes of what the cells say (0 where a cell is flat), noise that of the LR scan.
 * Found on held-out volumes; 1, 0, 0 before. */
enum { CT_SPREADS = 3 };

struct ct_slice_network {
	struct ct_patch_shape shape;
	size_t components, width; /* K, neurons of a hidden layer */
	size_t more; /* hidden layers after the second, each added to the one before it */
	size_t inputs, cell,
		out;         /* F, values of a cell, and those of `out`, the spread among them */
	float *mean, *basis; /* (patch), (K,patch); owned, one block at mean, and `all` in it */
	float spread[CT_SPREADS]; /* what the error is, of what the slices say: see below */
	float *all;
	size_t at[CT_PARTS + 1]; /* of each part in `all`, and the count of all */
};

/* shape, components and width are set; the rest is allocated, zero. CT_EINPUT, CT_ENOMEM. */
int ct_slice_network_alloc(struct ct_slice_network *r, struct ct_err *e);
void ct_slice_network_free(struct ct_slice_network *r);

/* Features of a patch of `slices` slices from `across` on: size, phase and regime. `cell` slices
 * make a coarse one (1: none does, and there is no phase). */
void ct_slice_network_describe(float features[static CT_SLICE_NETWORK_FEATURES],
	const struct ct_patch_pose *pose, const struct ct_regime *regime, size_t across,
	size_t cell, size_t slices);

/* Rows of work of n patches. */
struct ct_slice_network_work {
	float *patch, *feature, *a1, *h1, *out; /* owned, one block at patch */
	float *a2, *h2; /* of the second hidden layer; those after it follow at `apart` */
	size_t apart;
};
int ct_slice_network_work_alloc(struct ct_slice_network_work *w, const struct ct_slice_network *r,
	size_t most, struct ct_err *e);
void ct_slice_network_work_free(struct ct_slice_network_work *w);
/* Bytes of work of n patches on each of the threads, and of its matrices made ready. */
double ct_slice_network_bytes(const struct ct_slice_network *r, size_t n, size_t threads);
/* The features of row i. */
float *ct_slice_network_features(
	struct ct_slice_network_work *w, const struct ct_slice_network *r, size_t i);
/* Its large matrices, made ready for many patches; borrowed from r. Free it in any case. */
struct ct_slice_network_ready {
	struct ct_product *basis, *w1, *w2[1 + CT_SLICE_NETWORK_MORE];
};
int ct_slice_network_ready_alloc(
	struct ct_slice_network_ready *q, const struct ct_slice_network *r, struct ct_err *e);
void ct_slice_network_ready_free(struct ct_slice_network_ready *q);
/* w->out of the first n patches of w->patch, whose features are set. CT_EFAIL. */
int ct_slice_network_run(const struct ct_slice_network *r, const struct ct_slice_network_ready *q,
	struct ct_slice_network_work *w, size_t n, struct ct_err *e);
/* The same in two steps, with weights `all` that change: the components of the patches, and the
 * layers. */
int ct_slice_network_components(const struct ct_slice_network *r, struct ct_slice_network_work *w,
	size_t n, struct ct_err *e);
int ct_slice_network_forward(const struct ct_slice_network *r, const float *all,
	struct ct_slice_network_work *w, size_t n, struct ct_err *e);
/* A matrix of it as a layer of n rows: of CT_PART_2 that of hidden layer 2 + i. */
struct ct_dense_rows ct_slice_network_layer(const struct ct_slice_network *r, const float *all,
	enum ct_slice_network_part p, size_t i, size_t n);

/* Tensors NAME.mean, NAME.basis, NAME.linear, ..., shapes among them. CT_EINPUT naming the one that
 * is missing, of another shape or not finite. */
int ct_slice_network_put(
	const struct ct_slice_network *r, struct ct_tensors *w, const char *name, struct ct_err *e);
int ct_slice_network_get(
	struct ct_slice_network *r, const struct ct_tensors *w, const char *name, struct ct_err *e);

#endif
