/* t-kernels.c: every kernel (core/simd.h) at every level: the same bytes as at the lowest, as near
 * as promised to its plain twin, nothing written or read beyond its buffers, for sizes 1 to 70.
 *
 * bench/b-kernels is this file as well, and prints how many ticks of the clock a call takes.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/arssr-kernels.h"
#include "nn/dense-kernels.h"
#include "nn/layers.h"
#include "nn/norm.h"
#include "nn/pointwise.h"
#include "nn/spatial.h"
#include "solve/adam.h"
#include "solve/vector.h"
#include "kernels.h"

static double sigmoid(double x)
{
	return 1 / (1 + exp(-x));
}

static double gelu(double x)
{
	return x * 0.5 * (1 + erf(x / sqrt(2)));
}

/* The twin of all kernels that add to a sum what they write. */
static void into(float *to, double what, bool acc)
{
	*to = F(acc ? (double)*to + what : what);
}

/* src/solve */
static void dot(size_t n)
{
	const struct ct_vector v = {.x = floats(n), .w = floats(n)};

	KERNEL(kernel.sum = CT_SIMD(ct_vector_dot)(n, &v),
		EACH(i, n) kernel.sum += (double)v.x[i] * (double)v.w[i]);
}

static void scale(size_t n)
{
	const struct ct_vector v = {.y = floats(n), .c = -0.7};

	KERNEL(CT_SIMD(ct_vector_scale)(n, &v), EACH(i, n) v.y[i] = F(v.c * (double)v.y[i]));
}

static void mix(size_t n)
{
	const struct ct_vector v = {.y = floats(n), .x = floats(n), .b = 1.25, .c = -0.7};

	KERNEL(CT_SIMD(ct_vector_mix)(n, &v),
		EACH(i, n) v.y[i] = F(v.b * (double)v.x[i] + v.c * (double)v.y[i]));
}

static void lead(size_t n)
{
	const struct ct_vector v = {.y = floats(n), .x = floats(n), .c = 0.3};

	KERNEL(
		kernel.sum = CT_SIMD(ct_vector_lead)(n, &v), EACH(i, n) {
			const double d = (double)v.x[i] - (double)v.y[i];

			v.y[i] = F((double)v.x[i] + v.c * d);
			kernel.sum += d * d;
		});
}

static void times(size_t n)
{
	const struct ct_vector v = {.y = floats(n), .w = floats(n)};

	KERNEL(CT_SIMD(ct_vector_times)(n, &v), EACH(i, n) v.y[i] *= v.w[i]);
}

static void correct(size_t n)
{
	const struct ct_vector v = {
		.y = floats(n), .x = floats(n), .w = floats(n), .c = (double)(n % 2)};

	KERNEL(
		CT_SIMD(ct_vector_correct)(n, &v), EACH(i, n) {
			v.y[i] = F((double)v.y[i] + (double)v.w[i] * (double)v.x[i]);
			v.y[i] = v.c > 0 && v.y[i] < 0 ? 0 : v.y[i];
		});
}

static const struct ct_adamw adam = {0.01, 0.9, 0.99, 1e-8, 0.1};

static void adamw(size_t n)
{
	float *p = floats(n), *m = floats(n), *v = positives(n);
	const float *g = floats(n);

	KERNEL(
		CT_SIMD(ct_adamw_step)(&adam, 3, n, p, m, v, g), EACH(i, n) {
			const double d = (double)g[i], b1 = adam.beta1, b2 = adam.beta2;

			m[i] = F(b1 * (double)m[i] + (1 - b1) * d);
			v[i] = F(b2 * (double)v[i] + (1 - b2) * d * d);
			p[i] = F((1 - adam.lr * adam.decay) * (double)p[i] -
				 adam.lr * (double)m[i] / (1 - pow(b1, 3)) /
					 (sqrt((double)v[i] / (1 - pow(b2, 3))) + adam.eps));
		});
}

static void adam_each(size_t n)
{
	float *p = floats(n), *m = floats(n), *v = positives(n);
	const float *g = floats(n), *c1 = positives(n), *c2 = positives(n);

	KERNEL(
		CT_SIMD(ct_adam_each)(&adam, n, p, m, v, g, c1, c2), EACH(i, n) {
			const double d = (double)g[i], b1 = adam.beta1, b2 = adam.beta2;

			m[i] = F(b1 * (double)m[i] + (1 - b1) * d);
			v[i] = F(b2 * (double)v[i] + (1 - b2) * d * d);
			p[i] = F((double)p[i] -
				 adam.lr * (double)c1[i] * (double)m[i] /
					 (sqrt((double)v[i]) * (double)c2[i] + adam.eps));
		});
}

static void adam_average(size_t n)
{
	float *mean = floats(n);
	const float *p = floats(n);

	KERNEL(CT_SIMD(ct_adam_average)(0.75, n, mean, p),
		EACH(i, n) mean[i] = F(0.75 * (double)mean[i] + 0.25 * (double)p[i]));
}

static void adam_gradient(size_t n)
{
	float *g = floats(3 * n);

	KERNEL(
		kernel.sum = CT_SIMD(ct_adam_gradient)(n, g, 3, n, 0.5f), EACH(i, n) {
			g[i] = F(0.5 * ((double)g[i] + (double)g[n + i] + (double)g[2 * n + i]));
			kernel.sum += (double)g[i] * (double)g[i];
		});
}

/* src/nn; pictures are of 3 x 4 pixels where their channels are counted */
enum { H = 4, W = 6, HW = H * W };

static void silu(size_t n)
{
	float *y = floats(n);
	const float *x = floats(n);

	KERNEL(CT_SIMD(ct_layer_silu_forward)(n, y, x),
		EACH(i, n) y[i] = F((double)x[i] * sigmoid((double)x[i])));
}

static void silu_back(size_t n)
{
	float *dx = floats(n);
	const float *dy = floats(n), *x = floats(n);

	KERNEL(
		CT_SIMD(ct_layer_silu_back)(n, dx, dy, x, n % 2), EACH(i, n) {
			const double s = sigmoid((double)x[i]);

			into(dx + i, (double)dy[i] * s * (1 + (double)x[i] * (1 - s)), n % 2);
		});
}

static void linear(size_t n)
{
	float *y = floats(5);
	const float *x = floats(n), *w = floats(5 * n), *b = floats(5);

	KERNEL(
		CT_SIMD(ct_layer_linear_forward)(n, 5, y, x, w, b), EACH(c, 5) {
			double sum = (double)b[c];

			EACH(i, n) sum += (double)w[c * n + i] * (double)x[i];
			y[c] = F(sum);
		});
}

static void linear_back(size_t n)
{
	float *dx = floats(n), *dw = floats(5 * n), *db = floats(5);
	const float *dy = floats(5), *x = floats(n), *w = floats(5 * n);

	KERNEL(
		CT_SIMD(ct_layer_linear_back)(n, 5, dx, dw, db, dy, x, w, n % 2), EACH(c, 5) {
			EACH(i, n) dw[c * n + i] += dy[c] * x[i];
			EACH(i, n)
			into(dx + i, (double)dy[c] * (double)w[c * n + i], n % 2 || c > 0);
			db[c] += dy[c];
		});
}

static void up(size_t n)
{
	float *y = floats(4 * HW * n);
	const float *x = floats(HW * n);

	KERNEL(CT_SIMD(ct_layer_up_forward)(H, W, n, y, x),
		EACH(p, 4 * HW) EACH(c, n) y[p * n + c] =
			x[(p / (2 * W) / 2 * W + p % (2 * W) / 2) * n + c]);
}

static void up_back(size_t n)
{
	float *dx = floats(HW * n);
	const float *dy = floats(4 * HW * n);

	KERNEL(
		CT_SIMD(ct_layer_up_back)(H, W, n, dx, dy, n % 2), EACH(p, HW) EACH(c, n) {
			const float *d = dy + (p / W * 4 * W + p % W * 2) * n + c;

			into(dx + p * n + c,
				(double)d[0] + (double)d[n] + (double)d[2 * W * n] +
					(double)d[(2 * W + 1) * n],
				n % 2);
		});
}

static void down(size_t n)
{
	float *y = floats(HW / 4 * n);
	const float *x = floats(HW * n);

	KERNEL(
		CT_SIMD(ct_layer_down_forward)(H, W, n, y, x), EACH(p, HW / 4) EACH(c, n) {
			const float *d = x + (p / (W / 2) * 2 * W + p % (W / 2) * 2) * n + c;

			y[p * n + c] = 0.25f * (d[0] + d[n] + d[W * n] + d[(W + 1) * n]);
		});
}

static void down_back(size_t n)
{
	float *dx = floats(HW * n);
	const float *dy = floats(HW / 4 * n);

	KERNEL(CT_SIMD(ct_layer_down_back)(H, W, n, dx, dy, n % 2),
		EACH(p, HW) EACH(c, n) into(dx + p * n + c,
			0.25 * (double)dy[(p / W / 2 * (W / 2) + p % W / 2) * n + c], n % 2));
}

static void concat(size_t n)
{
	float *y = floats(HW * (n + 3));
	const float *a = floats(HW * n), *b = floats(HW * 3);

	KERNEL(CT_SIMD(ct_layer_concat_forward)(HW, n, 3, y, a, b),
		EACH(p, HW) EACH(c, n + 3) y[p * (n + 3) + c] =
			c < n ? a[p * n + c] : b[p * 3 + c - n]);
}

static void concat_back(size_t n)
{
	float *dx = floats(HW * n);
	const float *dy = floats(HW * (n + 3));

	KERNEL(CT_SIMD(ct_layer_concat_back)(HW, n + 3, 2, n, dx, dy, n % 2),
		EACH(p, HW) EACH(c, n)
			into(dx + p * n + c, (double)dy[p * (n + 3) + 2 + c], n % 2));
}

static void take(size_t n)
{
	float *y = floats(n);
	const float *x = floats(n);

	KERNEL(CT_SIMD(ct_layer_take)(n, y, x, n % 2), EACH(i, n) into(y + i, (double)x[i], n % 2));
}

static void to_last(size_t n)
{
	float *y = floats(HW * n);
	const float *x = floats(HW * n);

	KERNEL(CT_SIMD(ct_layer_to_last)(HW, n, y, x),
		EACH(p, HW) EACH(c, n) y[p * n + c] = x[c * HW + p]);
}

static void to_first(size_t n)
{
	float *y = floats(HW * n);
	const float *x = floats(HW * n);

	KERNEL(CT_SIMD(ct_layer_to_first)(n, HW, y, x),
		EACH(p, n) EACH(c, HW) y[c * n + p] = x[p * HW + c]);
}

static void softmax(size_t n)
{
	float *w = floats(3 * n);

	KERNEL(
		CT_SIMD(ct_layer_softmax)(3, n, w), EACH(r, 3) {
			double sum = 0;

			EACH(i, n) sum += exp((double)w[r * n + i]);
			EACH(i, n) w[r * n + i] = F(exp((double)w[r * n + i]) / sum);
		});
}

static void softmax_back(size_t n)
{
	float *dw = floats(3 * n);
	const float *w = floats(3 * n);

	KERNEL(
		CT_SIMD(ct_layer_softmax_back)(3, n, dw, w), EACH(r, 3) {
			const float *by = w + r * n;
			float *d = dw + r * n;
			double sum = 0;

			EACH(i, n) sum += (double)by[i] * (double)d[i];
			EACH(i, n) d[i] = F((double)by[i] * ((double)d[i] - sum));
		});
}

static void embed(size_t n)
{
	float *y = floats(n);

	KERNEL(
		CT_SIMD(ct_layer_embed)(n, y, 17.5), EACH(i, n) {
			const size_t half = n / 2, k = half ? i % half : 0;
			const double at = 17.5 * pow(10000, -(double)k / (double)half);

			y[i] = i >= 2 * half ? 0 : F(i < half ? cos(at) : sin(at));
		});
}

static void norm_sums(size_t n)
{
	double *sums = doubles(128);
	const float *x = floats(64 * n);

	KERNEL(
		CT_SIMD(ct_norm_sums)(n, 64, sums, x), EACH(c, 64) {
			sums[c] = sums[64 + c] = 0;
			EACH(p, n) sums[c] += (double)x[p * 64 + c];
			EACH(p, n) sums[64 + c] += (double)x[p * 64 + c] * (double)x[p * 64 + c];
		});
}

/* Of the 64 channels of n pixels; sums must be of x. */
static struct ct_norm norm_of(size_t n, double *sums, const float *x)
{
	struct ct_norm norm = {.hw = n,
		.c = 64,
		.gamma = floats(64),
		.beta = floats(64),
		.silu = n % 3 == 0,
		.scale_shift = n % 2};

	norm.e = floats(n % 2 ? 128 : 64);
	CT_SIMD(ct_norm_sums)(n, 64, sums, x);
	return norm;
}

static void norm(size_t n)
{
	float *y = floats(64 * n), *ab = scratch(128 * sizeof *ab);
	const float *x = floats(64 * n);
	double *sums = doubles(128);
	const struct ct_norm s = norm_of(n, sums, x);

	KERNEL(
		CT_SIMD(ct_norm_forward)(&s, y, x, sums, ab), EACH(c, 64) {
			const float *e = s.e;
			double mean = 0, square = 0;

			EACH(i, 2 * n)
			{
				const size_t k = c / 2 * 2 + i % 2;
				const double v =
					(double)x[i / 2 * 64 + k] + (n % 2 ? 0 : (double)e[k]);

				mean += v / (2 * (double)n);
				square += v * v / (2 * (double)n);
			}
			EACH(p, n)
			{
				const double v = (double)x[p * 64 + c] + (n % 2 ? 0 : (double)e[c]);
				double z = (double)s.gamma[c] * (v - mean) /
						   sqrt(square - mean * mean + 1e-5) +
					   (double)s.beta[c];

				z = n % 2 ? z * (1 + (double)e[c]) + (double)e[64 + c] : z;
				y[p * 64 + c] = F(s.silu ? z * sigmoid(z) : z);
			}
		});
}

static void norm_back(size_t n)
{
	float *dx = floats(64 * n), *dgamma = floats(64), *dbeta = floats(64), *de = floats(128),
	      *dy = floats(64 * n), *rest = scratch(ct_norm_scratch(64) * sizeof *rest);
	const float *x = floats(64 * n);
	double *sums = doubles(128);
	const struct ct_norm s = norm_of(n, sums, x);

	KERNEL(CT_SIMD(ct_norm_back)(&s, dx, dgamma, dbeta, de, dy, x, sums, n % 2, rest), ALONE);
}

static void pointwise(size_t n)
{
	float *y[3] = {floats(n), floats(n), floats(n)};
	const float *x = floats(n);

	KERNEL(
		EACH(f, 3) CT_SIMD(ct_pointwise_forward)((enum ct_pointwise)f, n, y[f], x),
		EACH(i, n) {
			y[0][i] = fmaxf(0, x[i]);
			y[1][i] = F(gelu((double)x[i]));
			y[2][i] = F(sigmoid((double)x[i]));
		});
}

static void pointwise_back(size_t n)
{
	float *dx[3] = {floats(n), floats(n), floats(n)};
	const float *dy = floats(n), *x = floats(n);

	KERNEL(
		EACH(f, 3) CT_SIMD(ct_pointwise_back)((enum ct_pointwise)f, n, dx[f], dy, x, n % 2),
		EACH(i, n) {
			const double v = (double)x[i], s = sigmoid(v), d = (double)dy[i];

			into(dx[0] + i, v > 0 ? d : 0, n % 2);
			into(dx[1] + i,
				d * (0.5 * (1 + erf(v / sqrt(2))) +
					    v * exp(-v * v / 2) / sqrt(2 * M_PI)),
				n % 2);
			into(dx[2] + i, d * s * (1 - s), n % 2);
		});
}

static void gate(size_t n)
{
	float *y = floats(5 * n);
	const float *x = floats(10 * n);

	KERNEL(CT_SIMD(ct_pointwise_gate_forward)(5, n, y, x),
		EACH(p, 5) EACH(c, n) y[p * n + c] =
			F(gelu((double)x[p * 2 * n + c]) * (double)x[p * 2 * n + n + c]));
}

static void gate_back(size_t n)
{
	float *dx = floats(10 * n);
	const float *dy = floats(5 * n), *x = floats(10 * n);

	KERNEL(CT_SIMD(ct_pointwise_gate_back)(5, n, dx, dy, x, n % 2), ALONE);
}

static void by_pixel(size_t n)
{
	float *y = floats(5 * n), *dx = floats(5 * n), *db = floats(n);
	const float *x = floats(5 * n), *b = floats(5 * n);
	double *sum = doubles(n);
	const bool one = n % 2;

	KERNEL(
		{
			CT_SIMD(ct_pointwise_times_forward)(5, n, one, y, x, b);
			CT_SIMD(ct_pointwise_times_back)(5, n, one, dx, x, b, n % 3 == 0);
			CT_SIMD(ct_pointwise_times_sum)(5, n, db, b, x, n % 3 == 0, sum);
		},
		EACH(c, n) {
			sum[c] = 0;
			EACH(p, 5)
			{
				const size_t at = p * n + c;
				const double v = (double)x[at] * (double)b[one ? c : at];

				y[at] = F(v);
				into(dx + at, v, n % 3 == 0);
				sum[c] += (double)b[at] * (double)x[at];
			}
			into(db + c, sum[c], n % 3 == 0);
		});
}

static void layer_norm(size_t n)
{
	float *y = floats(5 * n);
	const float *x = floats(5 * n), *gamma = floats(n), *beta = floats(n);

	KERNEL(
		CT_SIMD(ct_pointwise_norm_forward)(5, n, 1e-3, y, x, gamma, beta), EACH(p, 5) {
			const float *at = x + p * n;
			double mean = 0, var = 0;

			EACH(c, n) mean += (double)at[c] / (double)n;
			EACH(c, n)
			var += ((double)at[c] - mean) * ((double)at[c] - mean) / (double)n;
			EACH(c, n)
			y[p * n + c] =
				F((double)gamma[c] * ((double)at[c] - mean) / sqrt(var + 1e-3) +
					(double)beta[c]);
		});
}

static void layer_norm_back(size_t n)
{
	float *dx = floats(5 * n), *dgamma = floats(n), *dbeta = floats(n);
	const float *dy = floats(5 * n), *x = floats(5 * n), *gamma = floats(n);
	double *sum = scratch(2 * n * sizeof *sum);

	KERNEL(CT_SIMD(ct_pointwise_norm_back)(
		       5, n, 1e-3, dx, dgamma, dbeta, dy, x, gamma, n % 2, sum),
		ALONE);
}

static void dense(size_t n)
{
	enum { DEPTH = 7, COLS = 48, LD = 64 };
	float *y = floats(n * LD);
	const float *w = floats(n * DEPTH), *x = floats(DEPTH * LD), *b = floats(n),
		    *mask = floats(n * LD);
	const struct ct_dense_product p = {.rows = n,
		.depth = DEPTH,
		.cols = n % 2 ? COLS : LD,
		.ld = LD,
		.y = y,
		.w = w,
		.x = x,
		.b = n % 3 ? b : NULL,
		.mask = n % 5 ? NULL : mask,
		.wr = DEPTH,
		.wk = 1,
		.slope = 0.5f,
		.add = n % 7 == 0};

	KERNEL(
		CT_SIMD(ct_dense_kernels_product)(&p), EACH(r, n) EACH(i, p.cols) {
			double s = p.add ? (double)y[r * LD + i] : p.b ? (double)b[r] : 0;

			EACH(k, DEPTH) s += (double)w[r * DEPTH + k] * (double)x[k * LD + i];
			y[r * LD + i] = F((p.mask ? (double)mask[r * LD + i] : s) > 0 ? s : s / 2);
		});
}

static void dense_finish(size_t n)
{
	float *y = floats(n * 64);
	const float *b = floats(n);
	const struct ct_dense_product p = {
		.rows = n, .cols = 48, .ld = 64, .y = y, .b = b, .slope = 0.5f};

	KERNEL(
		CT_SIMD(ct_dense_kernels_finish)(&p), EACH(r, n) EACH(i, 48) {
			const double s = (double)y[r * 64 + i] + (double)b[r];

			y[r * 64 + i] = F(s > 0 ? s : s / 2);
		});
}

static void dense_gradient(size_t n)
{
	float *dw = floats(n * 9);
	const float *d = floats(n * 64), *x = floats(9 * 64);

	KERNEL(
		CT_SIMD(ct_dense_kernels_gradient)(n, 9, 48, 64, dw, 9, d, x),
		EACH(r, n) EACH(c, 9) {
			double sum = 0;

			EACH(i, 48) sum += (double)d[r * 64 + i] * (double)x[c * 64 + i];
			dw[r * 9 + c] = F((double)dw[r * 9 + c] + sum);
		});
}

static void dense_sums(size_t n)
{
	float *sums = floats(n);
	const float *a = floats(n * 64), *b = floats(n * 64);

	KERNEL(
		CT_SIMD(ct_dense_kernels_sums)(n, 48, 64, sums, a, n % 2 ? b : NULL), EACH(r, n) {
			double sum = (double)sums[r];

			EACH(i, 48)
			sum += (double)a[r * 64 + i] * (n % 2 ? (double)b[r * 64 + i] : 1);
			sums[r] = F(sum);
		});
}

static void dense_sigmoid(size_t n)
{
	float *y = floats((n + 15) / 16 * 16);

	KERNEL(CT_SIMD(ct_dense_kernels_sigmoid)((n + 15) / 16 * 16, y),
		EACH(i, (n + 15) / 16 * 16) y[i] = F(sigmoid((double)y[i])));
}

/* src/arssr */
static void mask(size_t n)
{
	float *dy = floats(n);
	const float *y = floats(n);

	KERNEL(CT_SIMD(ct_arssr_kernels_mask)(n, dy, y), EACH(i, n) dy[i] = y[i] > 0 ? dy[i] : 0);
}

static const float corner[8] = {0.5f, -0.25f, 0.125f, 1, -1, 0.75f, 0.3f, 0.1f};

static void gather(size_t n)
{
	const size_t at[8] = {0, n, 2 * n, 3 * n, 1, n + 2, 3, 2 * n + 1};
	float *y = floats(n);
	const float *x = floats(4 * n + 3);

	KERNEL(
		CT_SIMD(ct_arssr_kernels_gather)(n, y, x, at, corner), EACH(i, n) {
			double sum = 0;

			EACH(c, 8) sum += (double)corner[c] * (double)x[at[c] + i];
			y[i] = F(sum);
		});
}

static void scatter(size_t n)
{
	const size_t at[8] = {0, n, 2 * n, 3 * n, 1, n + 2, 3, 2 * n + 1};
	float *dx = floats(4 * n + 3);
	const float *dy = floats(n);

	KERNEL(CT_SIMD(ct_arssr_kernels_scatter)(n, dx, dy, at, corner),
		EACH(c, 8) EACH(i, n) dx[at[c] + i] += corner[c] * dy[i]);
}

static const struct kernel_row rows[] = {
	{"ct_vector_dot", dot, 1e-14, false},
	{"ct_vector_scale", scale, 1e-6, false},
	{"ct_vector_mix", mix, 1e-6, false},
	{"ct_vector_lead", lead, 1e-6, false},
	{"ct_vector_times", times, 1e-6, false},
	{"ct_vector_correct", correct, 1e-6, false},
	{"ct_adamw_step", adamw, 1e-5, false},
	{"ct_adam_each", adam_each, 1e-5, false},
	{"ct_adam_average", adam_average, 1e-6, false},
	{"ct_adam_gradient", adam_gradient, 1e-6, false},
	{"ct_layer_silu_forward", silu, 1e-6, false},
	{"ct_layer_silu_back", silu_back, 1e-6, false},
	{"ct_layer_linear_forward", linear, 1e-5, false},
	{"ct_layer_linear_back", linear_back, 1e-6, false},
	{"ct_layer_up_forward", up, 0, false},
	{"ct_layer_up_back", up_back, 1e-6, false},
	{"ct_layer_down_forward", down, 1e-6, false},
	{"ct_layer_down_back", down_back, 1e-6, false},
	{"ct_layer_concat_forward", concat, 0, false},
	{"ct_layer_concat_back", concat_back, 1e-6, false},
	{"ct_layer_take", take, 1e-6, false},
	{"ct_layer_to_last", to_last, 0, false},
	{"ct_layer_to_first", to_first, 0, false},
	{"ct_layer_softmax", softmax, 1e-6, false},
	{"ct_layer_softmax_back", softmax_back, 1e-5, false},
	{"ct_layer_embed", embed, 1e-5, false},
	{"ct_norm_sums", norm_sums, 1e-12, false},
	{"ct_norm_forward", norm, 1e-4, false},
	{"ct_norm_back", norm_back, 0, false},
	{"ct_pointwise_forward", pointwise, 1e-6, false},
	{"ct_pointwise_back", pointwise_back, 1e-6, false},
	{"ct_pointwise_gate_forward", gate, 1e-6, false},
	{"ct_pointwise_gate_back", gate_back, 0, false},
	{"ct_pointwise_times", by_pixel, 1e-6, false},
	{"ct_pointwise_norm_forward", layer_norm, 1e-5, false},
	{"ct_pointwise_norm_back", layer_norm_back, 0, false},
	{"ct_dense_kernels_product", dense, 1e-5, true},
	{"ct_dense_kernels_finish", dense_finish, 1e-6, true},
	{"ct_dense_kernels_gradient", dense_gradient, 1e-5, true},
	{"ct_dense_kernels_sums", dense_sums, 1e-5, true},
	{"ct_dense_kernels_sigmoid", dense_sigmoid, 1e-6, true},
	{"ct_arssr_kernels_mask", mask, 0, false},
	{"ct_arssr_kernels_gather", gather, 1e-5, false},
	{"ct_arssr_kernels_scatter", scatter, 1e-6, false},
};

int main(int argc, char **argv)
{
	(void)argv;
	return kernel_main(sizeof rows / sizeof *rows, rows, argc > 1);
}
