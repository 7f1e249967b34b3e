/* tv-row.c: see tv-row.h. */
#include "config.h"
#include "resolution/tv-row.h"
#include "core/vec.h"

#include <math.h>

/* No two of the rows overlap. The loops are short and plain because the compiler makes vectors of
 * no others. */
void CT_SIMD_HERE(ct_tv_row_sweep)(
	const struct ct_tv_row *r, size_t n, const float weight[3], float s, float t)
{
	float *q0 = r->q[0] + 1, *q1 = r->q[1], *q2 = r->q[2];
	float *p0 = r->p[0], *p1 = r->p[1], *p2 = r->p[2];
	float *grad = r->grad, *step = r->step, *out = r->out;
	float *below = r->below, *after = r->after;
	const float *x = r->x, *xj = r->xj, *xk = r->xk;
	const float *before = r->before, *left = r->q[0], *to = r->to;
	float pull = r->pull;
	float w0 = weight[0], w1 = weight[1], w2 = weight[2];

#pragma GCC ivdep
	for (size_t i = 0; i + 1 < n; i++)
		q0[i] = w0 * (x[i + 1] - x[i]);
	q0[n - 1] = 0;
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		float gi = q0[i], gj = w1 * (xj[i] - x[i]), gk = w2 * (xk[i] - x[i]);
		float qi = p0[i] + s * gi, qj = p1[i] + s * gj, qk = p2[i] + s * gk;
		float square = qi * qi + qj * qj + qk * qk;

		grad[i] = gi * gi + gj * gj + gk * gk;
		step[i] = square > 1.0f ? square : 1.0f;
		q0[i] = qi;
		q1[i] = qj;
		q2[i] = qk;
	}
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		float shrink = 1.0f / sqrtf(step[i]);
		float qi = shrink * q0[i], qj = shrink * q1[i], qk = shrink * q2[i];

		q0[i] = w0 * (2.0f * qi - p0[i]);
		after[i] = w1 * (2.0f * qj - p1[i]);
		q2[i] = w2 * (2.0f * qk - p2[i]);
		p0[i] = qi;
		p1[i] = qj;
		p2[i] = qk;
	}
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		step[i] = t * ((q0[i] - left[i]) + (after[i] - before[i]) + (q2[i] - below[i])) +
			  pull * (to[i] - x[i]);
		out[i] = x[i] + step[i];
		below[i] = q2[i];
	}
}

enum { LANES = 16 }; /* partial sums, in a fixed order */

static double total(const double part[LANES])
{
	double s = 0;

	for (size_t l = 0; l < LANES; l++)
		s += part[l];
	return s;
}

/* Sum of the square roots of v, which it leaves there. */
double CT_SIMD_HERE(ct_tv_row_roots)(float *v, size_t n)
{
	double part[LANES] = {0};

#pragma GCC ivdep
	for (size_t i = 0; i < n; i++)
		v[i] = sqrtf(v[i]);
	for (size_t i = 0; i < n; i += LANES)
		for (size_t l = 0; l < (n - i < LANES ? n - i : LANES); l++)
			part[l] += (double)v[i + l];
	return total(part);
}

double CT_SIMD_HERE(ct_tv_row_squares)(const float *v, size_t n)
{
	double part[LANES] = {0};

	for (size_t i = 0; i < n; i += LANES)
		for (size_t l = 0; l < (n - i < LANES ? n - i : LANES); l++)
			part[l] += (double)v[i + l] * (double)v[i + l];
	return total(part);
}
