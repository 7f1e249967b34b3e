/* headed-nrrd.c: the header of NRRD: lines "KEY: VALUE" and "KEY:=VALUE", up to an empty one. See
 * headed.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec3.h"
#include "formats/headed-impl.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { KINDS = 3 };
static const char *const kinds[KINDS] = {"domain", "space", "???"}; /* of an axis of space */

/* Small letters, no blanks. */
static void normalise(char *key)
{
	char *out = key;

	for (; *key; key++)
		if (*key != ' ' && *key != '\t')
			*out++ = (char)tolower((unsigned char)*key);
	*out = '\0';
}

static int take_line(struct ct_headed *h, char *line, struct ct_err *e)
{
	char *pair = strstr(line, ":="), *field = strstr(line, ": ");

	if (*line == '#')
		return 0;
	if (pair && (!field || pair < field)) {
		*pair = '\0';
		return strncmp(line, "ct:", 3) == 0 ? ct_headed_set(h, "ct:", line, pair + 2, e)
						    : 0; /* of another program */
	}
	if (!field)
		return ct_fail(e, CT_EINPUT, "'%.40s' is no field", line);
	*field = '\0';
	normalise(line);
	if (ct_headed_set(h, "ct:", line, field + 2, e))
		return -1;
	if (strcmp(line, "datafile") == 0 && strncmp(ct_headed_get(h, line), "LIST", 4) == 0)
		return ct_headed_file(h, "data file", "LIST", e); /* no fields are behind it */
	return 0;
}

static int read_fields(FILE *f, struct ct_headed *h, struct ct_err *e)
{
	char *line;
	int rc;

	while ((rc = ct_headed_line(f, &line, e)) == 1) {
		const bool last = !*line;

		rc = last ? 0 : take_line(h, line, e);
		free(line);
		if (last || rc)
			return rc;
	}
	free(line);
	if (rc < 0 || ct_headed_get(h, "datafile"))
		return rc;
	return ct_fail(e, CT_EINPUT, "truncated header: no empty line ends it");
}

/* Entry k of a list with one for each axis, a word, "text" or (vector), and its length; or NULL. */
static const char *entry(const struct ct_headed *h, const char *key, size_t k, size_t *n)
{
	const char *s = ct_headed_get(h, key);

	for (*n = 0; s && *(s += strspn(s, " \t")); s += *n) {
		const char *end = *s == '('   ? strchr(s, ')')
				  : *s == '"' ? strchr(s + 1, '"')
					      : NULL;

		*n = end ? (size_t)(end - s) + 1 : strcspn(s, " \t");
		if (k-- == 0)
			return s;
	}
	return NULL;
}

static bool is_entry(const struct ct_headed *h, const char *key, size_t k, const char *word)
{
	size_t n;
	const char *s = entry(h, key, k, &n);

	return s && n == strlen(word) && strncasecmp(s, word, n) == 0;
}

/* Is the axis none of space? */
static bool is_other(const struct ct_headed *h, size_t k)
{
	size_t n;

	if (is_entry(h, "spacedirections", k, "none"))
		return true;
	if (!entry(h, "kinds", k, &n))
		return false;
	for (size_t i = 0; i < KINDS; i++)
		if (is_entry(h, "kinds", k, kinds[i]))
			return false;
	return true;
}

/* As if the axis were not there, which has to be single. */
static int leave_out(struct ct_headed *h, size_t k, struct ct_err *e)
{
	static const char *const lists[] = {
		"sizes", "kinds", "spacings", "spacedirections", "units"};
	size_t n;

	if (!is_entry(h, "sizes", k, "1"))
		return ct_fail(e, CT_EINPUT,
			"sizes: axis %zu is none of space and not single: only one volume a file is "
			"read",
			k + 1);
	for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
		const char *all = ct_headed_get(h, lists[i]), *s = entry(h, lists[i], k, &n);
		char *rest = NULL;
		int rc;

		if (!s)
			continue;
		if (asprintf(&rest, "%.*s%s", (int)(s - all), all, s + n) < 0)
			return ct_fail(e, CT_ENOMEM, "no memory for a header");
		rc = ct_meta_set(&h->field, lists[i], rest, e);
		free(rest);
		if (rc)
			return -1;
	}
	h->axes--;
	return 0;
}

/* Those of space, 2 or 3. */
static int parse_axes(struct ct_headed *h, struct ct_err *e)
{
	double dimension;
	int rc = ct_headed_numbers(h, "dimension", 1, &dimension, e);
	size_t other = 0;

	if (rc)
		return rc < 0 ? -1 : ct_fail(e, CT_EINPUT, "has no dimension");
	if (dimension != 2 && dimension != 3 && dimension != 4)
		return ct_fail(
			e, CT_EINPUT, "dimension: %g is not read here, only 2 to 4", dimension);
	h->axes = (size_t)dimension;
	while (other < h->axes && !is_other(h, other))
		other++;
	if (other == h->axes && h->axes == 4)
		other = 3;
	if (other < h->axes && leave_out(h, other, e))
		return -1;
	return h->axes >= 2 ? 0 : ct_fail(e, CT_EINPUT, "dimension: only one of them is of space");
}

/* All words of a list, quoted or not, among those allowed? */
static int all_words(const struct ct_headed *h, const char *key, const char *const *allowed,
	size_t n, struct ct_err *e)
{
	const char *s = ct_headed_get(h, key);

	for (size_t len; s && *(s += strspn(s, " \t\"")); s += len) {
		size_t i = 0;

		len = strcspn(s, " \t\"");
		while (i < n && (strlen(allowed[i]) != len || strncasecmp(s, allowed[i], len) != 0))
			i++;
		if (i == n)
			return ct_fail(
				e, CT_EINPUT, "%s: '%.*s' is not read here", key, (int)len, s);
	}
	return 0;
}

/* Signs of the axes of `space` in RAS+. */
static int parse_space(const char *space, double sign[3], struct ct_err *e)
{
	static const struct {
		const char *name, *brief;
		double sign[3];
	} known[] = {{"right-anterior-superior", "RAS", {1, 1, 1}},
		{"left-anterior-superior", "LAS", {-1, 1, 1}},
		{"left-posterior-superior", "LPS", {-1, -1, 1}}};

	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		if (strcasecmp(space, known[i].name) == 0 ||
			strcasecmp(space, known[i].brief) == 0) {
			memcpy(sign, known[i].sign, sizeof known[i].sign);
			return 0;
		}
	return ct_fail(
		e, CT_EINPUT, "space: '%.40s' is not read here, only RAS, LAS and LPS", space);
}

/* Spacings, which beside directions say nothing else. */
static int parse_spacings(
	const struct ct_headed *h, bool directed, double step[3][3], struct ct_err *e)
{
	double mm[3];
	const int rc = ct_headed_numbers(h, "spacings", h->axes, mm, e);

	if (rc > 0 && !directed)
		return ct_fail(e, CT_EINPUT, "has neither space directions nor spacings");
	for (size_t d = 0; d < h->axes && rc == 0; d++) {
		const double by = ct_vec3_length(step[d]);

		if (directed && !(fabs(mm[d] - by) <= 1e-3 * by))
			return ct_fail(e, CT_EGEOM,
				"spacings: %g along axis %zu, where space directions say %g", mm[d],
				d, by);
		if (!directed && !(mm[d] > 0))
			return ct_fail(e, CT_EGEOM, "spacings: %g is no distance", mm[d]);
		if (!directed)
			step[d][d] = mm[d];
	}
	return rc < 0 ? -1 : 0;
}

static int parse_place(struct ct_headed *h, struct ct_err *e)
{
	const char *space = ct_headed_get(h, "space");
	double by[9], step[3][3] = {{0}}, origin[3] = {0}, sign[3] = {1, 1, 1};
	const size_t own = space ? 3 : h->axes; /* numbers of a direction */
	int rc, at;

	if (space && parse_space(space, sign, e))
		return -1;
	rc = ct_headed_numbers(h, "spacedirections", h->axes * own, by, e);
	if (rc == 0 && own == 3 && !space)
		return ct_fail(e, CT_EINPUT,
			"space directions without a space: where its axes run is not known");
	for (size_t d = 0; d < h->axes && rc == 0; d++)
		memcpy(step[d], by + d * own, own * sizeof *by);
	if (rc < 0 || parse_spacings(h, rc == 0, step, e))
		return -1;
	at = rc == 0 ? ct_headed_numbers(h, "spaceorigin", own, origin, e) : 1;
	h->placed = at == 0 && space;
	ct_headed_place(h, (const double(*)[3])step, origin, sign);
	return at < 0 ? -1 : 0;
}

static int parse_order(struct ct_headed *h, struct ct_err *e)
{
	const char *endian = ct_headed_get(h, "endian");
	const bool big = endian && strcasecmp(endian, "big") == 0;

	if (ct_voxel_bytes((int)h->stored.type) == 1)
		return 0;
	if (!endian || (!big && strcasecmp(endian, "little") != 0))
		return ct_fail(e, CT_EINPUT, "endian: '%.20s' is neither little nor big",
			endian ? endian : "");
	h->stored.big = big;
	return 0;
}

static int parse_file(struct ct_headed *h, struct ct_err *e)
{
	const char *encoding = ct_headed_get(h, "encoding");
	const char *file = ct_headed_get(h, "datafile");
	double lines = 0, skip = 0;

	if (!encoding)
		return ct_fail(e, CT_EINPUT, "has no encoding");
	h->packed = strcasecmp(encoding, "gzip") == 0 || strcasecmp(encoding, "gz") == 0;
	if (!h->packed && strcasecmp(encoding, "raw") != 0)
		return ct_fail(e, CT_EINPUT,
			"encoding: '%.20s' is not read here, only raw and gzip", encoding);
	if (ct_headed_numbers(h, "lineskip", 1, &lines, e) < 0 ||
		ct_headed_numbers(h, "byteskip", 1, &skip, e) < 0)
		return -1;
	h->at_end = skip == -1 && !h->packed;
	if ((skip < 0 && !h->at_end) || skip > 1e15 || lines < 0 || lines > 1e9 ||
		skip != floor(skip) || lines != floor(lines))
		return ct_fail(e, CT_EINPUT, "line skip: %g, byte skip: %g", lines, skip);
	h->lines = (size_t)lines;
	h->skip = h->at_end ? 0 : (size_t)skip;
	return file ? ct_headed_file(h, "data file", file, e) : 0;
}

int ct_headed_nrrd(FILE *f, struct ct_headed *h, struct ct_err *e)
{
	static const struct ct_voxel_name types[] = {{"signed char", CT_V_I8}, {"int8", CT_V_I8},
		{"int8_t", CT_V_I8}, {"uchar", CT_V_U8}, {"unsigned char", CT_V_U8},
		{"uint8", CT_V_U8}, {"uint8_t", CT_V_U8}, {"short", CT_V_I16},
		{"short int", CT_V_I16}, {"signed short", CT_V_I16}, {"signed short int", CT_V_I16},
		{"int16", CT_V_I16}, {"int16_t", CT_V_I16}, {"ushort", CT_V_U16},
		{"unsigned short", CT_V_U16}, {"unsigned short int", CT_V_U16},
		{"uint16", CT_V_U16}, {"uint16_t", CT_V_U16}, {"int", CT_V_I32},
		{"signed int", CT_V_I32}, {"int32", CT_V_I32}, {"int32_t", CT_V_I32},
		{"uint", CT_V_U32}, {"unsigned int", CT_V_U32}, {"uint32", CT_V_U32},
		{"uint32_t", CT_V_U32}, {"longlong", CT_V_I64}, {"long long", CT_V_I64},
		{"long long int", CT_V_I64}, {"signed long long", CT_V_I64},
		{"signed long long int", CT_V_I64}, {"int64", CT_V_I64}, {"int64_t", CT_V_I64},
		{"ulonglong", CT_V_U64}, {"unsigned long long", CT_V_U64},
		{"unsigned long long int", CT_V_U64}, {"uint64", CT_V_U64}, {"uint64_t", CT_V_U64},
		{"float", CT_V_F32}, {"double", CT_V_F64}, {NULL, 0}};
	static const char *const mm[] = {"mm"};

	return ct_err_any(read_fields(f, h, e) || parse_axes(h, e) ||
			  all_words(h, "kinds", kinds, KINDS, e) ||
			  all_words(h, "spaceunits", mm, 1, e) || all_words(h, "units", mm, 1, e) ||
			  ct_headed_sizes(h, "sizes", h->axes, e) ||
			  ct_headed_number_type(h, "type", types, e) || parse_order(h, e) ||
			  parse_place(h, e) || parse_file(h, e));
}
