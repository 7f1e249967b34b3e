/* dab.c: see dab.h. Vectors of GCC and clang, so that every processor runs wide code and the same
 * operations: no fused multiply-add, the same bytes everywhere.
 *
 * The exponent is a quadratic in the row, so e goes from row to row by two multiplications:
 *   e *= step,   step *= turn,   turn = exp(-2 (kx slope^2 + ky))
 * in up to PANEL vectors of columns at once, which hides the latency of the chain. That holds its
 * precision over CT_DAB_ROWS rows as long as nothing in the box around the ellipse is below e^-60:
 * for correlations up to 0.8. Beyond, every pixel has its exponential. */
#include "config.h"
#include "gs/dab.h"

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

enum { L = CT_DAB_LANES, PANEL = 4 };

typedef float vf __attribute__((vector_size(4 * CT_DAB_LANES)));
typedef int32_t vi __attribute__((vector_size(4 * CT_DAB_LANES)));

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

INLINE vf load(const float *p)
{
	vf v;

	memcpy(&v, p, sizeof v);
	return v;
}

size_t ct_dab_pitch(size_t w)
{
	return (w + L - 1) / L * L + L;
}

void ct_dab_close(struct ct_dab *d)
{
	double s = (double)d->slope, kx = (double)d->kx, ky = (double)d->ky;

	d->turn = (float)exp(-2 * (kx * s * s + ky));
	d->lean = (float)(s * sqrt((double)d->cut * kx / (ky * (ky + kx * s * s))));
}

/* e^p, relative error 2e-7, p within +-80. Rounds p/ln 2 by adding and taking away 1.5 2^23, then
 * Taylor on |r| <= ln 2 / 2. */
INLINE vf exp_of(vf x)
{
	const vf p = at_most(pick(x < -80, (vf){0} - 80, x), 80),
		 n = p * 1.44269504f + 12582912.0f - 12582912.0f;
	vf r, y;

	r = p - n * 0.693359375f + n * 2.12194440e-4f; /* ln 2 in two parts */
	y = r * (1.0f / 720.0f) + 1.0f / 120.0f;
	y = y * r + 1.0f / 24.0f;
	y = y * r + 1.0f / 6.0f;
	y = y * r + 0.5f;
	y = y * r + 1.0f;
	y = y * r + 1.0f;
	return y * (vf)((__builtin_convertvector(n, vi) + 127) << 23);
}

INLINE bool gentle(const struct ct_dab *d)
{
	return d->slope * d->slope * d->kx <= 0.64f / 0.36f * d->ky;
}

INLINE float within(float x, float low, float high)
{
	return x < low ? low : x > high ? high : x;
}

/* x of one side of the ellipse at y, from the centre's column. */
INLINE float side_of(const struct ct_dab *d, float y, float sign)
{
	float rest = d->cut - d->ky * y * y;

	return d->slope * y + sign * sqrtf((rest > 0 ? rest : 0) / d->kx);
}

/* Up to CT_DAB_ROWS rows of a dab: y of the first, and the columns [lo, hi] around its ellipse
 * there, relative to d->col; hi < lo: none. */
struct piece {
	float y;
	int32_t lo, hi;
};

INLINE void piece_of(struct piece *o, size_t w, int32_t r, int32_t count, const struct ct_dab *d)
{
	const float left = (float)-d->col, right = (float)((int32_t)w - 1 - d->col), hair = 1e-3f;
	const float y = (float)(r - d->row) - d->fy, last = y + (float)(count - 1);
	const float a = d->fx + side_of(d, within(-d->lean, y, last), -1) - hair;
	const float b = d->fx + side_of(d, within(d->lean, y, last), 1) + hair;

	o->y = y;
	o->lo = (int32_t)ceilf(within(a, left, right + 1));
	o->hi = (int32_t)floorf(within(b, left - 1, right));
}

/* Between the last column and the next, from the centre. */
INLINE float beyond(const struct piece *o, const struct ct_dab *d)
{
	return (float)o->hi + 0.5f - d->fx;
}

struct walk {
	vf e[PANEL], step[PANEL];
};

/* Columns from c. Those outside the piece are zero and stay zero. */
INLINE void walk_from(
	struct walk *k, int nb, int32_t c, const struct piece *o, const struct ct_dab *d)
{
	const float y = o->y, high = beyond(o, d);
	const float kxs = d->kx * d->slope, fall = kxs * d->slope + d->ky * (2 * y + 1);
	const float sy = d->slope * y, kyy = d->ky * y * y;

#pragma GCC unroll 4
	for (int b = 0; b < nb; b++) {
		const vf at = ramp() + ((float)(c + b * L) - d->fx);
		const vf x = at_most(at, high) - sy;

		k->e[b] = where(at < high, exp_of(-(d->kx * x * x + kyy)));
		k->step[b] = exp_of(2 * kxs * x - fall);
	}
}

INLINE void add_panel(float *p, size_t pitch, int nb, int32_t c, int32_t count,
	const struct piece *o, const struct ct_dab *d)
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

INLINE void add_gentle(
	float *p, size_t pitch, int32_t count, const struct piece *o, const struct ct_dab *d)
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

/* Long, thin and oblique. */
INLINE void add_steep(
	float *p, size_t pitch, size_t w, int32_t r, int32_t count, const struct ct_dab *d)
{
	for (int32_t m = 0; m < count; m++, p += pitch) {
		struct piece o;

		piece_of(&o, w, r + m, 1, d);
		for (int32_t c = o.lo; c <= o.hi; c += L) {
			const vf at = ramp() + ((float)c - d->fx), x = at - d->slope * o.y;
			vf e = exp_of(-(d->kx * x * x + d->ky * o.y * o.y)), v;

			e = where((e >= d->least) & (at < beyond(&o, d)), e);
			v = load(p + (d->col + c)) + d->amp * e;
			memcpy(p + (d->col + c), &v, sizeof v);
		}
	}
}

INLINE int32_t least_of(int32_t a, int32_t b)
{
	return a < b ? a : b;
}

CLONES
void ct_dabs_add(float *img, size_t pitch, size_t w, size_t r0, size_t r1, size_t n,
	const uint32_t *item, const struct ct_dab *dab)
{
	for (size_t i = 0; i < n; i++) {
		const struct ct_dab *d = dab + (item ? item[i] : i);
		const int32_t end = least_of(d->end, (int32_t)r1);
		int32_t r = d->first > (int32_t)r0 ? d->first : (int32_t)r0;

		while (r < end) {
			int32_t next = least_of(end, (r / CT_DAB_ROWS + 1) * CT_DAB_ROWS);
			float *p = img + (size_t)r * pitch;
			struct piece o;

			if (gentle(d)) {
				piece_of(&o, w, r, next - r, d);
				add_gentle(p, pitch, next - r, &o, d);
			} else
				add_steep(p, pitch, w, r, next - r, d);
			r = next;
		}
	}
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
	const struct piece *o, const struct ct_dab *d)
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

/* Moments of a piece from its sums: y = last + 1 - j, and x less slope y. */
INLINE void moments(double s[6], const float a[L], double past, double slope)
{
	double s0 = (double)a[0], u = (double)a[1], uu = (double)a[2], j = (double)a[3];
	double y = past * s0 - j, uy = past * u - (double)a[4];
	double yy = past * past * s0 - 2 * past * j + (2 * (double)a[5] - j);

	s[0] += s0;
	s[1] += u - slope * y;
	s[2] += y;
	s[3] += uu - slope * (2 * uy - slope * yy);
	s[4] += uy - slope * yy;
	s[5] += yy;
}

INLINE void sums_gentle(double sums[6], const float *p, size_t pitch, int32_t count,
	const struct piece *o, const struct ct_dab *d)
{
	vf acc[6] = {{0}};
	float a[L];

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
	moments(sums, a, (double)(o->y + (float)count), (double)d->slope);
}

INLINE void sums_steep(double sums[6], const float *p, size_t pitch, size_t w, int32_t r,
	int32_t count, const struct ct_dab *d)
{
	vf acc[6] = {{0}};
	float a[L];

	for (int32_t m = 0; m < count; m++, p += pitch) {
		struct piece o;

		piece_of(&o, w, r + m, 1, d);
		for (int32_t c = o.lo; c <= o.hi; c += L) {
			const vf at = ramp() + ((float)c - d->fx), x = at - d->slope * o.y;
			vf e = exp_of(-(d->kx * x * x + d->ky * o.y * o.y)), v;

			e = where((e >= d->least) & (at < beyond(&o, d)), e);
			v = load(p + (d->col + c)) * e;
			acc[0] += v;
			acc[1] += v * x;
			acc[2] += v * o.y;
			acc[3] += v * x * x;
			acc[4] += v * x * o.y;
			acc[5] += v * o.y * o.y;
		}
	}
	across(a, acc);
	for (int i = 0; i < 6; i++)
		sums[i] += (double)a[i];
}

CLONES
void ct_dabs_sums(double *out, size_t stride, const float *g, size_t pitch, size_t w, size_t n,
	const struct ct_dab *dab)
{
	for (size_t i = 0; i < n; i++) {
		const struct ct_dab *d = dab + i;
		double s[6] = {0};

		for (int32_t r = d->first; r < d->end;) {
			int32_t next = least_of(d->end, (r / CT_DAB_ROWS + 1) * CT_DAB_ROWS);
			const float *p = g + (size_t)r * pitch;
			struct piece o;

			if (gentle(d)) {
				piece_of(&o, w, r, next - r, d);
				sums_gentle(s, p, pitch, next - r, &o, d);
			} else
				sums_steep(s, p, pitch, w, r, next - r, d);
			r = next;
		}
		for (size_t k = 0; k < 6; k++)
			out[k * stride + i] = s[k];
	}
}
