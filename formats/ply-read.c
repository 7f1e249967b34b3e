/* ply-read.c: PLY to Gaussians; see ply.c. */
#include "config.h"
#include "formats/bytes.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/ply.h"
#include "formats/voxels.h"
#include "core/mem.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PROPERTIES = 4096, BLOCK = 1024 };

struct reader {
	const char *path;
	const unsigned char *data;
	size_t n, at;         /* bytes; start of the next header line, then of the data */
	uint64_t count, skip; /* vertices; bytes of elements before them */
	size_t stride;
	size_t offset[CT_PLY_FIELDS], properties;
	size_t comments;                   /* of ours */
	bool format;                       /* the line has been seen */
	enum ct_voxel type[CT_PLY_FIELDS]; /* 0: not there yet */
	struct ct_err *e;
};

static const struct ct_voxel_name types[] = {{"char", CT_V_I8}, {"int8", CT_V_I8},
	{"uchar", CT_V_U8}, {"uint8", CT_V_U8}, {"short", CT_V_I16}, {"int16", CT_V_I16},
	{"ushort", CT_V_U16}, {"uint16", CT_V_U16}, {"int", CT_V_I32}, {"int32", CT_V_I32},
	{"uint", CT_V_U32}, {"uint32", CT_V_U32}, {"float", CT_V_F32}, {"float32", CT_V_F32},
	{"double", CT_V_F64}, {"float64", CT_V_F64}, {NULL, 0}};

/* The next header line without its end, as a string from malloc, or NULL. */
static char *next_line(struct reader *d)
{
	const unsigned char *from = d->data + d->at, *end;
	size_t n;
	char *line;

	if (d->at >= d->n || !(end = memchr(from, '\n', d->n - d->at)))
		return NULL;
	n = (size_t)(end - from);
	d->at += n + 1;
	if (n && from[n - 1] == '\r')
		n--;
	line = malloc(n + 1);
	if (line) {
		memcpy(line, from, n);
		line[n] = '\0';
	}
	return line;
}

static void unescape(char *s)
{
	char *to = s;

	for (; *s; s++) {
		char hex[3] = {0};

		if (s[0] == '\\' && s[1] == 'n') {
			*to++ = '\n';
			s++;
		} else if (s[0] == '\\' && s[1] == '\\') {
			*to++ = '\\';
			s++;
		} else if (s[0] == '\\' && s[1] == 'x' && s[2] && s[3]) {
			memcpy(hex, s + 2, 2);
			*to++ = (char)strtol(hex, NULL, 16);
			s += 3;
		} else
			*to++ = *s;
	}
	*to = '\0';
}

/* "KEY=VALUE" of a comment into `own_keys` or into the metadata. */
static int comment(struct reader *d, char *s, struct ct_meta *own_keys, struct ct_meta *meta)
{
	char *value = strchr(s, '=');
	struct ct_meta *to;

	if (!value || value == s)
		return 0;
	*value++ = '\0';
	to = ct_ply_own(s) ? own_keys : meta;
	if (++d->comments > MOST_PROPERTIES)
		return ct_fail(d->e, CT_EINPUT, "%s: more than %d comments ct:KEY=VALUE", d->path,
			MOST_PROPERTIES);
	unescape(s);
	unescape(value);
	return *s ? ct_meta_set(to, s, value, d->e) : 0;
}

static int property(struct reader *d, const char *s, bool vertex, uint64_t *bytes)
{
	char word[20], name[80];
	enum ct_voxel type;
	size_t size;

	if (sscanf(s, "%19s %79s", word, name) != 2)
		return ct_fail(d->e, CT_EINPUT, "%s: header line 'property %.40s'", d->path, s);
	if (!ct_voxel_named(&type, types, word, strlen(word)))
		return ct_fail(d->e, CT_EINPUT,
			"%s: property %s is of type %s; lists and other types are not read",
			d->path, name, word);
	for (size_t k = 0; vertex && k < CT_PLY_FIELDS; k++)
		if (strcmp(name, ct_ply_names[k]) == 0) {
			d->type[k] = type;
			d->offset[k] = d->stride;
		}
	size = ct_voxel_bytes(type);
	d->stride += vertex ? size : 0;
	*bytes += size;
	return ++d->properties > MOST_PROPERTIES
		       ? ct_fail(d->e, CT_EINPUT, "%s: more than %d properties", d->path,
				 MOST_PROPERTIES)
		       : 0;
}

/* State of the header: which element the properties belong to. */
struct element {
	enum { NONE, BEFORE, VERTEX, AFTER } kind;
	uint64_t count, bytes;
};

/* Bytes of an element that lies before the vertices. */
static int close_element(struct reader *d, const struct element *el)
{
	uint64_t n;

	if (el->kind != BEFORE)
		return 0;
	if (__builtin_mul_overflow(el->count, el->bytes, &n) ||
		__builtin_add_overflow(d->skip, n, &d->skip))
		return ct_fail(d->e, CT_EINPUT, "%s: sizes in the header overflow", d->path);
	return 0;
}

static int open_element(struct reader *d, const char *s, struct element *el)
{
	char name[40], number[24], *end;

	if (close_element(d, el))
		return -1;
	if (sscanf(s, "%39s %23s", name, number) != 2)
		return ct_fail(d->e, CT_EINPUT, "%s: header line 'element %.40s'", d->path, s);
	el->count = strtoull(number, &end, 10);
	if (*end || *number == '-' || el->count > INT64_MAX)
		return ct_fail(
			d->e, CT_EINPUT, "%s: element %s: count '%s'", d->path, name, number);
	el->bytes = 0;
	if (strcmp(name, "vertex") == 0) {
		if (el->kind == VERTEX || el->kind == AFTER)
			return ct_fail(d->e, CT_EINPUT, "%s: two elements vertex", d->path);
		el->kind = VERTEX;
		d->count = el->count;
	} else
		el->kind = el->kind == VERTEX || el->kind == AFTER ? AFTER : BEFORE;
	return 0;
}

/* One line; 1 at the end of the header. */
static int header_line(struct reader *d, char *s, struct element *el, struct ct_meta *own_keys,
	struct ct_meta *meta)
{
	if (strncmp(s, CT_PLY_COMMENT, sizeof CT_PLY_COMMENT - 1) == 0)
		return comment(d, s + sizeof CT_PLY_COMMENT - 1, own_keys, meta);
	if (strcmp(s, "comment") == 0 || strncmp(s, "comment ", 8) == 0 ||
		strncmp(s, "obj_info", 8) == 0)
		return 0;
	if (strncmp(s, "format ", 7) == 0) {
		d->format = strcmp(s + 7, "binary_little_endian 1.0") == 0;
		return d->format
			       ? 0
			       : ct_fail(d->e, CT_EINPUT,
					 "%s: PLY format '%.40s'; only binary_little_endian 1.0 is read",
					 d->path, s + 7);
	}
	if (strncmp(s, "element ", 8) == 0)
		return open_element(d, s + 8, el);
	if (strncmp(s, "property ", 9) == 0) {
		if (el->kind == NONE)
			return ct_fail(d->e, CT_EINPUT, "%s: property before any element", d->path);
		return el->kind == AFTER ? 0 : property(d, s + 9, el->kind == VERTEX, &el->bytes);
	}
	if (strcmp(s, "end_header") == 0)
		return close_element(d, el) ? -1 : 1;
	return ct_fail(d->e, CT_EINPUT, "%s: header line '%.60s'", d->path, s);
}

static int read_header(struct reader *d, struct ct_meta *own_keys, struct ct_meta *meta)
{
	struct element el = {0};
	int rc = 0;

	if (d->n < 4 || memcmp(d->data, "ply", 3) != 0 ||
		(d->data[3] != '\n' && d->data[3] != '\r'))
		return ct_fail(d->e, CT_EINPUT, "%s: not a PLY file", d->path);
	free(next_line(d));
	while (rc == 0) {
		char *line = next_line(d);

		if (!line)
			return ct_fail(d->e, CT_EINPUT, "%s: the PLY header has no end", d->path);
		rc = header_line(d, line, &el, own_keys, meta);
		free(line);
	}
	if (rc < 0)
		return -1;
	if (!d->format)
		return ct_fail(d->e, CT_EINPUT, "%s: the PLY header has no format", d->path);
	for (size_t k = 0; k < CT_PLY_FIELDS; k++)
		if (!d->type[k])
			return ct_fail(d->e, CT_EINPUT, "%s: no vertex property %s%s", d->path,
				ct_ply_names[k],
				k == CT_PLY_FIELDS - 1
					? ": a PLY of colours, not of signed densities"
					: "");
	if (d->skip > d->n - d->at || d->count > (d->n - d->at - d->skip) / d->stride)
		return ct_fail(d->e, CT_EINPUT,
			"%s: %llu Gaussians of %zu bytes do not fit in %zu bytes", d->path,
			(unsigned long long)d->count, d->stride, d->n - d->at);
	d->at += (size_t)d->skip;
	return 0;
}

/* Field k of all vertices. */
static void read_field(const struct reader *d, size_t k, float *out)
{
	const size_t bytes = ct_voxel_bytes(d->type[k]);
	const unsigned char *from = d->data + d->at + d->offset[k];
	_Alignas(8) unsigned char block[BLOCK * 8];

	for (size_t i = 0, n; i < d->count; i += n) {
		n = d->count - i < BLOCK ? (size_t)d->count - i : BLOCK;
		for (size_t j = 0; j < n; j++, from += d->stride)
			memcpy(block + j * bytes, from, bytes);
		ct_voxels_float(n, out + i, d->type[k], block, 1, 0);
	}
}

/* n numbers of a comment of ours: 0, 1 if it is not there, -1. */
static int numbers(
	struct reader *d, const struct ct_meta *keys, const char *key, size_t n, double *v)
{
	int rc = ct_meta_numbers(keys, key, n, v, d->e);

	return rc < 0 ? ct_blame(d->e, d->path) : rc;
}

static int whole(struct reader *d, const char *key, double x, size_t *out)
{
	if (!(x >= 0 && x <= 0x1p53) || x != floor(x))
		return ct_fail(
			d->e, CT_EINPUT, "%s: comment ct:%s: %g is not a count", d->path, key, x);
	*out = (size_t)x;
	return 0;
}

static int read_own(struct reader *d, const struct ct_meta *keys, struct ct_gauss *g)
{
	const char *activation = ct_meta_get(keys, CT_PLY_ACTIVATION),
		   *units = ct_meta_get(keys, CT_PLY_UNITS);
	double x = 0, v[12];
	int rc, word;

	if (!activation)
		return ct_fail(d->e, CT_EINPUT, "%s: no comment ct:activation", d->path);
	if (ct_words_take(&word, CT_WORDS(CT_ACTIVATION_LIST), CT_PLY_ACTIVATION, activation, d->e))
		return ct_blame(d->e, d->path);
	g->activation = (enum ct_activation)word;
	if (units && strcmp(units, "mm") != 0)
		return ct_fail(d->e, CT_EINPUT, "%s: units are '%.20s', not mm", d->path, units);
	g->gamma = 1;
	rc = numbers(d, keys, CT_PLY_GAMMA, 1, &g->gamma);
	if (rc < 0)
		return -1;
	if ((rc && g->activation == CT_PRELU) || !(g->gamma > 0))
		return ct_fail(
			d->e, CT_EINPUT, "%s: comment ct:gamma is not a positive number", d->path);
	if (numbers(d, keys, CT_PLY_STEP, 1, &x) < 0 || whole(d, CT_PLY_STEP, x, &g->step))
		return -1;
	rc = numbers(d, keys, CT_PLY_GRID, 3, v);
	for (int a = 0; rc == 0 && a < 3; a++)
		rc = whole(d, CT_PLY_GRID, v[a], &g->grid[a]);
	if (rc < 0)
		return -1;
	rc = numbers(d, keys, CT_PLY_AFFINE, 12, v);
	for (int i = 0; rc == 0 && i < 12; i++)
		g->affine[i / 4][i % 4] = v[i];
	return rc < 0 ? -1 : 0;
}

static int sign(struct ct_gauss *g, const char *path, struct ct_err *e)
{
	const double head[2] = {g->gamma, (double)g->activation};
	struct ct_piece piece[CT_PLY_FIELDS + 1] = {{head, sizeof head}};

	for (size_t k = 0; k < CT_PLY_FIELDS; k++)
		piece[1 + k] = (struct ct_piece){g->column[k], g->n * sizeof **g->column};
	return ct_meta_input(&g->meta, path, CT_PLY_FIELDS + 1, piece, e);
}

int ct_bytes_read_ply(
	const unsigned char *data, size_t n, const char *name, struct ct_gauss *g, struct ct_err *e)
{
	struct reader d = {.path = name, .data = data, .n = n, .e = e};
	struct ct_meta keys = {0};
	int rc = -1;

	if (read_header(&d, &keys, &g->meta) || read_own(&d, &keys, g) ||
		ct_gauss_reserve(g, (size_t)d.count + 1, e))
		goto done;
	g->n = (size_t)d.count;
	for (size_t k = 0; k < CT_PLY_FIELDS; k++)
		read_field(&d, k, g->column[k]);
	rc = sign(g, name, e);
done:
	ct_meta_free(&keys);
	if (rc)
		ct_gauss_free(g);
	return rc;
}
