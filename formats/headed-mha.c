/* headed-mha.c: the header of MetaImage: lines KEY = VALUE, the last ElementDataFile. See headed.h.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/number.h"
#include "formats/headed-impl.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { DIMS = 4 }; /* that are read at most */

/* The fields, from `line` on. */
static int read_fields(FILE *f, char *line, struct ct_headed *h, struct ct_err *e)
{
	char *next = NULL;
	int rc = 1;

	while (rc == 1) {
		char *value = strpbrk(line, "=:");

		if (value) {
			*value++ = '\0';
			rc = ct_headed_set(h, "ct-", line, value, e) ? -1 : 1;
		} else if (line[strspn(line, " \t")])
			rc = ct_fail(e, CT_EINPUT, "'%.40s' is no field", line);
		free(next);
		next = NULL;
		if (rc == 1 && ct_headed_get(h, "ElementDataFile"))
			return 0;
		if (rc == 1)
			rc = ct_headed_line(f, &next, e);
		line = next;
	}
	free(next);
	return rc < 0 ? -1 : ct_fail(e, CT_EINPUT, "truncated header: has no ElementDataFile");
}

/* n numbers of a field that has three names, the first of them that is there: 0; 1: none is. If
 * more are, and say something else, CT_EGEOM. */
static int numbers_of(
	const struct ct_headed *h, const char *const name[3], size_t n, double *x, struct ct_err *e)
{
	const char *first = NULL;

	for (int i = 0; i < 3; i++) {
		double other[DIMS * DIMS];
		const int rc = ct_headed_numbers(h, name[i], n, other, e);

		if (rc < 0)
			return -1;
		for (size_t k = 0; rc == 0 && first && k < n; k++)
			if (!(fabs(x[k] - other[k]) <= 1e-4 * (1 + fabs(x[k]))))
				return ct_fail(
					e, CT_EGEOM, "%s: is not what %s says", name[i], first);
		if (rc == 0 && !first) {
			first = name[i];
			memcpy(x, other, n * sizeof *x);
		}
	}
	return !first;
}

/* The first of two names if it is there, else the other. */
static const char *one_of(const struct ct_headed *h, const char *a, const char *b)
{
	return ct_headed_get(h, a) ? a : b;
}

/* A field that is true or false; false if it is not there. */
static int truth(const struct ct_headed *h, const char *key, bool *is, struct ct_err *e)
{
	static const char *const words[] = {"false", "f", "0", "true", "t", "1"};
	const char *s = ct_headed_get(h, key);

	*is = false;
	for (size_t i = 0; s && i < sizeof words / sizeof *words; i++)
		if (strcasecmp(s, words[i]) == 0) {
			*is = i >= 3;
			return 0;
		}
	return s ? ct_fail(e, CT_EINPUT, "%s: '%.40s' is neither True nor False", key, s) : 0;
}

/* Are the highest bytes the first? By any of two names, which say the same. */
static int parse_order(struct ct_headed *h, struct ct_err *e)
{
	static const char *const name[] = {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"};
	bool big[2];

	if (truth(h, name[0], &big[0], e) || truth(h, name[1], &big[1], e))
		return -1;
	if (big[0] != big[1] && ct_headed_get(h, name[0]) && ct_headed_get(h, name[1]))
		return ct_fail(e, CT_EINPUT, "%s: is not what %s says", name[1], name[0]);
	h->stored.big = big[0] || big[1];
	return 0;
}

/* A field that may be only this, if it is there. */
static int must_be(const struct ct_headed *h, const char *key, const char *word, struct ct_err *e)
{
	const char *s = ct_headed_get(h, key);
	double said, expected;

	if (!s || strcasecmp(s, word) == 0 ||
		(ct_number_read(&said, s) && ct_number_read(&expected, word) && said == expected))
		return 0;
	return ct_fail(e, CT_EINPUT, "%s: '%.40s' is not read here, only %s", key, s, word);
}

static int parse_place(struct ct_headed *h, size_t dims, struct ct_err *e)
{
	static const double lps[3] = {-1, -1, 1};
	static const char *const matrix[3] = {"TransformMatrix", "Rotation", "Orientation"};
	static const char *const offset[3] = {"Offset", "Position", "Origin"};
	const char *spacing = one_of(h, "ElementSpacing", "ElementSize");
	double turn[DIMS * DIMS], step[3][3] = {{0}}, origin[DIMS] = {0}, mm[DIMS];
	int turned = numbers_of(h, matrix, dims * dims, turn, e);
	int moved = turned < 0 ? -1 : numbers_of(h, offset, dims, origin, e);
	int sized = moved < 0 ? -1 : ct_headed_numbers(h, spacing, dims, mm, e);

	if (sized)
		return sized < 0 ? -1 : ct_fail(e, CT_EINPUT, "has no ElementSpacing");
	for (size_t d = 0; d < h->axes; d++) {
		if (!(mm[d] > 0))
			return ct_fail(e, CT_EGEOM, "%s: %g is no distance", spacing, mm[d]);
		for (size_t r = 0; r < h->axes; r++)
			step[d][r] = mm[d] * (turned ? d == r : turn[d * dims + r]);
	}
	h->placed = h->axes == 3 && (!turned || !moved); /* two numbers are no place in space */
	ct_headed_place(h, (const double(*)[3])step, origin, lps);
	return 0;
}

/* NDims, 3 if it does not say: of 4 the last is none of space. */
static int parse_dims(struct ct_headed *h, size_t *dims, struct ct_err *e)
{
	double n = 3;

	if (ct_headed_numbers(h, "NDims", 1, &n, e) < 0)
		return -1;
	if (n != 2 && n != 3 && n != DIMS)
		return ct_fail(e, CT_EINPUT, "NDims: %g is not read here, only 2 to %d", n, DIMS);
	*dims = (size_t)n;
	h->axes = *dims == 2 ? 2 : 3;
	return 0;
}

static int parse_file(struct ct_headed *h, struct ct_err *e)
{
	const char *file = ct_headed_get(h, "ElementDataFile");
	double skip = 0;

	if (ct_headed_numbers(h, "HeaderSize", 1, &skip, e) < 0 ||
		truth(h, "CompressedData", &h->packed, e))
		return -1;
	h->at_end = skip == -1;
	if ((skip < 0 && !h->at_end) || skip > 1e15 || skip != floor(skip) ||
		(skip != 0 && h->packed))
		return ct_fail(e, CT_EINPUT, "HeaderSize: %g%s", skip,
			h->packed ? " of compressed data" : "");
	h->skip = h->at_end ? 0 : (size_t)skip;
	if (strcasecmp(file, "LOCAL") == 0)
		return 0;
	return ct_headed_file(h, "ElementDataFile", file, e);
}

int ct_headed_mha(FILE *f, char *line, struct ct_headed *h, struct ct_err *e)
{
	static const struct ct_voxel_name types[] = {{"MET_CHAR", CT_V_I8}, {"MET_UCHAR", CT_V_U8},
		{"MET_SHORT", CT_V_I16}, {"MET_USHORT", CT_V_U16}, {"MET_INT", CT_V_I32},
		{"MET_UINT", CT_V_U32}, {"MET_LONG_LONG", CT_V_I64}, {"MET_ULONG_LONG", CT_V_U64},
		{"MET_FLOAT", CT_V_F32}, {"MET_DOUBLE", CT_V_F64}, {NULL, 0}};
	static const char *const only[][2] = {{"ObjectType", "Image"}, {"BinaryData", "True"},
		{"ElementNumberOfChannels", "1"}, {"ElementToIntensityFunctionSlope", "1"},
		{"ElementToIntensityFunctionOffset", "0"}};
	const char *units;
	size_t dims = 0;

	if (read_fields(f, line, h, e))
		return -1;
	for (size_t i = 0; i < sizeof only / sizeof *only; i++)
		if (must_be(h, only[i][0], only[i][1], e))
			return -1;
	units = ct_headed_get(h, "DistanceUnits");
	if (units && strcmp(units, "?") != 0 && must_be(h, "DistanceUnits", "mm", e))
		return -1;
	if (parse_dims(h, &dims, e) || ct_headed_sizes(h, "DimSize", dims, e) ||
		ct_headed_number_type(h, "ElementType", types, e) || parse_place(h, dims, e) ||
		parse_file(h, e) || parse_order(h, e))
		return -1;
	return 0;
}
