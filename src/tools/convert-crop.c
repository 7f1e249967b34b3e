/* convert-crop.c: ct-convert --crop: a box of the voxels. */
#include "config.h"
#include "resolution/regrid.h"
#include "tools/convert.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* "LO:HI" of an axis, an end that is not said being infinite. */
static int parse_ends(
	double v[2], const char *text, size_t length, const char *all, struct ct_err *e)
{
	char s[80];
	char *colon, *end;

	snprintf(s, sizeof s, "%.*s", (int)length, text);
	colon = strchr(s, ':');
	v[0] = -(double)INFINITY;
	v[1] = (double)INFINITY;
	if (!colon || length >= sizeof s)
		return ct_fail(
			e, CT_EUSAGE, "--crop: '%.80s' is neither auto nor LO:HI,LO:HI,LO:HI", all);
	*colon++ = '\0';
	if (*s)
		v[0] = strtod(s, &end);
	if (*s && *end)
		return ct_fail(e, CT_EUSAGE, "--crop: '%s' is no number", s);
	if (*colon)
		v[1] = strtod(colon, &end);
	if (*colon && *end)
		return ct_fail(e, CT_EUSAGE, "--crop: '%s' is no number", colon);
	return v[0] < v[1] ? 0 : ct_fail(e, CT_EUSAGE, "--crop: '%.80s' is empty", all);
}

/* "LO:HI,LO:HI,LO:HI", mm if that is behind it. */
static int parse_box(double box[3][2], bool *mm, const char *text, struct ct_err *e)
{
	size_t n = strlen(text);
	const char *at = text;

	*mm = n > 2 && strcmp(text + n - 2, "mm") == 0;
	if (*mm)
		n -= 2;
	for (int d = 0; d < 3; d++) {
		const char *comma = memchr(at, ',', (size_t)(text + n - at));
		const char *end = comma && d < 2 ? comma : text + n;

		if ((d < 2 && !comma) || parse_ends(box[d], at, (size_t)(end - at), text, e))
			return d < 2 && !comma ? ct_fail(e, CT_EUSAGE,
							 "--crop: '%.80s' has no three axes", text)
					       : -1;
		at = end + 1;
	}
	return 0;
}

static int find_box(double box[3][2], const struct ct_vol *v, const char *text, struct ct_err *e)
{
	bool mm;

	if (strcmp(text, "auto") == 0)
		return ct_regrid_body(box, v, e);
	if (parse_box(box, &mm, text, e) || (mm && ct_vol_check_grid(v, e)))
		return -1;
	if (mm)
		ct_regrid_cells(box, v);
	for (int d = 0; d < 3 && !mm; d++)
		for (int k = 0; k < 2; k++)
			if (!isinf(box[d][k]) && box[d][k] != floor(box[d][k]))
				return ct_fail(
					e, CT_EUSAGE, "--crop: voxel %g is not whole", box[d][k]);
	return 0;
}

int convert_crop(struct ct_vol *v, const char *text, const struct ct_env *env, struct ct_err *e)
{
	double box[3][2];

	return find_box(box, v, text, e) || ct_regrid_box(v, box, env, e) ? -1 : 0;
}
