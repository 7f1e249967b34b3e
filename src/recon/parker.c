/* parker.c: see parker.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/parker.h"

#include <math.h>

double ct_parker_weight(double beta, double g, double delta)
{
	double s = 1;

	g = fmin(fmax(g, -delta), delta);
	if (beta < 2 * delta - 2 * g)
		s = sin(M_PI / 4 * beta / (delta - g));
	else if (beta > M_PI - 2 * g)
		s = sin(M_PI / 4 * fmax(M_PI + 2 * delta - beta, 0) / (delta + g));
	return s * s;
}
