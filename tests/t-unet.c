/* The U-Net: outputs of the public guided-diffusion model (tests/gold), its published parameter
 * counts, the gradient against differences, and weights that do not fit.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "gold-net.h"
#include "nn/unet.h"
#include "numbers.h"

#include <stdlib.h>
#include <string.h>

/* The names and shapes that the public program gave its state dictionary: "NAME 32,3,3,3;" each. */
static void test_names(const struct ct_tensors *w, const struct ct_tensors *gold, const char *name)
{
	const char *at = ct_meta_get(&gold->meta, "tensors");
	size_t same = 0;

	for (size_t i = 0; at && i < w->n; i++) {
		char want[300];
		size_t n = (size_t)snprintf(want, sizeof want, "%s", w->t[i].name);

		for (size_t k = 0; k < w->t[i].rank; k++)
			n += (size_t)snprintf(
				want + n, sizeof want - n, "%c%zu", k ? ',' : ' ', w->t[i].dim[k]);
		n += (size_t)snprintf(want + n, sizeof want - n, ";");
		if (strncmp(at, want, n) != 0)
			break;
		at += n;
		same++;
	}
	OK(at && same == w->n && !*at, "%s has the tensors of the public network: %zu of %zu", name,
		same, w->n);
}

/* All the plans that there are for one network give the same bytes. */
static void test_gold(const char *name)
{
	struct ct_tensors w = {0}, gold = {0};
	struct ct_unet *n = NULL;
	struct ct_tensor *x, *t, *y;
	float *out[2];
	size_t count;

	gold_read(&gold, name);
	gold_weights(&w, &gold);
	test_names(&w, &gold, name);
	if (ct_unet_alloc(&n, &w, &err)) {
		OK(0, "%s: %s", name, err.msg);
		return;
	}
	x = ct_tensors_find(&gold, "io.x");
	t = ct_tensors_find(&gold, "io.t");
	y = ct_tensors_find(&gold, "io.y");
	count = ct_tensor_count(y);
	for (int k = 0; k < 2; k++) { /* a plan to infer, and one to train */
		struct ct_unet_plan *p = NULL;

		out[k] = calloc(count, sizeof **out);
		if (!out[k])
			exit(99);
		if (ct_unet_plan_alloc(&p, n, x->dim[2], x->dim[3], k == 1, &err))
			OK(0, "%s: %s", name, err.msg);
		for (size_t i = 0; p && i < x->dim[0]; i++)
			if (ct_unet_forward(p, out[k] + i * (count / x->dim[0]),
				    x->data + i * (ct_tensor_count(x) / x->dim[0]),
				    (double)t->data[i], &err))
				OK(0, "%s: %s", name, err.msg);
		ct_unet_plan_free(p);
	}
	NEAR(apart(count, out[0], y->data), 0, 1e-5, name);
	OK(memcmp(out[0], out[1], count * sizeof **out) == 0, "%s: the same with training", name);
	for (int k = 0; k < 2; k++)
		free(out[k]);
	ct_unet_free(n);
	ct_tensors_free(&w);
	ct_tensors_free(&gold);
}

struct size {
	size_t image, d, blocks, params, tensors;
	double gmac;
	double mult[7];
	size_t levels;
};

/* The sizes that OpenAI published, and the one of the radiograph prior. */
static void test_counts(void)
{
	static const struct size s[] = {
		{512, 256, 2, 557970179, 644, 1981.4, {.5, 1, 1, 2, 2, 4, 4}, 7},
		{256, 256, 2, 552807171, 566, 1119.4, {1, 1, 2, 2, 4, 4}, 6},
		{256, 128, 2, 138286467, 566, 281.6, {1, 1, 2, 2, 4, 4}, 6},
		{128, 256, 2, 420498691, 492, 306.8, {1, 1, 2, 3, 4}, 5},
		{64, 192, 3, 295131267, 540, 109.7, {1, 2, 3, 4}, 4},
	};

	for (size_t i = 0; i < sizeof s / sizeof *s; i++) {
		struct ct_unet_arch a = {.image_size = s[i].image,
			.in_channels = 3,
			.out_channels = 3,
			.model_channels = s[i].d,
			.num_res_blocks = s[i].blocks,
			.levels = s[i].levels,
			.attentions = 3,
			.attention = {s[i].image / 32, s[i].image / 16, s[i].image / 8},
			.num_heads = 4,
			.num_head_channels = 64,
			.use_scale_shift_norm = true,
			.resblock_updown = true,
			.conv_resample = true};
		struct ct_graph g = {0};
		size_t n = 0;
		double flops = 0;

		memcpy(a.channel_mult, s[i].mult, sizeof s[i].mult);
		if (ct_unet_size(&a, s[i].image, s[i].image, &n, &flops, &err) ||
			ct_graph_build(&g, &a, s[i].image, s[i].image, &err))
			OK(0, "%s", err.msg);
		OK(n == s[i].params, "%zu^2 D=%zu: %zu parameters", s[i].image, s[i].d, n);
		OK(g.n_param == s[i].tensors, "its %zu tensors", g.n_param);
		NEAR(flops / 2e9, s[i].gmac, 0.06, "its GMAC");
		ct_graph_free(&g);
	}
}

static const char *const shapes[] = {
	"channel_mult=1:1,attention_resolutions=2,use_scale_shift_norm=True,resblock_updown=True",
	"channel_mult=1:2,attention_resolutions=1,use_scale_shift_norm=False,resblock_updown=False,"
	"use_new_attention_order=True,num_head_channels=-1,num_heads=2,num_res_blocks=2",
	"channel_mult=1:1,use_scale_shift_norm=True,resblock_updown=False,conv_resample=False,"
	"in_channels=3,out_channels=2",
	"channel_mult=1:1,num_classes=3",
};

static int parse(struct ct_unet_arch *a, const char *text)
{
	char copy[300], *item = copy;

	ct_unet_arch_default(a);
	snprintf(copy, sizeof copy, "%s", text);
	while (item && *item) {
		char *next = strchr(item, ','), *value = strchr(item, '=');

		if (next)
			*next++ = '\0';
		*value++ = '\0';
		if (ct_unet_arch_set(a, item, value, &err))
			return -1;
		item = next;
	}
	return ct_unet_arch_check(a, &err);
}

/* sum(weight y), in double. */
static double loss(struct ct_unet_plan *p, size_t ny, const float *x, const float *weight)
{
	float *y = malloc(ny * sizeof *y);
	double sum = 0;

	if (!y || ct_unet_forward(p, y, x, 17, &err))
		exit(99);
	for (size_t i = 0; i < ny; i++)
		sum += (double)weight[i] * (double)y[i];
	free(y);
	return sum;
}

/* (f(v + h d) - f(v - h d))/2h of the loss. The pointers are of the network's own weights or x. */
static double along(struct ct_unet_plan *p, struct ct_unet *n, size_t ny, const float *x,
	const float *weight, float *v, const float *d, size_t count, double h)
{
	double f[2];

	for (int k = 0; k < 2; k++) {
		double step = k ? -h : h;

		for (size_t i = 0; i < count; i++)
			v[i] += (float)(step * (double)d[i]);
		ct_unet_changed(n, NULL);
		f[k] = loss(p, ny, x, weight);
		for (size_t i = 0; i < count; i++)
			v[i] -= (float)(step * (double)d[i]);
	}
	return (f[0] - f[1]) / (2 * h);
}

/* Every tensor's gradient, along its own direction; the direction is the gradient's sign, so
 * that the difference is far above rounding, mixed with noise, so that it is not only that. */
static double worst_tensor(struct ct_unet_plan *p, struct ct_unet *n, size_t ny, const float *x,
	const float *weight, const float *grads, const char **name, size_t *sharp)
{
	double worst = 0;

	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *q = &n->graph.param[i];
		const float *g = grads + q->offset;
		float *d = normals(q->count, 11, 100 + i, 1);
		double want, got, h, size;

		for (size_t k = 0; k < q->count; k++)
			d[k] = (g[k] > 0 ? 1.0f : -1.0f) *
			       (1.0f + 0.5f * (d[k] > 0 ? 1.0f : -1.0f));
		size = sqrt(dot(q->count, d, d));
		h = 0.02 / size;
		want = dot(q->count, g, d);
		got = along(p, n, ny, x, weight, n->param + q->offset, d, q->count, h);
		/* a bias before a normalisation has none: not below the rounding of the loss */
		*sharp += fabs(want) > size;
		size = fabs(want) + 0.1 * size;
		if (!(fabs(got - want) <= worst * size)) {
			worst = fabs(got - want) / size;
			*name = q->name;
		}
		free(d);
	}
	return worst;
}

static void test_gradient(const char *text)
{
	struct ct_unet_arch a;
	struct ct_unet *n = NULL;
	struct ct_unet_plan *p = NULL;
	const size_t pixels = 96; /* 8 x 12 */
	size_t nx, ny, sharp = 0;
	float *x, *weight, *grads, *dx, *dir;
	const char *name = "";
	double got, want;

	if (parse(&a, text) || ct_unet_init(&n, &a, 3, &err) ||
		ct_unet_plan_alloc(&p, n, 8, 12, true, &err)) {
		OK(0, "%s: %s", text, err.msg);
		return;
	}
	n->label = a.num_classes ? a.num_classes - 1 : 0;
	/* nothing may be zero, or its partner has no gradient */
	for (size_t i = 0; i < n->graph.count; i++)
		n->param[i] += 0.05f * ct_rng_normal(4, 0, i);
	ct_unet_changed(n, NULL);
	nx = a.in_channels * pixels;
	ny = a.out_channels * pixels;
	x = normals(nx, 11, 1, 1);
	weight = normals(ny, 11, 2, 1);
	dir = normals(nx, 11, 3, 1);
	dx = calloc(nx, sizeof *dx);
	grads = calloc(n->graph.count, sizeof *grads);
	if (!dx || !grads)
		exit(99);
	loss(p, ny, x, weight);
	OK(ct_unet_backward(p, grads, dx, weight, &err) == 0, "backward of %s", text);
	got = worst_tensor(p, n, ny, x, weight, grads, &name, &sharp);
	OK(got < 5e-3 && sharp * 4 > n->graph.n_param,
		"the gradient of every tensor is the slope along it");
	printf("# worst %.2g, %s; %zu of %zu steep\n", got, name, sharp, n->graph.n_param);
	want = dot(nx, dx, dir);
	got = along(p, n, ny, x, weight, x, dir, nx, 1e-3);
	OK(fabs(got - want) < 5e-3 * fabs(want), "so is the gradient of the image");
	printf("# %g, %g\n", got, want);
	/* a second time without the image's: gradients are added to */
	want = dot(n->graph.count, grads, grads);
	loss(p, ny, x, weight);
	OK(ct_unet_backward(p, grads, NULL, weight, &err) == 0 &&
			fabs(dot(n->graph.count, grads, grads) - 4 * want) < 1e-4 * want,
		"gradients are added to");
	/* and without those of the weights, the image's to the byte */
	loss(p, ny, x, weight);
	must(ct_unet_backward(p, grads, dx, weight, &err));
	OK(ct_unet_backward(p, NULL, dir, weight, &err) == 0 &&
			memcmp(dir, dx, nx * sizeof *dx) == 0,
		"the image's gradient alone");
	free(x);
	free(weight);
	free(dir);
	free(dx);
	free(grads);
	ct_unet_plan_free(p);
	ct_unet_free(n);
}

static void refused(struct ct_tensors *w, int code, const char *word, const char *what)
{
	struct ct_unet *n = NULL;
	int rc = ct_unet_alloc(&n, w, &err);

	OK(rc == -1 && (int)err.code == code && strstr(err.msg, word), "%s: %s", what, err.msg);
	ct_unet_free(n);
}

static void test_refusals(void)
{
	struct ct_tensors w = {0}, gold = {0};
	struct ct_unet *n = NULL;
	struct ct_unet_plan *p = NULL;
	struct ct_tensor *t;
	size_t two = 2;

	gold_read(&gold, "unet-b");
	gold_weights(&w, &gold);
	ct_tensors_free(&gold);
	t = ct_tensors_find(&w, "middle_block.1.qkv.weight");
	t->dim[0]--;
	refused(&w, CT_EINPUT, "middle_block.1.qkv.weight is [191,64,1]", "a shape");
	t->dim[0]++;
	t->name[0] = 'n';
	refused(&w, CT_EINPUT, "no tensor middle_block.1.qkv.weight [192,64,1]", "a name");
	t->name[0] = 'm';
	for (size_t k = 0; k < 192 * 64; k += 192 * 64 - 1) { /* the first, and the last */
		t->data[k] = NAN;
		refused(&w, CT_ENUMERIC,
			k ? "middle_block.1.qkv.weight: value 12287"
			  : "middle_block.1.qkv.weight: value 0 is",
			"a value");
		t->data[k] = 0;
	}
	if (ct_meta_set(&w.meta, "channel_mult", "[1, 1, 1]", &err))
		exit(99);
	refused(&w, CT_EINPUT, "input_blocks.7.0.in_layers.2.weight", "another architecture");
	if (ct_meta_set(&w.meta, "channel_mult", "[1, 0.3, 1]", &err))
		exit(99);
	refused(&w, CT_EINPUT, "channel_mult", "channels that 32 does not divide");
	if (ct_meta_set(&w.meta, "channel_mult", "[1, 1, x]", &err))
		exit(99);
	refused(&w, CT_EINPUT, "channel_mult", "words for numbers");
	if (ct_meta_set(&w.meta, "channel_mult", "1,1,2", &err) ||
		ct_tensors_add(&w, "label_emb.weight", 1, &two, &t, &err))
		exit(99);
	t->data[0] = t->data[1] = 0;
	refused(&w, CT_EINPUT, "label_emb.weight", "classes that the metadata deny");
	if (ct_meta_set(&w.meta, "num_classes", "2", &err))
		exit(99);
	refused(&w, CT_EINPUT, "label_emb.weight is [2]", "or that have no embedding");
	ct_meta_drop(&w.meta, "num_classes");
	t->name[0] = 'n';
	must(ct_unet_alloc(&n, &w, &err));
	OK(ct_unet_plan_alloc(&p, n, 24, 42, false, &err) == -1 && err.code == CT_EGEOM,
		"a size that does not halve: %s", err.msg);
	ct_unet_free(n);
	ct_tensors_free(&w);
}

/* Weights out and in again. */
static void test_round_trip(void)
{
	struct ct_unet_arch a;
	struct ct_unet *n = NULL, *m = NULL;
	struct ct_tensors w = {0};
	struct ct_meta back = {0};
	size_t same = 0;

	if (parse(&a, shapes[1]) || ct_unet_init(&n, &a, 3, &err) ||
		ct_unet_tensors(n, n->param, &w, &err) || ct_unet_alloc(&m, &w, &err)) {
		OK(0, "round trip: %s", err.msg);
		return;
	}
	if (ct_unet_arch_to_meta(&m->arch, &back, &err))
		OK(0, "%s", err.msg);
	for (size_t i = 0; i < back.n; i++)
		same += strcmp(back.pair[i].value, w.meta.pair[i].value) == 0;
	OK(same == 14 && back.n == 14 && m->arch.num_heads == 2 && m->arch.levels == 2 &&
			m->arch.channel_mult[1] == 2 && m->arch.use_new_attention_order,
		"the architecture survives its metadata");
	same = 0;
	for (size_t i = 0; i < n->graph.n_param; i++)
		same += memcmp(n->at[i], m->at[i], n->graph.param[i].count * sizeof(float)) == 0;
	OK(same == n->graph.n_param, "so do the weights");
	ct_unet_free(n);
	ct_unet_free(m);
	ct_meta_free(&back);
	ct_tensors_free(&w);
}

/* What a network with moved weights gives, whatever was planned before: it keeps them in the order
 * of its first plan alone. */
static void test_moved(void)
{
	enum { PIXELS = 96, CLASSES = 3 };
	struct ct_unet_arch a;
	struct ct_unet *n[2] = {NULL};
	struct ct_unet_plan *p = NULL;
	struct ct_tensors w = {0};
	const double t = 300;
	float *x = normals(PIXELS, 11, 1, 1), y[2][CLASSES][PIXELS], dx[2][PIXELS], *grads;
	size_t held = 0;

	must(parse(&a, shapes[3]));
	must(ct_unet_init(&n[0], &a, 3, &err));
	for (size_t i = 0; i < n[0]->graph.count; i++)
		n[0]->param[i] += 0.05f * ct_rng_normal(4, 0, i);
	must(ct_unet_tensors(n[0], n[0]->param, &w, &err));
	must(ct_unet_alloc(&n[1], &w, &err));
	ct_tensors_free(&w);
	grads = calloc(n[0]->graph.count, sizeof *grads);
	if (!grads)
		exit(99);
	for (int k = 0; k < 2; k++) {
		must(ct_unet_plan_alloc(&p, n[k], 16, 16, false, &err));
		ct_unet_plan_free(p);
		must(ct_unet_plan_alloc(&p, n[k], 8, 12, true, &err));
		for (size_t c = 0; c < CLASSES; c++) {
			n[k]->label = c;
			must(ct_unet_forward(p, y[k][c], x, t, &err));
		}
		must(ct_unet_backward(p, grads, dx[k], x, &err));
		ct_unet_plan_free(p);
	}
	OK(memcmp(y[0], y[1], sizeof y[0]) == 0 && memcmp(dx[0], dx[1], sizeof dx[0]) == 0,
		"the same forward and backward with moved weights");
	OK(memcmp(y[0][0], y[0][1], sizeof y[0][0]) != 0 &&
			memcmp(y[0][1], y[0][2], sizeof y[0][0]) != 0,
		"another answer for every class");
	for (size_t i = 0; i < n[1]->graph.n_param; i++)
		held += n[1]->at[i] && n[1]->graph.param[i].rank > 2;
	OK(held == 0, "weights of convolutions are held once");
	free(x);
	free(grads);
	ct_unet_free(n[0]);
	ct_unet_free(n[1]);
}

int main(int argc, char **argv)
{
	if (argc == 3) { /* NAME FILE: only write the weights */
		struct ct_tensors w = {0}, gold = {0};

		gold_read(&gold, argv[1]);
		gold_weights(&w, &gold);
		must(ct_tensors_write_private(argv[2], &w, &err));
		ct_tensors_free(&w);
		ct_tensors_free(&gold);
		return 0;
	}
	test_gold("unet-a");
	test_gold("unet-b");
	test_counts();
	for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
		test_gradient(shapes[i]);
	test_moved();
	test_refusals();
	test_round_trip();
	return tap_done();
}
