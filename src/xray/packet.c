/* packet.c: see packet.h. */
#include "config.h"
#include "xray/packet.h"
#include "xray/ray.h"

#include <math.h>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define WIDE 1
#else
#define WIDE 0
#endif

enum {
	TABLE = 32, /* voxels of a column within reach of a packet */
	AHEAD = 8   /* pieces whose voxels are called into the cache early */
};

/* The pieces as one packet sees them: heights at the ends of row 0, relative to voxel `base`, and
 * the step from row to row. */
struct plan {
	float z0[CT_PIECES], q0[CT_PIECES], z1[CT_PIECES], q1[CT_PIECES];
	int32_t base[CT_PIECES], reach[CT_PIECES]; /* lowest voxel; voxels, 0: none that counts */
};

static CT_INLINE double limited(double x, double n)
{
	return ct_least(ct_most(x, -1000), n + 1000);
}

CT_HOT static void plan_packet(struct plan *restrict p, const struct ct_pieces *restrict s,
	const struct ct_heights *h, double row)
{
	const double last = CT_PACKET - 1, n = h->n, half = h->joseph ? 0.5 : 0;
	const double pa = h->pa - half, pb = h->pb, qa = h->qa, qb = h->qb;
	const int32_t above = h->joseph;

	for (size_t m = 0; m < CT_PIECES; m++) { /* a fixed number, so that it vectorises */
		double q0 = qa + qb * s->x0[m], q1 = qa + qb * s->x1[m];
		double a = pa + pb * s->x0[m] + row * q0, b = pa + pb * s->x1[m] + row * q1;
		double c = a + last * q0, d = b + last * q1;
		double lo = limited(ct_least(ct_least(a, b), ct_least(c, d)), n);
		double hi = limited(ct_most(ct_most(a, b), ct_most(c, d)), n);
		int32_t base = (int32_t)(lo + 1024) - 1024,
			top = (int32_t)(hi + 1024) - 1024 + above;

		p->z0[m] = (float)(a - base);
		p->q0[m] = (float)q0;
		p->z1[m] = (float)(b - base);
		p->q1[m] = (float)q1;
		p->base[m] = base;
		p->reach[m] = top < s->lo[m] || base >= s->hi[m] ? 0 : top - base + 1;
	}
}

static CT_INLINE float clamp01(float x)
{
	x = x > 0 ? x : 0;
	return x < 1 ? x : 1;
}

/* Largest slope is 1; a ray without slope crosses nothing, whatever this number. */
static CT_INLINE float inverse_of(double slope)
{
	return fabs(slope) < 1e-15 ? 1e15F : (float)(1 / slope);
}

/* Steps too wide for a table: heights in double, voxels fetched one by one. */
CT_HOT static void piece_far(float *restrict acc, const struct ct_pieces *restrict s, size_t m,
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

/* All others. The same as sum_wide, in C. */
CT_HOT static void piece_near(float *restrict acc, const struct ct_pieces *restrict s, size_t m,
	const struct plan *restrict p, bool joseph, const float *restrict rise,
	const float *restrict f)
{
	f += p->base[m];
	for (int j = 0; j < CT_PACKET; j++) {
		float z0 = p->z0[m] + (float)j * p->q0[m], z1 = p->z1[m] + (float)j * p->q1[m];
		int32_t k0 = (int32_t)z0, k1 = (int32_t)z1, face = k0 > k1 ? k0 : k1;
		float share, x, y;

		k1 = joseph ? k0 + 1 : k1;
		x = f[k0 & (TABLE - 1)];
		y = f[k1 & (TABLE - 1)];
		share = joseph ? 1 - (z0 - (float)k0)
			       : clamp01(((float)face - z0) * rise[j] * s->inverse[m]);
		acc[j] += s->weight[m] * (y + share * (x - y));
	}
}

#if WIDE
/* The voxels in reach lie in two registers, from which a permutation picks those of each ray. */
__attribute__((target("avx512f"))) static void sum_wide(float *restrict acc,
	const struct ct_pieces *restrict s, const struct plan *restrict p,
	const struct ct_heights *h, double row, const float *restrict rise,
	const float *restrict vol)
{
	const __m512 lane = _mm512_set_ps(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
	const __m512 zero = _mm512_setzero_ps(), one = _mm512_set1_ps(1);
	const __m512 rises = _mm512_loadu_ps(rise);
	__m512 sum = zero;

	for (size_t m = 0; m < s->n; m++) {
		const float *f = vol + s->at[m];
		__m512 z0, z1, low, high, x, y, share;
		__m512i k0, k1;

		if (m + AHEAD < s->n && p->reach[m + AHEAD]) {
			const float *next = vol + s->at[m + AHEAD] + p->base[m + AHEAD];

			_mm_prefetch((const char *)next, _MM_HINT_T0);
			_mm_prefetch((const char *)(next + CT_PACKET), _MM_HINT_T0);
		}
		if (p->reach[m] == 0)
			continue;
		if (p->reach[m] > TABLE - 1) {
			_mm512_storeu_ps(acc, sum);
			piece_far(acc, s, m, h, row, rise, f);
			sum = _mm512_loadu_ps(acc);
			continue;
		}
		f += p->base[m];
		low = _mm512_loadu_ps(f);
		high = _mm512_loadu_ps(f + CT_PACKET);
		z0 = _mm512_add_ps(
			_mm512_set1_ps(p->z0[m]), _mm512_mul_ps(lane, _mm512_set1_ps(p->q0[m])));
		k0 = _mm512_cvttps_epi32(z0);
		x = _mm512_permutex2var_ps(low, k0, high);
		if (h->joseph) {
			k1 = _mm512_add_epi32(k0, _mm512_set1_epi32(1));
			share = _mm512_sub_ps(one, _mm512_sub_ps(z0, _mm512_cvtepi32_ps(k0)));
		} else {
			z1 = _mm512_add_ps(_mm512_set1_ps(p->z1[m]),
				_mm512_mul_ps(lane, _mm512_set1_ps(p->q1[m])));
			k1 = _mm512_cvttps_epi32(z1);
			share = _mm512_sub_ps(_mm512_cvtepi32_ps(_mm512_max_epi32(k0, k1)), z0);
			share = _mm512_mul_ps(
				_mm512_mul_ps(share, rises), _mm512_set1_ps(s->inverse[m]));
			share = _mm512_min_ps(_mm512_max_ps(share, zero), one);
		}
		y = _mm512_permutex2var_ps(low, k1, high);
		x = _mm512_add_ps(y, _mm512_mul_ps(share, _mm512_sub_ps(x, y)));
		sum = _mm512_add_ps(sum, _mm512_mul_ps(_mm512_set1_ps(s->weight[m]), x));
	}
	_mm512_storeu_ps(acc, sum);
}
#endif

static void sum_plain(float *restrict acc, const struct ct_pieces *restrict s,
	const struct plan *restrict p, const struct ct_heights *h, double row,
	const float *restrict rise, const float *restrict vol)
{
	for (size_t m = 0; m < s->n; m++)
		if (p->reach[m] > TABLE - 1)
			piece_far(acc, s, m, h, row, rise, vol + s->at[m]);
		else if (p->reach[m] > 0)
			piece_near(acc, s, m, p, h->joseph, rise, vol + s->at[m]);
}

void ct_packet_sum(double sum[static CT_PACKET], const struct ct_pieces *restrict s,
	const struct ct_heights *h, double row, const float *restrict vol)
{
	float acc[CT_PACKET] = {0}, rise[CT_PACKET];
	struct plan p;

	plan_packet(&p, s, h, row);
	for (int j = 0; j < CT_PACKET; j++)
		rise[j] = inverse_of(h->s0 + (row + j) * h->s1);
#if WIDE
	if (__builtin_cpu_supports("avx512f"))
		sum_wide(acc, s, &p, h, row, rise, vol);
	else
#endif
		sum_plain(acc, s, &p, h, row, rise, vol);
	for (int j = 0; j < CT_PACKET; j++)
		sum[j] += (double)acc[j];
}

enum { FRONT = 8, BEHIND = 2 * TABLE + 8 };

/* Values and inverse slopes of the rows of a block, zeros around them: row r is at FRONT + r. Rows
 * are counted so that heights grow with them. */
struct rows {
	float value[FRONT + CT_ROWS + BEHIND], rise[FRONT + CT_ROWS + BEHIND];
	int32_t n;
};

/* The piece as the spread sees it. */
struct piece {
	double p0, q0, p1, q1; /* heights of row r of the block: p + r q, q > 0 */
	double i0, i1;         /* 1/q */
	float inverse, weight;
	bool joseph;
};

/* What sixteen voxels from k on receive: voxel k + l, from rows row + first(l) and on. With
 * lane l, first(l) = floor(min(r0 + l g0, r1 + l g1)); row 0 of these is at height z above k. */
struct block {
	int32_t row, rounds;
	float z, q, r0, r1, g0, g1;
};

static CT_INLINE int32_t first_row(const struct block *b, int32_t l)
{
	float x = b->r0 + (float)l * b->g0, y = b->r1 + (float)l * b->g1, r = x < y ? x : y;

	return (int32_t)((r > -4 ? r : -4) + 4) - 4;
}

/* False if no row reaches them. */
static CT_INLINE bool block_of(
	struct block *b, const struct piece *s, const struct rows *rows, int32_t k)
{
	double margin = s->joseph ? 0.5 : 0, last = CT_PACKET - 1;
	double from0 = (k - margin - s->p0) * s->i0, from1 = (k - margin - s->p1) * s->i1;
	double lead = ct_least(from0, from1), d0 = from0 - from1, d1 = d0 + last * (s->i0 - s->i1);
	double wide = ct_most(d0 < 0 ? -d0 : d0, d1 < 0 ? -d1 : d1) +
		      (1 + 2 * margin) * ct_most(s->i0, s->i1);

	if (lead >= rows->n)
		return false;
	b->row = (int32_t)ct_most(lead, -2);
	b->rounds = (int32_t)ct_least(wide, rows->n + 8) + 2;
	b->z = (float)(s->p0 + b->row * s->q0 - k);
	b->q = (float)s->q0;
	b->r0 = (float)(from0 - b->row);
	b->r1 = (float)(from1 - b->row);
	b->g0 = (float)s->i0;
	b->g1 = (float)s->i1;
	return true;
}

CT_HOT static void spread_plain(
	float *restrict acc, const struct block *b, const struct piece *s, const struct rows *rows)
{
	int32_t first[CT_PACKET];

	for (int32_t l = 0; l < CT_PACKET; l++)
		first[l] = first_row(b, l);
	for (int32_t i = 0; i < b->rounds; i++)
		for (int32_t l = 0; l < CT_PACKET; l++) {
			int32_t dr = first[l] + i, r = b->row + dr;
			float above = ((float)l - b->z) - (float)dr * b->q, w, x, y;

			r = r > -1 ? r : -1;
			r = (r < rows->n ? r : rows->n) + FRONT;
			if (s->joseph) {
				x = above + 0.5F;
				x = 1 - (x < 0 ? -x : x);
				w = x > 0 ? x : 0;
			} else {
				y = rows->rise[r] * s->inverse;
				x = above * y;
				w = clamp01(x + y) - clamp01(x);
				w = w < 0 ? -w : w;
			}
			acc[l] += w * rows->value[r];
		}
}

#if WIDE
/* Entry `at` of the 64 in a, b, c, d; of the 32 in a, b if not wide. */
__attribute__((target("avx512f"))) static CT_INLINE __m512 pick(
	__m512 a, __m512 b, __m512 c, __m512 d, __m512i at, bool wide)
{
	__m512 low = _mm512_permutex2var_ps(a, at, b);

	if (!wide)
		return low;
	return _mm512_mask_blend_ps(_mm512_cmpgt_epi32_mask(at, _mm512_set1_epi32(TABLE - 1)), low,
		_mm512_permutex2var_ps(c, at, d));
}

/* The same as spread_plain, the rows in reach (64 at most, 32 if not wide) in registers. */
__attribute__((target("avx512f"))) static CT_INLINE void spread_table(float *restrict f,
	int32_t count, const struct block *b, const struct piece *s, const struct rows *rows,
	bool joseph, bool wide)
{
	const __m512 lane = _mm512_set_ps(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
	const __m512 zero = _mm512_setzero_ps(), one = _mm512_set1_ps(1), q = _mm512_set1_ps(b->q);
	const __m512 four = _mm512_set1_ps(4), inverse = _mm512_set1_ps(s->inverse);
	const __m512i step = _mm512_set1_epi32(1);
	const __m512 over = _mm512_sub_ps(lane, _mm512_set1_ps(b->z));
	__m512 x = _mm512_add_ps(_mm512_set1_ps(b->r0), _mm512_mul_ps(lane, _mm512_set1_ps(b->g0)));
	__m512 y = _mm512_add_ps(_mm512_set1_ps(b->r1), _mm512_mul_ps(lane, _mm512_set1_ps(b->g1)));
	__m512 sum = zero, above, w;
	__m512i dr, at;
	int32_t first = first_row(b, 0);
	const float *v = rows->value + FRONT + b->row + first;
	const float *r = rows->rise + FRONT + b->row + first;
	__m512 v0 = _mm512_loadu_ps(v), v1 = _mm512_loadu_ps(v + 16), v2 = zero, v3 = zero;
	__m512 r0 = _mm512_loadu_ps(r), r1 = _mm512_loadu_ps(r + 16), r2 = zero, r3 = zero;
	__mmask16 valid = (__mmask16)((1U << count) - 1);

	if (wide) {
		v2 = _mm512_loadu_ps(v + 32);
		v3 = _mm512_loadu_ps(v + 48);
		r2 = _mm512_loadu_ps(r + 32);
		r3 = _mm512_loadu_ps(r + 48);
	}
	x = _mm512_max_ps(_mm512_min_ps(x, y), _mm512_set1_ps(-4));
	dr = _mm512_sub_epi32(_mm512_cvttps_epi32(_mm512_add_ps(x, four)), _mm512_set1_epi32(4));
	at = _mm512_sub_epi32(dr, _mm512_set1_epi32(first));
	for (int32_t i = 0; i < b->rounds; i++) {
		above = _mm512_sub_ps(over, _mm512_mul_ps(_mm512_cvtepi32_ps(dr), q));
		if (joseph) {
			x = _mm512_abs_ps(_mm512_add_ps(above, _mm512_set1_ps(0.5F)));
			w = _mm512_max_ps(_mm512_sub_ps(one, x), zero);
		} else {
			y = _mm512_mul_ps(pick(r0, r1, r2, r3, at, wide), inverse);
			x = _mm512_mul_ps(above, y);
			y = _mm512_min_ps(_mm512_max_ps(_mm512_add_ps(x, y), zero), one);
			x = _mm512_min_ps(_mm512_max_ps(x, zero), one);
			w = _mm512_abs_ps(_mm512_sub_ps(y, x));
		}
		sum = _mm512_add_ps(sum, _mm512_mul_ps(w, pick(v0, v1, v2, v3, at, wide)));
		dr = _mm512_add_epi32(dr, step);
		at = _mm512_add_epi32(at, step);
	}
	sum = _mm512_mul_ps(sum, _mm512_set1_ps(s->weight));
	_mm512_mask_storeu_ps(f, valid, _mm512_add_ps(_mm512_maskz_loadu_ps(valid, f), sum));
}

/* False if more rows than 64 are in reach. */
__attribute__((target("avx512f"))) static bool spread_wide(float *restrict f, int32_t count,
	const struct block *b, const struct piece *s, const struct rows *rows)
{
	int32_t reach = first_row(b, CT_PACKET - 1) - first_row(b, 0) + b->rounds;

	if (reach > 2 * TABLE)
		return false;
	if (s->joseph)
		spread_table(f, count, b, s, rows, true, reach > TABLE);
	else if (reach > TABLE)
		spread_table(f, count, b, s, rows, false, true);
	else
		spread_table(f, count, b, s, rows, false, false);
	return true;
}
#endif

static CT_INLINE void spread_block(float *restrict f, const struct piece *s,
	const struct rows *rows, int32_t k, int32_t count, bool wide)
{
	float acc[CT_PACKET] = {0};
	struct block b;

	if (!block_of(&b, s, rows, k))
		return;
#if WIDE
	if (wide && spread_wide(f, count, &b, s, rows))
		return;
#endif
	(void)wide;
	spread_plain(acc, &b, s, rows);
	for (int32_t l = 0; l < count; l++)
		f[l] += acc[l] * s->weight;
}

void ct_packet_spread(float *restrict vol, const struct ct_pieces *restrict s,
	const struct ct_heights *h, size_t row, size_t count, const float *restrict value)
{
	bool down = h->qa + h->qb * (s->n ? s->x0[0] : 0) < 0, wide = false;
	double at = (double)(down ? row + count - 1 : row), margin = h->joseph ? 0.5 : 0, top;
	struct rows rows = {.n = (int32_t)count};

#if WIDE
	wide = __builtin_cpu_supports("avx512f");
#endif
	for (size_t i = 0; i < count; i++) {
		size_t from = down ? count - 1 - i : i;

		rows.value[FRONT + i] = value[from];
		rows.rise[FRONT + i] = inverse_of(h->s0 + (double)(row + from) * h->s1);
	}
	for (size_t m = 0; m < s->n; m++) {
		double q0 = h->qa + h->qb * s->x0[m], q1 = h->qa + h->qb * s->x1[m];
		struct piece p = {.p0 = h->pa + h->pb * s->x0[m] + at * q0,
			.p1 = h->pa + h->pb * s->x1[m] + at * q1,
			.q0 = down ? -q0 : q0,
			.q1 = down ? -q1 : q1,
			.inverse = s->inverse[m],
			.weight = s->weight[m],
			.joseph = h->joseph};
		int32_t k, last;

		p.i0 = 1 / p.q0;
		p.i1 = 1 / p.q1;
		k = (int32_t)ct_most(limited(ct_least(p.p0, p.p1) - margin, h->n), 0);
		top = ct_most(p.p0 + (double)count * p.q0, p.p1 + (double)count * p.q1) + margin;
		last = (int32_t)(limited(top, h->n) + 1024) - 1024;
		last = last < h->n ? last : h->n - 1;
		for (; k <= last; k += CT_PACKET)
			spread_block(vol + s->at[m] + k, &p, &rows, k,
				last - k < CT_PACKET ? last - k + 1 : CT_PACKET, wide);
	}
}
