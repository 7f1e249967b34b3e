/* arch-tensors.c: the shape of a network from that of its tensors; see arch.h. */
#include "config.h"
#include "unet/arch.h"

#include <stdarg.h>
#include <stdio.h>

/* Size k of the tensor of this name, 0 if there is none. */
__attribute__((format(printf, 3, 4))) static size_t dim(
	const struct ct_tensors *w, size_t k, const char *fmt, ...)
{
	const struct ct_tensor *t;
	char name[100];
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(name, sizeof name, fmt, ap);
	va_end(ap);
	t = ct_tensors_find(w, name);
	return t && k < t->rank ? t->dim[k] : 0;
}

/* Blocks of a level: after so many the way up doubles its image for the first time. Where that is
 * done without any weights, the way down has an entry without tensors there. */
static size_t blocks(struct ct_unet_arch *a, const struct ct_tensors *w, size_t entries)
{
	size_t r;

	for (r = 0; r < entries; r++)
		for (size_t sub = 1; sub < 3; sub++) {
			a->resblock_updown =
				dim(w, 0, "output_blocks.%zu.%zu.in_layers.2.weight", r, sub) > 0;
			if (a->resblock_updown ||
				dim(w, 0, "output_blocks.%zu.%zu.conv.weight", r, sub))
				return r;
		}
	for (r = 1; r < entries && dim(w, 0, "input_blocks.%zu.0.in_layers.2.weight", r); r++)
		;
	a->conv_resample = r == entries;
	return r - 1;
}

static void levels(struct ct_unet_arch *a, const struct ct_tensors *w)
{
	for (size_t l = 0; l < a->levels; l++) {
		const size_t entry = 1 + l * (a->num_res_blocks + 1);

		a->channel_mult[l] =
			(double)dim(w, 0, "input_blocks.%zu.0.out_layers.3.weight", entry) /
			(double)a->model_channels;
		if (dim(w, 0, "input_blocks.%zu.1.qkv.weight", entry))
			a->attention[a->attentions++] = (size_t)1 << l;
	}
}

static int from_tensors(struct ct_unet_arch *a, const struct ct_tensors *w, struct ct_err *e)
{
	size_t entries = 0;

	*a = (struct ct_unet_arch){.image_size = 64,
		.conv_resample = true,
		.model_channels = dim(w, 1, "time_embed.0.weight"),
		.in_channels = dim(w, 1, "input_blocks.0.0.weight"),
		.out_channels = dim(w, 0, "out.2.weight"),
		.num_classes = dim(w, 0, "label_emb.weight")};
	while (dim(w, 0, "output_blocks.%zu.0.in_layers.2.weight", entries))
		entries++;
	if (a->model_channels == 0 || entries == 0)
		return ct_fail(e, CT_EINPUT,
			"not a diffusion prior: no metadata \"model_channels\", and no tensor %s",
			entries ? "time_embed.0.weight" : "output_blocks.0.0.in_layers.2.weight");
	a->num_res_blocks = blocks(a, w, entries);
	a->levels = entries / (a->num_res_blocks + 1);
	if (a->levels > CT_UNET_LEVELS)
		return ct_fail(e, CT_EINPUT, "architecture: tensors of %zu levels", a->levels);
	levels(a, w);
	a->use_scale_shift_norm = dim(w, 0, "input_blocks.1.0.emb_layers.1.weight") >
				  dim(w, 0, "input_blocks.1.0.out_layers.3.weight");
	return 0;
}

int ct_unet_arch_of(struct ct_unet_arch *a, const struct ct_tensors *w, struct ct_err *e)
{
	if (ct_unet_arch_is_whole(&w->meta))
		return ct_unet_arch_from_meta(a, &w->meta, e);
	if (from_tensors(a, w, e))
		return -1;
	for (size_t i = 0; i < w->meta.n; i++)
		if (ct_unet_arch_set(a, w->meta.pair[i].key, w->meta.pair[i].value, e) < 0)
			return -1;
	if (a->num_heads == 0 && a->num_head_channels == 0)
		return ct_fail(e, CT_EINPUT,
			"architecture: tensors do not tell num_head_channels or num_heads: state "
			"one");
	return ct_unet_arch_check(a, e);
}
