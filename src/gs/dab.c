/* dab.c: see dab.h. The loops over lanes have a fixed count, so that the compiler turns each into
 * a few vector instructions; no fused multiply-add, so all processors give the same bytes. */
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

enum { L = CT_DAB_LANES };

size_t ct_dab_pitch(size_t w)
{
	return (w + L - 1) / L * L + L;
}

/* e^p for p <= 0, relative error 2e-7; e^-80 below. Rounds p/ln 2 by adding and taking away
 * 1.5 2^23, then Taylor on |r| <= ln 2 / 2. */
static inline __attribute__((always_inline)) float exp_neg(float p)
{
	float n, r, y;
	int32_t bits;

	p = p < -80.0f ? -80.0f : p;
	n = p * 1.44269504f + 12582912.0f - 12582912.0f;
	r = p - n * 0.693359375f + n * 2.12194440e-4f; /* ln 2 in two parts */
	y = 1.0f / 720.0f;
	y = y * r + 1.0f / 120.0f;
	y = y * r + 1.0f / 24.0f;
	y = y * r + 1.0f / 6.0f;
	y = y * r + 0.5f;
	y = y * r + 1.0f;
	y = y * r + 1.0f;
	bits = ((int32_t)n + 127) << 23;
	memcpy(&n, &bits, sizeof n);
	return y * n;
}

/* Of L rows of a dab, from row r: columns [lo, hi] relative to d->col (hi < lo: none), the centre
 * there, and the factor e has in the row. */
struct rows {
	int32_t lo[L], hi[L];
	float xc[L], y[L], e[L];
};

static inline __attribute__((always_inline)) void rows_of(struct rows *o, size_t w, size_t r,
	const struct ct_dab *d)
{
	const float left = (float)-d->col, right = (float)((int32_t)w - 1 - d->col);
	const int32_t first = (int32_t)r - d->row;
	const float fx = d->fx, fy = d->fy, slope = d->slope, ky = d->ky, cut = d->cut, inv = 1.0f / d->kx;

	for (int l = 0; l < L; l++) {
		float y = (float)(first + l) - fy, t = ky * y * y, rest = cut - t;
		float xc = fx + slope * y;
		float half = sqrtf((rest > 0 ? rest : 0) * inv);
		float a = xc - half, b = xc + half;
		int32_t lo, hi;

		a = a < left ? left : a > right + 1 ? right + 1 : a;
		b = b < left - 1 ? left - 1 : b > right ? right : b;
		lo = (int32_t)a;
		hi = (int32_t)b;
		lo += (float)lo < a;
		hi -= (float)hi > b;
		o->lo[l] = lo;
		o->hi[l] = rest < 0 ? lo - 1 : hi;
		o->xc[l] = xc;
		o->y[l] = y;
		o->e[l] = exp_neg(-t);
	}
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
			float x0 = (float)o.lo[m] - o.xc[m];
			int32_t left = o.hi[m] - o.lo[m] + 1;
			float *p = img + (r + m) * pitch;

			if (left > 0)
				p += d->col + o.lo[m];
			for (; left > 0; left -= L, p += L, x0 += (float)L) {
				for (int l = 0; l < L; l++) {
					float x = x0 + (float)l, v = e * exp_neg(k * x * x);

					p[l] += l < left ? v : 0.0f;
				}
			}
		}
	}
}

/* Sums over one row in blocks of lanes. */
static inline __attribute__((always_inline)) void row_sums(float acc[6][L], const float *restrict p,
	float x0, int32_t left, float k, float y, float e)
{
	for (; left > 0; left -= L, p += L, x0 += (float)L)
		for (int l = 0; l < L; l++) {
			float x = x0 + (float)l, v = e * exp_neg(k * x * x) * p[l], vx, vy;

			v = l < left ? v : 0.0f;
			vx = v * x;
			vy = v * y;
			acc[0][l] += v;
			acc[1][l] += vx;
			acc[2][l] += vy;
			acc[3][l] += vx * x;
			acc[4][l] += vx * y;
			acc[5][l] += vy * y;
		}
}

CLONES
void ct_dab_sums(double s[static 6], const float *g, size_t pitch, size_t w, size_t r0, size_t r1,
	const struct ct_dab *d)
{
	float acc[6][L];
	struct rows o;

	memset(acc, 0, sizeof acc);
	for (size_t r = r0; r < r1; r += L) {
		size_t count = r1 - r < L ? r1 - r : L;

		rows_of(&o, w, r, d);
		for (size_t m = 0; m < count; m++) {
			int32_t left = o.hi[m] - o.lo[m] + 1;

			if (left > 0)
				row_sums(acc, g + (r + m) * pitch + (size_t)(d->col + o.lo[m]),
					(float)o.lo[m] - o.xc[m], left, -d->kx, o.y[m], o.e[m]);
		}
	}
	for (int i = 0; i < 6; i++) {
		double sum = 0;

		for (int l = 0; l < L; l++)
			sum += (double)acc[i][l];
		s[i] = sum;
	}
}
