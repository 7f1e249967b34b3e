/* render.c: see render.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/render.h"

#include <math.h>

static double gain(bool cube, float t)
{
	return cube ? (double)t * (double)t : 1;
}

static double width(size_t n, const float *t, double end, size_t i)
{
	return (i + 1 < n ? (double)t[i + 1] : fmax(end, (double)t[i])) - (double)t[i];
}

double ct_render(size_t n, float *w, const float *t, double end, bool cube, const float *y)
{
	double through = 1, value = 0;

	for (size_t i = 0; i < n; i++) {
		const double left = exp(-fmax((double)y[2 * i], 0) * width(n, t, end, i));
		const double weight = gain(cube, t[i]) * (1 - left) * through;

		w[i] = (float)weight;
		value += weight * (double)y[2 * i + 1];
		through *= left;
	}
	return value;
}

/* From the last sample on: d value / d a_i = g_i exp(-(a_0 + ... + a_i)) c_i - sum_{j > i} w_j c_j.
 */
void ct_render_back(size_t n, float *dy, const float *w, const float *t, double end, bool cube,
	const float *y, double dvalue)
{
	double through = 0, behind = 0;

	for (size_t i = 0; i < n; i++)
		through += fmax((double)y[2 * i], 0) * width(n, t, end, i);
	for (size_t i = n; i-- > 0;) {
		const double s = (double)y[2 * i], c = (double)y[2 * i + 1];
		const double d = width(n, t, end, i);
		const double slope = gain(cube, t[i]) * exp(-through) * c - behind;

		dy[2 * i] = s > 0 ? (float)(dvalue * d * slope) : 0;
		dy[2 * i + 1] = (float)(dvalue * (double)w[i]);
		behind += (double)w[i] * c;
		through -= fmax(s, 0) * d;
	}
}
