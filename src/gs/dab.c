/* dab.c: see dab.h. Vectors of GCC and clang, so that every processor runs wide code and the same
 * operations: no fused multiply-add, the same bytes everywhere. */
#include "config.h"
#include "gs/dab.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) &&                             \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif
/* vectors are passed to inlined functions only, so no call depends on how the ABI passes them */
#define INLINE static inline __attribute__((always_inline))

enum { L = CT_DAB_LANES, ROWS = 2 * L }; /* rows that are drawn together */

typedef float vf __attribute__((vector_size(4 * CT_DAB_LANES)));
typedef int32_t vi __attribute__((vector_size(4 * CT_DAB_LANES)));

INLINE vf ramp(void)
{
	vf v;

	for (int l = 0; l < L; l++)
		v[l] = (float)l;
	return v;
}

INLINE vf pick(vi mask, vf yes, vf no)
{
	return (vf)((mask & (vi)yes) | (~mask & (vi)no));
}

INLINE vf at_least(vf x, vf low)
{
	return pick(x < low, low, x);
}

INLINE vf at_most(vf x, vf high)
{
	return pick(x > high, high, x);
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

/* e^p for |p| <= 80, relative error 2e-7. Rounds p/ln 2 by adding and taking away 1.5 2^23, then
 * Taylor on |r| <= ln 2 / 2. */
INLINE vf exp_of(vf p)
{
	const vf n = p * 1.44269504f + 12582912.0f - 12582912.0f;
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

/* Of `count` <= ROWS rows of a dab, from row r: the columns [lo, hi] relative to d->col (hi < lo:
 * none), and the box [first, last] around them. */
struct span {
	int32_t lo[ROWS], hi[ROWS], first, last;
};

/* L rows of it. */
INLINE void ends_of(int32_t *lo_out, int32_t *hi_out, size_t w, size_t r, const struct ct_dab *d)
{
	const vf zero = {0}, left = zero + (float)-d->col;
	const vf right = zero + (float)((int32_t)w - 1 - d->col);
	const vf y = (ramp() + (float)((int32_t)r - d->row)) - d->fy;
	const vf xc = d->fx + d->slope * y, rest = d->cut - d->ky * y * y;
	vf half = at_least(rest, zero) / d->kx, a, b;
	float root[L];
	vi lo, hi;

	memcpy(root, &half, sizeof root);
	for (int l = 0; l < L; l++)
		root[l] = sqrtf(root[l]);
	half = load(root);
	a = at_most(at_least(xc - half, left), right + 1);
	b = at_most(at_least(xc + half, left - 1), right);
	lo = __builtin_convertvector(a, vi);
	hi = __builtin_convertvector(b, vi);
	lo -= __builtin_convertvector(lo, vf) < a; /* a comparison that holds is -1 */
	hi += __builtin_convertvector(hi, vf) > b;
	hi -= (hi - lo + 1) & (rest < zero);
	memcpy(lo_out, &lo, sizeof lo);
	memcpy(hi_out, &hi, sizeof hi);
}

INLINE void span_of(struct span *o, size_t w, size_t r, size_t count, const struct ct_dab *d)
{
	ends_of(o->lo, o->hi, w, r, d);
	if (count > L)
		ends_of(o->lo + L, o->hi + L, w, r + L, d);
	o->first = INT32_MAX;
	o->last = INT32_MIN;
	for (size_t m = 0; m < count; m++) {
		bool none = o->hi[m] < o->lo[m];

		o->first = none || o->lo[m] > o->first ? o->first : o->lo[m];
		o->last = none || o->hi[m] < o->last ? o->last : o->hi[m];
	}
}

INLINE vi ints(int32_t from)
{
	return __builtin_convertvector(ramp(), vi) + from;
}

/* The exponent is a quadratic in the row, so e goes from row to row by two multiplications:
 * e *= step, step *= turn. That holds its precision over ROWS rows as long as nothing in the box
 * around the ellipse is below e^-60: for correlations up to 0.8. */
struct walk {
	vf e, step;
};

INLINE bool gentle(const struct ct_dab *d)
{
	return d->slope * d->slope * d->kx <= 0.64f / 0.36f * d->ky;
}

/* Columns from c, beginning in row r. Columns outside the box take the values at its border, so
 * that no lane meets denormal numbers; they do not count. */
INLINE void walk_from(
	struct walk *k, int32_t c, size_t r, const struct span *o, const struct ct_dab *d)
{
	const vf zero = {0}, low = zero + ((float)o->first - d->fx);
	const vf high = zero + ((float)o->last - d->fx);
	const float y = (float)((int32_t)r - d->row) - d->fy, kxs = d->kx * d->slope;
	vf x = at_most(at_least(ramp() + ((float)c - d->fx), low), high) - d->slope * y;

	k->e = exp_of(-(d->kx * x * x + d->ky * y * y));
	k->step = exp_of(2 * kxs * x - (kxs * d->slope + d->ky * (2 * y + 1)));
}

/* The same in all lanes; past e^-80 only for dabs of a row or two, which do not use it. */
INLINE vf turn_of(const struct ct_dab *d)
{
	const vf zero = {0};

	return exp_of(at_least(zero - 2 * (d->kx * d->slope * d->slope + d->ky), zero - 80.0f));
}

INLINE void add_gentle(float *p, size_t pitch, size_t r, size_t count, const struct span *o,
	const struct ct_dab *d)
{
	const vf turn = turn_of(d);

	for (int32_t c = o->first; c <= o->last; c += L) {
		float *at = p + (d->col + c);
		const vi lane = ints(c);
		struct walk k;

		walk_from(&k, c, r, o, d);
		k.e *= d->amp;
		for (size_t m = 0; m < count; m++, at += pitch) {
			vi in = (lane >= o->lo[m]) & (lane <= o->hi[m]);
			vf v = load(at) + (vf)((vi)k.e & in);

			memcpy(at, &v, sizeof v);
			k.e *= k.step;
			k.step *= turn;
		}
	}
}

/* Long, thin and oblique: an exponential a pixel. */
INLINE void add_steep(float *p, size_t pitch, size_t r, size_t count, const struct span *o,
	const struct ct_dab *d)
{
	const vf least = (vf){0} - 80.0f;

	for (size_t m = 0; m < count; m++, p += pitch) {
		const float y = (float)((int32_t)(r + m) - d->row) - d->fy;

		for (int32_t c = o->lo[m]; c <= o->hi[m]; c += L) {
			vf x = (ramp() + ((float)c - d->fx)) - d->slope * y, v;

			v = d->amp * exp_of(at_least(-(d->kx * x * x + d->ky * y * y), least));
			v = load(p + (d->col + c)) + (vf)((vi)v & (ints(c) <= o->hi[m]));
			memcpy(p + (d->col + c), &v, sizeof v);
		}
	}
}

CLONES
void ct_dab_add(float *img, size_t pitch, size_t w, size_t r0, size_t r1, const struct ct_dab *d)
{
	for (size_t r = r0; r < r1; r += ROWS) {
		size_t count = r1 - r < ROWS ? r1 - r : ROWS;
		struct span o;

		span_of(&o, w, r, count, d);
		if (gentle(d))
			add_gentle(img + r * pitch, pitch, r, count, &o, d);
		else
			add_steep(img + r * pitch, pitch, r, count, &o, d);
	}
}

/* Sums with x from the centre's column. In a lane x is the same in all rows: three sums do. */
INLINE void sums_gentle(vf acc[6], const float *p, size_t pitch, size_t r, size_t count,
	const struct span *o, const struct ct_dab *d)
{
	const vf turn = turn_of(d);

	for (int32_t c = o->first; c <= o->last; c += L) {
		const float *at = p + (d->col + c);
		const vf x = ramp() + ((float)c - d->fx);
		const vi lane = ints(c);
		float y = (float)((int32_t)r - d->row) - d->fy;
		vf s = {0}, sy = {0}, syy = {0};
		struct walk k;

		walk_from(&k, c, r, o, d);
		for (size_t m = 0; m < count; m++, at += pitch, y += 1) {
			vi in = (lane >= o->lo[m]) & (lane <= o->hi[m]);
			vf v = load(at) * (vf)((vi)k.e & in);

			s += v;
			v *= y;
			sy += v;
			syy += v * y;
			k.e *= k.step;
			k.step *= turn;
		}
		acc[0] += s;
		acc[1] += s * x;
		acc[2] += sy;
		acc[3] += s * x * x;
		acc[4] += sy * x;
		acc[5] += syy;
	}
}

/* Sums with x from the centre of the row. */
INLINE void sums_steep(vf acc[6], const float *p, size_t pitch, size_t r, size_t count,
	const struct span *o, const struct ct_dab *d)
{
	const vf least = (vf){0} - 80.0f;

	for (size_t m = 0; m < count; m++, p += pitch) {
		const float y = (float)((int32_t)(r + m) - d->row) - d->fy;

		for (int32_t c = o->lo[m]; c <= o->hi[m]; c += L) {
			vf x = (ramp() + ((float)c - d->fx)) - d->slope * y, v;

			v = exp_of(at_least(-(d->kx * x * x + d->ky * y * y), least));
			v = load(p + (d->col + c)) * (vf)((vi)v & (ints(c) <= o->hi[m]));
			acc[0] += v;
			acc[1] += v * x;
			acc[2] += v * y;
			acc[3] += v * x * x;
			acc[4] += v * x * y;
			acc[5] += v * y * y;
		}
	}
}

CLONES
void ct_dab_sums(double s[static 6], const float *g, size_t pitch, size_t w, size_t r0, size_t r1,
	const struct ct_dab *d)
{
	vf acc[6] = {{0}};
	double k = (double)d->slope;

	for (size_t r = r0; r < r1; r += ROWS) {
		size_t count = r1 - r < ROWS ? r1 - r : ROWS;
		struct span o;

		span_of(&o, w, r, count, d);
		if (gentle(d))
			sums_gentle(acc, g + r * pitch, pitch, r, count, &o, d);
		else
			sums_steep(acc, g + r * pitch, pitch, r, count, &o, d);
	}
	for (int i = 0; i < 6; i++) {
		s[i] = 0;
		for (int l = 0; l < L; l++)
			s[i] += (double)acc[i][l];
	}
	if (gentle(d)) { /* to x of the row */
		s[1] -= k * s[2];
		s[3] -= k * (2 * s[4] - k * s[5]);
		s[4] -= k * s[5];
	}
}
