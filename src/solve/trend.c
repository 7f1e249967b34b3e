/* trend.c: see trend.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/trend.h"

#include <math.h>

struct ct_trend ct_trend_begin(double tolerance, size_t most)
{
	return (struct ct_trend){.tolerance = tolerance, .most = most, .likely = most};
}

void ct_trend_see(struct ct_trend *t, size_t at, double value)
{
	double power, end;

	if (!(value > 0 && t->tolerance > 0 && isfinite(value)))
		return;
	if (t->value[1] == 0 || at >= 2 * t->at[1]) {
		t->at[0] = t->at[1], t->value[0] = t->value[1];
		t->at[1] = at, t->value[1] = value;
	}
	t->likely = t->most;
	if (t->value[0] == 0)
		return;
	power = log(t->value[0] / value) / log((double)at / (double)t->at[0]);
	end = power > 0 ? ceil((double)at * pow(value / t->tolerance, 1 / power))
			: (double)INFINITY;
	if (end < (double)t->most)
		t->likely = end > (double)at ? (size_t)end : at;
}

size_t ct_trend_likely(const struct ct_trend *t)
{
	return t->tolerance > 0 ? t->likely : 0;
}
