/* Layers of the network: each fast backward against central differences, in double, of a plain
 * forward in double written from the formula; each fast forward against the same.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/adam.h"
#include "nn/layers.h"
#include "differences.h"
#include "core/par.h"
#include "core/rng.h"
#include "core/simd.h"
#include "numbers.h"
#include "nn/dnn.h"
#include "nn/product.h"
#include "tap.h"
#include "nn/arena.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static double silu(double z)
{
	return z / (1 + exp(-z));
}

/* inputs: x, gamma, beta, e */
static void norm_plain(const struct layer *l, double *y, double *const *in)
{
	const struct ct_norm *n = &l->norm;
	const size_t c = n->c, per = c / CT_NORM_GROUPS;
	const double *e = l->inputs > 3 ? in[3] : NULL;

	for (size_t g = 0; g < CT_NORM_GROUPS; g++) {
		double mean = 0, var = 0, m = (double)(n->hw * per);

		for (int pass = 0; pass < 3; pass++)
			for (size_t i = 0; i < n->hw; i++)
				for (size_t k = g * per; k < (g + 1) * per; k++) {
					double x = in[0][i * c + k] +
						   (e && !n->scale_shift ? e[k] : 0),
					       z;

					if (pass == 0)
						mean += x / m;
					if (pass == 1)
						var += (x - mean) * (x - mean) / m;
					if (pass < 2)
						continue;
					z = (x - mean) / sqrt(var + 1e-5) * in[1][k] + in[2][k];
					if (e && n->scale_shift)
						z = z * (1 + e[k]) + e[c + k];
					y[i * c + k] = n->silu ? silu(z) : z;
				}
	}
}

static void test_norm(const char *name, size_t hw, size_t c, bool e, bool scale_shift, bool act)
{
	struct layer l = {.name = name,
		.ny = hw * c,
		.inputs = e ? 4 : 3,
		.n = {hw * c, c, c, scale_shift ? 2 * c : c},
		.plain = norm_plain,
		.norm = {.hw = hw, .c = c, .scale_shift = scale_shift, .silu = act}};
	double sums[2 * 128];
	float scratch[7 * 128] __attribute__((aligned(64)));
	float twice[MOST], dy[MOST];
	double most = 0;

	draw(&l);
	l.norm.gamma = in_f[1];
	l.norm.beta = in_f[2];
	l.norm.e = e ? in_f[3] : NULL;
	CT_SIMD(ct_norm_sums)(hw, c, sums, in_f[0]);
	CT_SIMD(ct_norm_forward)(&l.norm, y_f, in_f[0], sums, scratch);
	check_forward(&l);
	memcpy(dy, dy_f, l.ny * sizeof *dy);
	CT_SIMD(ct_norm_back)
	(&l.norm, grad_f[0], grad_f[1], grad_f[2], e ? grad_f[3] : NULL, dy, in_f[0], sums, false,
		scratch);
	check_back(&l);
	/* adding: dx twice, the other gradients of a second pass go elsewhere */
	memcpy(dy, dy_f, l.ny * sizeof *dy);
	memcpy(twice, grad_f[0], l.ny * sizeof *twice);
	CT_SIMD(ct_norm_back)
	(&l.norm, twice, grad_f[1], grad_f[2], e ? grad_f[3] : NULL, dy, in_f[0], sums, true,
		scratch);
	for (size_t i = 0; i < l.ny; i++)
		most = fmax(most, fabs((double)twice[i] - 2 * (double)grad_f[0][i]));
	OK(most < 1e-5, "%s: backward adds", name);
}

static void silu_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t i = 0; i < l->ny; i++)
		y[i] = silu(in[0][i]);
}

static void test_silu(void)
{
	struct layer l = {.name = "SiLU", .ny = 300, .inputs = 1, .n = {300}, .plain = silu_plain};

	draw(&l);
	CT_SIMD(ct_layer_silu_forward)(300, y_f, in_f[0]);
	check_forward(&l);
	CT_SIMD(ct_layer_silu_back)(300, grad_f[0], dy_f, in_f[0], false);
	check_back(&l);
}

/* inputs: x, w, b; c in, ca out */
static void linear_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t o = 0; o < l->ca; o++) {
		y[o] = in[2][o];
		for (size_t i = 0; i < l->c; i++)
			y[o] += in[1][o * l->c + i] * in[0][i];
	}
}

static void test_linear(void)
{
	struct layer l = {.name = "linear",
		.ny = 21,
		.inputs = 3,
		.n = {37, 777, 21},
		.plain = linear_plain,
		.c = 37,
		.ca = 21};

	draw(&l);
	CT_SIMD(ct_layer_linear_forward)(37, 21, y_f, in_f[0], in_f[1], in_f[2]);
	check_forward(&l);
	CT_SIMD(ct_layer_linear_back)
	(37, 21, grad_f[0], grad_f[1], grad_f[2], dy_f, in_f[0], in_f[1], false);
	check_back(&l);
}

static void up_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t i = 0; i < 2 * l->h; i++)
		for (size_t j = 0; j < 2 * l->w; j++)
			for (size_t k = 0; k < l->c; k++)
				y[(i * 2 * l->w + j) * l->c + k] =
					in[0][(i / 2 * l->w + j / 2) * l->c + k];
}

static void down_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t i = 0; i < l->ny; i++)
		y[i] = 0;
	for (size_t i = 0; i < l->h; i++)
		for (size_t j = 0; j < l->w; j++)
			for (size_t k = 0; k < l->c; k++)
				y[(i / 2 * (l->w / 2) + j / 2) * l->c + k] +=
					in[0][(i * l->w + j) * l->c + k] / 4;
}

static void test_resample(void)
{
	const size_t h = 4, w = 6, c = 5, n = h * w * c;
	struct layer up = {.name = "up",
		.ny = 4 * n,
		.inputs = 1,
		.n = {n},
		.plain = up_plain,
		.h = h,
		.w = w,
		.c = c};
	struct layer down = {.name = "down",
		.ny = n / 4,
		.inputs = 1,
		.n = {n},
		.plain = down_plain,
		.h = h,
		.w = w,
		.c = c};

	draw(&up);
	CT_SIMD(ct_layer_up_forward)(h, w, c, y_f, in_f[0]);
	check_forward(&up);
	CT_SIMD(ct_layer_up_back)(h, w, c, grad_f[0], dy_f, false);
	CT_SIMD(ct_layer_up_back)(h, w, c, grad_f[0], dy_f, true);
	for (size_t i = 0; i < n; i++)
		grad_f[0][i] *= 0.5f;
	check_back(&up);
	draw(&down);
	CT_SIMD(ct_layer_down_forward)(h, w, c, y_f, in_f[0]);
	check_forward(&down);
	CT_SIMD(ct_layer_down_back)(h, w, c, grad_f[0], dy_f, false);
	CT_SIMD(ct_layer_down_back)(h, w, c, grad_f[0], dy_f, true);
	for (size_t i = 0; i < n; i++)
		grad_f[0][i] *= 0.5f;
	check_back(&down);
}

/* inputs: a[hw][ca], b[hw][c - ca] */
static void concat_plain(const struct layer *l, double *y, double *const *in)
{
	const size_t cb = l->c - l->ca;

	for (size_t i = 0; i < l->h; i++)
		for (size_t k = 0; k < l->c; k++)
			y[i * l->c + k] =
				k < l->ca ? in[0][i * l->ca + k] : in[1][i * cb + k - l->ca];
}

static void test_concat(void)
{
	struct layer l = {.name = "concat",
		.ny = 77,
		.inputs = 2,
		.n = {28, 49},
		.plain = concat_plain,
		.h = 7,
		.c = 11,
		.ca = 4};

	draw(&l);
	CT_SIMD(ct_layer_concat_forward)(7, 4, 7, y_f, in_f[0], in_f[1]);
	check_forward(&l);
	CT_SIMD(ct_layer_concat_back)(7, 11, 0, 4, grad_f[0], dy_f, false);
	CT_SIMD(ct_layer_concat_back)(7, 11, 4, 7, grad_f[1], dy_f, false);
	check_back(&l);
}

/* inputs: qkv */
static void attn_plain(const struct layer *l, double *y, double *const *in)
{
	const struct ct_attn *a = &l->attn;
	const size_t t = a->tokens, w = a->width, c = a->heads * w;
	double row[256];

	for (size_t h = 0; h < a->heads; h++)
		for (size_t i = 0; i < t; i++) {
			const double *q = in[0] + (a->legacy ? 3 * h * w : h * w);
			const double *k = q + (a->legacy ? w : c), *v = k + (a->legacy ? w : c);
			double sum = 0;

			for (size_t s = 0; s < t; s++) {
				row[s] = 0;
				for (size_t x = 0; x < w; x++)
					row[s] += q[i * 3 * c + x] * k[s * 3 * c + x];
				row[s] = exp(row[s] / sqrt((double)w));
				sum += row[s];
			}
			for (size_t x = 0; x < w; x++) {
				y[i * c + h * w + x] = 0;
				for (size_t s = 0; s < t; s++)
					y[i * c + h * w + x] += row[s] / sum * v[s * 3 * c + x];
			}
		}
}

static void test_attention(const char *name, size_t tokens, bool legacy, bool back)
{
	const size_t c = 16;
	struct layer l = {.name = name,
		.ny = tokens * c,
		.inputs = 1,
		.n = {tokens * 3 * c},
		.plain = attn_plain,
		.attn = {.tokens = tokens, .heads = 2, .width = 8, .legacy = legacy}};
	float *scratch = malloc(ct_attn_scratch(l.attn.tokens, true) * sizeof *scratch);

	draw(&l);
	if (!scratch || ct_attn_forward(&l.attn, y_f, in_f[0], scratch, &err))
		OK(0, "%s: %s", name, err.msg);
	check_forward(&l);
	if (back && ct_attn_back(&l.attn, grad_f[0], dy_f, in_f[0], scratch, &err))
		OK(0, "%s: %s", name, err.msg);
	if (back)
		check_back(&l);
	free(scratch);
}

/* inputs: x[h][w][ci], w[co][ci][k][k], b[co], what is added; of a volume x[d][h][w][ci] and
 * w[co][ci][k][k][k] */
static void conv_plain(const struct layer *l, double *y, double *const *in)
{
	const struct ct_conv_shape *s = &l->conv;
	const size_t st = s->stride, lost = s->inside ? s->k - 1 : 0;
	const size_t wo = (s->w - lost + st - 1) / st, ho = (s->h - lost + st - 1) / st;
	const ptrdiff_t edge = s->inside ? 0 : (ptrdiff_t)s->k / 2;
	const size_t deep = s->d ? s->k : 1, kk = s->k * s->k;

	for (size_t p = 0; p < l->ny; p++) {
		const size_t o = p % s->co, at = p / s->co % (ho * wo), z = p / s->co / ho / wo;
		double sum = in[2][o] + (s->add ? in[3][p] : 0);

		for (size_t t = 0; t < deep * kk; t++) {
			ptrdiff_t i = (ptrdiff_t)(at / wo * st + t % kk / s->k) - edge;
			ptrdiff_t j = (ptrdiff_t)(at % wo * st + t % s->k) - edge;
			size_t from;

			if (i < 0 || j < 0 || i >= (ptrdiff_t)s->h || j >= (ptrdiff_t)s->w)
				continue;
			from = ((z + t / kk) * s->h + (size_t)i) * s->w + (size_t)j;
			for (size_t c = 0; c < s->ci; c++)
				sum += in[0][from * s->ci + c] *
				       in[1][(o * s->ci + c) * deep * kk + t];
		}
		y[p] = sum;
	}
}

static int conv_run(struct ct_conv *c, const struct layer *l, void *scratch)
{
	if (ct_conv_forward(c, y_f, in_f[0], in_f[2], in_f[3], scratch, &err))
		return -1;
	check_forward(l);
	/* twice into the gradients of the weights: they are added to */
	for (int i = 0; i < 2; i++)
		if (ct_conv_back_weights(c, grad_f[1], grad_f[2], in_f[0], dy_f, scratch, &err))
			return -1;
	for (size_t i = 1; i < 3; i++)
		for (size_t k = 0; k < l->n[i]; k++)
			grad_f[i][k] *= 0.5f;
	if (l->conv.add)
		memcpy(grad_f[3], dy_f, l->ny * sizeof *dy_f);
	return ct_conv_back_data(c, grad_f[0], dy_f, scratch, &err);
}

static void test_conv(const char *name, struct ct_conv_shape s)
{
	const size_t lost = s.inside ? s.k - 1 : 0;
	const size_t ho = (s.h - lost + s.stride - 1) / s.stride,
		     wo = (s.w - lost + s.stride - 1) / s.stride;
	const size_t planes = s.d ? s.d : 1, out = s.d ? s.d + 1 - s.k : 1, deep = s.d ? s.k : 1;
	struct layer l = {.name = name,
		.ny = out * ho * wo * s.co,
		.inputs = s.add ? 4 : 3,
		.n = {planes * s.h * s.w * s.ci, s.co * s.ci * deep * s.k * s.k, s.co,
			out * ho * wo * s.co},
		.plain = conv_plain,
		.conv = s};
	struct ct_dnn *d = NULL;
	struct ct_conv *c = NULL;
	void *scratch = NULL;
	int was = ct_dnn_enter(), rc;

	draw(&l);
	rc = ct_dnn_alloc(&d, &err) || ct_conv_alloc(&c, d, &s, 0, in_f[1], true, &err);
	if (!rc) {
		scratch = aligned_alloc(64, (ct_conv_scratch(c) / 64 + 1) * 64);
		rc = conv_run(c, &l, scratch);
	}
	OK(rc == 0, "%s: runs %s", name, rc ? err.msg : "");
	if (!rc)
		check_back(&l);
	/* new weights are seen after a refresh */
	for (size_t i = 0; i < l.n[1]; i++) {
		in_f[1][i] = -in_f[1][i];
		in_d[1][i] = (double)in_f[1][i];
	}
	l.plain(&l, y_d, in_d);
	if (!rc)
		ct_dnn_refresh(d, NULL);
	if (!rc && !ct_conv_forward(c, y_f, in_f[0], in_f[2], in_f[3], scratch, &err))
		check_forward(&l);
	ct_conv_free(c);
	ct_dnn_free(d);
	free(scratch);
	ct_dnn_leave(was);
}

static void test_silu_beyond(void)
{
	in_f[0][0] = 1e30f;
	in_f[0][1] = -1e30f;
	CT_SIMD(ct_layer_silu_forward)(2, y_f, in_f[0]);
	OK(y_f[0] == 1e30f && fabsf(y_f[1]) < 1e-6f, "sigmoid of what is beyond");
}

static void test_embed(void)
{
	static const double c[4] = {-0.883849, 0.945943, 0.283662, 0.998557};
	static const double s[4] = {-0.467772, 0.324334, -0.958924, 0.053705};
	static const size_t at[4] = {0, 1, 64, 127};
	double most = 0;

	CT_SIMD(ct_layer_embed)(256, y_f, 500);
	for (int i = 0; i < 4; i++) {
		most = fmax(most, fabs((double)y_f[at[i]] - c[i]));
		most = fmax(most, fabs((double)y_f[128 + at[i]] - s[i]));
	}
	OK(most < 1e-6, "sinusoids of timestep 500");
}

/* One parameter by the formulas in double. */
static void test_adam(void)
{
	const struct ct_adamw a = {
		.lr = 0.01, .beta1 = 0.9, .beta2 = 0.999, .eps = 1e-8, .decay = 0.1};
	float p[3] = {1, -2, 0.5f}, m[3] = {0}, v[3] = {0}, mean[3] = {0};
	double dp = 1, dm = 0, dv = 0, de = 0;

	for (uint64_t t = 1; t <= 20; t++) {
		float g[3] = {ct_rng_normal(5, 0, t), 1, 0};
		double dg = (double)g[0];

		CT_SIMD(ct_adamw_step)(&a, t, 3, p, m, v, g);
		CT_SIMD(ct_adam_average)(0.9, 3, mean, p);
		dm = 0.9 * dm + 0.1 * dg;
		dv = 0.999 * dv + 0.001 * dg * dg;
		dp -= 0.01 * 0.1 * dp;
		dp -= 0.01 * dm / (1 - pow(0.9, (double)t)) /
		      (sqrt(dv / (1 - pow(0.999, (double)t))) + 1e-8);
		de = 0.9 * de + 0.1 * dp;
	}
	NEAR((double)p[0], dp, 2e-6, "AdamW");
	NEAR((double)mean[0], de, 2e-6, "average");
	OK(fabs((double)p[2] - 0.5 * pow(1 - 0.001, 20)) < 1e-6, "decay without gradient");
}

/* Products with a matrix that stays: against sums in double; any number of rows; two threads on one
 * product. */

enum { ROWS = 21, COLUMNS = 137, WIDE = 24, MOST_ROWS = 96 };

static double worst_of(const float *y, const float *x, const float *w, size_t n)
{
	double off = 0;

	for (size_t i = 0; i < n; i++)
		for (size_t k = 0; k < ROWS; k++) {
			double sum = 0;

			for (size_t j = 0; j < COLUMNS; j++)
				sum += (double)x[i * COLUMNS + j] * (double)w[k * COLUMNS + j];
			off = fmax(off, fabs(sum - (double)y[i * WIDE + k]));
		}
	return off;
}

struct job {
	const struct ct_product *p;
	const float *x;
	float (*y)[MOST_ROWS * WIDE];
};

static void run(void *arg, size_t i, size_t worker)
{
	struct job *j = arg;
	struct ct_err e = {0};
	const int was = ct_dnn_enter();

	(void)worker;
	if (ct_product_run(j->p, j->x, MOST_ROWS, j->y[i], &e))
		j->y[i][0] = NAN;
	ct_dnn_leave(was);
}

static void product(void)
{
	static float w[ROWS * COLUMNS], x[MOST_ROWS * COLUMNS], y[MOST_ROWS * WIDE],
		two[4][MOST_ROWS * WIDE];
	const size_t rows[] = {1, 31, 32, 33, MOST_ROWS};
	struct ct_product *p;
	struct ct_par *par;
	int fit = 0;

	ct_rng_normals(ROWS * COLUMNS, w, 1, 0, 0);
	ct_rng_normals(MOST_ROWS * COLUMNS, x, 2, 0, 0);
	must(ct_product_alloc(&p, w, ROWS, COLUMNS, WIDE, &err));
	for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
		const int was = ct_dnn_enter();
		double off;

		for (size_t i = 0; i < MOST_ROWS * WIDE; i++)
			y[i] = 7;
		must(ct_product_run(p, x, rows[k], y, &err));
		ct_dnn_leave(was);
		off = worst_of(y, x, w, rows[k]);
		OK(off < 5e-5 && y[WIDE - 1] == 7, "%zu rows (%g)", rows[k], off);
	}
	must(ct_par_alloc(&par, 2, &err));
	ct_par_for(par, 4, run, &(struct job){p, x, two});
	for (int k = 0; k < 4; k++) {
		const double off = worst_of(two[k], x, w, MOST_ROWS);

		fit += off < 5e-5;
	}
	OK(fit == 4, "two threads on one");
	ct_par_free(par);
	ct_product_free(p);
}

static void t_product(void)
{
	product();
	for (int level = ct_simd_level(); level > 2; level--) {
		must(ct_simd_use(level == 4 ? "v4" : "v3", &err));
		product();
	}
}

/* Places of a plan: disjoint, aligned, the first that is large enough; how much room all took. */

enum { UNITS = 400, UNIT = 16, SPANS = 30 };

static void t_arena(void)
{
	struct ct_arena a = {0};
	bool taken[UNITS] = {false};
	size_t at[SPANS], units[SPANS], n = 0, top = 0, wrong = 0, exact = 0, full = 0;

	for (uint64_t q = 0; q < 4000; q++) {
		if (n < SPANS && ct_rng_below(1, 0, q, 5) < 3) {
			const size_t count = ct_rng_below(1, 1, q, 5 * UNIT),
				     want = count / UNIT + 1;
			size_t first = 0, run = 0;

			for (size_t i = 0; i < UNITS && run < want; i++) {
				run = taken[i] ? 0 : run + 1;
				first = i + 1 - run;
			}
			exact += run == want && first + want < UNITS && taken[first + want];
			must(ct_arena_take(&a, count, &at[n], &err));
			wrong += at[n] != first * UNIT;
			for (size_t i = 0; i < want; i++)
				taken[first + i] = true;
			top = first + want > top ? first + want : top;
			units[n++] = want;
			full += n == SPANS;
		} else if (n > 0) {
			const size_t k = ct_rng_below(1, 2, q, n);

			ct_arena_give(&a, at[k]);
			for (size_t i = 0; i < units[k]; i++)
				taken[at[k] / UNIT + i] = false;
			at[k] = at[--n];
			units[k] = units[n];
		}
		wrong += a.n != n || a.top != top * UNIT;
	}
	OK(wrong == 0, "the first place that is free and large enough, in units of 64 bytes");
	OK(exact > 20 && full > 20, "some fit exactly (%zu), and many live (%zu)", exact, full);
	ct_arena_give(&a, 12345 * UNIT);
	OK(a.n == n, "what was not taken is not given back");
	ct_arena_free(&a);
	OK(!a.live && a.n == 0 && a.top == 0, "it is freed");
}

int main(void)
{
	begin();
	test_silu_beyond();
	test_embed();
	test_adam();
	test_silu();
	test_linear();
	test_resample();
	test_concat();
	test_norm("norm", 6, 64, false, false, false);
	test_norm("norm, SiLU", 6, 32, false, false, true);
	test_norm("norm, embedding added, SiLU", 5, 64, true, false, true);
	test_norm("norm, embedding scales and shifts, SiLU", 6, 64, true, true, true);
	test_norm("norm of one pixel a group, scale and shift", 3, 96, true, true, false);
	test_attention("attention, legacy order", 20, true, true);
	test_attention("attention, new order", 13, false, true);
	test_attention("attention over blocks", 100, true, true);
	test_conv("conv 3x3", (struct ct_conv_shape){5, 4, 32, 16, 3, 1, false, false, 0});
	test_conv("conv 3x3, added to", (struct ct_conv_shape){3, 4, 16, 32, 3, 1, true, false, 0});
	test_conv("conv 3x3, stride 2, odd size",
		(struct ct_conv_shape){5, 7, 16, 16, 3, 2, false, false, 0});
	test_conv("conv 3x3, stride 2, even",
		(struct ct_conv_shape){4, 6, 16, 16, 3, 2, false, false, 0});
	test_conv("conv 1x1", (struct ct_conv_shape){5, 3, 32, 48, 1, 1, false, false, 0});
	test_conv("conv 1x1, added to", (struct ct_conv_shape){5, 3, 32, 48, 1, 1, true, false, 0});
	test_conv("conv 3x3, stride 2, inside",
		(struct ct_conv_shape){6, 7, 16, 16, 3, 2, false, true, 0});
	test_conv(
		"conv of one channel", (struct ct_conv_shape){6, 5, 1, 32, 3, 1, false, false, 0});
	test_conv(
		"conv to two channels", (struct ct_conv_shape){6, 5, 32, 2, 3, 1, false, false, 0});
	test_conv("conv 3x3x3", (struct ct_conv_shape){5, 4, 8, 16, 3, 1, false, false, 6});
	test_conv("conv 3x3x3 of one channel",
		(struct ct_conv_shape){4, 3, 1, 16, 3, 1, true, false, 3});
	end();
	t_product();
	t_arena();
	return tap_done();
}
