/* unet.h: a network: forward, backward, weights.
 *
 * One of super-resolution (rdn.h, omni.h): a picture as many times finer, which no timestep
 * changes. Or the noise predictor of a diffusion prior. The network of guided diffusion (Dhariwal
 * and Nichol 2021): eps(x, t), t the timestep as a plain number. Weights have that project's names
 * and shapes, so its checkpoints load, and stand in one flat vector in the order of its state
 * dictionary: gradients and the moments of an optimiser have the same order. Images are
 * [channel][row][column] here.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_UNET_H
#define CT_NN_UNET_H
#include "core/err.h"
#include "core/par.h"
#include "core/tensors.h"
#include "nn/arch.h"
#include "nn/dnn.h"
#include "nn/graph.h"

#include <stdint.h>

struct ct_unet {
	struct ct_unet_arch arch;
	struct ct_graph graph; /* for its list of parameters */
	float *param;          /* [graph.count] of one to be trained; after a change call
				* ct_unet_changed */
	float **at;   /* [graph.n_param] every parameter: in param, or if that is NULL owned */
	size_t label; /* the class, of one that is conditioned: below arch.num_classes */
	struct ct_dnn *dnn;
};

struct ct_unet_plan;

/* How many parameters, and multiply-adds times two of one forward pass at h x w (convolutions,
 * linear layers, attention), without any allocation of their size. */
int ct_unet_size(const struct ct_unet_arch *a, size_t h, size_t w, size_t *parameters,
	double *flops, struct ct_err *e);

/* Network of the architecture of `w` (ct_unet_arch_of) with its weights, which are moved: the data
 * of the tensors that it has become NULL. It is to be run, not trained: weights of a convolution
 * are held once, in the order that oneDNN likes, from the first plan on. Every name and shape is
 * checked: CT_EINPUT naming the tensor and both shapes. Tensors of other names are ignored, but of
 * a class embedding that the metadata deny. CT_ENUMERIC for a weight that is not finite. */
int ct_unet_alloc(struct ct_unet **out, struct ct_tensors *w, struct ct_err *e);
/* Untrained: PyTorch's defaults (uniform within 1/sqrt(fan in)), gains one; of a U-Net the last
 * convolution of every residual branch and of the network and the embedding of classes zero; of
 * Omni-SR the bias of the places. */
int ct_unet_init(
	struct ct_unet **out, const struct ct_unet_arch *a, uint64_t seed, struct ct_err *e);
void ct_unet_free(struct ct_unet *n);
/* The parameters have been written to. No plan may run meanwhile. */
void ct_unet_changed(struct ct_unet *n, struct ct_par *par);
/* A flat vector [graph.count] as named tensors with the architecture in their metadata; *w zero:
 * free it in any case. */
int ct_unet_tensors(
	const struct ct_unet *n, const float *flat, struct ct_tensors *w, struct ct_err *e);

/* Workspace of one thread for an image of h x w. CT_EGEOM unless h and w are multiples of
 * ct_unet_arch_multiple and no less than ct_unet_arch_least. With `train`, ct_unet_backward may
 * follow a forward: all activations are kept. Plans share the weights of *net; make and free them
 * from one thread. */
int ct_unet_plan_alloc(struct ct_unet_plan **out, struct ct_unet *net, size_t h, size_t w,
	bool train, struct ct_err *e);
void ct_unet_plan_free(struct ct_unet_plan *p);
/* Bytes of workspace a plan holds. */
size_t ct_unet_plan_bytes(const struct ct_unet_plan *p);
/* y[out][h][w] from x[in][h][w] at timestep t; of super-resolution y[out][factor h][factor w]. */
int ct_unet_forward(struct ct_unet_plan *p, float *y, const float *x, double t, struct ct_err *e);
/* From dy = d loss / d y of the last forward: grads[graph.count] added to unless NULL, which saves
 * their work; dx[in][h][w] written unless NULL. */
int ct_unet_backward(
	struct ct_unet_plan *p, float *grads, float *dx, const float *dy, struct ct_err *e);

#endif
