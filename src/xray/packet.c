/* packet.c: see packet.h.
 *
 * The voxels, or rows, that the lanes of a vector need are neighbours: they lie in a table of one,
 * two or four registers, from which a permutation picks those of each lane.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/packet.h"
#include "core/vec.h"
#include "xray/ray.h"

#include <math.h>

enum {
	TABLE = 32, /* voxels of a column within reach of a packet */
	AHEAD = 8,  /* pieces whose voxels are called into the cache early */
	LANES = CT_F32_LANES,
	PARTS = CT_PACKET / LANES /* vectors of a packet */
};

/* Where the lanes of a vector find their voxels: anywhere within TABLE; in a table of one register,
 * or of two; none counts; or too far apart for float heights. */
enum reach { REACH_SPARSE, REACH_ONE, REACH_TWO, REACH_NOTHING, REACH_FAR };

/* The pieces as one packet sees them: heights at the ends of row 0, relative to voxel `base`, and
 * the step from row to row. */
struct plan {
	float z0[CT_PIECES], q0[CT_PIECES], z1[CT_PIECES], q1[CT_PIECES];
	int32_t base[CT_PIECES], reach[CT_PIECES];
	int32_t low[PARTS][CT_PIECES]; /* where the table of a part begins, above base */
};

CT_INLINE float least(float a, float b)
{
	return a < b ? a : b;
}

CT_INLINE float most(float a, float b)
{
	return a > b ? a : b;
}

CT_INLINE double limited(double x, double n)
{
	return ct_least(ct_most(x, -1000), n + 1000);
}

/* The table of part k: span[m] becomes the voxels that it needs, where that is more. */
CT_INLINE void plan_part(
	struct plan *restrict p, int32_t span[restrict CT_PIECES], int k, const int32_t above)
{
	const float first = (float)(k * LANES), last = first + LANES - 1;
	const int32_t end = TABLE - 2 * LANES; /* so that no table goes beyond TABLE */

	for (size_t m = 0; m < CT_PIECES; m++) {
		float a = p->z0[m] + first * p->q0[m], b = p->z0[m] + last * p->q0[m];
		float c = p->z1[m] + first * p->q1[m], d = p->z1[m] + last * p->q1[m];
		int32_t lo = (int32_t)least(least(a, b), least(c, d));
		int32_t hi = (int32_t)most(most(a, b), most(c, d)) + 1 + above;

		lo = lo < end ? lo : end;
		p->low[k][m] = lo;
		span[m] = hi - lo > span[m] ? hi - lo : span[m];
	}
}

CT_INLINE void plan_packet(struct plan *restrict p, const struct ct_pieces *restrict s,
	const struct ct_heights *h, double row)
{
	const double end = CT_PACKET - 1, n = h->n, half = h->joseph ? 0.5 : 0;
	const double pa = h->pa - half, pb = h->pb, qa = h->qa, qb = h->qb;
	const int32_t above = h->joseph;
	int32_t reach[CT_PIECES], span[CT_PIECES] = {0};

	for (size_t m = 0; m < CT_PIECES; m++) { /* a fixed number, so that it vectorises */
		double q0 = qa + qb * s->x0[m], q1 = qa + qb * s->x1[m];
		double a = pa + pb * s->x0[m] + row * q0, b = pa + pb * s->x1[m] + row * q1;
		double c = a + end * q0, d = b + end * q1;
		double lo = limited(ct_least(ct_least(a, b), ct_least(c, d)), n);
		double hi = limited(ct_most(ct_most(a, b), ct_most(c, d)), n);
		int32_t base = (int32_t)(lo + 1024) - 1024,
			top = (int32_t)(hi + 1024) - 1024 + above;

		p->z0[m] = (float)(a - base);
		p->q0[m] = (float)q0;
		p->z1[m] = (float)(b - base);
		p->q1[m] = (float)q1;
		p->base[m] = base;
		reach[m] = top < s->lo[m] || base >= s->hi[m] ? 0 : top - base + 1;
	}
	for (int k = 0; k < PARTS; k++)
		plan_part(p, span, k, above);
	for (size_t m = 0; m < CT_PIECES; m++) {
		int32_t how = span[m] <= LANES       ? REACH_ONE
			      : span[m] <= 2 * LANES ? REACH_TWO
						     : REACH_SPARSE;

		how = reach[m] > TABLE - 1 ? REACH_FAR : how;
		p->reach[m] = reach[m] > 0 ? how : REACH_NOTHING;
	}
}

CT_INLINE float clamp01(float x)
{
	x = x > 0 ? x : 0;
	return x < 1 ? x : 1;
}

/* Largest slope is 1; a ray without slope crosses nothing, whatever this number. */
CT_INLINE float inverse_of(double slope)
{
	return fabs(slope) < 1e-15 ? 1e15F : (float)(1 / slope);
}

/* REACH_FAR: heights in double, voxels fetched one by one. */
static void piece_far(float *restrict acc, const struct ct_pieces *restrict s, size_t m,
	const struct ct_heights *h, double row, const float *restrict rise, const float *restrict f)
{
	double n = h->n, half = h->joseph ? 0.5 : 0;
	double q0 = h->qa + h->qb * s->x0[m], q1 = h->qa + h->qb * s->x1[m];
	double a = h->pa - half + h->pb * s->x0[m] + row * q0;
	double b = h->pa - half + h->pb * s->x1[m] + row * q1;

	for (int j = 0; j < CT_PACKET; j++) {
		double z0 = ct_least(ct_most(a + j * q0, -2), n + 1.5);
		double z1 = ct_least(ct_most(b + j * q1, -2), n + 1.5);
		int32_t k0 = (int32_t)(z0 + 2) - 2, k1 = (int32_t)(z1 + 2) - 2;
		int32_t face = k0 > k1 ? k0 : k1;
		float share, x, y;

		k1 = h->joseph ? k0 + 1 : k1;
		x = f[k0];
		y = f[k1];
		share = h->joseph ? 1 - (float)(z0 - k0)
				  : clamp01((float)(face - z0) * rise[j] * s->inverse[m]);
		acc[j] += s->weight[m] * (y + share * (x - y));
	}
}

/* Entry `at` of a table of `registers` registers from t on; of t itself if 0. */
CT_INLINE ct_f32 lookup(const float *t, ct_i32 at, const int registers)
{
	return registers == 1   ? ct_f32_table(t, at)
	       : registers == 2 ? ct_f32_table2(t, at)
	       : registers == 4 ? ct_f32_table4(t, at)
				: ct_f32_gather(t, at);
}

CT_INLINE ct_f32 clamp01_all(ct_f32 x)
{
	return ct_f32_min(ct_f32_max(x, ct_f32_set(0)), ct_f32_set(1));
}

CT_INLINE ct_f32 lanes_from(int32_t first)
{
	return __builtin_convertvector(ct_i32_count(first), ct_f32);
}

CT_INLINE void piece_near(ct_f32 sum[PARTS], const struct ct_pieces *restrict s, size_t m,
	const struct plan *restrict p, const ct_f32 rise[PARTS], const float *restrict vol,
	const bool joseph, const int registers)
{
	const ct_f32 inverse = ct_f32_set(s->inverse[m]), weight = ct_f32_set(s->weight[m]);
	const float *f = vol + s->at[m] + p->base[m];

#pragma GCC unroll 4
	for (int k = 0; k < PARTS; k++) {
		const ct_f32 lane = lanes_from(k * LANES);
		const int32_t low = PARTS > 1 ? p->low[k][m] : 0;
		const ct_f32 z0 = ct_f32_set(p->z0[m]) + lane * ct_f32_set(p->q0[m]);
		const ct_i32 k0 = __builtin_convertvector(z0, ct_i32);
		ct_i32 k1 = k0 + 1, face = k0;
		ct_f32 share, x, y;

		if (!joseph) {
			k1 = __builtin_convertvector(
				ct_f32_set(p->z1[m]) + lane * ct_f32_set(p->q1[m]), ct_i32);
			face = ct_i32_max(k0, k1);
		}
		share = __builtin_convertvector(face, ct_f32);
		if (joseph)
			share = 1 - (z0 - share);
		else
			share = clamp01_all((share - z0) * rise[k] * inverse);
		x = lookup(f + low, k0 - low, registers);
		y = lookup(f + low, k1 - low, registers);
		sum[k] += weight * (y + share * (x - y));
	}
}

CT_INLINE void store_all(float acc[restrict CT_PACKET], const ct_f32 sum[PARTS])
{
#pragma GCC unroll 4
	for (int k = 0; k < PARTS; k++)
		ct_f32_store(acc + k * LANES, sum[k]);
}

CT_INLINE void sum_pieces(float acc[restrict CT_PACKET], const struct ct_pieces *restrict s,
	const struct plan *restrict p, const struct ct_heights *h, double row,
	const float *restrict rise, const float *restrict vol, const bool joseph)
{
	ct_f32 sum[PARTS], rises[PARTS];

#pragma GCC unroll 4
	for (int k = 0; k < PARTS; k++) {
		sum[k] = ct_f32_set(0);
		rises[k] = ct_f32_load(rise + k * LANES);
	}
	for (size_t m = 0; m < s->n; m++) {
		if (m + AHEAD < s->n && p->reach[m + AHEAD] != REACH_NOTHING) {
			const float *next = vol + s->at[m + AHEAD] + p->base[m + AHEAD];

			__builtin_prefetch(next);
			__builtin_prefetch(next + CT_PACKET);
		}
		if (p->reach[m] == REACH_ONE) {
			piece_near(sum, s, m, p, rises, vol, joseph, 1);
		} else if (p->reach[m] == REACH_TWO) {
			piece_near(sum, s, m, p, rises, vol, joseph, 2);
		} else if (p->reach[m] == REACH_SPARSE) {
			piece_near(sum, s, m, p, rises, vol, joseph, 0);
		} else if (p->reach[m] == REACH_FAR) {
			store_all(acc, sum);
			piece_far(acc, s, m, h, row, rise, vol + s->at[m]);
#pragma GCC unroll 4
			for (int k = 0; k < PARTS; k++)
				sum[k] = ct_f32_load(acc + k * LANES);
		}
	}
	store_all(acc, sum);
}

void CT_SIMD_HERE(ct_packet_sum)(double sum[static CT_PACKET], const struct ct_pieces *restrict s,
	const struct ct_heights *h, double row, const float *restrict vol)
{
	float acc[CT_PACKET], rise[CT_PACKET];
	struct plan p;

	plan_packet(&p, s, h, row);
	for (int j = 0; j < CT_PACKET; j++)
		rise[j] = inverse_of(h->pb + (row + j) * h->qb);
	if (h->joseph)
		sum_pieces(acc, s, &p, h, row, rise, vol, true);
	else
		sum_pieces(acc, s, &p, h, row, rise, vol, false);
	for (int j = 0; j < CT_PACKET; j++)
		sum[j] += (double)acc[j];
}

enum {
	FRONT = 8,
	BEHIND = CT_ROWS + 2 * TABLE + 16,
	BLOCKS = 8,                    /* of sixteen voxels, that are planned at once */
	GROUP = PARTS < 2 ? PARTS : 2, /* vectors of voxels that go through the rows together */
};

/* Values and inverse slopes of the rows of a packet's detector column, zeros around them: row r is
 * at FRONT + r. Rows are counted so that heights grow with them. */
struct rows {
	float value[FRONT + CT_ROWS + BEHIND], rise[FRONT + CT_ROWS + BEHIND];
	int32_t n;
};

/* The piece as the spread sees it. */
struct piece {
	double p0, q0, p1, q1; /* heights of row r: p + r q, q > 0 */
	double i0, i1;         /* 1/q */
	float inverse, weight;
};

/* What sixteen voxels from k on receive: voxel k + l, from rows row + first(l) and on, so many
 * rounds. With lane l, first(l) = floor(min(r0 + l/q0, r1 + l/q1)); row 0 of these is at height z
 * above k. */
struct blocks {
	int32_t row[BLOCKS], rounds[BLOCKS];
	float z[BLOCKS], r0[BLOCKS], r1[BLOCKS];
};

/* Those from voxel k on; 0 rounds where no row reaches them. */
CT_INLINE void plan_blocks(struct blocks *restrict b, const struct piece *restrict s, int32_t rows,
	int32_t k, const bool joseph)
{
	const double margin = joseph ? 0.5 : 0, last = CT_PACKET - 1, n = rows;
	const double p0 = s->p0, q0 = s->q0, p1 = s->p1, i0 = s->i0, i1 = s->i1;
	const double voxel = (1 + 2 * margin) * ct_most(i0, i1);

	for (int j = 0; j < BLOCKS; j++) {
		double at = k + j * CT_PACKET;
		double from0 = (at - margin - p0) * i0, from1 = (at - margin - p1) * i1;
		double lead = ct_least(from0, from1), d0 = from0 - from1,
		       d1 = d0 + last * (i0 - i1);
		double wide = ct_most(fabs(d0), fabs(d1)) + voxel;
		int32_t row = (int32_t)ct_least(ct_most(lead, -2), n);
		int32_t rounds = (int32_t)ct_least(wide, n + 8) + 2;

		b->row[j] = row;
		b->rounds[j] = lead < n ? rounds : 0;
		b->z[j] = (float)(p0 + row * q0 - at);
		b->r0[j] = (float)(from0 - row);
		b->r1[j] = (float)(from1 - row);
	}
}

/* Vectors of voxels: `over` above row 0 of the block, met by rows from `dr` on. */
struct group {
	ct_f32 over[GROUP];
	ct_i32 dr[GROUP];
	int32_t row, rounds; /* row 0 of the block */
	float q;             /* from row to row */
};

/* sum: what the voxels receive. From one row to the next it is the tables that move on, not the
 * indices into them. */
CT_INLINE void spread_rows(ct_f32 sum[GROUP], const struct group *g, const struct rows *rows,
	float inverse, const bool joseph, const int registers)
{
	const ct_i32 none = {0};
	const float *v[GROUP], *r[GROUP];
	ct_i32 at[GROUP];
	ct_f32 row[GROUP];

#pragma GCC unroll 2
	for (int k = 0; k < GROUP; k++) {
		int32_t first = g->row + g->dr[k][0];

		first = registers ? (first < rows->n ? first : rows->n) + FRONT : 0;
		v[k] = rows->value + first;
		r[k] = rows->rise + first;
		at[k] = registers ? g->dr[k] - g->dr[k][0] : none;
		row[k] = __builtin_convertvector(g->dr[k], ct_f32);
		sum[k] = ct_f32_set(0);
	}
	for (int32_t i = 0; i < g->rounds; i++) {
#pragma GCC unroll 2
		for (int k = 0; k < GROUP; k++) {
			const ct_f32 above = g->over[k] - row[k] * ct_f32_set(g->q);
			const size_t on = registers ? (size_t)i : 0;
			ct_f32 w, x, y;

			if (!registers) {
				at[k] = ct_i32_max(g->dr[k] + (g->row + i), none - 1);
				at[k] = ct_i32_min(at[k], none + rows->n) + FRONT;
			}
			if (joseph) {
				x = ct_f32_abs(above + 0.5F);
				w = ct_f32_max(1 - x, ct_f32_set(0));
			} else {
				y = lookup(r[k] + on, at[k], registers) * inverse;
				x = above * y;
				w = ct_f32_abs(clamp01_all(x + y) - clamp01_all(x));
			}
			sum[k] += w * lookup(v[k] + on, at[k], registers);
			row[k] += 1;
		}
	}
}

/* The voxels f of a block from lane `l` on, of which `count` are there. */
CT_INLINE void spread_group(float *restrict f, const struct blocks *b, int j, const struct piece *s,
	const struct rows *rows, int32_t l, int32_t count, const bool joseph)
{
	struct group g = {.row = b->row[j], .q = (float)s->q0};
	ct_f32 sum[GROUP];
	int32_t reach = 0, left;

#pragma GCC unroll 2
	for (int k = 0; k < GROUP; k++) {
		const ct_f32 lane = lanes_from(l + k * LANES);
		const ct_f32 x = b->r0[j] + lane * (float)s->i0, y = b->r1[j] + lane * (float)s->i1;
		const ct_f32 lead = ct_f32_max(ct_f32_min(x, y), ct_f32_set(-4));
		int32_t span;

		g.over[k] = lane - b->z[j];
		g.dr[k] = __builtin_convertvector(lead + 4, ct_i32) - 4;
		span = g.dr[k][LANES - 1] - g.dr[k][0];
		reach = span > reach ? span : reach;
	}
	left = rows->n - g.row - g.dr[0][0];
	g.rounds = left < b->rounds[j] ? left : b->rounds[j];
	if (reach < LANES)
		spread_rows(sum, &g, rows, s->inverse, joseph, 1);
	else if (reach < 2 * LANES)
		spread_rows(sum, &g, rows, s->inverse, joseph, 2);
	else if (reach < 4 * LANES)
		spread_rows(sum, &g, rows, s->inverse, joseph, 4);
	else
		spread_rows(sum, &g, rows, s->inverse, joseph, 0);
#pragma GCC unroll 2
	for (int k = 0; k < GROUP; k++) {
		const ct_i32 valid = ct_i32_count(l + k * LANES) < count;
		float *to = f + l + k * LANES;

		sum[k] *= s->weight;
		ct_f32_store(to, ct_f32_load(to) + (ct_f32)((ct_i32)sum[k] & valid));
	}
}

/* The voxels of a piece that rows reach, sixteen after sixteen. Those of the piece `next` are
 * called into the cache. */
CT_INLINE void spread_piece(float *restrict f, const float *next, const struct piece *s,
	const struct rows *rows, int32_t n, const bool joseph)
{
	double margin = joseph ? 0.5 : 0, low = ct_least(s->p0, s->p1) - margin;
	double high =
		ct_most(s->p0 + (double)rows->n * s->q0, s->p1 + (double)rows->n * s->q1) + margin;
	int32_t k = (int32_t)ct_most(limited(low, n), 0);
	int32_t last = (int32_t)(limited(high, n) + 1024) - 1024;

	last = last < n ? last : n - 1;
	while (k <= last) {
		struct blocks b;

		plan_blocks(&b, s, rows->n, k, joseph);
		for (int j = 0; j < BLOCKS && k <= last; j++, k += CT_PACKET) {
			__builtin_prefetch(next + k);
			for (int32_t l = 0; l < CT_PACKET && b.rounds[j]; l += GROUP * LANES)
				spread_group(f + k, &b, j, s, rows, l, last - k + 1, joseph);
		}
	}
}

void CT_SIMD_HERE(ct_packet_spread)(float *restrict vol, const struct ct_pieces *restrict s,
	const struct ct_heights *h, size_t row, size_t count, const float *restrict value)
{
	bool down = h->qa + h->qb * (s->n ? s->x0[0] : 0) < 0;
	double at = (double)(down ? row + count - 1 : row);
	struct rows rows = {.n = (int32_t)count};

	for (size_t i = 0; i < count; i++) {
		size_t from = down ? count - 1 - i : i;

		rows.value[FRONT + i] = value[from];
		rows.rise[FRONT + i] = inverse_of(h->pb + (double)(row + from) * h->qb);
	}
	for (size_t m = 0; m < s->n; m++) {
		const float *next = vol + s->at[m + 1 < s->n ? m + 1 : m];
		double q0 = h->qa + h->qb * s->x0[m], q1 = h->qa + h->qb * s->x1[m];
		struct piece p = {.p0 = h->pa + h->pb * s->x0[m] + at * q0,
			.p1 = h->pa + h->pb * s->x1[m] + at * q1,
			.q0 = down ? -q0 : q0,
			.q1 = down ? -q1 : q1,
			.inverse = s->inverse[m],
			.weight = s->weight[m]};

		p.i0 = 1 / p.q0;
		p.i1 = 1 / p.q1;
		if (h->joseph)
			spread_piece(vol + s->at[m], next, &p, &rows, h->n, true);
		else
			spread_piece(vol + s->at[m], next, &p, &rows, h->n, false);
	}
}
