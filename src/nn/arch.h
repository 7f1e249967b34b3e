/* arch.h: the shape of a network: a U-Net of guided diffusion (Dhariwal and Nichol 2021), or one of
 * super-resolution (rdn.h, omni.h). SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_NN_ARCH_H
#define CT_NN_ARCH_H
#include "core/err.h"
#include "core/meta.h"
#include "core/tensors.h"
#include "core/words.h"

#include <stdbool.h>
#include <stddef.h>

/* Largest values; the others are in arch.c. */
enum { CT_UNET_LEVELS = 10, CT_NET_FACTOR = 64, CT_NET_WINDOW = 64 };

#define CT_NET_LIST(X)                                                                             \
	X(CT_NET_UNET, "unet")                                                                     \
	X(CT_NET_RDN, "rdn")                                                                       \
	X(CT_NET_OMNI, "omni")
enum ct_net { CT_NET_LIST(CT_WORD_VALUE) };

struct ct_unet_arch {
	enum ct_net net;
	size_t image_size; /* what it was made for; other sizes run too */
	size_t in_channels, out_channels;
	size_t model_channels; /* D: the time embedding has D and 4D */
	size_t num_res_blocks; /* a level */
	size_t levels;
	double channel_mult[CT_UNET_LEVELS]; /* of D, finest first; may be 0.5 */
	size_t attentions;
	size_t attention[CT_UNET_LEVELS]; /* downsampling factors 1, 2, 4.. that have attention */
	size_t num_heads;                 /* used when num_head_channels is 0 */
	size_t num_head_channels;
	size_t num_classes; /* that it is conditioned on; 0: it is not */
	bool use_scale_shift_norm, resblock_updown, use_new_attention_order, conv_resample;
	/* of the networks of super-resolution, which have channels and num_heads besides */
	size_t factor; /* times finer */
	size_t features, blocks, layers;
	size_t growth; /* RDN */
	size_t window; /* Omni-SR: pixels */
};

/* D 32, multipliers 1,2,3,4, one block a level, attention in the middle only, 1 channel. */
void ct_unet_arch_default(struct ct_unet_arch *a);
/* Into the metadata, by keys as guided diffusion names its arguments: "image_size", "in_channels",
 * "model_channels", "out_channels", "num_res_blocks", "attention_resolutions" (downsampling
 * factors), "channel_mult", "num_heads", "num_head_channels" (-1: use num_heads),
 * "use_scale_shift_norm", "resblock_updown", "use_new_attention_order", "conv_resample",
 * "num_classes" (0: not conditioned). With "net" (CT_NET_LIST; without it a U-Net) another one,
 * which has instead "in_channels", "out_channels", "factor", "features", "blocks", "layers",
 * and "growth" or "num_heads" and "window". Lists are "[1, 2]", "1,2" or "1:2"; truths True or
 * False. */
int ct_unet_arch_to_meta(const struct ct_unet_arch *a, struct ct_meta *meta, struct ct_err *e);
/* From the metadata of a network, CT_EINPUT naming the key, and what these do not state from the
 * names and shapes of its tensors, which tell all but the heads of attention (without num_heads and
 * num_head_channels it is CT_EINPUT) and the order of their channels (taken for guided diffusion's
 * default). */
int ct_unet_arch_of(struct ct_unet_arch *a, const struct ct_tensors *w, struct ct_err *e);
/* One key as above, from its words: the command line's way. 1 if the network has no such key. "net"
 * makes it the network as published, of one channel, but a U-Net, which stays as it is. */
int ct_unet_arch_set(struct ct_unet_arch *a, const char *key, const char *value, struct ct_err *e);
/* Both sides of a picture are multiples of the first, and no less than the second. */
size_t ct_unet_arch_multiple(const struct ct_unet_arch *a);
size_t ct_unet_arch_least(const struct ct_unet_arch *a);
/* CT_EINPUT unless all is within its limits, every channel count of a U-Net a multiple of 32, and
 * the heads divide the channels that have attention. */
int ct_unet_arch_check(const struct ct_unet_arch *a, struct ct_err *e);
/* Channels of a level. */
size_t ct_unet_arch_channels(const struct ct_unet_arch *a, size_t level);
bool ct_unet_arch_attends(const struct ct_unet_arch *a, size_t level);
/* Heads of an attention block of c channels. */
size_t ct_unet_arch_heads(const struct ct_unet_arch *a, size_t c);

#endif
