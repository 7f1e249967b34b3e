/* dab.c: see dab.h. Vectors of GCC and clang, so that every processor runs wide code and the same
 * operations: no fused multiply-add, the same bytes everywhere. */
#include "config.h"
#include "gs/dab.h"

#include <math.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif
/* vectors are passed to inlined functions only, so no call depends on how the ABI passes them */
#define INLINE static inline __attribute__((always_inline))

enum { L = CT_DAB_LANES };

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

/* e^p for p <= 0, relative error 2e-7; e^-80 below. Rounds p/ln 2 by adding and taking away
 * 1.5 2^23, then Taylor on |r| <= ln 2 / 2. */
INLINE vf exp_neg(vf p)
{
	vf n, r, y;

	p = at_least(p, (vf){0} - 80.0f);
	n = p * 1.44269504f + 12582912.0f - 12582912.0f;
	r = p - n * 0.693359375f + n * 2.12194440e-4f; /* ln 2 in two parts */
	y = r * (1.0f / 720.0f) + 1.0f / 120.0f;
	y = y * r + 1.0f / 24.0f;
	y = y * r + 1.0f / 6.0f;
	y = y * r + 0.5f;
	y = y * r + 1.0f;
	y = y * r + 1.0f;
	return y * (vf)((__builtin_convertvector(n, vi) + 127) << 23);
}

/* Of L rows of a dab, from row r: columns [lo, hi] relative to d->col (hi < lo: none), the centre
 * there, and the factor e has in the row. */
struct rows {
	int32_t lo[L], hi[L];
	float xc[L], y[L], e[L];
};

INLINE void rows_of(struct rows *o, size_t w, size_t r, const struct ct_dab *d)
{
	const vf zero = {0}, left = zero + (float)-d->col;
	const vf right = zero + (float)((int32_t)w - 1 - d->col);
	const vf y = (ramp() + (float)((int32_t)r - d->row)) - d->fy, t = d->ky * y * y;
	const vf xc = d->fx + d->slope * y, rest = d->cut - t;
	vf half = at_least(rest, zero) / d->kx, a, b, e;
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
	e = exp_neg(-t);
	memcpy(o->lo, &lo, sizeof lo);
	memcpy(o->hi, &hi, sizeof hi);
	memcpy(o->xc, &xc, sizeof xc);
	memcpy(o->y, &y, sizeof y);
	memcpy(o->e, &e, sizeof e);
}

CLONES
void ct_dab_add(float *img, size_t pitch, size_t w, size_t r0, size_t r1, const struct ct_dab *d)
{
	const float k = -d->kx, amp = d->amp;
	struct rows o;

	for (size_t r = r0; r < r1; r += L) {
		size_t count = r1 - r < L ? r1 - r : L;

		rows_of(&o, w, r, d);
		for (size_t m = 0; m < count; m++) {
			const float e = amp * o.e[m];
			int32_t left = o.hi[m] - o.lo[m] + 1;
			vf x = ramp() + ((float)o.lo[m] - o.xc[m]);
			float *p = img + (r + m) * pitch;

			if (left > 0)
				p += d->col + o.lo[m];
			for (; left > 0; left -= L, p += L, x += (float)L) {
				vf v = e * exp_neg(k * x * x);
				vi in = ramp() < (vf){0} + (float)left;

				v = load(p) + (vf)((vi)v & in);
				memcpy(p, &v, sizeof v);
			}
		}
	}
}

CLONES
void ct_dab_sums(double s[static 6], const float *g, size_t pitch, size_t w, size_t r0, size_t r1,
	const struct ct_dab *d)
{
	const float k = -d->kx;
	vf acc[6] = {{0}};
	struct rows o;

	for (size_t r = r0; r < r1; r += L) {
		size_t count = r1 - r < L ? r1 - r : L;

		rows_of(&o, w, r, d);
		for (size_t m = 0; m < count; m++) {
			int32_t left = o.hi[m] - o.lo[m] + 1;
			vf x = ramp() + ((float)o.lo[m] - o.xc[m]), a0 = {0}, a1 = {0}, a2 = {0};
			const float *p = g + (r + m) * pitch;

			if (left > 0)
				p += d->col + o.lo[m];
			for (; left > 0; left -= L, p += L, x += (float)L) {
				vf v = load(p) * exp_neg(k * x * x);
				vi in = ramp() < (vf){0} + (float)left;

				v = (vf)((vi)v & in);
				a0 += v;
				a1 += v * x;
				a2 += v * x * x;
			}
			a0 *= o.e[m];
			a1 *= o.e[m];
			acc[0] += a0;
			acc[1] += a1;
			acc[2] += a0 * o.y[m];
			acc[3] += a2 * o.e[m];
			acc[4] += a1 * o.y[m];
			acc[5] += a0 * o.y[m] * o.y[m];
		}
	}
	for (int i = 0; i < 6; i++) {
		s[i] = 0;
		for (int l = 0; l < L; l++)
			s[i] += (double)acc[i][l];
	}
}
