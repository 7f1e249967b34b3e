/* said.c: see said.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "tools/lib/said.h"

#include "formats/io.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int said_slices(
	struct ct_slice_profile_said *to, const char *profile, double thickness, struct ct_err *e)
{
	unsigned char *text = NULL;
	size_t n;
	bool file;
	int rc;

	if (ct_slice_profile_say(to, &file, profile, thickness, e))
		return -1;
	if (!file)
		return 0;
	if (access(profile, F_OK))
		return ct_fail(e, CT_EINPUT,
			"%s: no file, and no shape of --profile: gaussian, box, triangle, trapezoid",
			profile);
	if (ct_slurp(profile, &text, &n, e))
		return -1;
	rc = ct_slice_profile_parse(&to->samples, (const char *)text, n, e);
	free(text);
	return rc ? ct_blame(e, profile) : 0;
}

int said_parse(struct ct_said *to, const struct said_opts *o, struct ct_err *e)
{
	const struct ct_said nothing = CT_SAID_NOTHING;

	*to = nothing;
	if ((o->factor &&
		    ct_cli_within("factor", o->factor, 3, true, 1, CT_SAID_TIMES, to->factor, e)) ||
		(o->spacing &&
			ct_cli_numbers("spacing", o->spacing, ',', 3, true, to->spacing, e)) ||
		(o->sigma &&
			ct_cli_within("sigma", o->sigma, 3, true, 0, CT_SAID_SIGMA, to->sigma, e)))
		return -1;
	for (int a = 0; a < 3; a++)
		if (o->spacing && !(to->spacing[a] > 0))
			return ct_fail(
				e, CT_EUSAGE, "--spacing: %g is not positive", to->spacing[a]);
	to->sigma_for_all = o->sigma && !strchr(o->sigma, ',');
	to->decimate = o->decimate;
	to->noise = o->noise;
	to->trust = o->trust;
	return said_slices(&to->slice, o->profile, o->thickness, e);
}
