/* The networks of super-resolution as wholes: numbers of parameters, the architecture found from
 * tensors and from metadata, sizes and files that do not fit.
 *
 *   t-super-net answer IN OUT   for tests/t-train.sh: IN has the weights of a network, "io.x"
 *   and "io.y"; OUT gets "y" of the network, and the gradients of mean |y - io.y| by their names.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/rng.h"
#include "diffusion/prior.h"
#include "formats/format.h"
#include "formats/io.h"
#include "nn/unet.h"
#include "numbers.h"

#include <stdlib.h>
#include <string.h>

static struct ct_unet_arch arch_of(const char *net, size_t blocks, size_t layers, size_t features)
{
	struct ct_unet_arch a = {0};

	must(ct_unet_arch_set(&a, "net", net, &err));
	a.blocks = blocks;
	a.layers = layers;
	a.features = features;
	a.growth = a.net == CT_NET_RDN ? 6 : 0;
	a.num_heads = a.net == CT_NET_OMNI ? 2 : 0;
	return a;
}

static void test_published(void)
{
	static const struct {
		const char *net;
		size_t factor, params;
	} known[] = {{"rdn", 2, 22123395}, {"rdn", 4, 22271107}, {"omni", 4, 805376}};

	for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
		struct ct_unet_arch a = {0};
		double flops;
		size_t n;

		must(ct_unet_arch_set(&a, "net", known[i].net, &err));
		a.factor = known[i].factor;
		a.in_channels = a.out_channels = 3;
		must(ct_unet_size(&a, 16, 16, &n, &flops, &err));
		OK(n == known[i].params, "%s, factor %zu: %zu parameters", known[i].net,
			known[i].factor, n);
	}
}

/* Names of tensors tell the network, and metadata what was written. */
static void test_arch(const char *net, size_t factor)
{
	struct ct_unet_arch a = arch_of(net, 2, 3, 8), b;
	struct ct_tensors w = {0};
	struct ct_unet *n;

	a.factor = factor;
	must(ct_unet_init(&n, &a, 1, &err));
	must(ct_unet_tensors(n, n->param, &w, &err));
	must(ct_unet_arch_of(&b, &w, &err));
	OK(memcmp(&a, &b, sizeof a) == 0, "%s: metadata tell the architecture", net);
	ct_meta_free(&w.meta);
	must(ct_unet_arch_of(&b, &w, &err));
	OK(memcmp(&a, &b, sizeof a) == 0, "%s, factor %zu: and so do the tensors", net, factor);
	must(ct_meta_set(&w.meta, "factor", "9", &err));
	OK(ct_unet_arch_of(&b, &w, &err) && err.code == CT_EINPUT, "%s: %s", net, err.msg);
	must(ct_meta_set(&w.meta, "net", "unet", &err));
	OK(ct_unet_arch_of(&b, &w, &err) && err.code == CT_EINPUT, "%s: %s", net, err.msg);
	ct_meta_free(&w.meta);
	w.t[0].dim[0]--;
	OK(ct_unet_alloc(&n, &w, &err), "%s: a shape that does not fit: %s", net, err.msg);
	ct_tensors_free(&w);
	ct_unet_free(n);
}

static void test_limits(void)
{
	struct ct_unet_arch a = arch_of("omni", 1, 1, 8);
	struct ct_graph g = {0};

	OK(ct_graph_build(&g, &a, 20, 24, &err) && err.code == CT_EGEOM, "windows: %s", err.msg);
	OK(ct_graph_build(&g, &a, 8, 16, &err) && err.code == CT_EGEOM, "least: %s", err.msg);
	a.num_heads = 3;
	OK(ct_unet_arch_check(&a, &err), "heads: %s", err.msg);
	a.num_heads = 2;
	a.factor = 65;
	OK(ct_unet_arch_check(&a, &err), "factor: %s", err.msg);
	OK(ct_unet_arch_set(&a, "growth", "8", &err) == 1, "growth is a key of RDN alone");
	OK(ct_unet_arch_set(&a, "net", "edsr", &err) < 0, "another net: %s", err.msg);
}

/* A plan that keeps nothing gives the bytes of one to train with. */
static void test_plans(const char *net)
{
	struct ct_unet_arch a = arch_of(net, 1, 2, 8);
	const size_t h = 16, w = 24, n = h * w * 16;
	float *x = normals(h * w, 1, 2, 1), *y[2];
	struct ct_unet *u;

	must(ct_unet_init(&u, &a, 1, &err));
	for (int train = 0; train < 2; train++) {
		struct ct_unet_plan *p;

		y[train] = normals(n, 1, 3, 1);
		must(ct_unet_plan_alloc(&p, u, h, w, train, &err));
		must(ct_unet_forward(p, y[train], x, 0, &err));
		ct_unet_plan_free(p);
	}
	OK(memcmp(y[0], y[1], n * sizeof **y) == 0, "%s: the same bytes with training", net);
	for (int train = 0; train < 2; train++)
		free(y[train]);
	free(x);
	ct_unet_free(u);
}

/* A view as the sampler "once" makes it finer is what the network makes of it, between 0 and its
 * norm; a value that is not finite is refused by the name of the view. */
static void test_once(void)
{
	const struct ct_env env = {0};
	const struct ct_unet_arch a = arch_of("rdn", 1, 2, 8);
	const size_t h = 5, w = 6, n = h * w;
	struct ct_superres p = ct_superres_default(4);
	struct ct_stack in = {0}, out = {0};
	struct ct_prior prior = {0};
	struct ct_tensors t = {0};
	struct ct_denoiser net;
	float x[5 * 6], y[5 * 6 * 16];
	bool done[2] = {false};
	double off = 0;

	must(ct_unet_init(&prior.unet, &a, 1, &err));
	must(ct_unet_tensors(prior.unet, prior.unet->param, &t, &err));
	ct_unet_free(prior.unet);
	prior = (struct ct_prior){0};
	must(ct_prior_alloc(&prior, &t, &err));
	OK(prior.factor == 4 && prior.multiple == 4, "a prior of factor 4");
	must(ct_prior_plan(&prior, 1, 4 * h, 4 * w, false, &err));
	must(ct_stack_alloc(&in, 2, h, w, &err));
	must(ct_stack_alloc(&out, 2, 4 * h, 4 * w, &err));
	for (size_t i = 0; i < 2 * n; i++)
		in.data[i] = 7 * (float)ct_rng_uniform(1, 1, i) - 1;
	p.how = ct_sampler_default(CT_SAMPLER_ONCE);
	p.steps = ct_sampler_steps(CT_SAMPLER_ONCE);
	p.norm = 5;
	net = ct_prior_denoiser(&prior);
	must(ct_superres(&p, &net, &in, NULL, &out, NULL, done, &env, &err));
	for (size_t i = 0; i < n; i++)
		x[i] = 2 * fmaxf(in.data[n + i] / 5, 0) - 1;
	must(ct_unet_forward(prior.plan[0], y, x, 0, &err));
	for (size_t i = 0; i < 16 * n; i++)
		off = fmax(off, fabs(fmin(fmax(2.5 * ((double)y[i] + 1), 0), 5.25) -
					(double)out.data[16 * n + i]));
	NEAR(off, 0, 2e-6, "once: what the network makes of the view");
	OK(done[0] && done[1], "all views are done");
	done[1] = false;
	in.data[n] = (float)HUGE_VAL;
	OK(ct_superres(&p, &net, &in, NULL, &out, NULL, done, &env, &err) &&
			err.code == CT_ENUMERIC,
		"%s", err.msg);
	ct_stack_free(&in);
	ct_stack_free(&out);
	ct_prior_free(&prior);
	ct_tensors_free(&t);
}

static int answer(const char *in, const char *path)
{
	struct ct_env env = {.files = &(const struct ct_io_rule){.force = true}};
	struct ct_tensors w = {0}, out = {0};
	struct ct_tensor *x, *want, *y;
	struct ct_unet_plan *p;
	struct ct_unet_arch a;
	float *grads, *dy;
	struct ct_unet *n;
	size_t count;

	must(ct_tensors_read(in, &w, &err));
	must(ct_unet_arch_of(&a, &w, &err));
	must(ct_unet_init(&n, &a, 1, &err));
	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *q = &n->graph.param[i];
		const struct ct_tensor *t = ct_tensors_find(&w, q->name);

		if (!t || ct_tensor_count(t) != q->count) {
			printf("%s\n", q->name);
			return 1;
		}
		memcpy(n->at[i], t->data, q->count * sizeof *t->data);
	}
	x = ct_tensors_find(&w, "io.x");
	want = ct_tensors_find(&w, "io.y");
	count = ct_tensor_count(want);
	must(ct_unet_plan_alloc(&p, n, x->dim[2], x->dim[3], true, &err));
	must(ct_tensors_add(&out, "y", want->rank, want->dim, &y, &err));
	must(ct_unet_forward(p, y->data, x->data, 0, &err));
	grads = normals(n->graph.count, 1, 1, 0);
	dy = normals(count, 1, 1, 0);
	for (size_t i = 0; i < count; i++) {
		const float d = y->data[i] - want->data[i];

		dy[i] = (float)((d > 0) - (d < 0)) / (float)count;
	}
	must(ct_unet_backward(p, grads, NULL, dy, &err));
	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *q = &n->graph.param[i];

		must(ct_tensors_put(&out, q->name, q->rank, q->dim, grads + q->offset, &err));
	}
	must(ct_tensors_write(path, &out, false, &env, &err));
	ct_unet_plan_free(p);
	ct_unet_free(n);
	ct_tensors_free(&w);
	ct_tensors_free(&out);
	free(grads);
	free(dy);
	return 0;
}

int main(int argc, char **argv)
{
	if (argc == 4 && strcmp(argv[1], "answer") == 0)
		return answer(argv[2], argv[3]);
	test_published();
	for (size_t factor = 2; factor <= 8; factor++)
		test_arch("rdn", factor);
	test_arch("omni", 3);
	test_arch("omni", 8);
	test_limits();
	test_plans("rdn");
	test_plans("omni");
	test_once();
	return tap_done();
}
