/* t-kernels-model.c: as t-kernels.c, of models and what measures them: Gaussians and their loss,
 * SSIM, neural fields. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/encoding.h"
#include "field/ray-attention.h"
#include "gs/loss.h"
#include "gs/rasterise.h"
#include "gs/splat.h"
#include "quality/ssim-kernels.h"
#include "kernels.h"

/* src/gs */
static void loss_l1(size_t n)
{
	const float *base = floats(n), *weight = floats(n);
	const struct ct_loss_row r = {floats(n), floats(n), floats(n), floats(n),
		n % 2 ? base : NULL, floats(n), n % 3 ? weight : NULL};

	KERNEL(
		kernel.sum = CT_SIMD(ct_loss_row_l1)(&r, n, 0.5f, 0.25f), EACH(i, n) {
			const double x = 0.5 * ((double)r.img[i] + (r.base ? (double)base[i] : 0)),
				     y = 0.5 * (double)r.want[i],
				     w = r.weight ? (double)weight[i] : 1;

			r.x[i] = F(x);
			r.y[i] = F(y);
			r.g[i] = F(0.25 * w * (x > y ? 1 : -1));
			kernel.sum += w * fabs(x - y);
		});
}

static void loss_tv(size_t n)
{
	float *da = floats(n), *db = floats(n);
	const float *a = floats(n), *b = floats(n), *ab = floats(n), *bb = floats(n);

	KERNEL(
		kernel.sum = CT_SIMD(ct_loss_row_tv)(n % 5 ? da : NULL, n % 7 ? db : NULL, a, b,
			n % 2 ? ab : NULL, n % 2 ? bb : NULL, n, 0.25f),
		EACH(i, n) {
			const double d = (double)b[i] - (double)a[i] +
					 (n % 2 ? (double)bb[i] - (double)ab[i] : 0);
			const float g = d > 0 ? 0.25f : -0.25f;

			da[i] -= n % 5 ? g : 0;
			db[i] += n % 7 ? g : 0;
			kernel.sum += fabs(d);
		});
}

/* Gaussians on rows [32, 72) of w columns, round or long. */
enum { DRAWN = 5, ROW0 = 32, ROW1 = 72 };

static void drawn(struct ct_pixel_gaussian d[DRAWN], size_t w)
{
	EACH(i, DRAWN)
	{
		const double kx = 0.02 + 0.05 * (double)i, ky = 0.3 / (double)(i + 1),
			     slope = 0.4 * (double)i - 0.7, cut = CT_GS_CUT, reach = sqrt(cut / ky);
		const double row = 40.3 + 5 * (double)i;

		d[i] = (struct ct_pixel_gaussian){.col = (int32_t)(w * (i + 1) / 6),
			.row = (int32_t)row,
			.first = (int32_t)fmax(ceil(row - reach), ROW0),
			.end = (int32_t)fmin(floor(row + reach) + 1, ROW1),
			.fx = 0.37f,
			.fy = F(row - floor(row)),
			.slope = F(slope),
			.kx = F(kx),
			.ky = F(ky),
			.amp = F(0.5 + (double)i),
			.cut = F(cut),
			.least = F(exp(-cut)),
			.bend = F(exp(-2 * (kx * slope * slope + ky))),
			.y_right = F(slope / ky * sqrt(cut / (1 / kx + slope * slope / ky)))};
	}
}

/* e of a pixel, and where it is. */
static double drawn_at(const struct ct_pixel_gaussian *d, size_t row, size_t col, double at[2])
{
	double e;

	at[1] = (double)row - d->row - (double)d->fy;
	at[0] = (double)col - d->col - (double)d->fx - (double)d->slope * at[1];
	e = exp(-(double)d->kx * at[0] * at[0] - (double)d->ky * at[1] * at[1]);
	return (int32_t)row < d->first || (int32_t)row >= d->end || e < (double)d->least ? 0 : e;
}

static void rasterise(size_t n)
{
	const size_t pitch = ct_rasterise_pitch(n);
	struct ct_pixel_gaussian d[DRAWN];
	float *img = floats((ROW1 - ROW0) * pitch);

	drawn(d, n);
	KERNEL(
		CT_SIMD(ct_rasterise_add)(img, pitch, n, ROW0, ROW1, DRAWN, NULL, d),
		EACH(g, DRAWN) EACH(r, ROW1 - ROW0) EACH(c, n) {
			double at[2];

			img[r * pitch + c] += d[g].amp * F(drawn_at(d + g, ROW0 + r, c, at));
		});
	EACH(i, (ROW1 - ROW0) * pitch) img[i] = i % pitch < n ? img[i] : 0;
}

static void rasterise_sums(size_t n)
{
	const size_t pitch = ct_rasterise_pitch(n);
	struct ct_pixel_gaussian d[DRAWN];
	double *s = doubles(6 * DRAWN);
	const float *g = floats(ROW1 * pitch);

	drawn(d, n);
	KERNEL(
		CT_SIMD(ct_rasterise_sums)(s, DRAWN, g, 0, pitch, n, DRAWN, d), EACH(k, DRAWN) {
			EACH(m, 6) s[m * DRAWN + k] = 0;
			EACH(r, ROW1) EACH(c, n)
			{
				double at[2],
					e = drawn_at(d + k, r, c, at) * (double)g[r * pitch + c];
				const double by[6] = {1, at[0], at[1], at[0] * at[0], at[0] * at[1],
					at[1] * at[1]};

				EACH(m, 6) s[m * DRAWN + k] += e * by[m];
			}
		});
}

static struct ct_gauss raw(size_t n)
{
	struct ct_gauss g = {.n = n, .cap = n};

	EACH(c, CT_GAUSS_COLUMNS) g.column[c] = floats(n);
	return g;
}

enum { GAUSSIAN = sizeof(struct ct_gaussian) / sizeof(double) };

static void resolve(size_t n)
{
	struct ct_gaussian *b = (struct ct_gaussian *)(void *)doubles(n * GAUSSIAN);
	const struct ct_gauss g = raw(n);

	KERNEL(CT_SIMD(ct_gaussian_resolve_some)(b, &g, 0, n), ALONE);
}

static const struct ct_camera camera = {
	true, 64, 64, {0, -500, 0}, {0, 1, 0}, {{8000, 0, 0}, {0, 0, 8000}}, {32, 32}, 1};

static void splat(size_t n)
{
	const size_t some = n < CT_GS_CHUNK ? n : CT_GS_CHUNK;
	struct ct_gradient grad = {.cap = n};
	const struct ct_gauss g = raw(some);
	struct ct_gaussian *b = (struct ct_gaussian *)(void *)doubles(some * GAUSSIAN);
	double *sums = doubles((size_t)6 * CT_GS_CHUNK);
	struct ct_pixel_gaussian *o =
		(struct ct_pixel_gaussian *)(void *)floats(some * sizeof *o / sizeof(float));
	struct ct_splat s = {.n = some, .cam = camera, .footprint = o};

	EACH(c, CT_GS_FIELDS + 1) grad.column[c] = floats(some);
	EACH(m, 6) EACH(i, CT_GS_CHUNK - some) sums[m * CT_GS_CHUNK + some + i] = 0;
	CT_SIMD(ct_gaussian_resolve_some)(b, &g, 0, some);
	KERNEL(
		{
			CT_SIMD(ct_splat_project_some)(o, &camera, b, some);
			CT_SIMD(ct_splat_backward_some)(&grad, &s, b, &g, 0, some, sums);
		},
		ALONE);
}

/* src/quality */
static void ssim_tile(size_t n)
{
	const size_t w = n < CT_SSIM_TILE ? n : CT_SSIM_TILE;
	struct ct_ssim_rule rule;
	const struct ct_ssim_tile t = {20, w, 0, w, floats(20 * w), floats(20 * w), floats(20 * w)};
	float *gx = floats(20 * w);

	ct_ssim_rule(&rule, CT_SSIM_R2, 1);
	KERNEL(kernel.sum = CT_SIMD(ct_ssim_tile_back)(&rule, &t, 3, 17, gx, 0.3f), ALONE);
}

static void ssim_block(size_t n)
{
	const size_t w = n + 6;
	static const struct ct_ssim_map map = {-10, 10, 0, 1};
	struct ct_ssim_rule rule;
	const struct ct_ssim_block b = {&rule, &map, 2, {w, 12, 5}, {3, 3, 0}, {3, 3, 0},
		floats(60 * w), floats(60 * w), n % 2 ? floats(60 * w) : NULL};
	double *sum = doubles(5), *count = doubles(5),
	       *wide = scratch(CT_SSIM_SCRATCH * sizeof *wide);
	float *work = scratch(CT_SSIM_SCRATCH * sizeof *work);

	ct_ssim_rule(&rule, CT_SSIM_SKIMAGE, 3);
	KERNEL(
		{
			CT_SIMD(ct_ssim_block_float)(&b, 0, 5, work, sum, count);
			CT_SIMD(ct_ssim_block_double)(&b, 0, 5, wide, sum, count);
		},
		ALONE);
}

/* src/field */
static void attention_norm(size_t n)
{
	enum { COLS = 32, LD = 48 };
	float *y = floats(n * LD), *unit = floats(n * LD), *by = floats(LD), *dx = floats(n * LD);
	const float *x = floats(n * LD), *gain = floats(n), *shift = floats(n);

	KERNEL(
		{
			CT_SIMD(ct_attention_kernels_norm)
			(n, COLS, LD, y, unit, by, x, gain, shift);
			CT_SIMD(ct_attention_kernels_norm_back)(n, COLS, LD, dx, x, unit, by, gain);
		},
		EACH(i, COLS) {
			double mean = 0, var = 0, sum = 0, along = 0, r = (double)n;

			EACH(f, n) mean += (double)x[f * LD + i] / r;
			EACH(f, n) var += pow((double)x[f * LD + i] - mean, 2) / r;
			by[i] = F(1 / sqrt(var + 1e-5));
			EACH(f, n)
			{
				const size_t at = f * LD + i;
				const double g = (double)x[at] * (double)gain[f];

				unit[at] = F(((double)x[at] - mean) / sqrt(var + 1e-5));
				y[at] = unit[at] * gain[f] + shift[f];
				sum += g / r;
				along += g * (double)unit[at] / r;
			}
			EACH(f, n)
			dx[f * LD + i] +=
				F((double)by[i] * ((double)x[f * LD + i] * (double)gain[f] - sum -
							  (double)unit[f * LD + i] * along));
		});
}

static void attention_gelu(size_t n)
{
	const size_t all = (n + 15) / 16 * 16;
	float *y = floats(all), *dx = floats(all);
	const float *x = floats(all);

	KERNEL(
		{
			CT_SIMD(ct_attention_kernels_gelu)(all, y, x);
			CT_SIMD(ct_attention_kernels_gelu_back)(all, dx, x);
		},
		ALONE);
}

static void attention_head(size_t n)
{
	enum { HEAD = 6, SEGMENT = 4 };
	const size_t some = (n + 15) / 16 * 16, ld = some * SEGMENT;
	float *d[3] = {floats(HEAD * ld), floats(HEAD * ld), floats(HEAD * ld)},
	      *out = floats(HEAD * ld);
	const float *dout = floats(HEAD * ld);
	const struct ct_attention_head h = {SEGMENT, HEAD, some, ld, floats(HEAD * ld),
		floats(HEAD * ld), floats(HEAD * ld), floats(SEGMENT * SEGMENT),
		floats(SEGMENT * SEGMENT * some)};

	KERNEL(
		{
			CT_SIMD(ct_attention_kernels_head)(&h, out);
			CT_SIMD(ct_attention_kernels_head_back)(&h, d[0], d[1], d[2], dout);
		},
		ALONE);
}

static void encoding(size_t n)
{
	const struct ct_encoding_level l = {7.3f, 10, n % 2 ? 255 : 0};
	float *at = floats(3 * CT_ENCODING_BLOCK), *code = floats(2 * 64 + n), *grad = floats(2048);
	const float *weights = floats(2048), *dcode = floats(2 * 64 + n);

	EACH(i, 3 * CT_ENCODING_BLOCK) at[i] = fminf(fabsf(at[i]), 1);
	n = n < 64 ? n : 64;
	KERNEL(
		{
			CT_SIMD(ct_encoding_level_forward)(&l, weights, n, at, code, 64);
			CT_SIMD(ct_encoding_level_back)(&l, n, at, dcode, 64, grad);
		},
		ALONE);
}

static void sines(size_t n)
{
	const size_t some = n < CT_ENCODING_BLOCK ? n : CT_ENCODING_BLOCK;
	float *at = floats(3 * CT_ENCODING_BLOCK), *code = floats(21 * some);

	EACH(i, 3 * CT_ENCODING_BLOCK) at[i] = fminf(fabsf(at[i]), 1);
	KERNEL(
		CT_SIMD(ct_encoding_level_sines)(3, some, at, code, some),
		EACH(a, 3) EACH(i, some) {
			const double p = (2 * (double)at[a * CT_ENCODING_BLOCK + i] - 1) * M_PI;

			code[a * some + i] = F(p);
			EACH(l, 3)
			{
				code[(3 + 6 * l + a) * some + i] = F(sin(ldexp(p, (int)l)));
				code[(6 + 6 * l + a) * some + i] = F(cos(ldexp(p, (int)l)));
			}
		});
}

static const struct kernel_row rows[] = {
	{"ct_loss_row_l1", loss_l1, 1e-5, false},
	{"ct_loss_row_tv", loss_tv, 1e-5, false},
	{"ct_rasterise_add", rasterise, 5e-3, false},
	{"ct_rasterise_sums", rasterise_sums, 5e-3, false},
	{"ct_gaussian_resolve_some", resolve, 0, false},
	{"ct_splat", splat, 0, false},
	{"ct_ssim_tile_back", ssim_tile, 0, false},
	{"ct_ssim_block", ssim_block, 0, false},
	{"ct_attention_kernels_norm", attention_norm, 1e-4, true},
	{"ct_attention_kernels_gelu", attention_gelu, 0, true},
	{"ct_attention_kernels_head", attention_head, 0, true},
	{"ct_encoding_level", encoding, 0, false},
	{"ct_encoding_level_sines", sines, 1e-5, false},
};

int main(int argc, char **argv)
{
	(void)argv;
	return kernel_main(sizeof rows / sizeof *rows, rows, argc > 1);
}
