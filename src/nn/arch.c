/* arch.c: see arch.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "nn/arch.h"
#include "nn/omni.h"
#include "nn/rdn.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { CHANNELS = 16384, MOST = 65536 };
enum kind { COUNT, TRUTH, MULTS, FACTORS, HEADS };
/* whose key it is */
enum { UNET = 1 << CT_NET_UNET, RDN = 1 << CT_NET_RDN, OMNI = 1 << CT_NET_OMNI };

static const struct key {
	const char *name;
	enum kind kind;
	size_t at;
	bool needed;        /* a file that lacks it is not of such a network */
	int nets;           /* UNET | RDN | OMNI */
	size_t least, most; /* of a count */
} keys[] = {
	{"image_size", COUNT, offsetof(struct ct_unet_arch, image_size), false, UNET, 0, MOST},
	{"in_channels", COUNT, offsetof(struct ct_unet_arch, in_channels), true, UNET | RDN | OMNI,
		1, 64},
	{"model_channels", COUNT, offsetof(struct ct_unet_arch, model_channels), true, UNET, 2,
		CHANNELS},
	{"out_channels", COUNT, offsetof(struct ct_unet_arch, out_channels), true,
		UNET | RDN | OMNI, 1, 64},
	{"num_res_blocks", COUNT, offsetof(struct ct_unet_arch, num_res_blocks), true, UNET, 1, 16},
	{"attention_resolutions", FACTORS, 0, true, UNET, 0, 0},
	{"channel_mult", MULTS, 0, true, UNET, 0, 0},
	{"num_head_channels", HEADS, offsetof(struct ct_unet_arch, num_head_channels), false, UNET,
		0, MOST},
	{"num_heads", COUNT, offsetof(struct ct_unet_arch, num_heads), false, UNET | OMNI, 0, MOST},
	{"use_scale_shift_norm", TRUTH, offsetof(struct ct_unet_arch, use_scale_shift_norm), true,
		UNET, 0, 0},
	{"resblock_updown", TRUTH, offsetof(struct ct_unet_arch, resblock_updown), true, UNET, 0,
		0},
	{"use_new_attention_order", TRUTH, offsetof(struct ct_unet_arch, use_new_attention_order),
		true, UNET, 0, 0},
	{"conv_resample", TRUTH, offsetof(struct ct_unet_arch, conv_resample), false, UNET, 0, 0},
	{"num_classes", COUNT, offsetof(struct ct_unet_arch, num_classes), false, UNET, 0, MOST},
	{"factor", COUNT, offsetof(struct ct_unet_arch, factor), true, RDN | OMNI, 2,
		CT_NET_FACTOR},
	{"features", COUNT, offsetof(struct ct_unet_arch, features), true, RDN | OMNI, 4, 1024},
	{"blocks", COUNT, offsetof(struct ct_unet_arch, blocks), true, RDN | OMNI, 1, 100},
	{"layers", COUNT, offsetof(struct ct_unet_arch, layers), true, RDN | OMNI, 1, 100},
	{"growth", COUNT, offsetof(struct ct_unet_arch, growth), true, RDN, 1, 1024},
	{"window", COUNT, offsetof(struct ct_unet_arch, window), true, OMNI, 2, CT_NET_WINDOW},
};

enum { KEYS = sizeof keys / sizeof *keys };

void ct_unet_arch_default(struct ct_unet_arch *a)
{
	*a = (struct ct_unet_arch){
		.image_size = 64,
		.in_channels = 1,
		.out_channels = 1,
		.model_channels = 32,
		.num_res_blocks = 1,
		.levels = 4,
		.channel_mult = {1, 2, 3, 4},
		.num_heads = 4,
		.num_head_channels = 32,
		.use_scale_shift_norm = true,
		.resblock_updown = true,
		.conv_resample = true,
	};
}

static size_t *count_of(struct ct_unet_arch *a, const struct key *k)
{
	return (size_t *)(void *)((char *)a + k->at);
}

static bool *truth_of(struct ct_unet_arch *a, const struct key *k)
{
	return (bool *)((char *)a + k->at);
}

/* Does a network of this kind have the key? */
static bool has(enum ct_net net, const struct key *k)
{
	return k->nets >> net & 1;
}

/* The network of that name, as published. */
static int set_net(struct ct_unet_arch *a, const char *value, struct ct_err *e)
{
	const int net = ct_words_find(CT_WORDS(CT_NET_LIST), value);

	if (net < 0)
		return ct_fail(e, CT_EINPUT, "architecture: net is \"%.100s\"", value);
	if (net == CT_NET_RDN)
		*a = (struct ct_unet_arch){.blocks = 16, .layers = 8, .growth = 64};
	if (net == CT_NET_OMNI)
		*a = (struct ct_unet_arch){.blocks = 5, .layers = 1, .window = 8, .num_heads = 4};
	if (net != CT_NET_UNET) {
		a->in_channels = a->out_channels = 1;
		a->features = 64;
		a->factor = 4;
	}
	a->net = (enum ct_net)net;
	return 0;
}

/* Numbers of "[1, 2]", "1,2" or "1:2" into v, at most `max`; false if it is none. */
static bool numbers(const char *s, size_t max, size_t *n, double *v)
{
	*n = 0;
	for (;;) {
		const char *end;

		s += strspn(s, "[(,: ])");
		if (!*s)
			return true;
		if (*n == max)
			return false;
		v[*n] = ct_number_begin(s, &end);
		if (end == s || (*end && !strchr("[(,: ])", *end)))
			return false;
		++*n;
		s = end;
	}
}

/* A whole number in [0, MOST], or -1 if `negative`. */
static bool whole(double v, bool negative)
{
	return v == floor(v) && v >= (negative ? -1 : 0) && v <= MOST;
}

static bool set_count(struct ct_unet_arch *a, const struct key *k, const char *value)
{
	double v[1];
	size_t n;

	if (!numbers(value, 1, &n, v) || n != 1 || !whole(v[0], k->kind == HEADS))
		return false;
	*count_of(a, k) = v[0] < 0 ? 0 : (size_t)v[0];
	return true;
}

static bool set_truth(struct ct_unet_arch *a, const struct key *k, const char *value)
{
	const int place = ct_words_find("False|True|false|true|0|1|no|yes", value);

	if (place >= 0)
		*truth_of(a, k) = place % 2;
	return place >= 0;
}

static bool set_list(struct ct_unet_arch *a, const struct key *k, const char *value)
{
	double v[CT_UNET_LEVELS];
	size_t n;

	if (!numbers(value, CT_UNET_LEVELS, &n, v))
		return false;
	if (k->kind == MULTS) {
		a->levels = n;
		memcpy(a->channel_mult, v, n * sizeof *v);
		return n > 0;
	}
	for (size_t i = 0; i < n; i++) {
		if (!whole(v[i], false))
			return false;
		a->attention[i] = (size_t)v[i];
	}
	a->attentions = n;
	return true;
}

int ct_unet_arch_set(struct ct_unet_arch *a, const char *key, const char *value, struct ct_err *e)
{
	if (strcmp(key, CT_META_NET) == 0)
		return set_net(a, value, e);
	for (size_t i = 0; i < KEYS; i++) {
		const struct key *k = &keys[i];
		bool ok;

		if (strcmp(key, k->name) != 0 || !has(a->net, k))
			continue;
		ok = k->kind == TRUTH                       ? set_truth(a, k, value)
		     : k->kind == COUNT || k->kind == HEADS ? set_count(a, k, value)
							    : set_list(a, k, value);
		return ok ? 0 : ct_fail(e, CT_EINPUT, "architecture: %s is \"%.100s\"", key, value);
	}
	return 1;
}

/* What the metadata state. */
static int take_keys(struct ct_unet_arch *a, const struct ct_meta *meta, struct ct_err *e)
{
	for (size_t i = 0; i < KEYS; i++) {
		const char *value = ct_meta_get(meta, keys[i].name);

		if (value && ct_unet_arch_set(a, keys[i].name, value, e) < 0)
			return -1;
	}
	return 0;
}

static void list_text(char *text, size_t size, const struct ct_unet_arch *a, enum kind kind)
{
	size_t n = kind == MULTS ? a->levels : a->attentions, used = 1;

	text[0] = '[';
	text[1] = '\0';
	for (size_t i = 0; i < n && used < size; i++) {
		double v = kind == MULTS ? a->channel_mult[i] : (double)a->attention[i];

		used += (size_t)snprintf(text + used, size - used, "%s%.10g", i ? ", " : "", v);
	}
	if (used < size)
		snprintf(text + used, size - used, "]");
}

int ct_unet_arch_to_meta(const struct ct_unet_arch *arch, struct ct_meta *meta, struct ct_err *e)
{
	struct ct_unet_arch a = *arch;

	if (a.net != CT_NET_UNET && ct_meta_set(meta, CT_META_NET, CT_WORD(CT_NET_LIST, a.net), e))
		return -1;
	for (size_t i = 0; i < KEYS; i++) {
		const struct key *k = &keys[i];
		char text[200];

		if (!has(a.net, k))
			continue;
		if (k->kind == TRUTH)
			snprintf(text, sizeof text, "%s", *truth_of(&a, k) ? "True" : "False");
		else if (k->kind == MULTS || k->kind == FACTORS)
			list_text(text, sizeof text, &a, k->kind);
		else if (k->kind == HEADS && *count_of(&a, k) == 0)
			snprintf(text, sizeof text, "-1");
		else
			snprintf(text, sizeof text, "%zu", *count_of(&a, k));
		if (ct_meta_set(meta, k->name, text, e))
			return -1;
	}
	return 0;
}

size_t ct_unet_arch_channels(const struct ct_unet_arch *a, size_t level)
{
	return (size_t)(a->channel_mult[level] * (double)a->model_channels);
}

bool ct_unet_arch_attends(const struct ct_unet_arch *a, size_t level)
{
	for (size_t i = 0; i < a->attentions; i++)
		if (a->attention[i] == (size_t)1 << level)
			return true;
	return false;
}

size_t ct_unet_arch_heads(const struct ct_unet_arch *a, size_t c)
{
	return a->num_head_channels ? c / a->num_head_channels : a->num_heads;
}

static int check_level(const struct ct_unet_arch *a, size_t level, struct ct_err *e)
{
	double c = a->channel_mult[level] * (double)a->model_channels;
	bool attends = ct_unet_arch_attends(a, level) || level + 1 == a->levels;
	size_t unit;

	if (!(c >= 32 && c <= CHANNELS) || (size_t)c % 32 != 0)
		return ct_fail(e, CT_EINPUT,
			"architecture: channel_mult %g of %zu model_channels gives %g channels, not a "
			"multiple of 32 up to %d",
			a->channel_mult[level], a->model_channels, c, CHANNELS);
	unit = a->num_head_channels ? a->num_head_channels : a->num_heads;
	if (attends && (unit == 0 || (size_t)c % unit != 0))
		return ct_fail(e, CT_EINPUT, "architecture: %s %zu does not divide %zu channels",
			a->num_head_channels ? "num_head_channels" : "num_heads", unit, (size_t)c);
	return 0;
}

size_t ct_unet_arch_multiple(const struct ct_unet_arch *a)
{
	return a->net == CT_NET_RDN    ? 1
	       : a->net == CT_NET_OMNI ? a->window
				       : (size_t)1 << (a->levels - 1);
}

size_t ct_unet_arch_least(const struct ct_unet_arch *a)
{
	enum { SEEN = 15 }; /* by one value that Omni-SR's attention over space pools */
	const size_t unit = ct_unet_arch_multiple(a);

	return a->net == CT_NET_OMNI ? (SEEN + unit - 1) / unit * unit : unit;
}

static int check_counts(struct ct_unet_arch a, struct ct_err *e)
{
	for (size_t i = 0; i < KEYS; i++) {
		const struct key *k = &keys[i];

		if (has(a.net, k) && (k->kind == COUNT || k->kind == HEADS) &&
			(*count_of(&a, k) < k->least || *count_of(&a, k) > k->most))
			return ct_fail(e, CT_EINPUT, "architecture: %s is %zu: expected %zu to %zu",
				k->name, *count_of(&a, k), k->least, k->most);
	}
	return 0;
}

int ct_unet_arch_check(const struct ct_unet_arch *a, struct ct_err *e)
{
	const size_t heads = a->net == CT_NET_OMNI ? a->num_heads : 1;

	if (check_counts(*a, e))
		return -1;
	if (a->net == CT_NET_UNET) {
		if (a->levels < 1 || a->levels > CT_UNET_LEVELS)
			return ct_fail(e, CT_EINPUT, "architecture: channel_mult has no level");
		for (size_t i = 0; i < a->levels; i++)
			if (check_level(a, i, e))
				return -1;
		return 0;
	}
	if (a->out_channels != a->in_channels)
		return ct_fail(e, CT_EINPUT, "architecture: %zu channels in, %zu out",
			a->in_channels, a->out_channels);
	if (!heads || a->features % heads)
		return ct_fail(e, CT_EINPUT,
			"architecture: num_heads %zu does not divide %zu features", heads,
			a->features);
	return 0;
}

/* Blocks of a level: after so many the way up doubles its image for the first time. Where that is
 * done without any weights, the way down has an entry without tensors there. */
static size_t blocks(struct ct_unet_arch *a, const struct ct_tensors *w, size_t entries)
{
	size_t r;

	for (r = 0; r < entries; r++)
		for (size_t sub = 1; sub < 3; sub++) {
			a->resblock_updown =
				ct_tensors_dim(w, 0, "output_blocks.%zu.%zu.in_layers.2.weight", r,
					sub) > 0;
			if (a->resblock_updown ||
				ct_tensors_dim(w, 0, "output_blocks.%zu.%zu.conv.weight", r, sub))
				return r;
		}
	for (r = 1; r < entries && ct_tensors_dim(w, 0, "input_blocks.%zu.0.in_layers.2.weight", r);
		r++)
		;
	a->conv_resample = r == entries;
	return r - 1;
}

static void levels(struct ct_unet_arch *a, const struct ct_tensors *w)
{
	for (size_t l = 0; l < a->levels; l++) {
		const size_t entry = 1 + l * (a->num_res_blocks + 1);

		a->channel_mult[l] = (double)ct_tensors_dim(w, 0,
					     "input_blocks.%zu.0.out_layers.3.weight", entry) /
				     (double)a->model_channels;
		if (ct_tensors_dim(w, 0, "input_blocks.%zu.1.qkv.weight", entry))
			a->attention[a->attentions++] = (size_t)1 << l;
	}
}

static int from_tensors(struct ct_unet_arch *a, const struct ct_tensors *w, struct ct_err *e)
{
	size_t entries = 0;

	*a = (struct ct_unet_arch){.image_size = 64,
		.conv_resample = true,
		.model_channels = ct_tensors_dim(w, 1, "time_embed.0.weight"),
		.in_channels = ct_tensors_dim(w, 1, "input_blocks.0.0.weight"),
		.out_channels = ct_tensors_dim(w, 0, "out.2.weight"),
		.num_classes = ct_tensors_dim(w, 0, "label_emb.weight")};
	while (ct_tensors_dim(w, 0, "output_blocks.%zu.0.in_layers.2.weight", entries))
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
	a->use_scale_shift_norm = ct_tensors_dim(w, 0, "input_blocks.1.0.emb_layers.1.weight") >
				  ct_tensors_dim(w, 0, "input_blocks.1.0.out_layers.3.weight");
	return 0;
}

/* Does the metadata state all that a network cannot be built without? */
static bool is_whole(const struct ct_meta *meta)
{
	const char *word = ct_meta_get(meta, CT_META_NET);
	const int net = word ? ct_words_find(CT_WORDS(CT_NET_LIST), word) : CT_NET_UNET;

	for (size_t i = 0; i < KEYS; i++)
		if (net >= 0 && has((enum ct_net)net, &keys[i]) && keys[i].needed &&
			!ct_meta_get(meta, keys[i].name))
			return false;
	return true;
}

static int check_net(const struct ct_unet_arch *a, const struct ct_meta *meta, struct ct_err *e)
{
	const char *net = ct_meta_get(meta, CT_META_NET), *own = CT_WORD(CT_NET_LIST, a->net);

	return !net || strcmp(net, own) == 0
		       ? 0
		       : ct_fail(e, CT_EINPUT,
				 "architecture: net is \"%.100s\", the tensors are %s", net, own);
}

/* What metadata state is what the tensors of a network of super-resolution are. */
static int agrees(struct ct_unet_arch *a, const struct ct_meta *meta, struct ct_err *e)
{
	struct ct_unet_arch b = *a;

	if (check_net(a, meta, e) || take_keys(&b, meta, e))
		return -1;
	for (size_t i = 0; i < KEYS; i++)
		if (has(a->net, &keys[i]) && *count_of(a, &keys[i]) != *count_of(&b, &keys[i]))
			return ct_fail(e, CT_EINPUT,
				"architecture: %s is %.100s, the tensors are of another",
				keys[i].name, ct_meta_get(meta, keys[i].name));
	return ct_unet_arch_check(a, e);
}

int ct_unet_arch_of(struct ct_unet_arch *a, const struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_meta *meta = &w->meta;
	const char *net = ct_meta_get(meta, CT_META_NET);

	if (is_whole(meta)) {
		*a = (struct ct_unet_arch){.image_size = 64, .num_heads = 1, .conv_resample = true};
		if ((net && set_net(a, net, e)) || take_keys(a, meta, e))
			return -1;
		return ct_unet_arch_check(a, e);
	}
	*a = (struct ct_unet_arch){0};
	if (ct_rdn_of(a, w) || ct_omni_of(a, w))
		return agrees(a, meta, e);
	if (from_tensors(a, w, e) || check_net(a, meta, e) || take_keys(a, meta, e))
		return -1;
	if (a->num_heads == 0 && a->num_head_channels == 0)
		return ct_fail(e, CT_EINPUT,
			"architecture: tensors do not give num_head_channels or num_heads: state "
			"one");
	return ct_unet_arch_check(a, e);
}
