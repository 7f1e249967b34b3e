/* ArSSR: the gradient of every layer, tiles, threads, files. With a folder it writes what
 * tests/arssr-torch.py compares, and tests nothing. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/arssr-kernels.h"
#include "arssr/arssr-train.h"
#include "arssr/arssr-volume.h"
#include "core/mem.h"
#include "formats/format.h"
#include "formats/io.h"
#include "numbers.h"

#include <string.h>

static const struct ct_arssr_shape small = {6, 2, 2, 5, 7, 9};
enum { SIDE = 5 };

/* A smooth volume of about 0 to 1000 HU, longer than wide. */
static void volume(struct ct_vol *v, size_t nx, size_t ny, size_t nz)
{
	must(ct_vol_alloc(v, (const size_t[3]){nx, ny, nz}, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double x = (double)(i % nx), y = (double)(i / nx % ny),
			     z = (double)(i / nx / ny);

		v->data[i] = (float)(500 + 300 * sin(0.9 * x + 0.3 * z) * cos(0.7 * y) +
				     150 * sin(1.3 * z));
	}
}

static void network(struct ct_arssr *a, const struct ct_arssr_shape *shape)
{
	*a = (struct ct_arssr){.shape = *shape, .window = {-1024, 3071}};
	must(ct_arssr_alloc(a, &err));
	ct_arssr_begin(a, 7);
}

/* Weights at random are small: what is far away hardly counts. */
static void strengthen(struct ct_arssr *a)
{
	for (size_t k = 0; k < a->layers; k++)
		for (size_t i = a->layer[k].weight; i < a->layer[k].bias; i++)
			a->all[i] *= 2;
}

static double spread(size_t n, const float *x)
{
	double sum = 0, square = 0;

	for (size_t i = 0; i < n; i++) {
		sum += (double)x[i];
		square += (double)x[i] * (double)x[i];
	}
	return sqrt(square / (double)n - sum / (double)n * (sum / (double)n));
}

static struct ct_arssr_train *training(const struct ct_vol *v, size_t n,
	const struct ct_arssr_shape *shape, size_t side, struct ct_par *par)
{
	const struct ct_arssr net = {.shape = *shape, .window = {-1024, 3071}};
	const struct ct_arssr_train_rule rule = {
		.piece = {.seed = 3, .side = side, .factor = CT_ARSSR_PIECE_FACTORS},
		.steps = 10,
		.batch = 3,
		.rate = 1e-3,
		.average = 0.9};
	const struct ct_env env = {.par = par};
	struct ct_arssr_train *t = NULL;

	must(ct_arssr_train_alloc(&t, &net, &rule, v, n, &env, &err));
	return t;
}

static double loss_of(struct ct_arssr_train *t, const struct ct_arssr_piece *p, float *grad)
{
	double loss;

	ct_dnn_refresh(t->dnn, NULL);
	must(ct_arssr_train_piece(t, 0, p, &loss, grad, &err));
	return loss;
}

/* The loss along the gradient of each layer. Targets are below all that the network makes: what is
 * left of corners are those of its ReLUs, which a small step seldom meets. */
static void test_gradient(void)
{
	static const struct ct_arssr_shape deep = {6, 2, 3, 5, 7, 9};
	struct ct_vol v = {0};
	struct ct_arssr_piece p = {0};
	struct ct_arssr_train *t;
	float *grad;
	double worst = 0;

	volume(&v, 24, 25, 26);
	t = training(&v, 1, &deep, SIDE, NULL);
	must(ct_arssr_piece_alloc(&p, &t->rule.piece, &err));
	must(ct_arssr_piece_draw(&p, &t->rule.piece, &v, 1, 0, &err));
	for (size_t i = 0; i < p.points; i++)
		p.want[i] = -0.5f;
	must(ct_alloc0(&grad, t->net.n, sizeof *grad, &err));
	strengthen(&t->net);
	loss_of(t, &p, grad);
	for (size_t k = 0; k < t->net.layers; k++) {
		const struct ct_arssr_layer *l = &t->net.layer[k];
		const size_t from = l->weight, n = l->bias + l->co - from;
		const double size = sqrt(dot(n, grad + from, grad + from));
		double side[2], step = 0.002 / size, off;

		for (int s = 0; s < 2; s++) {
			for (size_t i = 0; i < n; i++)
				t->net.all[from + i] +=
					(float)((s ? -2 : 1) * step) * grad[from + i] / (float)size;
			side[s] = loss_of(t, &p, NULL);
		}
		for (size_t i = 0; i < n; i++)
			t->net.all[from + i] += (float)step * grad[from + i] / (float)size;
		off = fabs((side[0] - side[1]) / (2 * step * size) - 1);
		if (!(off < 0.01))
			printf("# %s: gradient %g, off by %.3g\n", l->name, size, off);
		worst = off <= worst ? worst : off;
	}
	OK(worst < 0.01, "the gradient of every layer is that of differences (%.2g)", worst);
	free(grad);
	ct_arssr_piece_free(&p);
	ct_arssr_train_free(t);
	ct_vol_free(&v);
}

static void test_sample(void)
{
	const size_t at[8] = {0, 8, 16, 24, 8, 40, 48, 0};
	const float w[8] = {.1f, .2f, .3f, .05f, .15f, .02f, .08f, .1f};
	float *x = normals(56, 1, 1, 1), *y = normals(8, 1, 2, 1), a[8], b[56] = {0};

	CT_SIMD(ct_arssr_kernels_gather)(8, a, x, at, w);
	CT_SIMD(ct_arssr_kernels_scatter)(8, b, y, at, w);
	NEAR(dot(8, a, y), dot(56, b, x), 1e-5, "scatter is the adjoint of gather");
	free(x);
	free(y);
}

static struct ct_arssr_volume of(const struct ct_arssr *net, const struct ct_vol *v)
{
	return (struct ct_arssr_volume){.net = net,
		.in = v,
		.n = {23, 31, 64},
		.start = {-0.3, -0.2, -0.35},
		.step = {0.4, 0.313, 0.4375}};
}

static void run(const struct ct_arssr_volume *a, float *out, size_t threads)
{
	struct ct_env env = {0};

	must(ct_par_alloc(&env.par, threads, &err));
	must(ct_arssr_volume_run(a, out, &env, &err));
	ct_par_free(env.par);
}

static void test_volume(void)
{
	struct ct_vol v = {0};
	struct ct_arssr net;
	struct ct_arssr_volume a;
	size_t n;
	float *one, *other = NULL;

	volume(&v, 9, 10, 28);
	network(&net, &small);
	strengthen(&net);
	a = of(&net, &v);
	n = a.n[0] * a.n[1] * a.n[2];
	must(ct_alloc(&one, n, sizeof *one, &err) || ct_alloc(&other, n, sizeof *other, &err));
	must(ct_arssr_volume_plan(&a, 1e9, 1, &err));
	OK(a.tiles[0] * a.tiles[1] * a.tiles[2] == 1, "what fits is one tile");
	run(&a, one, 1);
	OK(spread(n, one) > 10, "the values vary (%.3g HU)", spread(n, one));
	run(&a, other, 3);
	OK(memcmp(one, other, n * sizeof *one) == 0, "three threads: the same bytes");
	a.tiles[0] = 2;
	a.tiles[2] = 3;
	memset(other, 0, n * sizeof *other);
	run(&a, other, 2);
	OK(maxdiff(n, one, other) < 0.01, "tiles give the whole (%.2g HU)", maxdiff(n, one, other));
	v.data[17] = 9000;
	run(&a, one, 1);
	v.data[17] = 3071;
	run(&a, other, 1);
	OK(memcmp(one, other, n * sizeof *one) == 0, "beyond the window counts as its end");
	must(ct_arssr_volume_plan(&a, a.bytes * 0.99, 1, &err));
	OK(a.tiles[2] == 2 && a.tiles[0] == 1, "less memory: the longest axis is cut");
	OK(ct_arssr_volume_plan(&a, 1000, 1, &err) && err.code == CT_ENOMEM, "too little: %s",
		err.msg);
	free(one);
	free(other);
	ct_arssr_free(&net);
	ct_vol_free(&v);
}

/* A volume of 128^3 voxels by the published network: a few GB. */
static void test_memory(void)
{
	static const struct ct_arssr_shape published = CT_ARSSR_PUBLISHED;
	struct ct_vol v = {.n = {128, 128, 128}};
	struct ct_arssr net;
	struct ct_arssr_volume a;
	double encoder, decoder;

	network(&net, &published);
	ct_arssr_work(&net, &encoder, &decoder);
	OK(fabs(encoder / 5.9e6 - 1) < 0.01 && fabs(decoder / 0.36e6 - 1) < 0.02,
		"the published network: %.3g and %.3g multiply-adds", encoder, decoder);
	a = (struct ct_arssr_volume){
		.net = &net, .in = &v, .n = {512, 512, 512}, .step = {0.25, 0.25, 0.25}};
	must(ct_arssr_volume_plan(&a, 16e9, 2, &err));
	OK(a.bytes < 4e9 && a.tiles[0] * a.tiles[1] * a.tiles[2] <= 2, "128^3 voxels: %.2g bytes",
		a.bytes);
	ct_arssr_free(&net);
}

static void test_steps(void)
{
	struct ct_vol v[2];
	struct ct_arssr_train *t[2];
	struct ct_tensors w = {0};
	struct ct_par *par;
	double loss, held[2];

	memset(v, 0, sizeof v);
	volume(&v[0], 24, 25, 26);
	volume(&v[1], 30, 24, 24);
	must(ct_par_alloc(&par, 3, &err));
	t[0] = training(v, 2, &small, SIDE, NULL);
	t[1] = training(v, 2, &small, SIDE, par);
	for (int i = 0; i < 4; i++)
		must(ct_arssr_train_step(t[0], &loss, &err));
	for (int i = 0; i < 2; i++)
		must(ct_arssr_train_step(t[1], &loss, &err));
	must(ct_arssr_train_save(t[1], &w, &err));
	ct_arssr_train_free(t[1]);
	t[1] = training(v, 2, &small, SIDE, par);
	must(ct_arssr_train_restore(t[1], &w, &err));
	for (int i = 0; i < 2; i++)
		must(ct_arssr_train_step(t[1], &loss, &err));
	OK(memcmp(t[0]->trainer.average, t[1]->trainer.average,
		   t[0]->net.n * sizeof *t[0]->trainer.average) == 0,
		"stopped, restored, three threads: the same bytes");
	must(ct_arssr_train_held(t[0], v, 2, 5, &held[0], &err));
	must(ct_arssr_train_held(t[1], v, 2, 5, &held[1], &err));
	OK(held[0] > 0 && fabs(held[0] - held[1]) == 0 &&
			memcmp(t[0]->net.all, t[1]->net.all,
				t[0]->net.n * sizeof *t[0]->trainer.average) == 0,
		"a validation changes nothing");
	ct_tensors_free(&w);
	for (int i = 0; i < 2; i++) {
		ct_arssr_train_free(t[i]);
		ct_vol_free(&v[i]);
	}
	ct_par_free(par);
}

/* The weights after two steps, at the rates given or along a cosine (rate[1] < 0). */
static struct ct_arssr_train *stepped(const struct ct_vol *v, const double rate[2], float *first)
{
	struct ct_arssr_train *t = training(v, 1, &small, SIDE, NULL);
	double loss;

	memcpy(first, t->net.all, t->net.n * sizeof *first);
	t->trainer.rule.steps = 2;
	t->trainer.rule.cosine = rate[1] < 0;
	for (int i = 0; i < 2; i++) {
		t->trainer.rule.adam.lr = rate[t->trainer.rule.cosine ? 0 : i];
		must(ct_arssr_train_step(t, &loss, &err));
		if (i == 0)
			memcpy(first + t->net.n, t->net.all, t->net.n * sizeof *first);
	}
	return t;
}

static void test_rates(void)
{
	struct ct_vol v = {0};
	struct ct_arssr_train *t[2];
	struct ct_arssr net;
	float *first;
	double worst = 0;

	volume(&v, 24, 25, 26);
	network(&net, &small);
	must(ct_alloc(&first, 2 * net.n, sizeof *first, &err));
	t[0] = stepped(&v, (const double[2]){1e-3, -1}, first);
	t[1] = stepped(&v, (const double[2]){1e-3, 5e-4}, first);
	OK(memcmp(t[0]->net.all, t[1]->net.all, net.n * sizeof *first) == 0,
		"half way along the cosine the rate is half");
	OK(maxdiff(net.n, first, first + net.n) > 1e-4, "a step changes the weights (%.2g)",
		maxdiff(net.n, first, first + net.n));
	/* After k steps the mean keeps (1 + k)/(10 + k) of what it was. */
	for (size_t i = 0; i < net.n; i++) {
		const double one = (2 * (double)first[i] + 9 * (double)first[net.n + i]) / 11;
		const double two = (3 * one + 9 * (double)t[1]->net.all[i]) / 12;

		worst = fmax(worst, fabs(two - (double)t[1]->trainer.average[i]));
	}
	OK(worst < 1e-7, "the mean of the weights begins short (%.2g)", worst);
	for (int i = 0; i < 2; i++)
		ct_arssr_train_free(t[i]);
	ct_arssr_free(&net);
	free(first);
	ct_vol_free(&v);
}

/* A ramp stays one when it is reduced, so where a voxel is in the LR cube says its value. */
static void test_piece(void)
{
	static const struct ct_arssr_piece_rule r = {
		.side = 8, .factor = {2.3, 2.3}, .window = {0, 1000}};
	const size_t n = ct_arssr_piece_least(&r);
	struct ct_vol v = {0};
	struct ct_arssr_piece p = {0};
	double worst = 0;
	size_t inner = 0;

	must(ct_vol_alloc(&v, (const size_t[3]){n, n, n}, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)(100 + 10 * (i % n) + 20 * (i / n % n));
	must(ct_arssr_piece_alloc(&p, &r, &err) || ct_arssr_piece_draw(&p, &r, &v, 1, 0, &err));
	for (size_t i = 0; i < p.points; i++) {
		const double x = p.at[i][0] - 3, y = p.at[i][1] - 3;
		const double at = (double)p.lo[(3 * 8 + 3) * 8 + 3] + 2.3e-2 * (x + 2 * y);

		if (fabs(x - 0.5) > 1.5 || fabs(y - 0.5) > 1.5)
			continue;
		inner++;
		worst = fmax(worst, fabs(at - (double)p.want[i]));
	}
	OK(n != 8 * 2 && inner > 20 && worst < 2e-3, "voxels lie where they are asked for (%.2g)",
		worst);
	ct_arssr_piece_free(&p);
	ct_vol_free(&v);
}

/* A number that is none in HU. */
static void test_large(void)
{
	struct ct_env env = {0};
	struct ct_arssr net;
	struct ct_arssr_volume a;
	struct ct_vol v = {0};
	float *out = calloc(23 * 31 * 64, sizeof *out);

	network(&net, &small);
	net.all[net.n - 1] = 1e37f;
	volume(&v, 9, 10, 28);
	a = of(&net, &v);
	must(ct_par_alloc(&env.par, 1, &err));
	must(ct_arssr_volume_plan(&a, 1e9, 1, &err));
	OK(ct_arssr_volume_run(&a, out, &env, &err) && err.code == CT_ENUMERIC, "%s", err.msg);
	ct_par_free(env.par);
	ct_vol_free(&v);
	ct_arssr_free(&net);
	free(out);
}

/* A window that float32 cannot hold. */
static void test_window(void)
{
	static const double bad[][2] = {
		{1, 1}, {-1e308, 1e308}, {-3e38, 3e38}, {0, 1e-99}, {-1e99, 0}};

	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct ct_arssr a = {.shape = small, .window = {bad[i][0], bad[i][1]}};

		OK(ct_arssr_alloc(&a, &err) && err.code == CT_EINPUT, "%s", err.msg);
		ct_arssr_free(&a);
	}
}

static void test_files(void)
{
	struct ct_tensors w = {0};
	struct ct_arssr net, back = {0};
	struct ct_tensor *x;

	network(&net, &small);
	must(ct_arssr_put(&net, net.all, &w, &err));
	must(ct_arssr_get(&back, &w, &err));
	OK(back.n == net.n && memcmp(back.all, net.all, net.n * sizeof *net.all) == 0,
		"weights to tensors and back");
	ct_arssr_free(&back);
	x = ct_tensors_find(&w, "encoder.rdbs.1.layers.1.conv.weight");
	OK(x && x->rank == 5 && x->dim[0] == 5 && x->dim[1] == 11 && x->dim[4] == 3,
		"a tensor has the name and the shape of the authors'");
	x = ct_tensors_find(&w, "decoder.stage_two.6.bias");
	x->data[0] = NAN;
	OK(ct_arssr_get(&back, &w, &err) && err.code == CT_ENUMERIC, "no number: %s", err.msg);
	ct_arssr_free(&back);
	must(ct_meta_set(&w.meta, "blocks", "3", &err));
	OK(ct_arssr_get(&back, &w, &err) && err.code == CT_EINPUT, "another shape: %s", err.msg);
	ct_arssr_free(&back);
	for (const char *const *k = (const char *const[]){"features", "growth", "out", NULL}; *k;
		k++)
		must(ct_meta_set(&w.meta, *k, "1024", &err));
	must(ct_meta_set(&w.meta, "blocks", "64", &err) ||
		ct_meta_set(&w.meta, "layers", "16", &err));
	OK(ct_arssr_get(&back, &w, &err) && strncmp(err.msg, "tensor", 6) == 0,
		"a terabyte is said: not so large: %s", err.msg);
	ct_arssr_free(&back);
	must(ct_meta_set(&w.meta, "blocks", "-3", &err));
	OK(ct_arssr_get(&back, &w, &err) && err.code == CT_EINPUT, "no shape: %s", err.msg);
	ct_arssr_free(&back);
	ct_tensors_free(&w);
	OK(ct_arssr_get(&back, &w, &err) && err.code == CT_EINPUT, "another file: %s", err.msg);
	ct_arssr_free(&back);
	ct_arssr_free(&net);
}

/* What the network makes at the points of a piece. */
static void values_of(
	float *values, const struct ct_arssr *net, const struct ct_arssr_piece *p, size_t side)
{
	const size_t n[3] = {side, side, side};
	const struct ct_env env = {0};
	struct ct_encoder c = {0};
	struct ct_decoder d = {0};
	struct ct_decoder_field f = {.whole = {side, side, side}, .n = {side, side, side}};
	struct ct_dnn *dnn = NULL;

	must(ct_dnn_alloc(&dnn, &err) || ct_encoder_alloc(&c, dnn, net, n, 1, false, &err) ||
		ct_decoder_alloc(&d, net, false, &err) || ct_encoder_run(&c, p->lo, &env, &err));
	f.features = c.to;
	for (size_t i = 0; i < p->points; i += CT_DECODER_ROWS) {
		const size_t left = p->points - i;
		const size_t rows = left < CT_DECODER_ROWS ? left : CT_DECODER_ROWS;

		for (size_t k = 0; k < rows; k++)
			ct_decoder_point(&d, k, &f, p->at[i + k]);
		must(ct_decoder_run(&d, rows, &err));
		memcpy(values + i, d.h[9], rows * sizeof *values);
	}
	ct_encoder_free(&c);
	ct_decoder_free(&d);
	ct_dnn_free(dnn);
}

/* Weights, a piece, what the network makes of it, and gradients. */
static void dump(const char *path, const struct ct_arssr_shape *shape, size_t side)
{
	struct ct_vol v = {0};
	struct ct_arssr_piece p = {0};
	struct ct_arssr_train *t;
	struct ct_tensors w = {0}, g = {0};
	const struct ct_env env = {.files = &(const struct ct_io_rule){.force = true}};
	const size_t cube[3] = {side, side, side};
	size_t three[2] = {0, 3};
	float *grad, *at, *values;
	double loss;

	volume(&v, 44, 45, 46);
	t = training(&v, 1, shape, side, NULL);
	must(ct_arssr_piece_alloc(&p, &t->rule.piece, &err));
	must(ct_arssr_piece_draw(&p, &t->rule.piece, &v, 1, 0, &err));
	must(ct_alloc0(&grad, t->net.n, sizeof *grad, &err));
	must(ct_alloc(&at, 3 * p.points, sizeof *at, &err));
	must(ct_alloc(&values, p.points, sizeof *values, &err));
	values_of(values, &t->net, &p, side);
	must(ct_arssr_train_piece(t, 0, &p, &loss, grad, &err));
	for (size_t i = 0; i < 3 * p.points; i++)
		at[i] = (float)p.at[i / 3][i % 3];
	three[0] = p.points;
	must(ct_arssr_put(&t->net, t->net.all, &w, &err));
	must(ct_arssr_put(&t->net, grad, &g, &err));
	for (size_t i = 0; i < g.n; i++) {
		char name[120];

		snprintf(name, sizeof name, "grad.%s", g.t[i].name);
		must(ct_tensors_put(&w, name, g.t[i].rank, g.t[i].dim, g.t[i].data, &err));
	}
	must(ct_tensors_put(&w, "lo", 3, cube, p.lo, &err) ||
		ct_tensors_put(&w, "at", 2, three, at, &err) ||
		ct_tensors_put(&w, "want", 1, three, p.want, &err) ||
		ct_tensors_put(&w, "values", 1, three, values, &err) ||
		ct_tensors_write(path, &w, false, &env, &err));
	ct_tensors_free(&w);
	ct_tensors_free(&g);
	free(grad);
	free(at);
	free(values);
	ct_arssr_piece_free(&p);
	ct_arssr_train_free(t);
	ct_vol_free(&v);
}

int main(int argc, char **argv)
{
	static const struct ct_arssr_shape published = CT_ARSSR_PUBLISHED;

	if (argc == 3) {
		dump(argv[1], &small, SIDE);
		dump(argv[2], &published, 6);
		return 0;
	}
	test_sample();
	test_gradient();
	test_volume();
	test_memory();
	test_steps();
	test_rates();
	test_piece();
	test_files();
	test_window();
	test_large();
	return tap_done();
}
