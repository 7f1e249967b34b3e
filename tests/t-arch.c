/* The shape of a network by its keys: what each takes, what the whole must be, and how it begins.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "nn/unet.h"
#include "tap.h"

#include <string.h>

/* 0, 1 or the code of what is refused. */
static int set(struct ct_unet_arch *a, const char *key, const char *value)
{
	int rc = ct_unet_arch_set(a, key, value, &err);

	if (rc < 0)
		return strstr(err.msg, key) && strstr(err.msg, value) ? (int)err.code : -1;
	return rc;
}

static void counts(void)
{
	static const char *const keys[] = {"image_size", "in_channels", "model_channels",
		"out_channels", "num_res_blocks", "num_heads", "num_head_channels", "num_classes"};
	struct ct_unet_arch a;

	ct_unet_arch_default(&a);
	for (size_t i = 0; i < 8; i++) {
		size_t *const fields[] = {&a.image_size, &a.in_channels, &a.model_channels,
			&a.out_channels, &a.num_res_blocks, &a.num_heads, &a.num_head_channels,
			&a.num_classes};
		bool heads = i == 6;
		int good = set(&a, keys[i], "17") == 0 && *fields[i] == 17;

		good = good && set(&a, keys[i], "65536") == 0 && *fields[i] == 65536;
		good = good && set(&a, keys[i], "65537") == CT_EINPUT && *fields[i] == 65536;
		good = good && set(&a, keys[i], "0") == 0 && *fields[i] == 0;
		good = good && set(&a, keys[i], "2.5") == CT_EINPUT &&
		       set(&a, keys[i], "1,2") == CT_EINPUT &&
		       set(&a, keys[i], "-2") == CT_EINPUT && set(&a, keys[i], "x") == CT_EINPUT &&
		       set(&a, keys[i], "nan") == CT_EINPUT &&
		       ct_unet_arch_set(&a, keys[i], "", &err) == -1;
		*fields[i] = 5;
		good = good && set(&a, keys[i], "-1") == (heads ? 0 : CT_EINPUT) &&
		       *fields[i] == (heads ? 0 : 5);
		OK(good, "%s", keys[i]);
	}
	OK(set(&a, "colour", "3") == 1, "no such key");
}

static void truths(void)
{
	static const char *const words[] = {
		"False", "True", "false", "true", "0", "1", "no", "yes"};
	static const char *const keys[] = {"use_scale_shift_norm", "resblock_updown",
		"use_new_attention_order", "conv_resample"};
	struct ct_unet_arch a;

	ct_unet_arch_default(&a);
	for (size_t i = 0; i < 4; i++) {
		const bool *const fields[] = {&a.use_scale_shift_norm, &a.resblock_updown,
			&a.use_new_attention_order, &a.conv_resample};
		int good = 0;

		for (int k = 0; k < 8; k++)
			good += set(&a, keys[i], words[k]) == 0 && *fields[i] == (k % 2 == 1);
		OK(good == 8 && set(&a, keys[i], "maybe") == CT_EINPUT, "%s", keys[i]);
	}
}

static void lists(void)
{
	struct ct_unet_arch a;
	int attends = 0;

	ct_unet_arch_default(&a);
	OK(set(&a, "channel_mult", "[0.5, 1, 1.5]") == 0 && a.levels == 3 &&
			a.channel_mult[0] == 0.5 && a.channel_mult[1] == 1 &&
			a.channel_mult[2] == 1.5,
		"multipliers");
	OK(set(&a, "channel_mult", "1:2:(3),4,5,6,7,8,9,10") == 0 && a.levels == 10 &&
			a.channel_mult[9] == 10,
		"ten of them");
	OK(set(&a, "channel_mult", "1:2:3:4:5:6:7:8:9:10:11") == CT_EINPUT, "not eleven");
	OK(set(&a, "channel_mult", "[]") == CT_EINPUT &&
			set(&a, "channel_mult", "inf") == CT_EINPUT,
		"nor none");
	OK(set(&a, "attention_resolutions", "2, 8") == 0 && a.attentions == 2 &&
			a.attention[0] == 2 && a.attention[1] == 8,
		"resolutions");
	for (size_t level = 0; level < 5; level++)
		attends += ct_unet_arch_attends(&a, level) == (level == 1 || level == 3);
	OK(attends == 5, "are factors");
	OK(set(&a, "attention_resolutions", "") == 0 && a.attentions == 0, "none");
	OK(set(&a, "attention_resolutions", "2, 0.5") == CT_EINPUT &&
			set(&a, "attention_resolutions", "-1") == CT_EINPUT,
		"whole ones");
	a.model_channels = 96;
	a.channel_mult[1] = 1.5;
	a.num_heads = 3;
	OK(ct_unet_arch_channels(&a, 1) == 144, "channels of a level");
	a.num_head_channels = 16;
	OK(ct_unet_arch_heads(&a, 96) == 6, "heads by their channels");
	a.num_head_channels = 0;
	OK(ct_unet_arch_heads(&a, 96) == 3, "or by their number");
}

/* The default with one field changed. */
#define WITH(field, value, want)                                                                   \
	do {                                                                                       \
		struct ct_unet_arch a;                                                             \
                                                                                                   \
		ct_unet_arch_default(&a);                                                          \
		a.field = value;                                                                   \
		err.code = CT_OK;                                                                  \
		OK((ct_unet_arch_check(&a, &err) < 0) == (want != CT_OK) && err.code == want,      \
			"%s = %s", #field, #value);                                                \
	} while (0)

static void limits(void)
{
	WITH(levels, 4, CT_OK);
	WITH(levels, 0, CT_EINPUT);
	WITH(levels, 11, CT_EINPUT);
	WITH(levels, 1, CT_OK);
	WITH(model_channels, 16384 / 4, CT_OK);
	WITH(model_channels, 16384 / 4 + 32, CT_EINPUT); /* four times that many */
	WITH(model_channels, 16385, CT_EINPUT);
	WITH(model_channels, 1, CT_EINPUT);
	WITH(model_channels, 48, CT_EINPUT);
	WITH(in_channels, 0, CT_EINPUT);
	WITH(in_channels, 64, CT_OK);
	WITH(in_channels, 65, CT_EINPUT);
	WITH(out_channels, 0, CT_EINPUT);
	WITH(out_channels, 64, CT_OK);
	WITH(out_channels, 65, CT_EINPUT);
	WITH(num_res_blocks, 0, CT_EINPUT);
	WITH(num_res_blocks, 16, CT_OK);
	WITH(num_res_blocks, 17, CT_EINPUT);
	WITH(channel_mult[0], 0, CT_EINPUT);
	WITH(channel_mult[0], -1, CT_EINPUT);
	WITH(channel_mult[1], (double)NAN, CT_EINPUT);
	WITH(channel_mult[3], 4.5, CT_EINPUT);
	WITH(num_head_channels, 128, CT_OK);
	WITH(num_head_channels, 96, CT_EINPUT); /* does not divide the middle's 128 */
	WITH(num_heads, 3, CT_OK);              /* not used */
}

static void heads(void)
{
	struct ct_unet_arch a;

	ct_unet_arch_default(&a);
	a.num_head_channels = 0;
	OK(ct_unet_arch_check(&a, &err) == 0, "four heads");
	a.num_heads = 3;
	OK(ct_unet_arch_check(&a, &err) == -1 && strstr(err.msg, "num_heads 3 does not"), "%s",
		err.msg);
	a.num_heads = 0;
	OK(ct_unet_arch_check(&a, &err) == -1 && strstr(err.msg, "num_heads 0"), "%s", err.msg);
	ct_unet_arch_default(&a);
	a.num_head_channels = 64;
	OK(ct_unet_arch_check(&a, &err) == 0, "64 channels a head in the middle");
	must(ct_unet_arch_set(&a, "attention_resolutions", "1", &err));
	OK(ct_unet_arch_check(&a, &err) == -1 &&
			strstr(err.msg, "num_head_channels 64 does not divide 32"),
		"%s", err.msg);
}

/* Metadata: what may be missing, what is then used, and what is written. */
static void metadata(void)
{
	static const char *const needed[] = {"in_channels", "model_channels", "out_channels",
		"num_res_blocks", "attention_resolutions", "channel_mult", "use_scale_shift_norm",
		"resblock_updown", "use_new_attention_order"};
	struct ct_unet_arch a, b;
	struct ct_tensors w = {0};
	struct ct_meta *m = &w.meta;
	int refused = 0;

	ct_unet_arch_default(&a);
	OK(a.image_size == 64 && a.in_channels == 1 && a.out_channels == 1 && a.levels == 4 &&
			a.model_channels == 32 && a.channel_mult[1] == 2 &&
			a.channel_mult[2] == 3 && a.conv_resample && a.resblock_updown &&
			a.use_scale_shift_norm && !a.use_new_attention_order && a.num_heads == 4 &&
			a.num_head_channels == 32,
		"the default");
	a.attentions = 2;
	a.attention[0] = 2;
	a.attention[1] = 4;
	a.channel_mult[1] = 1.5;
	a.model_channels = 64;
	a.num_head_channels = 0;
	must(ct_unet_arch_to_meta(&a, m, &err));
	OK(strcmp(ct_meta_get(m, "channel_mult"), "[1, 1.5, 3, 4]") == 0 &&
			strcmp(ct_meta_get(m, "attention_resolutions"), "[2, 4]") == 0 &&
			strcmp(ct_meta_get(m, "num_head_channels"), "-1") == 0 &&
			strcmp(ct_meta_get(m, "num_heads"), "4") == 0 &&
			strcmp(ct_meta_get(m, "resblock_updown"), "True") == 0 &&
			strcmp(ct_meta_get(m, "use_new_attention_order"), "False") == 0,
		"as guided diffusion writes them");
	for (int i = 0; i < 9; i++) {
		char was[100];

		snprintf(was, sizeof was, "%s", ct_meta_get(m, needed[i]));
		ct_meta_drop(m, needed[i]);
		refused += ct_unet_arch_of(&b, &w, &err) == -1 && err.code == CT_EINPUT &&
			   strstr(err.msg, "no metadata");
		must(ct_meta_set(m, needed[i], was, &err));
	}
	OK(refused == 9, "nine are needed");
	ct_meta_drop(m, "image_size");
	ct_meta_drop(m, "num_heads");
	ct_meta_drop(m, "num_head_channels");
	ct_meta_drop(m, "conv_resample");
	OK(ct_unet_arch_of(&b, &w, &err) == 0 && b.image_size == 64 && b.num_heads == 1 &&
			b.num_head_channels == 0 && b.conv_resample && b.levels == 4 &&
			b.model_channels == 64 && b.attentions == 2,
		"the others need not be there");
	ct_meta_free(m);
}

/* A network without its metadata but for the heads, which no tensor tells. */
static void told_by_tensors(const char *const *item)
{
	struct ct_unet_arch a, b;
	struct ct_unet *n = NULL;
	struct ct_tensors w = {0};
	struct ct_meta want = {0};
	char name[300] = "";

	ct_unet_arch_default(&a);
	for (const char *const *s = item; *s; s += 2) {
		must(ct_unet_arch_set(&a, s[0], s[1], &err));
		snprintf(name + strlen(name), sizeof name - strlen(name), " %s=%s", s[0], s[1]);
	}
	must(ct_unet_init(&n, &a, 1, &err));
	must(ct_unet_tensors(n, n->param, &w, &err));
	must(ct_meta_copy(&want, &w.meta, &err));
	for (size_t i = 0; i < want.n; i++)
		if (strncmp(want.pair[i].key, "num_head", 8) != 0)
			ct_meta_drop(&w.meta, want.pair[i].key);
	OK(ct_unet_arch_of(&b, &w, &err) == 0, "read:%s %s", name, err.msg);
	ct_meta_free(&w.meta);
	must(ct_unet_arch_to_meta(&b, &w.meta, &err));
	for (size_t i = 0; i < want.n; i++)
		if (strcmp(want.pair[i].value, w.meta.pair[i].value) != 0)
			OK(0, "%s is %s, not %s", want.pair[i].key, w.meta.pair[i].value,
				want.pair[i].value);
	ct_meta_drop(&w.meta, "num_heads");
	ct_meta_drop(&w.meta, "num_head_channels");
	ct_meta_drop(&w.meta, "model_channels");
	OK(ct_unet_arch_of(&b, &w, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "num_head_channels or num_heads"),
		"not the heads");
	ct_meta_free(&want);
	ct_tensors_free(&w);
	ct_unet_free(n);
}

static void tensors(void)
{
	static const char *const plain[] = {NULL};
	static const char *const deep[] = {"channel_mult", "[0.5, 1, 1, 2, 2, 4, 4]",
		"model_channels", "64", "attention_resolutions", "[16, 32, 64]", "num_res_blocks",
		"2", "in_channels", "3", "out_channels", "6", NULL};
	static const char *const classes[] = {"num_classes", "10", "num_heads", "2",
		"num_head_channels", "-1", "attention_resolutions", "[1, 2]", NULL};
	static const char *const convolved[] = {"resblock_updown", "False", "num_res_blocks", "3",
		"use_scale_shift_norm", "False", "attention_resolutions", "[2, 4]", NULL};
	static const char *const bare[] = {"resblock_updown", "False", "conv_resample", "False",
		"num_res_blocks", "2", "attention_resolutions", "[8]", NULL};
	static const char *const one[] = {"channel_mult", "[1]", "resblock_updown", "False", NULL};
	static const char *const *const all[] = {plain, deep, classes, convolved, bare, one};
	struct ct_tensors w = {0};
	struct ct_unet_arch a;

	for (size_t i = 0; i < sizeof all / sizeof *all; i++)
		told_by_tensors(all[i]);
	OK(ct_unet_arch_of(&a, &w, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "not a diffusion prior: no metadata"),
		"%s", err.msg);
}

/* Uniform within 1/sqrt(fan in), gains of one, and zeros where a branch begins as nothing; so do
 * the classes. */
static void untrained(size_t classes, size_t nothing)
{
	struct ct_unet_arch a;
	struct ct_unet *n = NULL;
	size_t odd = 0, zeros = 0, drawn = 0;

	ct_unet_arch_default(&a);
	a.levels = 1;
	a.num_classes = classes;
	must(ct_unet_init(&n, &a, 3, &err));
	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *p = &n->graph.param[i];
		const float *v = n->param + p->offset;
		double least = 2, most = -2, bound = p->fan_in ? 1 / sqrt((double)p->fan_in) : 0;

		for (size_t k = 0; k < p->count; k++) {
			least = fmin(least, (double)v[k]);
			most = fmax(most, (double)v[k]);
		}
		if (p->gamma || p->zero || !p->fan_in) {
			odd += least != most || fabs(most - (p->gamma ? 1 : 0)) > 0;
			zeros += p->zero;
		} else {
			drawn++;
			odd += least < -bound || most > bound;
			if (p->count > 1000)
				odd += least > -0.99 * bound || most < 0.99 * bound;
		}
	}
	OK(odd == 0 && zeros == nothing && drawn > 20, "%zu drawn, %zu zero, %zu odd", drawn, zeros,
		odd);
	ct_unet_free(n);
}

static void sizes(void)
{
	struct ct_unet_arch a;
	struct ct_graph g = {0};

	ct_unet_arch_default(&a);
	OK(ct_graph_build(&g, &a, 65536, 8, &err) == 0, "a long image");
	ct_graph_free(&g);
	OK(ct_graph_build(&g, &a, 65544, 8, &err) == -1 && err.code == CT_EGEOM &&
			strstr(err.msg, "8 x 65544"),
		"%s", err.msg);
	OK(ct_graph_build(&g, &a, 8, 65544, &err) == -1 && err.code == CT_EGEOM, "%s", err.msg);
	OK(ct_graph_build(&g, &a, 0, 8, &err) == -1 && ct_graph_build(&g, &a, 8, 0, &err) == -1,
		"no rows, no columns");
	OK(ct_graph_build(&g, &a, 12, 8, &err) == -1 && ct_graph_build(&g, &a, 8, 12, &err) == -1 &&
			strstr(err.msg, "12 x 8: the network takes multiples of 8"),
		"%s", err.msg);
}

int main(void)
{
	counts();
	truths();
	lists();
	limits();
	heads();
	metadata();
	tensors();
	untrained(0, 14);
	untrained(5, 15);
	sizes();
	return tap_done();
}
