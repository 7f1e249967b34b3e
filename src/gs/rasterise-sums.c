/* rasterise-sums.c: the sums over pixels that gradients need; see rasterise.h and
 * rasterise-batch.h. Each is added in SPAN lanes, of columns SPAN apart, and then by a tree. */
#include "config.h"
#include "gs/rasterise-batch.h"

enum { SPAN = 16, PARTS = SPAN / L };

typedef float four __attribute__((vector_size(16)));

struct sums {
	ct_f32 of[6][PARTS];
};

/* Four sums of the 16 lanes, 4 apart. */
CT_INLINE four fold(const ct_f32 part[PARTS])
{
	four q[4];

	memcpy(q, part, sizeof q);
	return (q[0] + q[2]) + (q[1] + q[3]);
}

/* a0 + a2, a1 + a3, b0 + b2, b1 + b3, and then neighbours. */
CT_INLINE four halve(four a, four b)
{
	return __builtin_shufflevector(a, b, 0, 1, 4, 5) +
	       __builtin_shufflevector(a, b, 2, 3, 6, 7);
}

CT_INLINE four pairs(four a, four b)
{
	return __builtin_shufflevector(a, b, 0, 2, 4, 6) +
	       __builtin_shufflevector(a, b, 1, 3, 5, 7);
}

/* out[i] = sum of the lanes of s->of[i]; out[6] and out[7] are no sums. */
CT_INLINE void across(float out[8], const struct sums *s)
{
	const four a = halve(fold(s->of[0]), fold(s->of[1]));
	const four b = halve(fold(s->of[2]), fold(s->of[3]));
	const four c = halve(fold(s->of[4]), fold(s->of[5]));
	const four low = pairs(a, b), high = pairs(c, c);

	memcpy(out, &low, sizeof low);
	memcpy(out + 4, &high, sizeof high);
}

/* acc += sums of v {1, x, x^2, j, j x, j (j + 1) / 2} with x from the centre's column and j = count
 * to 1 from the first row to the last: running sums of running sums. */
CT_INLINE void sums_panel(struct sums *acc, const float *p, size_t pitch, int nb, int32_t c,
	int32_t count, const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const ct_f32 bend = ct_f32_set(d->bend), least = ct_f32_set(d->least);
	ct_f32 s[PANEL] = {{0}}, sj[PANEL] = {{0}}, sjj[PANEL] = {{0}};
	struct walk k;

	walk_from(&k, nb, c, o, d);
	for (int32_t m = 0; m < count; m++, p += pitch)
#pragma GCC unroll 4
		for (int b = 0; b < nb; b++) {
			s[b] += ct_f32_load(p + b * L) * where(k.e[b] >= least, k.e[b]);
			sj[b] += s[b];
			sjj[b] += sj[b];
			k.e[b] *= k.step[b];
			k.step[b] *= bend;
		}
#pragma GCC unroll 4
	for (int b = 0; b < nb; b++) {
		const ct_f32 x = columns(c + b * L, d), sx = s[b] * x;

		acc->of[0][b % PARTS] += s[b];
		acc->of[1][b % PARTS] += sx;
		acc->of[2][b % PARTS] += sx * x;
		acc->of[3][b % PARTS] += sj[b];
		acc->of[4][b % PARTS] += sj[b] * x;
		acc->of[5][b % PARTS] += sjj[b];
	}
}

/* Sums of the pieces of a batch, raw: as sums_panel has them; done: by x and y. */
struct tally {
	float raw[6][BATCH], done[6][BATCH];
	size_t of[BATCH]; /* the Gaussian that a piece belongs to */
};

CT_INLINE ct_f64 widen_int(const int32_t *p)
{
	ct_i32h v;

	memcpy(&v, p, sizeof v);
	return __builtin_convertvector(v, ct_f64);
}

/* CT_F64_LANES pieces from i on: y = past - j with y of the row after the last, and x less slope
 * y. */
CT_INLINE void moments(ct_f64 s[6], const struct tally *t, const struct batch *o, size_t i)
{
	const ct_f64 s0 = ct_f64_widen(t->raw[0] + i), u = ct_f64_widen(t->raw[1] + i);
	const ct_f64 uu = ct_f64_widen(t->raw[2] + i), j = ct_f64_widen(t->raw[3] + i);
	const ct_f64 slope = ct_f64_widen(o->slope + i);
	const ct_f64 past = ct_f64_widen(o->y + i) + widen_int(o->count + i);
	const ct_f64 y = past * s0 - j, uy = past * u - ct_f64_widen(t->raw[4] + i);
	const ct_f64 yy = past * past * s0 - 2 * past * j + (2 * ct_f64_widen(t->raw[5] + i) - j);

	s[0] = s0 + ct_f64_widen(t->done[0] + i);
	s[1] = u - slope * y + ct_f64_widen(t->done[1] + i);
	s[2] = y + ct_f64_widen(t->done[2] + i);
	s[3] = uu - slope * (2 * uy - slope * yy) + ct_f64_widen(t->done[3] + i);
	s[4] = uy - slope * yy + ct_f64_widen(t->done[4] + i);
	s[5] = yy + ct_f64_widen(t->done[5] + i);
}

CT_INLINE void sums_gentle(float a[8], const float *p, size_t pitch, int32_t count,
	const struct piece *o, const struct ct_pixel_gaussian *d)
{
	struct sums acc = {{{{0}}}};

	for (int32_t c = o->lo; c <= o->hi; c += PANEL * L) {
		const float *at = p + (d->col + c);
		int32_t left = o->hi - c;

		if (left < L)
			sums_panel(&acc, at, pitch, 1, c, count, o, d);
		else if (left < 2 * L)
			sums_panel(&acc, at, pitch, 2, c, count, o, d);
		else if (left < 3 * L)
			sums_panel(&acc, at, pitch, 3, c, count, o, d);
		else
			sums_panel(&acc, at, pitch, 4, c, count, o, d);
	}
	across(a, &acc);
}

CT_INLINE void sums_steep(float a[8], const float *p, size_t pitch, size_t w, int32_t r,
	int32_t count, const struct ct_pixel_gaussian *d)
{
	struct sums acc = {{{{0}}}};
	struct batch o;

	rows_of(&o, w, r, count, d);
	for (size_t m = 0; m < o.n; m++, p += pitch)
		for (int32_t c = o.lo[m]; c <= o.hi[m]; c += L) {
			const size_t part = (size_t)(c - o.lo[m]) / L % PARTS;
			const float y = o.y[m];
			ct_f32 x, v = row_of(&x, &o, m, c, d) * ct_f32_load(p + (d->col + c));

			acc.of[0][part] += v;
			acc.of[1][part] += v * x;
			acc.of[2][part] += v * y;
			acc.of[3][part] += v * x * x;
			acc.of[4][part] += v * x * y;
			acc.of[5][part] += v * y * y;
		}
	across(a, &acc);
}

/* out[k] of each piece's Gaussian += its sums. */
CT_INLINE void sums_batch(double *out, size_t stride, struct tally *t, const float *g, size_t skip,
	size_t pitch, size_t w, struct batch *o)
{
	close_batch(o, w);
	for (size_t i = 0; i < o->n; i++) {
		const struct piece p = {o->y[i], o->lo[i], o->hi[i]};
		const float *at = g + t->of[i] * skip + (size_t)o->r[i] * pitch;
		const bool walks = gentle(o->d[i]);
		float a[8];

		if (walks)
			sums_gentle(a, at, pitch, o->count[i], &p, o->d[i]);
		else
			sums_steep(a, at, pitch, w, o->r[i], o->count[i], o->d[i]);
		for (size_t k = 0; k < 6; k++) {
			t->raw[k][i] = walks ? a[k] : 0;
			t->done[k][i] = walks ? 0 : a[k];
		}
	}
	for (size_t i = o->n; i % L; i++) /* lanes that do not count */
		for (size_t k = 0; k < 6; k++)
			t->raw[k][i] = t->done[k][i] = 0;
	for (size_t i = 0; i < o->n; i += CT_F64_LANES) {
		ct_f64 s[6];

		moments(s, t, o, i);
		for (size_t l = 0; l < CT_F64_LANES && i + l < o->n; l++)
			for (size_t k = 0; k < 6; k++)
				out[k * stride + t->of[i + l]] += s[k][l];
	}
	o->n = 0;
}

void CT_SIMD_HERE(ct_rasterise_sums)(double *out, size_t stride, const float *g, size_t skip,
	size_t pitch, size_t w, size_t n, const struct ct_pixel_gaussian *all)
{
	struct tally t;
	struct batch o;

	o.n = 0;
	for (size_t i = 0; i < n; i++) {
		for (size_t k = 0; k < 6; k++)
			out[k * stride + i] = 0;
		for (int32_t r = all[i].first; r < all[i].end;) {
			int32_t next = next_block(r, all[i].end);

			t.of[o.n] = i;
			push(&o, r, next - r, all + i);
			r = next;
			if (o.n == BATCH)
				sums_batch(out, stride, &t, g, skip, pitch, w, &o);
		}
	}
	sums_batch(out, stride, &t, g, skip, pitch, w, &o);
}
