/* rasterise.c: see rasterise.h. Vectors of GCC and clang, so that every processor runs wide code
 * and the same operations: no fused multiply-add, the same bytes everywhere.
 *
 * The exponent is a quadratic in the row, so e goes from row to row by two multiplications:
 *   e *= step,   step *= turn,   turn = exp(-2 (kx slope^2 + ky))
 * in up to PANEL vectors of columns at once, which hides the latency of the chain. That holds its
 * precision over CT_RASTERISE_ROWS rows as long as nothing in the box around the ellipse is below
 * e^-60: for correlations up to 0.8. Beyond, every pixel has its exponential. */
#include "config.h"
#include "gs/rasterise.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) &&                             \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define CLONES
#endif
/* vectors are passed to inlined functions only, so no call depends on how the ABI passes them */
#define INLINE static inline __attribute__((always_inline))

enum { L = CT_RASTERISE_LANES, PANEL = 4, AHEAD = 16 };

typedef float vf __attribute__((vector_size(4 * CT_RASTERISE_LANES)));
typedef int32_t vi __attribute__((vector_size(4 * CT_RASTERISE_LANES)));
typedef uint32_t vu __attribute__((vector_size(4 * CT_RASTERISE_LANES)));

INLINE vf ramp(void)
{
	return (vf){0, 1, 2, 3, 4, 5, 6, 7};
}

INLINE vf where(vi mask, vf x)
{
	return (vf)(mask & (vi)x);
}

INLINE vf pick(vi mask, vf yes, vf no)
{
	return (vf)((mask & (vi)yes) | (~mask & (vi)no));
}

INLINE vf at_most(vf x, float high)
{
	return pick(x > high, (vf){0} + high, x);
}

INLINE vf at_least(vf x, float low)
{
	return pick(x < low, (vf){0} + low, x);
}

INLINE vf load(const float *p)
{
	vf v;

	memcpy(&v, p, sizeof v);
	return v;
}

size_t ct_rasterise_pitch(size_t w)
{
	return (w + L - 1) / L * L + L;
}

void ct_rasterise_prepare(struct ct_pixel_gaussian *d)
{
	double s = (double)d->slope, kx = (double)d->kx, ky = (double)d->ky;

	d->turn = (float)exp(-2 * (kx * s * s + ky));
	d->hop = (float)exp(fmax(-80, fmin(80, 2 * L * kx * s)));
	d->lean = (float)(s * sqrt((double)d->cut * kx / (ky * (ky + kx * s * s))));
}

/* e^p for |p| <= 80, relative error 2e-7; beyond, any number: lanes past the end of a row, which
 * have e = 0 and are masked. Adding 1.5 2^23 rounds p/ln 2 to n, whose low bits are
 * then those of the sum; Taylor on |r| <= ln 2 / 2. */
INLINE vf exp_of(vf p)
{
	const vf t = p * 1.44269504f + 12582912.0f, n = t - 12582912.0f;
	vf r, y;

	r = p - n * 0.693359375f + n * 2.12194440e-4f; /* ln 2 in two parts */
	y = r * (1.0f / 720.0f) + 1.0f / 120.0f;
	y = y * r + 1.0f / 24.0f;
	y = y * r + 1.0f / 6.0f;
	y = y * r + 0.5f;
	y = y * r + 1.0f;
	y = y * r + 1.0f;
	return (vf)((vu)y + ((vu)t << 23));
}

INLINE bool gentle(const struct ct_pixel_gaussian *d)
{
	return d->slope * d->slope * d->kx <= 0.64f / 0.36f * d->ky;
}

/* Up to CT_RASTERISE_ROWS rows of dabs, many at a time, so that their boxes are found in vectors
 * and well before they are needed: row r of the image, `count` of them, y of the first, and the
 * columns [lo, hi] around the ellipse there, relative to the centre's column; hi < lo: none. */
enum { BATCH = 8 * L };

struct batch {
	size_t n;
	const struct ct_pixel_gaussian *d[BATCH];
	int32_t r[BATCH], count[BATCH], lo[BATCH], hi[BATCH], col[BATCH];
	float y[BATCH], fx[BATCH], kx[BATCH], ky[BATCH], slope[BATCH], cut[BATCH], lean[BATCH];
};

INLINE void push(struct batch *o, int32_t r, int32_t count, const struct ct_pixel_gaussian *d)
{
	size_t i = o->n++;

	o->d[i] = d;
	o->r[i] = r;
	o->count[i] = count;
	o->col[i] = d->col;
	o->y[i] = (float)(r - d->row) - d->fy;
	o->fx[i] = d->fx;
	o->kx[i] = d->kx;
	o->ky[i] = d->ky;
	o->slope[i] = d->slope;
	o->cut[i] = d->cut;
	o->lean[i] = d->lean;
}

INLINE vf root(vf x)
{
	float v[L];

	memcpy(v, &x, sizeof v);
	for (int l = 0; l < L; l++)
		v[l] = sqrtf(v[l]);
	return load(v);
}

INLINE vf within(vf x, vf low, vf high)
{
	x = pick(x < low, low, x);
	return pick(x > high, high, x);
}

INLINE vf floor_of(vf x)
{
	vf r = __builtin_convertvector(__builtin_convertvector(x, vi), vf);

	return r - where(r > x, (vf){0} + 1.0f);
}

INLINE vi load_int(const int32_t *p)
{
	vi v;

	memcpy(&v, p, sizeof v);
	return v;
}

/* L of them from i on: the ellipse reaches x = slope y -+ sqrt((cut - ky y^2) / kx), the leftmost
 * at y = -lean, the rightmost at y = lean, or as near as its rows go. */
INLINE void measure(struct batch *o, size_t i, size_t w)
{
	const vf zero = {0}, kx = load(o->kx + i), ky = load(o->ky + i), y = load(o->y + i);
	const vf slope = load(o->slope + i), cut = load(o->cut + i), lean = load(o->lean + i);
	const vf col = __builtin_convertvector(load_int(o->col + i), vf), fx = load(o->fx + i);
	const vf last = y + __builtin_convertvector(load_int(o->count + i) - 1, vf);
	const vf ya = within(-lean, y, last), yb = within(lean, y, last);
	const vf ra = cut - ky * ya * ya, rb = cut - ky * yb * yb;
	const vf left = zero - col, right = (float)((int32_t)w - 1) - col;
	const float hair = 1e-3f;
	vf a = fx + slope * ya - root(where(ra > zero, ra) / kx) - hair;
	vf b = fx + slope * yb + root(where(rb > zero, rb) / kx) + hair;
	vi lo, hi;

	a = -floor_of(-within(a, left, right + 1));
	b = floor_of(within(b, left - 1, right));
	lo = __builtin_convertvector(a, vi);
	hi = __builtin_convertvector(b, vi);
	memcpy(o->lo + i, &lo, sizeof lo);
	memcpy(o->hi + i, &hi, sizeof hi);
}

INLINE void close_batch(struct batch *o, size_t w)
{
	for (size_t i = o->n; i % L; i++) { /* lanes that do not count */
		o->y[i] = o->fx[i] = o->slope[i] = o->cut[i] = o->lean[i] = 0;
		o->kx[i] = o->ky[i] = 1;
		o->col[i] = o->count[i] = 0;
	}
	for (size_t i = 0; i < o->n; i += L)
		measure(o, i, w);
}

struct piece {
	float y;
	int32_t lo, hi;
};

/* Between the last column and the next, from the centre. */
INLINE float beyond(const struct piece *o, const struct ct_pixel_gaussian *d)
{
	return (float)o->hi + 0.5f - d->fx;
}

struct walk {
	vf e[PANEL], step[PANEL];
};

/* Columns from c. Those outside the piece are zero and stay zero. */
INLINE void walk_from(
	struct walk *k, int nb, int32_t c, const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const float y = o->y, high = beyond(o, d);
	const float kxs = d->kx * d->slope, fall = kxs * d->slope + d->ky * (2 * y + 1);
	const float sy = d->slope * y, kyy = d->ky * y * y;

#pragma GCC unroll 4
	for (int b = 0; b < nb; b++) {
		const vf at = ramp() + ((float)(c + b * L) - d->fx);
		const vf x = at_most(at, high) - sy;

		k->e[b] = where(at < high, exp_of(at_least(-(d->kx * x * x + kyy), -80)));
		k->step[b] = b ? k->step[b - 1] * d->hop : exp_of(2 * kxs * x - fall);
	}
}

INLINE void add_panel(float *p, size_t pitch, int nb, int32_t c, int32_t count,
	const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const vf zero = {0}, turn = zero + d->turn, least = zero + d->least, amp = zero + d->amp;
	struct walk k;

	walk_from(&k, nb, c, o, d);
	for (int32_t m = 0; m < count; m++, p += pitch)
#pragma GCC unroll 4
		for (int b = 0; b < nb; b++) {
			vf v = load(p + b * L) + amp * where(k.e[b] >= least, k.e[b]);

			memcpy(p + b * L, &v, sizeof v);
			k.e[b] *= k.step[b];
			k.step[b] *= turn;
		}
}

INLINE void add_gentle(float *p, size_t pitch, int32_t count, const struct piece *o,
	const struct ct_pixel_gaussian *d)
{
	for (int32_t c = o->lo; c <= o->hi; c += PANEL * L) {
		float *at = p + (d->col + c);
		int32_t left = o->hi - c;

		if (left < L)
			add_panel(at, pitch, 1, c, count, o, d);
		else if (left < 2 * L)
			add_panel(at, pitch, 2, c, count, o, d);
		else if (left < 3 * L)
			add_panel(at, pitch, 3, c, count, o, d);
		else
			add_panel(at, pitch, 4, c, count, o, d);
	}
}

/* Long, thin and oblique: rows one by one. */
INLINE void rows_of(
	struct batch *o, size_t w, int32_t r, int32_t count, const struct ct_pixel_gaussian *d)
{
	o->n = 0;
	for (int32_t m = 0; m < count; m++)
		push(o, r + m, 1, d);
	close_batch(o, w);
}

/* e of the columns from c of row m of the batch. */
INLINE vf row_of(
	vf *x, const struct batch *o, size_t m, int32_t c, const struct ct_pixel_gaussian *d)
{
	const struct piece p = {o->y[m], o->lo[m], o->hi[m]};
	const vf at = ramp() + ((float)c - d->fx);
	vf e;

	*x = at - d->slope * p.y;
	e = exp_of(at_least(-(d->kx * *x * *x + d->ky * p.y * p.y), -80));
	return where((e >= d->least) & (at < beyond(&p, d)), e);
}

INLINE void add_steep(float *p, size_t pitch, size_t w, int32_t r, int32_t count,
	const struct ct_pixel_gaussian *d)
{
	struct batch o;

	rows_of(&o, w, r, count, d);
	for (size_t m = 0; m < o.n; m++, p += pitch)
		for (int32_t c = o.lo[m]; c <= o.hi[m]; c += L) {
			vf x, v = d->amp * row_of(&x, &o, m, c, d);

			v += load(p + (d->col + c));
			memcpy(p + (d->col + c), &v, sizeof v);
		}
}

INLINE int32_t least_of(int32_t a, int32_t b)
{
	return a < b ? a : b;
}

INLINE void add_batch(float *img, size_t pitch, size_t w, size_t r0, struct batch *o)
{
	close_batch(o, w);
	for (size_t i = 0; i < o->n; i++) {
		const struct piece p = {o->y[i], o->lo[i], o->hi[i]};
		float *at = img + ((size_t)o->r[i] - r0) * pitch;

		if (gentle(o->d[i]))
			add_gentle(at, pitch, o->count[i], &p, o->d[i]);
		else
			add_steep(at, pitch, w, o->r[i], o->count[i], o->d[i]);
	}
	o->n = 0;
}

CLONES
void ct_rasterise_add(float *img, size_t pitch, size_t w, size_t r0, size_t r1, size_t n,
	const uint32_t *item, const struct ct_pixel_gaussian *dab)
{
	struct batch o;

	o.n = 0;
	for (size_t i = 0; i < n; i++) {
		const struct ct_pixel_gaussian *d = dab + (item ? item[i] : i);
		int32_t r = d->first > (int32_t)r0 ? d->first : (int32_t)r0;
		int32_t end = least_of(d->end, (int32_t)r1);

		while (r < end) {
			int32_t next =
				least_of(end, (r / CT_RASTERISE_ROWS + 1) * CT_RASTERISE_ROWS);

			push(&o, r, next - r, d);
			r = next;
			if (o.n == BATCH)
				add_batch(img, pitch, w, r0, &o);
		}
		if (item && i + AHEAD < n)
			__builtin_prefetch(dab + item[i + AHEAD]);
	}
	add_batch(img, pitch, w, r0, &o);
}

/* Sums over the lanes of six vectors: out[i] = sum of acc[i], by a tree. */
INLINE void across(float out[L], const vf acc[6])
{
	const vf zero = {0};
	vf v[L] = {acc[0], acc[1], acc[2], acc[3], acc[4], acc[5], zero, zero};

#pragma GCC unroll 4
	for (int k = 0; k < 4; k++)
		v[k] = __builtin_shufflevector(v[k], v[k + 4], 0, 1, 2, 3, 8, 9, 10, 11) +
		       __builtin_shufflevector(v[k], v[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
#pragma GCC unroll 2
	for (int k = 0; k < 2; k++)
		v[k] = __builtin_shufflevector(v[k], v[k + 2], 0, 1, 8, 9, 4, 5, 12, 13) +
		       __builtin_shufflevector(v[k], v[k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
	v[0] = __builtin_shufflevector(v[0], v[1], 0, 8, 2, 10, 4, 12, 6, 14) +
	       __builtin_shufflevector(v[0], v[1], 1, 9, 3, 11, 5, 13, 7, 15);
	memcpy(out, &v[0], sizeof v[0]);
}

/* acc += sums of v {1, x, x^2, j, j x, j (j + 1) / 2} with x from the centre's column and j = count
 * to 1 from the first row to the last: running sums of running sums. */
INLINE void sums_panel(vf acc[6], const float *p, size_t pitch, int nb, int32_t c, int32_t count,
	const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const vf zero = {0}, turn = zero + d->turn, least = zero + d->least;
	vf s[PANEL] = {{0}}, sj[PANEL] = {{0}}, sjj[PANEL] = {{0}};
	struct walk k;

	walk_from(&k, nb, c, o, d);
	for (int32_t m = 0; m < count; m++, p += pitch)
#pragma GCC unroll 4
		for (int b = 0; b < nb; b++) {
			s[b] += load(p + b * L) * where(k.e[b] >= least, k.e[b]);
			sj[b] += s[b];
			sjj[b] += sj[b];
			k.e[b] *= k.step[b];
			k.step[b] *= turn;
		}
#pragma GCC unroll 4
	for (int b = 0; b < nb; b++) {
		const vf x = ramp() + ((float)(c + b * L) - d->fx), sx = s[b] * x;

		acc[0] += s[b];
		acc[1] += sx;
		acc[2] += sx * x;
		acc[3] += sj[b];
		acc[4] += sj[b] * x;
		acc[5] += sjj[b];
	}
}

typedef double vd __attribute__((vector_size(8 * CT_RASTERISE_LANES)));

/* Sums of the pieces of a batch, raw: as sums_panel has them; done: by x and y. */
struct tally {
	float raw[6][BATCH], done[6][BATCH];
	size_t of[BATCH]; /* the dab that a piece belongs to */
};

INLINE vd widen(const float *p)
{
	return __builtin_convertvector(load(p), vd);
}

/* L pieces from i on: y = past - j with y of the row after the last, and x less slope y. */
INLINE void moments(vd s[6], const struct tally *t, const struct batch *o, size_t i)
{
	const vd s0 = widen(t->raw[0] + i), u = widen(t->raw[1] + i), uu = widen(t->raw[2] + i);
	const vd j = widen(t->raw[3] + i), slope = widen(o->slope + i);
	const vd past = widen(o->y + i) + __builtin_convertvector(load_int(o->count + i), vd);
	const vd y = past * s0 - j, uy = past * u - widen(t->raw[4] + i);
	const vd yy = past * past * s0 - 2 * past * j + (2 * widen(t->raw[5] + i) - j);

	s[0] = s0 + widen(t->done[0] + i);
	s[1] = u - slope * y + widen(t->done[1] + i);
	s[2] = y + widen(t->done[2] + i);
	s[3] = uu - slope * (2 * uy - slope * yy) + widen(t->done[3] + i);
	s[4] = uy - slope * yy + widen(t->done[4] + i);
	s[5] = yy + widen(t->done[5] + i);
}

INLINE void sums_gentle(float a[L], const float *p, size_t pitch, int32_t count,
	const struct piece *o, const struct ct_pixel_gaussian *d)
{
	vf acc[6] = {{0}};

	for (int32_t c = o->lo; c <= o->hi; c += PANEL * L) {
		const float *at = p + (d->col + c);
		int32_t left = o->hi - c;

		if (left < L)
			sums_panel(acc, at, pitch, 1, c, count, o, d);
		else if (left < 2 * L)
			sums_panel(acc, at, pitch, 2, c, count, o, d);
		else if (left < 3 * L)
			sums_panel(acc, at, pitch, 3, c, count, o, d);
		else
			sums_panel(acc, at, pitch, 4, c, count, o, d);
	}
	across(a, acc);
}

INLINE void sums_steep(float a[L], const float *p, size_t pitch, size_t w, int32_t r, int32_t count,
	const struct ct_pixel_gaussian *d)
{
	vf acc[6] = {{0}};
	struct batch o;

	rows_of(&o, w, r, count, d);
	for (size_t m = 0; m < o.n; m++, p += pitch)
		for (int32_t c = o.lo[m]; c <= o.hi[m]; c += L) {
			const float y = o.y[m];
			vf x, v = row_of(&x, &o, m, c, d) * load(p + (d->col + c));

			acc[0] += v;
			acc[1] += v * x;
			acc[2] += v * y;
			acc[3] += v * x * x;
			acc[4] += v * x * y;
			acc[5] += v * y * y;
		}
	across(a, acc);
}

/* out[k] of each piece's dab += its sums. */
INLINE void sums_batch(double *out, size_t stride, struct tally *t, const float *g, size_t pitch,
	size_t w, struct batch *o)
{
	close_batch(o, w);
	for (size_t i = 0; i < o->n; i++) {
		const struct piece p = {o->y[i], o->lo[i], o->hi[i]};
		const float *at = g + (size_t)o->r[i] * pitch;
		const bool walks = gentle(o->d[i]);
		float a[L];

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
	for (size_t i = 0; i < o->n; i += L) {
		vd s[6];

		moments(s, t, o, i);
		for (size_t l = 0; l < L && i + l < o->n; l++)
			for (size_t k = 0; k < 6; k++)
				out[k * stride + t->of[i + l]] += s[k][l];
	}
	o->n = 0;
}

CLONES
void ct_rasterise_sums(double *out, size_t stride, const float *g, size_t pitch, size_t w, size_t n,
	const struct ct_pixel_gaussian *dab)
{
	struct tally t;
	struct batch o;

	o.n = 0;
	for (size_t i = 0; i < n; i++) {
		for (size_t k = 0; k < 6; k++)
			out[k * stride + i] = 0;
		for (int32_t r = dab[i].first; r < dab[i].end;) {
			int32_t next = least_of(
				dab[i].end, (r / CT_RASTERISE_ROWS + 1) * CT_RASTERISE_ROWS);

			t.of[o.n] = i;
			push(&o, r, next - r, dab + i);
			r = next;
			if (o.n == BATCH)
				sums_batch(out, stride, &t, g, pitch, w, &o);
		}
	}
	sums_batch(out, stride, &t, g, pitch, w, &o);
}
