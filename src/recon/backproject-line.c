/* backproject-line.c: back-projection along lines of voxels that run with the detector's columns
 * (backproject.h): each reads one blend of two detector columns at equal steps. Kernels
 * (core/simd.h). SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/backproject.h"
#include "core/vec.h"

#include <math.h>
#include <stdbool.h>

enum {
	SEGMENT = CT_BP_SEGMENT,
	TILE = CT_BP_TILE,
	STEP = 16, /* voxels whose rows are counted from one of them */
	BLOCKS = SEGMENT / STEP,
	LANES = CT_F32_LANES,
	PARTS = STEP / LANES,
};

/* How the rows that a vector of voxels reads are found: in a table of two registers, of four, or
 * anywhere. */
enum reach { TWO, FOUR, ANY };

/* A line of voxels in a view: the voxels [k0, k1) of a segment read, at the rows row + k step of
 * the blend, a left[] + b right[]. row counts from the blend's first. */
struct line {
	const float *left, *right;
	float a, b;
	size_t rows; /* of the blend */
	size_t k0, k1;
	double row, step;
};

/* The part of the detector that the line sees: one column, between two. */
CT_INLINE void blend_columns(float *restrict blend, const struct line *l)
{
	const ct_f32 a = ct_f32_set(l->a), b = ct_f32_set(l->b);

#pragma GCC unroll 4
	for (size_t i = 0; i < l->rows; i += LANES)
		ct_f32_store(
			blend + i, a * ct_f32_load(l->left + i) + b * ct_f32_load(l->right + i));
}

/* Where the blocks of STEP voxels begin: row low + from of the blend, from >= 0 counted from the
 * lowest row that the block reads. */
struct starts {
	int32_t low[BLOCKS];
	float from[BLOCKS];
};

CT_INLINE void find_starts(struct starts *restrict s, const struct line *l)
{
	const double row = l->row, step = l->step, back = step < 0 ? (STEP - 1) * step : 0;

	for (int k = 0; k < BLOCKS; k++) {
		double first = row + (double)(k * STEP) * step, low = floor(first + back);

		s->low[k] = (int32_t)low;
		s->from[k] = (float)(first - low);
	}
}

/* The lowest row, above that of the block, that the lanes [l, l + LANES) may read. */
CT_INLINE int32_t lowest_of(int l, float step)
{
	float low = step < 0 ? (float)(STEP - LANES - l) * -step - 0.01F : (float)l * step;

	return low > 0 ? (int32_t)low : 0;
}

CT_INLINE void line_blocks(float *restrict acc, const struct line *l, const struct starts *s,
	const float *restrict blend, const enum reach reach)
{
	const float step = (float)l->step;
	ct_f32 ramp[PARTS];
	int32_t low[PARTS];

#pragma GCC unroll 4
	for (int p = 0; p < PARTS; p++) {
		ramp[p] = __builtin_convertvector(ct_i32_count(p * LANES), ct_f32) * step;
		low[p] = reach == ANY ? 0 : lowest_of(p * LANES, step);
	}
	for (size_t k = l->k0 / STEP * STEP; k < l->k1; k += STEP) {
		const float *t = blend + s->low[k / STEP];
		const ct_f32 from = ct_f32_set(s->from[k / STEP]);
		const bool whole = k >= l->k0 && k + STEP <= l->k1;

#pragma GCC unroll 4
		for (int p = 0; p < PARTS; p++) {
			const ct_f32 x = from + ramp[p];
			const ct_i32 i = __builtin_convertvector(x, ct_i32), at = i - low[p];
			const ct_f32 f = x - __builtin_convertvector(i, ct_f32);
			float *to = acc + k + (size_t)p * LANES;
			ct_f32 t0, t1, y;

			if (reach == ANY) {
				ct_f32_gather2(&t0, &t1, t, at);
			} else if (reach == TWO) {
				t0 = ct_f32_table2(t + low[p], at);
				t1 = ct_f32_table2(t + low[p] + 1, at);
			} else {
				t0 = ct_f32_table4(t + low[p], at);
				t1 = ct_f32_table4(t + low[p] + 1, at);
			}
			y = t0 + f * (t1 - t0);
			if (!whole) {
				ct_i32 lane = ct_i32_count((int32_t)k + p * LANES);

				lane = (lane >= (int32_t)l->k0) & (lane < (int32_t)l->k1);
				y = (ct_f32)((ct_i32)y & lane);
			}
			ct_f32_store(to, ct_f32_load(to) + y);
		}
	}
}

/* acc += the line. Tables are faster than gathering but for short vectors, two numbers a time. */
CT_INLINE void add_line(float *restrict acc, const struct line *l, float *restrict blend)
{
	const double span = fabs(l->step) * (LANES - 1) + 2.1; /* rows that a vector reads */
	struct starts s;

	blend_columns(blend, l);
	find_starts(&s, l);
	if (LANES > 4 && span < 2 * LANES)
		line_blocks(acc, l, &s, blend, TWO);
	else if (LANES > 8 && span < 4 * LANES)
		line_blocks(acc, l, &s, blend, FOUR);
	else
		line_blocks(acc, l, &s, blend, ANY);
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
CT_INLINE void place_lines(struct places *restrict p, const double m[restrict 3][4],
	const double x[3], int across, int along, double w)
{
	const double c0 = ct_backproject_map(m[0], x), r0 = ct_backproject_map(m[1], x),
		     d0 = ct_backproject_map(m[2], x);
	const double dc = m[0][across], dr = m[1][across], dd = m[2][across], ds = m[1][along];

	for (int i = 0; i < TILE; i++) {
		double inv = 1 / (d0 + i * dd), col = (c0 + i * dc) * inv, weight = inv * inv;
		double in = ((col >= -0.5) & (col <= w - 0.5)) ? 1 : 0, frac;
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
CT_INLINE void line_in_view(float *restrict acc, const struct ct_bp_tile *j, const float *view,
	const struct places *p, size_t i, float *restrict blend)
{
	const struct ct_backprojector *b = j->b;
	const size_t n = j->n[0];
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
	add_line(acc, &l, blend);
}

/* The axis (1 or 2 of the tile's) along which neighbouring lines are nearer on the detector: taken
 * in that order they find its columns in the first cache. */
static int nearer(const struct ct_bp_tile *j, size_t view)
{
	const double(*m)[4] = (const double(*)[4])j->b->map[view];
	double col = ct_backproject_map(m[0], j->x) / ct_backproject_map(m[2], j->x), d[3];

	for (int a = 1; a < 3; a++)
		d[a] = fabs(m[0][j->axis[a]] - col * m[2][j->axis[a]]);
	return d[1] <= d[2] ? 1 : 2;
}

void CT_SIMD_HERE(ct_backproject_line_tile)(
	float acc[restrict CT_BP_TILE][CT_BP_TILE][CT_BP_SEGMENT], const struct ct_bp_tile *j,
	size_t view, size_t count, const float *restrict from, float *restrict blend)
{
	int fast = nearer(j, view), slow = 3 - fast;
	struct places p[CT_BP_GROUP];

	for (size_t s = 0; s < j->n[slow]; s++) {
		double y[3] = {j->x[0], j->x[1], j->x[2]};

		y[j->axis[slow]] += (double)s;
		for (size_t g = 0; g < count; g++)
			place_lines(&p[g], (const double(*)[4])j->b->map[view + g], y,
				j->axis[fast], j->axis[0], (double)j->b->w);
		for (size_t f = 0; f < j->n[fast]; f++)
			for (size_t g = 0; g < count; g++)
				line_in_view(fast == 1 ? acc[s][f] : acc[f][s], j,
					from + g * ct_backprojector_size(j->b), &p[g], f, blend);
	}
}
