/* Layers of the networks of super-resolution: each fast forward against a plain one in double from
 * the formula, each backward against central differences of that; and a backward that adds.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/dnn.h"
#include "nn/pointwise.h"
#include "nn/spatial.h"
#include "differences.h"

static float scratch[100000] __attribute__((aligned(64)));
static double sum[100];

static double gelu(double x)
{
	return 0.5 * x * erfc(-x / sqrt(2));
}

/* dx was written once and must then be added to by a second call. */
#define TWICE(l, call)                                                                             \
	do {                                                                                       \
		for (int acc = 0; acc < 2; acc++)                                                  \
			(call);                                                                    \
		for (size_t i = 0; i < (l).inputs; i++)                                            \
			for (size_t k = 0; k < (l).n[i]; k++)                                      \
				grad_f[i][k] *= 0.5f;                                              \
		check_back(&(l));                                                                  \
	} while (0)

static void pointwise_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t i = 0; i < l->ny; i++) {
		const double x = in[0][i];

		y[i] = l->ca == CT_POINTWISE_RELU   ? fmax(x, 0)
		       : l->ca == CT_POINTWISE_GELU ? gelu(x)
						    : 1 / (1 + exp(-x));
	}
}

static void test_pointwise(const char *name, enum ct_pointwise f)
{
	struct layer l = {.name = name,
		.ny = 301,
		.inputs = 1,
		.n = {301},
		.plain = pointwise_plain,
		.ca = f};

	draw(&l);
	CT_SIMD(ct_pointwise_forward)(f, 301, y_f, in_f[0]);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_pointwise_back)(f, 301, grad_f[0], dy_f, in_f[0], acc));
}

static void test_gelu_far(void)
{
	const float x[] = {-40, -6, -3, -0.001f, 0, 0.001f, 3, 6, 40};
	float y[9];

	CT_SIMD(ct_pointwise_forward)(CT_POINTWISE_GELU, 9, y, x);
	for (size_t i = 0; i < 9; i++)
		NEAR((double)y[i], gelu((double)x[i]), 3e-7 * fmax(1, fabs((double)x[i])), "GELU");
}

static void gate_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t p = 0; p < l->h; p++)
		for (size_t k = 0; k < l->c; k++)
			y[p * l->c + k] =
				gelu(in[0][p * 2 * l->c + k]) * in[0][p * 2 * l->c + l->c + k];
}

static void test_gate(void)
{
	struct layer l = {.name = "gate",
		.ny = 7 * 19,
		.inputs = 1,
		.n = {2 * 7 * 19},
		.plain = gate_plain,
		.h = 7,
		.c = 19};

	draw(&l);
	CT_SIMD(ct_pointwise_gate_forward)(7, 19, y_f, in_f[0]);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_pointwise_gate_back)(7, 19, grad_f[0], dy_f, in_f[0], acc));
}

/* ca: the second has one pixel */
static void times_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t i = 0; i < l->ny; i++)
		y[i] = in[0][i] * in[1][l->ca ? i % l->c : i];
}

static void test_times(const char *name, bool one)
{
	const size_t hw = 9, c = 13;
	struct layer l = {.name = name,
		.ny = hw * c,
		.inputs = 2,
		.n = {hw * c, one ? c : hw * c},
		.plain = times_plain,
		.c = c,
		.ca = one};

	draw(&l);
	CT_SIMD(ct_pointwise_times_forward)(hw, c, one, y_f, in_f[0], in_f[1]);
	check_forward(&l);
	for (int acc = 0; acc < 2; acc++) {
		CT_SIMD(ct_pointwise_times_back)
		(hw, c, one, grad_f[0], dy_f, in_f[1], acc);
		if (one)
			CT_SIMD(ct_pointwise_times_sum)
		(hw, c, grad_f[1], dy_f, in_f[0], acc, sum);
		else CT_SIMD(ct_pointwise_times_back)(hw, c, false, grad_f[1], dy_f, in_f[0], acc);
	}
	TWICE(l, (void)0);
}

/* inputs: x, gamma, beta */
static void norm_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t p = 0; p < l->h; p++) {
		const double *x = in[0] + p * l->c;
		double mean = 0, var = 0, n = (double)l->c;

		for (size_t k = 0; k < l->c; k++)
			mean += x[k] / n;
		for (size_t k = 0; k < l->c; k++)
			var += (x[k] - mean) * (x[k] - mean) / n;
		for (size_t k = 0; k < l->c; k++)
			y[p * l->c + k] = in[1][k] * (x[k] - mean) / sqrt(var + 1e-3) + in[2][k];
	}
}

static void test_norm(void)
{
	const size_t hw = 5, c = 37;
	struct layer l = {.name = "layer norm",
		.ny = hw * c,
		.inputs = 3,
		.n = {hw * c, c, c},
		.plain = norm_plain,
		.h = hw,
		.c = c};

	draw(&l);
	CT_SIMD(ct_pointwise_norm_forward)(hw, c, 1e-3, y_f, in_f[0], in_f[1], in_f[2]);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_pointwise_norm_back)(hw, c, 1e-3, grad_f[0], grad_f[1], grad_f[2], dy_f,
			 in_f[0], in_f[1], acc, sum));
}

static void shuffle_plain(const struct layer *l, double *y, double *const *in)
{
	const size_t r = l->ca;

	for (size_t i = 0; i < l->h * r; i++)
		for (size_t j = 0; j < l->w * r; j++)
			for (size_t k = 0; k < l->c; k++)
				y[(i * l->w * r + j) * l->c + k] =
					in[0][(i / r * l->w + j / r) * l->c * r * r + k * r * r +
						i % r * r + j % r];
}

static void test_shuffle(void)
{
	struct layer l = {.name = "pixel shuffle",
		.ny = 3 * 4 * 5 * 9,
		.inputs = 1,
		.n = {3 * 4 * 5 * 9},
		.plain = shuffle_plain,
		.h = 3,
		.w = 4,
		.c = 5,
		.ca = 3};

	draw(&l);
	CT_SIMD(ct_spatial_shuffle_forward)(3, 4, 5, 3, y_f, in_f[0]);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_spatial_shuffle_back)(3, 4, 5, 3, grad_f[0], dy_f, acc));
}

/* inputs: x, w, b */
static void depth_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t i = 0; i < l->h; i++)
		for (size_t j = 0; j < l->w; j++)
			for (size_t k = 0; k < l->c; k++) {
				double v = in[2][k];

				for (size_t t = 0; t < 9; t++) {
					const size_t p = i + t / 3, q = j + t % 3;

					if (p > 0 && q > 0 && p <= l->h && q <= l->w)
						v += in[1][k * 9 + t] *
						     in[0][((p - 1) * l->w + q - 1) * l->c + k];
				}
				y[(i * l->w + j) * l->c + k] = v;
			}
}

static void test_depth(size_t h, size_t w)
{
	const size_t c = 11;
	struct layer l = {.name = "depthwise convolution",
		.ny = h * w * c,
		.inputs = 3,
		.n = {h * w * c, 9 * c, c},
		.plain = depth_plain,
		.h = h,
		.w = w,
		.c = c};

	draw(&l);
	CT_SIMD(ct_spatial_depth_forward)(h, w, c, y_f, in_f[0], in_f[1], in_f[2], scratch);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_spatial_depth_back)(h, w, c, grad_f[0], grad_f[1], grad_f[2], dy_f,
			 in_f[0], in_f[1], acc, scratch));
}

static void mean_plain(const struct layer *l, double *y, double *const *in)
{
	for (size_t k = 0; k < l->c; k++) {
		y[k] = 0;
		for (size_t p = 0; p < l->h; p++)
			y[k] += in[0][p * l->c + k] / (double)l->h;
	}
}

static void test_mean(void)
{
	struct layer l = {.name = "mean",
		.ny = 7,
		.inputs = 1,
		.n = {31 * 7},
		.plain = mean_plain,
		.h = 31,
		.c = 7};

	draw(&l);
	CT_SIMD(ct_spatial_mean_forward)(31, 7, y_f, in_f[0], sum);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_spatial_mean_back)(31, 7, grad_f[0], dy_f, acc));
}

static void pool_plain(const struct layer *l, double *y, double *const *in)
{
	const size_t nh = (l->h - 7) / 3 + 1, nw = (l->w - 7) / 3 + 1;

	for (size_t p = 0; p < nh * nw; p++)
		for (size_t k = 0; k < l->c; k++) {
			double most = -HUGE_VAL;

			for (size_t t = 0; t < 49; t++)
				most = fmax(most,
					in[0][((p / nw * 3 + t / 7) * l->w + p % nw * 3 + t % 7) *
							l->c +
						k]);
			y[p * l->c + k] = most;
		}
}

static void test_pool(void)
{
	const size_t h = 13, w = 11, c = 5;
	struct layer l = {.name = "largest",
		.ny = 3 * 2 * c,
		.inputs = 1,
		.n = {h * w * c},
		.plain = pool_plain,
		.h = h,
		.w = w,
		.c = c};

	draw(&l);
	CT_SIMD(ct_spatial_pool_forward)(h, w, c, 7, 3, y_f, in_f[0]);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_spatial_pool_back)(h, w, c, 7, 3, grad_f[0], dy_f, in_f[0], acc));
}

/* Weight of pixel i of m in pixel k of n. */
static double weight(size_t k, size_t n, size_t i, size_t m)
{
	const double u = ((double)k + 0.5) * (double)m / (double)n - 0.5,
		     at = fmin(fmax(u, 0), (double)m - 1);

	return fmax(0, 1 - fabs(at - (double)i));
}

static void stretch_plain(const struct layer *l, double *y, double *const *in)
{
	const size_t nh = 7, nw = l->ca;

	memset(y, 0, l->ny * sizeof *y);
	for (size_t p = 0; p < nh * nw; p++)
		for (size_t q = 0; q < l->h * l->w; q++)
			for (size_t k = 0; k < l->c; k++)
				y[p * l->c + k] += weight(p / nw, nh, q / l->w, l->h) *
						   weight(p % nw, nw, q % l->w, l->w) *
						   in[0][q * l->c + k];
}

static void test_stretch(size_t h, size_t w, size_t nw)
{
	const size_t c = 3;
	struct layer l = {.name = "bilinear",
		.ny = 7 * nw * c,
		.inputs = 1,
		.n = {h * w * c},
		.plain = stretch_plain,
		.h = h,
		.w = w,
		.c = c,
		.ca = nw};

	draw(&l);
	CT_SIMD(ct_spatial_stretch_forward)(h, w, 7, nw, c, y_f, in_f[0]);
	check_forward(&l);
	TWICE(l, CT_SIMD(ct_spatial_stretch_back)(h, w, 7, nw, c, grad_f[0], dy_f, acc));
}

/* Are pixels p and q of one group? And the place of p within it, a pixel of a square. */
static bool together(const struct ct_window *a, size_t p, size_t q, size_t at[2])
{
	const size_t pos[2][2] = {{p / a->w, q / a->w}, {p % a->w, q % a->w}}, n[2] = {a->h, a->w};
	bool same = true;

	for (size_t k = 0; k < 2; k++) {
		const size_t x = pos[k][0], y = pos[k][1], far = n[k] / a->size;

		if (!a->spread) {
			same = same && x / a->size == y / a->size;
			at[k] = x % a->size;
		} else if (a->channels) {
			same = same && x % a->size == y % a->size;
		} else {
			same = same && x % far == y % far;
			at[k] = x / far;
		}
	}
	return same;
}

/* inputs: qkv, bias */
static void window_plain(const struct layer *l, double *y, double *const *in)
{
	const struct ct_window *a = &l->window;
	const size_t n = a->h * a->w, c = a->heads * a->width, m = a->size;
	size_t at[2] = {0}, to[2] = {0};

	memset(y, 0, l->ny * sizeof *y);
	for (size_t s = 0; s < n * a->heads; s++) {
		const size_t p = s / a->heads, head = s % a->heads;
		const double *q = in[0] + p * 3 * c + head * a->width;
		double all = 0;

		for (size_t r = 0; r < n; r++) {
			const double *k = in[0] + r * 3 * c + c + head * a->width, *v = k + c;
			double e = 0;

			if (!together(a, p, r, at) || !together(a, r, p, to))
				continue;
			for (size_t i = 0; i < a->width; i++)
				e += q[i] * k[i] / sqrt((double)a->width);
			e += in[1][((at[0] + m - 1 - to[0]) * (2 * m - 1) + at[1] + m - 1 - to[1]) *
					   a->heads +
				   head];
			all += exp(e);
			for (size_t i = 0; i < a->width; i++)
				y[p * c + head * a->width + i] += exp(e) * v[i];
		}
		for (size_t i = 0; i < a->width; i++)
			y[p * c + head * a->width + i] /= all;
	}
}

static void test_window(const char *name, bool spread)
{
	const size_t h = 6, w = 9, c = 8, n = h * w;
	struct layer l = {.name = name,
		.ny = n * c,
		.inputs = 2,
		.n = {n * 3 * c, 25 * 2},
		.plain = window_plain,
		.window = {false, spread, h, w, 3, 2, 4}};

	draw(&l);
	if (ct_window_forward(&l.window, y_f, in_f[0], in_f[1], scratch, &err))
		OK(0, "%s", err.msg);
	check_forward(&l);
	if (ct_window_back(&l.window, grad_f[0], grad_f[1], dy_f, in_f[0], in_f[1], scratch, &err))
		OK(0, "%s", err.msg);
	check_back(&l);
}

/* Cosine of channels i of q and j of k over the pixels of the group of pixel p. */
static double cosine(const struct layer *l, const double *qkv, size_t p, size_t i, size_t j)
{
	const struct ct_window *a = &l->window;
	const size_t c = a->heads * a->width;
	double qk = 0, qq = 0, kk = 0;
	size_t at[2];

	for (size_t r = 0; r < a->h * a->w; r++) {
		const double *x = qkv + r * 3 * c;

		if (!together(a, p, r, at))
			continue;
		qk += x[i] * x[c + j];
		qq += x[i] * x[i];
		kk += x[c + j] * x[c + j];
	}
	return qk / sqrt(qq * kk);
}

/* inputs: qkv, temperature */
static void channels_plain(const struct layer *l, double *y, double *const *in)
{
	const struct ct_window *a = &l->window;
	const size_t c = a->heads * a->width, wd = a->width;

	for (size_t p = 0; p < a->h * a->w; p++)
		for (size_t i = 0; i < c; i++) {
			double all = 0, v = 0;

			for (size_t j = i / wd * wd; j < (i / wd + 1) * wd; j++) {
				const double e = exp(in[1][i / wd] * cosine(l, in[0], p, i, j));

				all += e;
				v += e * in[0][p * 3 * c + 2 * c + j];
			}
			y[p * c + i] = v / all;
		}
}

static void test_channels(const char *name, bool spread)
{
	const size_t h = 4, w = 6, c = 6, n = h * w;
	struct layer l = {.name = name,
		.ny = n * c,
		.inputs = 2,
		.n = {n * 3 * c, 2},
		.plain = channels_plain,
		.window = {true, spread, h, w, 2, 2, 3}};

	draw(&l);
	if (ct_window_forward(&l.window, y_f, in_f[0], in_f[1], scratch, &err))
		OK(0, "%s", err.msg);
	check_forward(&l);
	if (ct_window_back(&l.window, grad_f[0], grad_f[1], dy_f, in_f[0], in_f[1], scratch, &err))
		OK(0, "%s", err.msg);
	check_back(&l);
}

int main(void)
{
	const int was = ct_dnn_enter();

	begin();
	test_pointwise("ReLU", CT_POINTWISE_RELU);
	test_pointwise("GELU", CT_POINTWISE_GELU);
	test_pointwise("sigmoid", CT_POINTWISE_SIGMOID);
	test_gelu_far();
	test_gate();
	test_times("times", false);
	test_times("times one pixel", true);
	test_norm();
	test_shuffle();
	test_depth(4, 5);
	test_depth(1, 3);
	test_mean();
	test_pool();
	test_stretch(3, 4, 9);
	test_stretch(1, 5, 3);
	test_window("attention in windows", false);
	test_window("attention over a grid", true);
	test_channels("attention of channels in windows", false);
	test_channels("attention of channels over a comb", true);
	end();
	ct_dnn_leave(was);
	return tap_done();
}
