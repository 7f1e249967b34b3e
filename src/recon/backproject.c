/* backproject.c: see backproject.h. */
#include "config.h"
#include "recon/backproject.h"
#include "core/mem.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define HAVE_512 1
#else
#define HAVE_512 0
#endif
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) &&                        \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HOT __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HOT
#endif

enum {
	SEGMENT = 256, /* voxels of a line that are done together */
	TILE = 16,     /* lines of a tile along both other axes: their sums stay in the second
			  cache, */
	GROUP = 2,     /* with the part of so many views that they read */
	STEP = 16,     /* voxels of a vector */
	BLEND = 4096,  /* rows of a blend */
	LONGEST = BLEND / SEGMENT - 1, /* rows from voxel to voxel, at most */
	SLACK = STEP * LONGEST + 16,   /* what a vector may read before and after a blend */
	BLOCKS = SEGMENT / STEP,
	CHUNK = 64, /* voxels of the general kernel that are done together */
};

/* Invert the matrix with columns a, b, c; false if it is singular. */
static bool invert(double m[3][3], const double a[3], const double b[3], const double c[3])
{
	double det = 0, size = 0;

	for (int i = 0; i < 3; i++) {
		int j = (i + 1) % 3, k = (i + 2) % 3;

		m[0][i] = b[j] * c[k] - b[k] * c[j];
		m[1][i] = c[j] * a[k] - c[k] * a[j];
		m[2][i] = a[j] * b[k] - a[k] * b[j];
		det += a[i] * m[0][i];
		size += fabs(a[i] * m[0][i]);
	}
	if (!(fabs(det) > 1e-12 * size))
		return false;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			m[i][j] /= det;
	return true;
}

/* World mm to (depth col, depth row, depth). */
static bool world_map(
	double map[3][4], const struct ct_stack *s, const struct ct_view *v, const double origin[3])
{
	bool parallel = s->beam == CT_PARALLEL;
	const double *from = parallel ? v->centre : v->source;
	double m[3][3], along[3], scale = 1;

	for (int a = 0; a < 3; a++)
		along[a] = v->centre[a] - v->source[a];
	if (!invert(m, v->u, v->v, along))
		return false;
	for (int r = 0; r < 3; r++) {
		map[r][3] = 0;
		for (int a = 0; a < 3; a++) {
			map[r][a] = m[r][a];
			map[r][3] -= m[r][a] * from[a];
		}
	}
	if (parallel) {
		memcpy(map[2], (const double[4]){0, 0, 0, 1}, sizeof map[2]);
	} else {
		scale = map[2][3];
		for (int a = 0; a < 3; a++)
			scale += map[2][a] * origin[a];
	}
	for (int k = 0; k < 4; k++) {
		map[2][k] /= scale;
		map[0][k] = map[0][k] / scale + ((double)s->w - 1) / 2 * map[2][k];
		map[1][k] = map[1][k] / scale + ((double)s->h - 1) / 2 * map[2][k];
	}
	return isfinite(1 / scale);
}

static double map_row(const double m[4], const double x[3])
{
	return m[0] * x[0] + m[1] * x[1] + m[2] * x[2] + m[3];
}

/* Is every voxel in front of the source? */
static bool in_front(const struct ct_backprojector *b, const double map[3][4])
{
	for (unsigned k = 0; k < 8; k++) {
		double x[3];

		for (int a = 0; a < 3; a++)
			x[a] = k >> a & 1 ? (double)b->n[a] - 0.5 : -0.5;
		if (!(map_row(map[2], x) > 0))
			return false;
	}
	return true;
}

/* Are depth and column the same along the axis, and the rows not too far apart? The drift over the
 * whole line is within 1e-4 of a pixel. */
static bool lines_along(const struct ct_backprojector *b, int axis)
{
	double n = (double)b->n[axis];

	for (size_t k = 0; k < b->views; k++) {
		const double(*m)[4] = (const double(*)[4])b->map[k];

		for (unsigned corner = 0; corner < 8; corner++) {
			double x[3], depth, col;

			for (int a = 0; a < 3; a++)
				x[a] = corner >> a & 1 ? (double)b->n[a] - 1 : 0;
			depth = map_row(m[2], x);
			col = map_row(m[0], x) / depth;
			if (!(fabs(m[0][axis] - col * m[2][axis]) * n <= 1e-4 * depth) ||
				!(fabs(m[2][axis]) * n <= 1e-7 * depth) ||
				!(fabs(m[1][axis]) <= (LONGEST - 1) * depth))
				return false;
		}
	}
	return true;
}

/* Offsets within a stored view are 32 bits. */
static int check_size(const struct ct_backprojector *b, struct ct_err *e)
{
	if (b->h > INT32_MAX / 4 || b->w > INT32_MAX / b->pitch - 3)
		return ct_fail(
			e, CT_EINPUT, "a detector of %zux%zu pixels is too large", b->w, b->h);
	return 0;
}

int ct_backprojector_alloc(struct ct_backprojector *b, const struct ct_vol *grid,
	const struct ct_stack *scan, const double origin[static 3], struct ct_err *e)
{
	*b = (struct ct_backprojector){
		.views = scan->views, .h = scan->h, .w = scan->w, .line = -1};
	memcpy(b->n, grid->n, sizeof b->n);
	/* a vector that begins in the last row may end fifteen later */
	b->pitch = (CT_BP_PAD + scan->h + 1 + 15 + 15) / 16 * 16;
	if (ct_vol_check_grid(grid, e) || ct_stack_check(scan, e))
		return -1;
	if (check_size(b, e) || ct_alloc(&b->map, b->views, sizeof *b->map, e))
		return -1;
	for (size_t k = 0; k < b->views; k++) {
		double m[3][4];

		if (!world_map(m, scan, &scan->view[k], origin))
			goto degenerate;
		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 4; c++) {
				double x = c == 3 ? m[r][3] : 0;

				for (int a = 0; a < 3; a++)
					x += m[r][a] * grid->affine[a][c];
				b->map[k][r][c] = x;
			}
		if (!in_front(b, (const double(*)[4])b->map[k])) {
			ct_backprojector_free(b);
			return ct_fail(e, CT_EGEOM,
				"view %zu: a part of the volume is not in front of the source", k);
		}
		continue;
	degenerate:
		ct_backprojector_free(b);
		return ct_fail(e, CT_EGEOM, "view %zu: the geometry is degenerate", k);
	}
	for (int a = 2; a >= 0 && b->line < 0; a--)
		if (lines_along(b, a))
			b->line = a;
	return 0;
}

int ct_backprojector_widen(
	struct ct_backprojector *b, size_t before, size_t after, struct ct_err *e)
{
	b->w += before + after;
	for (size_t k = 0; k < b->views; k++)
		for (int i = 0; i < 4; i++)
			b->map[k][0][i] += (double)before * b->map[k][2][i];
	return check_size(b, e);
}

void ct_backprojector_free(struct ct_backprojector *b)
{
	free(b->map);
	*b = (struct ct_backprojector){.line = -1};
}

size_t ct_backprojector_size(const struct ct_backprojector *b)
{
	return (b->w + 2) * b->pitch;
}

void ct_backproject_frame(const struct ct_backprojector *b, float *view)
{
	for (size_t c = 1; c <= b->w; c++) {
		float *col = view + c * b->pitch + CT_BP_PAD;

		col[-1] = col[0];
		col[b->h] = col[b->h - 1];
	}
	memcpy(view, view + b->pitch, b->pitch * sizeof *view);
	memcpy(view + (b->w + 1) * b->pitch, view + b->w * b->pitch, b->pitch * sizeof *view);
}

void ct_backproject_at(const struct ct_backprojector *b, size_t view, const double x[static 3],
	double at[static 3])
{
	const double(*m)[4] = (const double(*)[4])b->map[view];

	at[2] = map_row(m[2], x);
	at[0] = map_row(m[0], x) / at[2];
	at[1] = map_row(m[1], x) / at[2];
}

/* A line of voxels in a view: the voxels [k0, k1) of a segment read, at the rows row + k step of
 * the blend, a left[] + b right[]. row counts from the blend's first. */
struct line {
	const float *left, *right;
	float a, b;
	size_t rows; /* of the blend */
	size_t k0, k1;
	double row, step;
};

/* blend has SLACK floats before and after its BLEND. */
HOT static void line_plain(float *restrict acc, const struct line *l, float *restrict blend)
{
	const float *restrict left = l->left, *restrict right = l->right;
	float a = l->a, b = l->b;

	for (size_t i = 0; i < l->rows; i++)
		blend[i] = a * left[i] + b * right[i];
	for (size_t k = l->k0 / STEP * STEP; k < l->k1; k += STEP) {
		double first = l->row + (double)k * l->step;
		double low = floor(l->step < 0 ? first + (STEP - 1) * l->step : first);
		float from = (float)(first - low), step = (float)l->step, y[STEP];
		const float *t = blend + (ptrdiff_t)low;

		for (int j = 0; j < STEP; j++) {
			float x = from + (float)j * step;
			int i = (int)x;
			float f = x - (float)i, t0 = t[i], t1 = t[i + 1];

			y[j] = t0 + f * (t1 - t0);
		}
		for (size_t j = 0; j < STEP; j++)
			acc[k + j] += k + j >= l->k0 && k + j < l->k1 ? y[j] : 0;
	}
}

#if HAVE_512
/* The same numbers. Sixteen voxels read from 32 rows (64 if `wide`) that are in registers. */
__attribute__((target("avx512f"), always_inline)) static inline void line_512(
	float *restrict acc, const struct line *l, float *restrict blend, bool wide)
{
	const __m512 lane = _mm512_set_ps(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
	__m512 a = _mm512_set1_ps(l->a), b = _mm512_set1_ps(l->b);
	__m512 ramp = _mm512_mul_ps(lane, _mm512_set1_ps((float)l->step));
	__m512d back = _mm512_set1_pd((STEP - 1) * l->step);
	_Alignas(32) int32_t lows[BLOCKS];
	_Alignas(32) float froms[BLOCKS];

#pragma GCC unroll 4
	for (size_t i = 0; i < l->rows; i += STEP)
		_mm512_store_ps(
			blend + i, _mm512_add_ps(_mm512_mul_ps(a, _mm512_load_ps(l->left + i)),
					   _mm512_mul_ps(b, _mm512_load_ps(l->right + i))));
	for (size_t k = 0; k < BLOCKS; k += 8) { /* where the vectors begin */
		__m512d at = _mm512_add_pd(_mm512_set1_pd((double)(k * STEP)),
			_mm512_set_pd(112, 96, 80, 64, 48, 32, 16, 0));
		__m512d first = _mm512_add_pd(
			_mm512_set1_pd(l->row), _mm512_mul_pd(at, _mm512_set1_pd(l->step)));
		__m512d low = _mm512_floor_pd(l->step < 0 ? _mm512_add_pd(first, back) : first);

		_mm256_store_si256((__m256i *)(lows + k), _mm512_cvttpd_epi32(low));
		_mm256_store_ps(froms + k, _mm512_cvtpd_ps(_mm512_sub_pd(first, low)));
	}
	for (size_t k = l->k0 / STEP * STEP; k < l->k1; k += STEP) {
		__m512 x = _mm512_add_ps(_mm512_set1_ps(froms[k / STEP]), ramp), t0, t1, f;
		__m512i i = _mm512_cvttps_epi32(x), i1 = _mm512_add_epi32(i, _mm512_set1_epi32(1));
		const float *t = blend + lows[k / STEP];
		unsigned mask = 0xffff;

		t0 = _mm512_permutex2var_ps(_mm512_loadu_ps(t), i, _mm512_loadu_ps(t + 16));
		t1 = _mm512_permutex2var_ps(_mm512_loadu_ps(t), i1, _mm512_loadu_ps(t + 16));
		if (wide) {
			__m512 p = _mm512_loadu_ps(t + 32), q = _mm512_loadu_ps(t + 48);
			__m512i half = _mm512_set1_epi32(32);

			t0 = _mm512_mask_mov_ps(t0, _mm512_test_epi32_mask(i, half),
				_mm512_permutex2var_ps(p, i, q));
			t1 = _mm512_mask_mov_ps(t1, _mm512_test_epi32_mask(i1, half),
				_mm512_permutex2var_ps(p, i1, q));
		}
		f = _mm512_sub_ps(x, _mm512_cvtepi32_ps(i));
		t0 = _mm512_add_ps(t0, _mm512_mul_ps(f, _mm512_sub_ps(t1, t0)));
		t1 = _mm512_load_ps(acc + k);
		if (k >= l->k0 && k + STEP <= l->k1) {
			_mm512_store_ps(acc + k, _mm512_add_ps(t1, t0));
			continue;
		}
		if (k < l->k0)
			mask &= 0xffffU << (l->k0 - k);
		if (k + STEP > l->k1)
			mask &= 0xffffU >> (k + STEP - l->k1);
		_mm512_store_ps(acc + k, _mm512_mask_add_ps(t1, (__mmask16)mask, t1, t0));
	}
}

__attribute__((target("avx512f"))) static void line_near(
	float *restrict acc, const struct line *l, float *restrict blend)
{
	line_512(acc, l, blend, false);
}

__attribute__((target("avx512f"))) static void line_far(
	float *restrict acc, const struct line *l, float *restrict blend)
{
	line_512(acc, l, blend, true);
}
#endif

struct job {
	const struct ct_backprojector *b;
	size_t first, count;
	float *vol;
	const float *views;
	int axis[3];      /* line, and the two others */
	size_t stride[3]; /* of them */
	size_t tiles[3];  /* segments of lines, and tiles */
	bool fast;        /* the machine has AVX-512 */
};

static void line_of_any(float *acc, const struct line *l, float *blend, bool fast)
{
#if HAVE_512
	if (fast && fabs(l->step) * (STEP - 1) < 29.9) {
		line_near(acc, l, blend);
		return;
	}
	if (fast && fabs(l->step) * (STEP - 1) < 61.9) {
		line_far(acc, l, blend);
		return;
	}
#endif
	(void)fast;
	line_plain(acc, l, blend);
}

/* The voxels k of [0, n) with lo <= row + k step <= hi. */
static void range(size_t k[2], size_t n, double row, double step, double lo, double hi)
{
	double p, q, most = (double)n;

	k[0] = 0;
	k[1] = row >= lo && row <= hi ? n : 0;
	if (step == 0)
		return;
	p = ((step > 0 ? lo : hi) - row) / step;
	q = ((step > 0 ? hi : lo) - row) / step;
	k[0] = (size_t)fmin(fmax(ceil(p), 0), most);
	k[1] = (size_t)fmin(fmax(floor(q) + 1, 0), most);
}

/* The lines of one row of a tile in one view. */
struct places {
	double row[TILE], step[TILE]; /* detector row of the first voxel, and from voxel to voxel */
	float a[TILE], b[TILE];       /* how much the columns left and right count */
	int32_t left[TILE];           /* -2: outside the detector */
};

/* Lines that begin at voxel x, one step along `across` apart. */
HOT static void place_lines(struct places *restrict p, const double m[restrict 3][4],
	const double x[3], int across, int along, double w)
{
	const double c0 = map_row(m[0], x), r0 = map_row(m[1], x), d0 = map_row(m[2], x);
	const double dc = m[0][across], dr = m[1][across], dd = m[2][across], ds = m[1][along];

	for (int i = 0; i < TILE; i++) {
		double inv = 1 / (d0 + i * dd), col = (c0 + i * dc) * inv, weight = inv * inv;
		double in = (col >= -0.5) & (col <= w - 0.5) ? 1 : 0, frac;
		int32_t left;

		col = in > 0 ? col + 1 : -1;
		left = (int32_t)col;
		frac = col - left;
		p->left[i] = left - 1;
		p->a[i] = (float)(weight * (1 - frac));
		p->b[i] = (float)(weight * frac);
		p->row[i] = (r0 + i * dr) * inv;
		p->step[i] = ds * inv;
	}
}

/* Line i of `p` of n voxels, in a view. */
static void line_in_view(float *restrict acc, size_t n, const struct job *j, const float *view,
	const struct places *p, size_t i, float *restrict blend)
{
	const struct ct_backprojector *b = j->b;
	double row = p->row[i], step = p->step[i], most = (double)b->h - 0.5, low, high;
	size_t k[2] = {0, n};
	ptrdiff_t lowest, highest;
	struct line l;

	if (p->left[i] < -1)
		return;
	low = row;
	high = row + (double)(n - 1) * step;
	if (!(low >= -0.5 && low <= most && high >= -0.5 && high <= most)) {
		range(k, n, row, step, -0.5, most);
		if (k[0] >= k[1])
			return;
		low = fmin(fmax(row + (double)k[0] * step, -0.5), most);
		high = fmin(fmax(row + (double)(k[1] - 1) * step, -0.5), most);
	}
	lowest = (ptrdiff_t)((step < 0 ? high : low) + 1) - 1;
	lowest = (lowest + CT_BP_PAD) / STEP * STEP - CT_BP_PAD; /* aligned */
	highest = (ptrdiff_t)((step < 0 ? low : high) + 1);
	l = (struct line){
		.a = p->a[i],
		.b = p->b[i],
		.rows = (size_t)(highest - lowest) + 1,
		.k0 = k[0],
		.k1 = k[1],
		.row = row - (double)lowest,
		.step = step,
	};
	l.left = view + (size_t)(p->left[i] + 1) * b->pitch + CT_BP_PAD + lowest;
	l.right = l.left + b->pitch;
	line_of_any(acc, &l, blend, j->fast);
}

/* The axis (1 or 2 of the job's) along which neighbouring lines are nearer on the detector: taken
 * in that order they find its columns in the first cache. */
static int nearer(const struct job *j, size_t view, const double x[3])
{
	const double(*m)[4] = (const double(*)[4])j->b->map[j->first + view];
	double col = map_row(m[0], x) / map_row(m[2], x), d[3];

	for (int a = 1; a < 3; a++)
		d[a] = fabs(m[0][j->axis[a]] - col * m[2][j->axis[a]]);
	return d[1] <= d[2] ? 1 : 2;
}

/* The lines of a tile, n[1] x n[2] of n[0] voxels from voxel x, in up to GROUP views. */
static void tile_in_views(float acc[restrict TILE][TILE][SEGMENT], const size_t n[3],
	const struct job *j, size_t view, size_t count, const double x[3], float *restrict blend)
{
	const float *from = j->views + view * ct_backprojector_size(j->b);
	int fast = nearer(j, view, x), slow = 3 - fast;
	struct places p[GROUP];

	for (size_t s = 0; s < n[slow]; s++) {
		double y[3] = {x[0], x[1], x[2]};

		y[j->axis[slow]] += (double)s;
		for (size_t g = 0; g < count; g++)
			place_lines(&p[g], (const double(*)[4])j->b->map[j->first + view + g], y,
				j->axis[fast], j->axis[0], (double)j->b->w);
		for (size_t f = 0; f < n[fast]; f++)
			for (size_t g = 0; g < count; g++)
				line_in_view(fast == 1 ? acc[s][f] : acc[f][s], n[0], j,
					from + g * ct_backprojector_size(j->b), &p[g], f, blend);
	}
}

/* A tile of lines in all views; then it is added to the volume. */
static void tile(void *arg, size_t task, size_t worker)
{
	const struct job *j = arg;
	const struct ct_backprojector *b = j->b;
	size_t at[3] = {task % j->tiles[0] * SEGMENT, task / j->tiles[0] % j->tiles[1] * TILE,
		task / j->tiles[0] / j->tiles[1] * TILE};
	static const size_t most[3] = {SEGMENT, TILE, TILE};
	_Alignas(64) float acc[TILE][TILE][SEGMENT];
	_Alignas(64) float blend[SLACK + BLEND + SLACK];
	double x[3];
	size_t n[3];

	(void)worker;
	memset(acc, 0, sizeof acc);
	memset(blend, 0, sizeof blend);
	for (int a = 0; a < 3; a++) {
		size_t left = b->n[j->axis[a]] - at[a];

		n[a] = left < most[a] ? left : most[a];
	}
	for (int a = 0; a < 3; a++)
		x[j->axis[a]] = (double)at[a];
	for (size_t view = 0; view < j->count; view += GROUP) {
		size_t left = j->count - view;

		tile_in_views(acc, n, j, view, left < GROUP ? left : GROUP, x, blend + SLACK);
	}
	for (size_t c = 0; c < n[2]; c++)
		for (size_t k = 0; k < n[0]; k++) {
			float *out = j->vol + (at[0] + k) * j->stride[0] + at[1] * j->stride[1] +
				     (at[2] + c) * j->stride[2];

			for (size_t i = 0; i < n[1]; i++)
				out[i * j->stride[1]] += acc[c][i][k];
		}
}

/* Positions of n <= CHUNK voxels: the offset of the pixel before each, the fractions, the weight
 * (0 outside the detector). */
struct chunk {
	int32_t at[CHUNK];
	float fc[CHUNK], fr[CHUNK], weight[CHUNK];
};

HOT static void place(struct chunk *restrict p, const double m[restrict 3][4], const double x[3],
	double w, double h, double pitch)
{
	const double c0 = map_row(m[0], x), r0 = map_row(m[1], x), d0 = map_row(m[2], x);
	const double dc = m[0][0], dr = m[1][0], dd = m[2][0];

	for (int i = 0; i < CHUNK; i++) {
		double inv = 1 / (d0 + i * dd), col = (c0 + i * dc) * inv,
		       row = (r0 + i * dr) * inv;
		double in =
			(col >= -0.5) & (col <= w - 0.5) & (row >= -0.5) & (row <= h - 0.5) ? 1 : 0;
		int32_t ic, ir;

		col = in > 0 ? col + 1 : 0; /* from the frame: never negative */
		row = in > 0 ? row + 1 : 0;
		ic = (int32_t)col;
		ir = (int32_t)row;
		p->fc[i] = (float)(col - ic);
		p->fr[i] = (float)(row - ir);
		p->at[i] = (int32_t)pitch * ic + ir;
		p->weight[i] = (float)(in * inv * inv);
	}
}

HOT static void blend4(
	float *restrict y, const struct chunk *restrict p, const float *restrict view, size_t pitch)
{
	const float *restrict next = view + pitch;

	for (int i = 0; i < CHUNK; i++) {
		int32_t at = p->at[i];
		float a = view[at], b = view[at + 1], c = next[at], d = next[at + 1];
		float l = a + p->fr[i] * (b - a), r = c + p->fr[i] * (d - c);

		y[i] += p->weight[i] * (l + p->fc[i] * (r - l));
	}
}

/* The general case: a row of voxels along axis 0 in all views. */
static void row_of_voxels(void *arg, size_t task, size_t worker)
{
	const struct job *j = arg;
	const struct ct_backprojector *b = j->b;
	float *out = j->vol + task * b->n[0];

	(void)worker;
	for (size_t i = 0; i < b->n[0]; i += CHUNK) {
		size_t n = b->n[0] - i < CHUNK ? b->n[0] - i : CHUNK;
		double x[3] = {(double)i, (double)(task % b->n[1]), (double)(task / b->n[1])};
		float y[CHUNK] = {0};

		for (size_t view = 0; view < j->count; view++) {
			const float *from =
				j->views + view * ct_backprojector_size(b) + CT_BP_PAD - 1;
			struct chunk p;

			place(&p, (const double(*)[4])b->map[j->first + view], x, (double)b->w,
				(double)b->h, (double)b->pitch);
			blend4(y, &p, from, b->pitch);
		}
		for (size_t k = 0; k < n; k++)
			out[i + k] += y[k];
	}
}

void ct_backproject(const struct ct_backprojector *b, size_t first, size_t count,
	float *restrict vol, const float *restrict views, struct ct_par *par)
{
	struct job j = {.b = b, .first = first, .count = count, .vol = vol, .views = views};
	const size_t stride[3] = {1, b->n[0], b->n[0] * b->n[1]};
	static const size_t most[3] = {SEGMENT, TILE, TILE};

	if (b->line < 0) {
		ct_par_for(par, b->n[1] * b->n[2], row_of_voxels, &j);
		return;
	}
#if HAVE_512
	j.fast = __builtin_cpu_supports("avx512f");
#endif
	j.axis[0] = b->line;
	j.axis[1] = b->line == 0;
	j.axis[2] = b->line == 2 ? 1 : 2;
	for (int a = 0; a < 3; a++) {
		j.stride[a] = stride[j.axis[a]];
		j.tiles[a] = (b->n[j.axis[a]] + most[a] - 1) / most[a];
	}
	ct_par_for(par, j.tiles[0] * j.tiles[1] * j.tiles[2], tile, &j);
}
