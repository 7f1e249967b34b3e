/* t-kernels-scan.c: as t-kernels.c, of what works on scans: transforms, the operator, total
 * variation, back-projection, rays. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/fourier.h"
#include "inverse/hessian-row.h"
#include "inverse/tv-row.h"
#include "operator/banded.h"
#include "operator/cosine.h"
#include "recon/backproject.h"
#include "recon/ramp.h"
#include "recon/rof.h"
#include "xray/packet.h"
#include "xray/ray.h"
#include "kernels.h"

/* src/core */
static void fourier(size_t n)
{
	enum { LINES = 5 };
	struct ct_fourier f = {0};
	double *re = doubles(n * LINES), *im = doubles(n * LINES),
	       *work = scratch(2 * n * LINES * sizeof *work), *from = calloc(2 * n, sizeof *from);

	must(ct_fourier_plan(&f, n, &err));
	KERNEL(
		CT_SIMD(ct_fourier_apply)(&f, LINES, re, im, work), EACH(l, LINES) {
			EACH(t, n) from[t] = re[t * LINES + l];
			EACH(t, n) from[n + t] = im[t * LINES + l];
			EACH(k, n)
			{
				double a = 0, b = 0;

				EACH(t, n)
				{
					const double by =
						-2 * M_PI * (double)(k * t % n) / (double)n;

					a += from[t] * cos(by) - from[n + t] * sin(by);
					b += from[t] * sin(by) + from[n + t] * cos(by);
				}
				re[k * LINES + l] = a;
				im[k * LINES + l] = b;
			}
		});
	free(from);
	ct_fourier_free(&f);
}

/* src/operator */
enum { COLUMNS = 37, LD = 40 };

/* A table of half as many rows as an axis has samples, three weights each. */
static struct ct_taps halves(size_t n)
{
	struct ct_taps t = {0};

	must(ct_taps_alloc(&t, n, (n + 1) / 2, 3, &err));
	EACH(m, t.n_out)
	{
		ct_taps_place(&t, m, (ptrdiff_t)(2 * m) - 1);
		EACH(q, t.taps) t.w[m * t.taps + q] = q == 1 ? 0.6 : 0.2;
	}
	return t;
}

static void separable(size_t n)
{
	enum { WIDE = CT_SEPARABLE_WIDTH };
	struct ct_taps t = halves(n);
	float *out = floats(t.n_out * WIDE);
	const double *tile = doubles(n * WIDE);

	KERNEL(
		CT_SIMD(ct_separable_rows)(out, tile, &t, 0, t.n_out),
		EACH(m, t.n_out) EACH(i, WIDE) {
			double sum = 0;

			EACH(q, t.taps)
			sum += t.w[m * t.taps + q] * tile[(t.first[m] + q) * WIDE + i];
			out[m * WIDE + i] = F(sum);
		});
	ct_taps_free(&t);
}

static void banded(size_t n)
{
	struct ct_taps t = halves(n);
	const size_t m = t.n_out;
	struct ct_banded b = {0};
	float *down, *up, *across, *tile;
	const float *rows = floats(COLUMNS * n), *few = floats(m * LD), *many = floats(n * LD);

	must(ct_banded_alloc(&b, &t, &err));
	down = floats(m * LD);
	up = floats(COLUMNS * n);
	across = floats(m * LD);
	tile = scratch(ct_banded_scratch(&b) * sizeof *tile);
	KERNEL(
		{
			CT_SIMD(ct_banded_down)(&b, down, LD, rows, n, COLUMNS, tile);
			CT_SIMD(ct_banded_up)(&b, up, n, few, LD, COLUMNS, tile);
			CT_SIMD(ct_banded_across)(&b.down, across, LD, few, many, LD, COLUMNS);
		},
		EACH(c, COLUMNS) {
			EACH(i, n) up[c * n + i] = 0;
			EACH(r, m)
			{
				double sum = 0, add = (double)few[r * LD + c];

				EACH(q, t.taps)
				{
					const double w = t.w[r * t.taps + q];
					const size_t i = t.first[r] + q;

					sum += w * (double)rows[c * n + i];
					add += w * (double)many[i * LD + c];
					up[c * n + i] += F(w * (double)few[r * LD + c]);
				}
				down[r * LD + c] = F(sum);
				across[r * LD + c] = F(add);
			}
		});
	ct_banded_free(&b);
	ct_taps_free(&t);
}

static void banded_solve(size_t n)
{
	struct ct_taps t = halves(n);
	const size_t m = t.n_out;
	struct ct_banded b = {0};
	float *x = floats(m * LD), *turned = floats(COLUMNS * m), *tile;

	must(ct_banded_alloc(&b, &t, &err));
	tile = scratch(ct_banded_scratch(&b) * sizeof *tile);
	KERNEL(
		{
			CT_SIMD(ct_banded_solve)(&b, x, LD, COLUMNS);
			CT_SIMD(ct_banded_solve_turned)(&b, turned, m, COLUMNS, tile);
		},
		ALONE);
	ct_banded_free(&b);
	ct_taps_free(&t);
}

static void banded_blend(size_t n)
{
	const float *part[3] = {floats(n), floats(n), floats(n)}, *w = floats(3);
	float *out = floats(n);

	KERNEL(
		CT_SIMD(ct_banded_blend)(out, 3, part, w, n), EACH(i, n) {
			double sum = 0;

			EACH(p, 3) sum += (double)w[p] * (double)part[p][i];
			out[i] = F(sum);
		});
}

static void cosine(size_t n)
{
	const size_t m = (n + 1) / 2;
	const bool turned = n % 2;
	struct ct_cosine b = {0};
	double *v = calloc(m * n, sizeof *v);
	float *c = floats(m * LD), *back = floats(COLUMNS * n), *rest;
	const float *x = floats(COLUMNS * n), *few = floats(m * LD);
	const size_t step = turned ? n : 1, ld = turned ? 1 : COLUMNS;

	ct_cosine_rows(v, m, n);
	must(ct_cosine_alloc(&b, v, m, n, &err));
	rest = scratch(ct_cosine_scratch(&b) * sizeof *rest);
	KERNEL(
		{
		CT_SIMD(ct_cosine_analyse)
		(&b, c, LD, x, turned ? n : COLUMNS, COLUMNS, turned, rest);
		CT_SIMD(ct_cosine_synthesise)
		(&b, back, turned ? n : COLUMNS, NULL, few, LD, COLUMNS, turned, rest);
		},
		EACH(l, COLUMNS) {
			EACH(k, m) {
				double sum = 0;

				EACH(j, n) sum += v[k * n + j] * (double)x[l * step + j * ld];
				c[ct_cosine_place(&b, k) * LD + l] = F(sum);
}
EACH(j, n)
{
	double sum = 0;

	EACH(k, m) sum += v[k * n + j] * (double)few[ct_cosine_place(&b, k) * LD + l];
	back[l * step + j * ld] = F(sum);
}
});
free(v);
ct_cosine_free(&b);
}

/* src/inverse */
static void tv_sweep(size_t n)
{
	const float one = CT_TV_ONE, *xj = floats(n), *ahead = floats(n), *to = floats(n),
		    *before = floats(n);
	const struct ct_tv_row r = {.p = {shorts(n), shorts(n), shorts(n)},
		.out = floats(n),
		.below = floats(n),
		.before = floats(n),
		.after = floats(n),
		.step = floats(n),
		.xk = floats(n),
		.x = before,
		.xj = xj,
		.ahead = n % 2 ? ahead : NULL,
		.plus = to,
		.to = n % 3 ? to : NULL,
		.by = 0.25f,
		.pull = 0.125f,
		.s = {8000, 9000, 7000},
		.t = {1e-5f, 2e-5f, 1e-5f}};

	KERNEL(CT_SIMD(ct_tv_row_sweep)(&r, n), {
		double left = 0;

		EACH(i, n)
		{
			const double x = (double)r.x[i];
			double q[3], square = 0, by, step;

			if (r.ahead)
				r.xk[i] = r.ahead[i] + r.by * r.plus[i];
			q[0] = i + 1 < n ? (double)r.x[i + 1] - x : 0;
			q[1] = (double)r.xj[i] - x;
			q[2] = (double)r.xk[i] - x;
			EACH(a, 3)
			{
				q[a] = r.p[a][i] + (double)r.s[a] * q[a];
				square += q[a] * q[a];
			}
			by = (double)one / fmax(sqrt(square), (double)one);
			EACH(a, 3)
			{
				const double now = rint(q[a] * by);

				q[a] = 2 * now - r.p[a][i];
				r.p[a][i] = (int16_t)now;
			}
			step = (double)r.t[0] * (q[0] - left) +
			       (double)r.t[1] * (q[1] - (double)r.before[i]) +
			       (double)r.t[2] * (q[2] - (double)r.below[i]) +
			       (r.to ? (double)r.pull * ((double)r.to[i] - x) : 0);
			left = q[0];
			r.after[i] = F(q[1]);
			r.below[i] = F(q[2]);
			r.out[i] = F(x + step);
			r.step[i] = F(step);
		}
	});
}

static void tv_mend(size_t n)
{
	float *x = floats(n);
	const float *before = floats(n), *below = floats(n);

	KERNEL(
		kernel.sum = CT_SIMD(ct_tv_row_mend)(x, n % 5 ? before : NULL, below, 0.3f, n),
		EACH(i, n) {
			x[i] = F((double)x[i] - 0.3 * (double)below[i]);
			kernel.sum += n % 5 ? pow((double)x[i] - (double)before[i], 2) : 0;
		});
}

/* Rows of a volume 3 x 3 of them; the middle one. */
static void hessian_ascend(size_t n)
{
	const float *x = floats(9 * n);
	const ptrdiff_t w = (ptrdiff_t)n;
	const struct ct_hessian_ascent r = {
		.q = {shorts(n), shorts(n), shorts(n), shorts(n), shorts(n), shorts(n)},
		.x = x + 4 * n,
		.j0 = -w,
		.j1 = w,
		.k0 = -3 * w,
		.k1 = 3 * w,
		.weight = {1, 1, 0.5f, 1.4f, 1.4f, 0.7f}};

	KERNEL(
		CT_SIMD(ct_hessian_row_ascend)(&r, n, 5000), EACH(i, n) {
			const float *at = r.x + i;
			const bool end = i + 1 == n;
			double q[6], square = 0;

			q[0] = i == 0 || end ? 0
					     : (double)at[-1] + (double)at[1] - 2 * (double)at[0];
			q[1] = (double)at[-w] + (double)at[w] - 2 * (double)at[0];
			q[2] = (double)at[-3 * w] + (double)at[3 * w] - 2 * (double)at[0];
			q[3] = end ? 0
				   : (double)at[w + 1] - (double)at[w] - (double)at[1] +
					       (double)at[0];
			q[4] = end ? 0
				   : (double)at[3 * w + 1] - (double)at[3 * w] - (double)at[1] +
					       (double)at[0];
			q[5] = (double)at[4 * w] - (double)at[w] - (double)at[3 * w] +
			       (double)at[0];
			EACH(c, 6) q[c] = r.q[c][i] + 5000 * (double)r.weight[c] * q[c];
			EACH(c, 6) square += q[c] * q[c];
			EACH(c, 6)
			r.q[c][i] = (int16_t)rint(q[c] * 32767 / fmax(sqrt(square), 32767));
		});
}

static void hessian_descend(size_t n)
{
	const struct ct_hessian_descent r = {.out = floats(n),
		.step = n % 2 ? floats(n) : NULL,
		.x = floats(n),
		.ii = shorts(n),
		.jj = {shorts(n), shorts(n), shorts(n)},
		.kk = {shorts(n), shorts(n), shorts(n)},
		.ij = {shorts(n), shorts(n)},
		.ik = {shorts(n), shorts(n)},
		.jk = {shorts(n), shorts(n), shorts(n), shorts(n)},
		.weight = {1, 1, 0.5f, 1.4f, 1.4f, 0.7f}};

	KERNEL(CT_SIMD(ct_hessian_row_descend)(&r, n, 1e-5f), ALONE);
}

static void hessian_ahead(size_t n)
{
	float *x = floats(n), *next = floats(n);

	KERNEL(
		CT_SIMD(ct_hessian_row_ahead)(n, x, next), EACH(i, n) {
			const float now = next[i];

			next[i] = F(2 * (double)now - (double)x[i]);
			x[i] = now;
		});
}

/* src/recon */
static void ramp(size_t n)
{
	const size_t rows = n % CT_RAMP_ROWS + 1, count = n - n / 3, at = n / 4;
	struct ct_ramp f = {0};
	float *out = floats(n * CT_RAMP_ROWS);
	const float *in = floats(rows * count), *weight = floats(rows * count);
	double *work;

	must(ct_ramp_alloc(&f, CT_RAMP_RAM_LAK, 1, n, &err));
	work = scratch(ct_ramp_scratch(&f) * sizeof *work);
	KERNEL(
		CT_SIMD(ct_ramp_rows)(&f, rows, out, CT_RAMP_ROWS, in, weight, at, count, work),
		EACH(r, rows) EACH(c, n) {
			double sum = 0;

			EACH(k, count)
			{
				const double m = (double)c - (double)(k + at);
				const double h = m == 0            ? 0.25
						 : fmod(m, 2) != 0 ? -1 / (M_PI * M_PI * m * m)
								   : 0;

				sum += h * (double)in[r * count + k] *
				       (double)weight[r * count + k];
			}
			out[c * CT_RAMP_ROWS + r] = F(sum);
		});
	ct_ramp_free(&f);
}

static void rof(size_t n)
{
	enum { ROWS = 3, PLANES = 4, K = 2 };
	const size_t plane = n * ROWS, all = plane * PLANES;
	const struct ct_rof r = {{n, ROWS, PLANES}, floats(3 * all), 0.3f, n % 2};
	float *x = floats(all);
	const float *v = floats(all);

	KERNEL(
		{
			CT_SIMD(ct_rof_plane)(&r, x, v, false, K);
			CT_SIMD(ct_rof_plane)(&r, x, v, true, K);
		},
		{
			float *const p[3] = {r.p, r.p + all, r.p + 2 * all};
			const size_t step[3] = {1, n, plane},
				     last[3] = {n - 1, ROWS - 1, PLANES - 1};

			for (size_t i = K * plane; i < (K + 1) * plane; i++) {
				const size_t at[3] = {i % n, i / n % ROWS, K};
				double sum = 0;

				EACH(a, 3)
				sum += (double)p[a][i] - (at[a] ? (double)p[a][i - step[a]] : 0);
				sum = (double)v[i] + 0.3 * sum;
				x[i] = F(n % 2 ? fmax(sum, 0) : sum);
			}
			for (size_t i = K * plane; i < (K + 1) * plane; i++) {
				const size_t at[3] = {i % n, i / n % ROWS, K};
				double g[3], square = 0;

				EACH(a, 3)
				{
					const size_t to = at[a] < last[a] ? i + step[a] : i;

					g[a] = (double)p[a][i] +
					       ((double)x[to] - (double)x[i]) / 3.6;
					square += g[a] * g[a];
				}
				EACH(a, 3) p[a][i] = F(g[a] / sqrt(fmax(square, 1)));
			}
		});
}

/* A scan of three views whose detector sees a part of the grid; lines of voxels run along axis 2,
 * `step` rows apart. */
enum { VIEWS = 3, SIDE = 24, TALL = 61 };

static struct ct_backprojector scan_of(double map[VIEWS][3][4], const size_t n[3], double step)
{
	struct ct_backprojector b = {{n[0], n[1], n[2]}, VIEWS, TALL, SIDE,
		(CT_BP_PAD + TALL + 1 + 15 + 15) / 16 * 16, map, 2};

	EACH(v, VIEWS)
	{
		const double a = 0.4 + 1.1 * (double)v, c = cos(a), s = sin(a);
		const double m[3][4] = {{0.7 * c, 0.7 * s, 0, 3},
			{0, 0, step, step > 0 ? -2.4 : 58}, {0.004 * s, -0.004 * c, 0, 1.1}};

		memcpy(map[v], m, sizeof m);
	}
	return b;
}

static float *views_of(const struct ct_backprojector *b)
{
	float *views = aligned(VIEWS * ct_backprojector_size(b));

	EACH(v, VIEWS) ct_backproject_frame(b, views + v * ct_backprojector_size(b));
	return views;
}

/* What the views [first, end) add at a voxel. */
static double seen(const struct ct_backprojector *b, const float *views, const double x[3],
	size_t first, size_t end)
{
	double sum = 0;

	for (size_t v = first; v < end; v++) {
		const float *f = views + v * ct_backprojector_size(b);
		double at[3], c, r;

		ct_backproject_at(b, v, x, at);
		if (at[0] < -0.5 || at[0] > SIDE - 0.5 || at[1] < -0.5 || at[1] > TALL - 0.5)
			continue;
		c = floor(at[0] + 1);
		r = floor(at[1] + 1);
		f += (size_t)c * b->pitch + CT_BP_PAD - 1 + (size_t)r;
		c = at[0] + 1 - c;
		r = at[1] + 1 - r;
		sum += ((1 - c) * ((1 - r) * (double)f[0] + r * (double)f[1]) +
			       c * ((1 - r) * (double)f[b->pitch] + r * (double)f[b->pitch + 1])) /
		       (at[2] * at[2]);
	}
	return sum;
}

static void backproject_row(size_t n)
{
	double map[VIEWS][3][4];
	const size_t grid[3] = {n, 5, 6};
	const struct ct_backprojector b = scan_of(map, grid, 3.3);
	float *out = floats(n);
	const float *views = views_of(&b);

	KERNEL(
		CT_SIMD(ct_backproject_row)(out, &b, 2, 4, 0, VIEWS, views), EACH(i, n) {
			const double x[3] = {(double)i, 2, 4};

			out[i] += F(seen(&b, views, x, 0, VIEWS));
		});
}

/* Steps of less than a row, of some, of many, and backwards: each finds its rows another way. */
static void backproject_line(size_t n)
{
	static const double step[] = {0.9, 2.3, 5.1, -1.3};
	typedef float tile_of[CT_BP_TILE][CT_BP_SEGMENT];
	double map[VIEWS][3][4];
	const size_t grid[3] = {7, 5, n};
	const struct ct_backprojector b = scan_of(map, grid, step[n % 4]);
	const struct ct_bp_tile t = {
		&b, {2, 0, 1}, {n < CT_BP_SEGMENT ? n : CT_BP_SEGMENT, 7, 5}, {0, 0, 0}};
	tile_of *acc = (tile_of *)(void *)aligned((size_t)CT_BP_TILE * CT_BP_TILE * CT_BP_SEGMENT);
	const float *views = views_of(&b);
	float *blend = scratch((CT_BP_BLEND + 2 * CT_BP_SLACK) * sizeof *blend);

	KERNEL(
		CT_SIMD(ct_backproject_line_tile)(acc, &t, 1, CT_BP_GROUP,
			views + ct_backprojector_size(&b), blend + CT_BP_SLACK),
		EACH(j, 5) EACH(i, 7) EACH(k, n) {
			const double x[3] = {(double)i, (double)j, (double)k};

			acc[j][i][k] += F(seen(&b, views, x, 1, 1 + CT_BP_GROUP));
		});
}

/* src/xray */
static const struct ct_ray slanted = {{0, 1, 2}, {1.2, 3.9}, {0, 0}, {0, 0}, 1.1};

static void joseph(size_t n)
{
	const struct ct_box box = {
		{0, 0, 0}, {(ptrdiff_t)n, 5, 5}, {1, (ptrdiff_t)n, 5 * (ptrdiff_t)n}};
	const float *vol = floats(25 * n);
	float *to = floats(25 * n);
	struct ct_ray r = slanted;

	r.x[1] = (double)n;
	r.slope[0] = 1.4 / (double)n;
	r.slope[1] = -2.1 / (double)n;
	KERNEL(
		{
			kernel.sum = CT_SIMD(ct_ray_joseph)(vol, &box, &r);
			CT_SIMD(ct_ray_joseph_spread)(to, &box, &r, 0.7);
		},
		EACH(i, n) {
			const double x = (double)i + 0.5, y = r.from[0] + r.slope[0] * x - 0.5,
				     z = r.from[1] + r.slope[1] * x - 0.5;

			EACH(c, 4)
			{
				const double w = (c & 1 ? y - floor(y) : 1 - (y - floor(y))) *
						 (c & 2 ? z - floor(z) : 1 - (z - floor(z)));
				const size_t at = i + ((size_t)y + (c & 1)) * n +
						  ((size_t)z + (c >> 1)) * 5 * n;

				kernel.sum += 1.1 * w * (double)vol[at];
				to[at] += F(0.7 * 1.1 * w);
			}
		});
}

static void siddon(size_t n)
{
	const struct ct_box box = {
		{0, 0, 0}, {(ptrdiff_t)n, 5, 5}, {1, (ptrdiff_t)n, 5 * (ptrdiff_t)n}};
	const float *vol = floats(25 * n);
	float *to = floats(25 * n);
	struct ct_ray r = slanted;

	r.x[1] = (double)n;
	r.slope[0] = 1.4 / (double)n;
	r.slope[1] = -2.1 / (double)n;
	KERNEL(
		{
			kernel.sum = CT_SIMD(ct_ray_siddon)(vol, &box, &r);
			CT_SIMD(ct_ray_siddon_spread)(to, &box, &r, 0.7);
		},
		ALONE);
}

static void packet(size_t n)
{
	enum { PIECES = 10 };
	const size_t pitch = n + CT_PAD, rows = n < CT_ROWS ? n : CT_ROWS;
	const bool between = n % 2;
	static struct ct_pieces s;
	const struct ct_heights z = {0.6, 0.11, n % 3 ? 0.07 : 0.9, 0.001, (int32_t)n, between};
	double *sum = doubles(CT_PACKET);
	float *vol = floats(PIECES * pitch + CT_PAD), *to = floats(PIECES * pitch + CT_PAD);
	const float *value = floats(rows);

	s = (struct ct_pieces){.n = PIECES};
	EACH(m, PIECES)
	{
		s.x0[m] = (double)m + (between ? 0.5 : 0);
		s.x1[m] = (double)m + (between ? 0.5 : 1);
		s.weight[m] = 1.05f;
		s.inverse[m] = 1;
		s.at[m] = CT_PAD + m * pitch;
		s.hi[m] = (int32_t)n;
	}
	EACH(i, PIECES * pitch + CT_PAD) if (i < CT_PAD || (i - CT_PAD) % pitch >= n) vol[i] = 0;
	KERNEL(
		{
			CT_SIMD(ct_packet_sum)(sum, &s, &z, 1, vol);
			CT_SIMD(ct_packet_spread)(to, &s, &z, 0, rows, value);
		},
		ALONE);
}

static const struct kernel_row rows[] = {
	{"ct_fourier_apply", fourier, 1e-12, false},
	{"ct_separable_rows", separable, 1e-6, false},
	{"ct_banded", banded, 1e-5, true},
	{"ct_banded_solve", banded_solve, 0, true},
	{"ct_banded_blend", banded_blend, 1e-6, true},
	{"ct_cosine", cosine, 1e-5, true},
	{"ct_tv_row_sweep", tv_sweep, 1e-4, true},
	{"ct_tv_row_mend", tv_mend, 1e-6, false},
	{"ct_hessian_row_ascend", hessian_ascend, 1e-4, true},
	{"ct_hessian_row_descend", hessian_descend, 0, true},
	{"ct_hessian_row_ahead", hessian_ahead, 1e-6, false},
	{"ct_ramp_rows", ramp, 1e-6, false},
	{"ct_rof_plane", rof, 1e-5, false},
	{"ct_backproject_row", backproject_row, 1e-5, false},
	{"ct_backproject_line_tile", backproject_line, 1e-4, false},
	{"ct_ray_joseph", joseph, 1e-5, false},
	{"ct_ray_siddon", siddon, 0, false},
	{"ct_packet", packet, 0, false},
};

int main(int argc, char **argv)
{
	(void)argv;
	return kernel_main(sizeof rows / sizeof *rows, rows, argc > 1);
}
