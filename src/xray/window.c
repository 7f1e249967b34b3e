/* window.c: see window.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/words.h"
#include "xray/window.h"

#include <math.h>

void ct_window_density(size_t n, float *dst, const float *src, const double window[static 2])
{
	double lo = window[0], width = window[1] - window[0];

	for (size_t i = 0; i < n; i++) {
		double d = ((double)src[i] - lo) / width;

		d = d > 0 ? d : 0;
		dst[i] = (float)(d < 1 ? d : 1);
	}
}

void ct_window_density_open(size_t n, float *dst, const float *src, const double window[static 2])
{
	double lo = window[0], width = window[1] - window[0];

	for (size_t i = 0; i < n; i++)
		dst[i] = (float)(((double)src[i] - lo) / width);
}

void ct_window_hu(size_t n, float *dst, const float *src, const double window[static 2])
{
	double lo = window[0], width = window[1] - window[0];

	for (size_t i = 0; i < n; i++)
		dst[i] = (float)(lo + (double)src[i] * width);
}

void ct_window_add(size_t n, float *base, const float *res, double gain, double floor,
	const double window[static 2])
{
	const float least = (float)floor, hi = (float)window[1], g = (float)gain;
	const float lo = floor < window[0] ? least : (float)window[0];

	for (size_t i = 0; i < n; i++) {
		float v = base[i] > lo ? base[i] : lo;

		v = (v < hi ? v : hi) + g * res[i];
		base[i] = v < least ? least : v;
	}
}

size_t ct_window_above(size_t n, const float *src, const double window[static 2], float *largest)
{
	const float hi = (float)window[1];
	size_t above = 0;

	*largest = -HUGE_VALF;
	for (size_t i = 0; i < n; i++) {
		above += src[i] > hi;
		*largest = src[i] > *largest ? src[i] : *largest;
	}
	return above;
}

bool ct_window_is(const double window[static 2])
{
	const float lo = (float)window[0], hi = (float)window[1];

	return isfinite(lo) && lo < hi && isfinite((float)(window[1] - window[0]));
}

int ct_window_get(double window[static 2], const struct ct_meta *m, struct ct_err *e)
{
	const char *text = m ? ct_meta_get(m, CT_META_WINDOW) : NULL;
	window[0] = -1024;
	window[1] = 3071;
	if (!text)
		return 0;
	if (ct_words_numbers(text, ':', 2, false, window) && ct_window_is(window))
		return 0;
	return ct_fail(e, CT_EINPUT, "metadata: the window is not LO:HI with LO < HI");
}

int ct_window_put(struct ct_meta *m, const double window[static 2], struct ct_err *e)
{
	return ct_meta_setf(m, e, CT_META_WINDOW, "%.10g:%.10g", window[0], window[1]);
}

int ct_window_volume(
	struct ct_vol *v, bool residual, const double window[static 2], struct ct_err *e)
{
	const double to[2] = {
		residual ? 0 : window[0], residual ? window[1] - window[0] : window[1]};

	ct_window_hu(ct_vol_count(v), v->data, v->data, to);
	return residual ? ct_meta_set(&v->meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e) : 0;
}
