/* convert-crop.c: ct-convert --crop: a box of the voxels. */
#include "config.h"
#include "core/mem.h"
#include "resolution/crop.h"
#include "tools/convert.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BODY -500   /* HU */
#define MARGIN 10.0 /* mm about the body */

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

static void corner(double ijk[3], const size_t n[3], int which)
{
	for (int d = 0; d < 3; d++)
		ijk[d] = ct_cell_index(which >> d & 1 ? (double)n[d] : 0);
}

/* Where the box says nothing, the field's own ends in RAS+ mm. */
static void fill_ends(double box[3][2], const struct ct_vol *v)
{
	double lo[3], hi[3];

	for (int c = 0; c < 8; c++) {
		double ijk[3], mm[3];

		corner(ijk, v->n, c);
		ct_vol_world(v, ijk, mm);
		for (int d = 0; d < 3; d++) {
			lo[d] = c ? fmin(lo[d], mm[d]) : mm[d];
			hi[d] = c ? fmax(hi[d], mm[d]) : mm[d];
		}
	}
	for (int d = 0; d < 3; d++) {
		box[d][0] = isinf(box[d][0]) ? lo[d] : box[d][0];
		box[d][1] = isinf(box[d][1]) ? hi[d] : box[d][1];
	}
}

/* The box of voxel cells, from 0 to n, that covers one of RAS+ mm. */
static void to_cells(double box[3][2], const struct ct_vol *v)
{
	double lo[3], hi[3], mm[3];

	fill_ends(box, v);
	ct_vol_spacing(v, mm);
	for (int c = 0; c < 8; c++)
		for (int d = 0; d < 3; d++) {
			double at = 0;

			for (int r = 0; r < 3; r++)
				at += v->affine[r][d] * (box[r][c >> r & 1] - v->affine[r][3]);
			at = ct_cell_centre(at / (mm[d] * mm[d]));
			lo[d] = c ? fmin(lo[d], at) : at;
			hi[d] = c ? fmax(hi[d], at) : at;
		}
	for (int d = 0; d < 3; d++) { /* a hair of the next cell is rounding */
		box[d][0] = floor(lo[d] + 1e-4);
		box[d][1] = ceil(hi[d] - 1e-4);
	}
}

static int find_body(double box[3][2], const struct ct_vol *v, struct ct_err *e)
{
	size_t from[3], to[3];
	double mm[3];

	if (ct_crop_region(from, to, v->data, v->n, BODY, e))
		return -1;
	ct_vol_spacing(v, mm);
	for (int d = 0; d < 3; d++) {
		const double margin = ceil(MARGIN / mm[d]);

		box[d][0] = (double)from[d] - margin;
		box[d][1] = (double)to[d] + margin;
	}
	return 0;
}

static int find_box(double box[3][2], const struct ct_vol *v, const char *text, struct ct_err *e)
{
	bool mm;

	if (strcmp(text, "auto") == 0)
		return find_body(box, v, e);
	if (parse_box(box, &mm, text, e) || (mm && ct_vol_check_grid(v, e)))
		return -1;
	if (mm)
		to_cells(box, v);
	for (int d = 0; d < 3 && !mm; d++)
		for (int k = 0; k < 2; k++)
			if (!isinf(box[d][k]) && box[d][k] != floor(box[d][k]))
				return ct_fail(
					e, CT_EUSAGE, "--crop: voxel %g is not whole", box[d][k]);
	return 0;
}

int convert_crop(struct ct_vol *v, const char *text, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol w = {0};
	ptrdiff_t start[3];
	double box[3][2], first[3];
	size_t n[3];

	if (find_box(box, v, text, e))
		return -1;
	for (int d = 0; d < 3; d++) {
		const double lo = fmax(box[d][0], 0), hi = fmin(box[d][1], (double)v->n[d]);

		if (!(lo < hi))
			return ct_fail(e, CT_EUSAGE, "--crop: nothing of axis %d is inside", d);
		first[d] = lo;
		start[d] = (ptrdiff_t)lo;
		n[d] = (size_t)(hi - lo);
	}
	if (ct_vol_alloc(&w, n, e))
		return -1;
	ct_log(env, CT_INFO, "cropped to voxels %td:%td,%td:%td,%td:%td of %zux%zux%zu", start[0],
		start[0] + (ptrdiff_t)n[0], start[1], start[1] + (ptrdiff_t)n[1], start[2],
		start[2] + (ptrdiff_t)n[2], v->n[0], v->n[1], v->n[2]);
	ct_crop(w.data, n, v->data, v->n, start, 0);
	ct_crop_affine(v->affine, first);
	convert_replace(v, &w);
	return 0;
}
