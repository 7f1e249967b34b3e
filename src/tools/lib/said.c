/* said.c: see said.h. */
#include "config.h"
#include "tools/lib/said.h"

#include <math.h>
#include <string.h>

int said_parse(struct ct_said *to, const struct said_opts *o, struct ct_err *e)
{
	const struct ct_said nothing = CT_SAID_NOTHING;

	*to = nothing;
	if ((o->factor && ct_cli_numbers("factor", o->factor, ',', 3, true, to->factor, e)) ||
		(o->spacing &&
			ct_cli_numbers("spacing", o->spacing, ',', 3, true, to->spacing, e)) ||
		(o->sigma && ct_cli_numbers("sigma", o->sigma, ',', 3, true, to->sigma, e)))
		return -1;
	for (int a = 0; a < 3; a++) {
		if (o->factor && !(to->factor[a] >= 1 && to->factor[a] <= CT_SAID_TIMES))
			return ct_fail(e, CT_EUSAGE, "--factor: %g is outside [1, %d]",
				to->factor[a], CT_SAID_TIMES);
		if (o->spacing && !(to->spacing[a] > 0))
			return ct_fail(
				e, CT_EUSAGE, "--spacing: %g is not positive", to->spacing[a]);
		if (o->sigma && !(to->sigma[a] >= 0 && to->sigma[a] <= CT_SAID_SIGMA))
			return ct_fail(e, CT_EUSAGE, "--sigma: %g is outside [0, %d]", to->sigma[a],
				CT_SAID_SIGMA);
	}
	to->sigma_for_all = o->sigma && !strchr(o->sigma, ',');
	to->decimate = o->decimate;
	to->noise = o->noise;
	return 0;
}
