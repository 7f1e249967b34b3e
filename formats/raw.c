/* raw.c: see raw.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/mem.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/raw.h"
#include "formats/source.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int ct_raw_type(const char *word, enum ct_voxel *type, bool *big, struct ct_err *e)
{
#define NAME(value, word) {word, value},
	static const struct ct_voxel_name names[] = {CT_RAW_LIST(NAME){NULL, 0}};
	const size_t len = strcspn(word, ":");

	*big = strcmp(word + len, ":be") == 0;
	if ((*big || word[len] == '\0' || strcmp(word + len, ":le") == 0) &&
		ct_voxel_named(type, names, word, len))
		return 0;
	return ct_fail(e, CT_EUSAGE,
		"--raw: '%s' is not one of" CT_RAW_LIST(CT_WORD_SPACE) ", with :be if big-endian",
		word);
}

int ct_raw_axes(const char *option, const char *word, int world[3], int sign[3], struct ct_err *e)
{
	static const char letters[] = "RLAPSI";
	int seen = 0;

	for (int d = 0; d < 3 && strlen(word) == 3; d++) {
		const char *at = strchr(letters, word[d]);

		if (at) {
			world[d] = (int)(at - letters) / 2;
			sign[d] = (at - letters) % 2 ? -1 : 1;
			seen |= 1 << world[d];
		}
	}
	if (seen != 7)
		return ct_fail(e, CT_EUSAGE,
			"--%s: '%s' is not three letters such as LPS, one each of R/L, A/P and S/I",
			option, word);
	return 0;
}

void ct_raw_place(struct ct_vol *v, const struct ct_raw *how)
{
	double centre[3];

	memset(v->affine, 0, sizeof v->affine);
	for (int d = 0; d < 3; d++)
		v->affine[how->world[d]][d] = how->sign[d] * how->spacing[d];
	ct_vol_centre(v, centre);
	for (int r = 0; r < 3; r++)
		v->affine[r][3] = 0 - centre[r];
}

int ct_raw_read(const char *path, const struct ct_raw *how, struct ct_vol *v, struct ct_err *e)
{
	const struct ct_stored stored = {how->type, how->big, how->slope, how->inter};
	FILE *f = NULL;
	int rc = -1;

	if (ct_io_open(path, &f, e))
		return -1;
	if (ct_vol_alloc(v, how->n, e))
		goto out;
	ct_raw_place(v, how);
	if (ct_vol_check_grid(v, e) || ct_source_whole(f, &stored, ct_vol_count(v), v->data,
					       "its dimensions and type say", e))
		goto out;
	rc = ct_meta_input(&v->meta, path, 2,
		(const struct ct_piece[]){{v->affine, sizeof v->affine},
			{v->data, ct_vol_count(v) * sizeof *v->data}},
		e);
out:
	ct_io_close(f);
	if (rc) {
		ct_vol_free(v);
		ct_blame(e, path);
	}
	return rc;
}

/* "\x93NUMPY", version, length of the header (2 bytes in version 1, else 4), then a Python dict:
 * {'descr': '<f4', 'fortran_order': False, 'shape': (100, 64, 64), }, blanks and a newline. */
enum { LONGEST = 1 << 16 }; /* bytes of a header */

struct header {
	struct ct_stored stored;
	size_t n[3];
};

static int parse_type(struct header *h, const char *s, struct ct_err *e)
{
	static const struct ct_voxel_name types[] = {{"f2", CT_V_F16}, {"f4", CT_V_F32},
		{"f8", CT_V_F64}, {"u1", CT_V_U8}, {"i1", CT_V_I8}, {"u2", CT_V_U16},
		{"i2", CT_V_I16}, {"u4", CT_V_U32}, {"i4", CT_V_I32}, {"u8", CT_V_U64},
		{"i8", CT_V_I64}, {NULL, 0}};
	char quote = *s;

	if ((quote == '\'' || quote == '"') && s[1] && strchr("<>|=", s[1]) && strlen(s) > 4 &&
		s[4] == quote && ct_voxel_named(&h->stored.type, types, s + 2, 2)) {
		h->stored.big = s[1] == '>';
		if (h->stored.type == CT_V_F16) { /* scaled once they are read */
			h->stored.slope = 1;
			h->stored.inter = 0;
		}
		return 0;
	}
	return ct_fail(e, CT_EINPUT, "descr %.*s is no type of number that is read here",
		(int)fmin((double)strcspn(s, ","), 40), s);
}

static int parse_shape(struct header *h, const char *s, struct ct_err *e)
{
	const int all = (int)fmin((double)strcspn(s, ")") + 1, 40);
	const char *begin = s, *end;
	size_t dims = 0, n[3];

	for (s += *s == '('; dims < 3 && *s >= '0' && *s <= '9'; s = end) {
		const double x = ct_number_begin(s, &end);

		if (!(x >= 1 && x <= INT32_MAX) || x != floor(x))
			return ct_fail(
				e, CT_EINPUT, "shape %.*s has a length that is none", all, begin);
		n[dims++] = (size_t)x;
		end += strspn(end, ", ");
	}
	if (dims < 2 || *s != ')')
		return ct_fail(e, CT_EINPUT, "shape is not of two or three dimensions");
	h->n[0] = n[0];
	h->n[1] = dims == 3 ? n[1] : 1;
	h->n[2] = n[dims - 1];
	return 0;
}

/* The text behind 'key': */
static const char *value(const char *text, const char *key)
{
	const char *s = strstr(text, key);

	if (!s)
		return NULL;
	s += strlen(key);
	s += strspn(s, "'\" ");
	if (*s++ != ':')
		return NULL;
	return s + strspn(s, " ");
}

static int parse(struct header *h, const char *text, struct ct_err *e)
{
	const char *type = value(text, "descr"), *order = value(text, "fortran_order");
	const char *shape = value(text, "shape");

	if (!type || !order || !shape)
		return ct_fail(e, CT_EINPUT, "header without descr, fortran_order or shape");
	if (strncmp(order, "False", 5) != 0)
		return ct_fail(e, CT_EINPUT, "fortran_order is not False: save it in C order");
	return ct_err_any(parse_type(h, type, e) || parse_shape(h, shape, e));
}

static int read_header(struct header *h, FILE *f, struct ct_err *e)
{
	unsigned char start[12];
	size_t lead = 10, n;
	char *text = NULL;
	int rc = -1;

	if (fread(start, 1, lead, f) != lead || memcmp(start, "\x93NUMPY", 6) != 0)
		return ct_fail(
			e, CT_EINPUT, "not a numpy array, nor MATLAB, HDF5, EXR or a picture");
	n = start[8] | (size_t)start[9] << 8;
	if (start[6] < 1 || start[6] > 3)
		return ct_fail(e, CT_EINPUT, "numpy format version %d", start[6]);
	if (start[6] > 1) {
		if (fread(start + 10, 1, 2, f) != 2)
			return ct_fail(e, CT_EINPUT, "truncated in its header");
		n |= (size_t)start[10] << 16 | (size_t)start[11] << 24;
	}
	if (n > LONGEST)
		return ct_fail(e, CT_EINPUT, "header of %zu bytes", n);
	if (ct_alloc(&text, n + 1, 1, e))
		return -1;
	text[n] = '\0';
	if (fread(text, 1, n, f) != n)
		ct_fail(e, CT_EINPUT, "truncated in its header");
	else
		rc = parse(h, text, e);
	free(text);
	return rc;
}

int ct_raw_npy(const char *path, double slope, double inter, size_t n[static 3], float **data,
	struct ct_err *e)
{
	struct header h = {.stored = {.slope = slope, .inter = inter}};
	float *out = NULL;
	size_t total;
	FILE *f;
	int rc = -1;

	if (ct_io_open(path, &f, e))
		return -1;
	if (read_header(&h, f, e) || ct_size_mul(&total, h.n[0], h.n[1], "shape", e) ||
		ct_size_mul(&total, total, h.n[2], "shape", e) ||
		ct_alloc(&out, total, sizeof *out, e) ||
		ct_source_whole(f, &h.stored, total, out, "its shape says", e)) {
		free(out);
		ct_blame(e, path);
	} else {
		for (size_t i = 0; h.stored.type == CT_V_F16 && i < total; i++)
			out[i] = (float)(slope * (double)out[i] + inter);
		memcpy(n, h.n, sizeof h.n);
		*data = out;
		rc = 0;
	}
	ct_io_close(f);
	return rc;
}
