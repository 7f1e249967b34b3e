/* t-trend.c: where a loop is likely to end, of powers of the iteration.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/trend.h"
#include "tap.h"

#include <math.h>

static size_t likely(double tolerance, size_t most, double first, double power, size_t upto)
{
	struct ct_trend t = ct_trend_begin(tolerance, most);

	for (size_t at = 5; at <= upto; at += 5)
		ct_trend_see(&t, at, first * pow((double)at, -power));
	return ct_trend_likely(&t);
}

int main(void)
{
	size_t n = likely(1, 300, 100, 1, 20);

	OK(n == 100 || n == 101, "100 / k is 1 at 100 (%zu)", n);
	n = likely(0.5, 1000, 200, 2, 15);
	OK(n == 20 || n == 21, "200 / k^2 is .5 at 20 (%zu)", n);
	OK(likely(1, 80, 100, 1, 20) == 80, "but no more than the most");
	OK(likely(1, 150, 100, 1, 20) < 150, "nor the most, where it is less");
	OK(likely(1, 300, 100, 1, 5) == 300, "one value says nothing");
	OK(likely(1, 300, 2, -1, 40) == 300, "nor do values that rise");
	OK(likely(50, 300, 100, 1, 20) == 20, "what is below has come to its end");
	OK(likely(0, 300, 100, 1, 20) == 0, "without a tolerance there is none");
	return tap_done();
}
