/* ply.c: Gaussians as PLY, binary little-endian, so that 3-D Gaussian splatting viewers open them.
 *
 * Properties, all float: x y z nx ny nz f_dc_0..2 opacity scale_0..2 rot_0..3 density. Position in
 * mm, scale is ln of the standard deviation in mm, rot the quaternion w x y z, density the
 * raw signed value that the activation maps. nx..nz are 0; f_dc and opacity are for viewers
 * only: warm for positive and cold for negative density, as opaque as it is strong. What else
 * a set has stands in lines "comment ct:KEY=VALUE", with \n, \\ and \xHH for bytes that a line
 * cannot hold.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/number.h"
#include "core/mem.h"
#include "core/stream.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/r2.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/text.h"
#include "formats/voxels.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define COMMENT "comment ct:"
/* Keys of comments that are of the format, not metadata. */
#define UNITS "units"
#define ACTIVATION "activation"
#define GAMMA "gamma"
#define STEP "step"
#define GRID "grid"
#define AFFINE "affine"

enum { MOST_PROPERTIES = 4096, BLOCK = 1024, FIELDS = CT_GAUSS_COLUMNS };

/* The properties that are read, in the order of the columns of a set. */
static const char *const names[FIELDS] = {"x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0",
	"rot_1", "rot_2", "rot_3", "density"};

struct reader {
	const unsigned char *data;
	size_t n, at;    /* bytes; start of the next header line, then of the data */
	uint64_t count;  /* vertices */
	size_t elements; /* so far: properties are of the last one */
	size_t stride;
	size_t offset[FIELDS], properties;
	struct ct_meta own, *meta;  /* comments of the format, and others of ours */
	size_t comments;            /* how many */
	bool format;                /* the line has been seen */
	enum ct_voxel type[FIELDS]; /* 0: not there yet */
	struct ct_err *e;
};

static const struct ct_voxel_name types[] = {{"char", CT_V_I8}, {"int8", CT_V_I8},
	{"uchar", CT_V_U8}, {"uint8", CT_V_U8}, {"short", CT_V_I16}, {"int16", CT_V_I16},
	{"ushort", CT_V_U16}, {"uint16", CT_V_U16}, {"int", CT_V_I32}, {"int32", CT_V_I32},
	{"uint", CT_V_U32}, {"uint32", CT_V_U32}, {"float", CT_V_F32}, {"float32", CT_V_F32},
	{"double", CT_V_F64}, {"float64", CT_V_F64}, {NULL, 0}};

/* Is it a key of the format, not of metadata? */
static bool is_own(const char *key)
{
	static const char *const own[] = {UNITS, ACTIVATION, GAMMA, STEP, GRID, AFFINE};

	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (strcmp(own[i], key) == 0)
			return true;
	return false;
}

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

/* "KEY=VALUE". */
static int comment(struct reader *d, char *s)
{
	char *value = strchr(s, '=');
	struct ct_meta *to;

	if (!value || value == s)
		return 0;
	*value++ = '\0';
	to = is_own(s) ? &d->own : d->meta;
	if (++d->comments > MOST_PROPERTIES)
		return ct_fail(
			d->e, CT_EINPUT, "more than %d comments ct:KEY=VALUE", MOST_PROPERTIES);
	ct_text_unescape(s);
	ct_text_unescape(value);
	return *s ? ct_meta_set(to, s, value, d->e) : 0;
}

static int property(struct reader *d, const char *s)
{
	char word[20], name[80];
	enum ct_voxel type;

	if (sscanf(s, "%19s %79s", word, name) != 2)
		return ct_fail(d->e, CT_EINPUT, "header line 'property %.40s'", s);
	if (!ct_voxel_named(&type, types, word, strlen(word)))
		return ct_fail(d->e, CT_EINPUT,
			"property %s is of type %s; lists and other types are not read", name,
			word);
	for (size_t k = 0; k < FIELDS; k++)
		if (strcmp(name, names[k]) == 0) {
			d->type[k] = type;
			d->offset[k] = d->stride;
		}
	d->stride += ct_voxel_bytes(type);
	return ++d->properties > MOST_PROPERTIES
		       ? ct_fail(d->e, CT_EINPUT, "more than %d properties", MOST_PROPERTIES)
		       : 0;
}

/* The first are the vertices; what lies behind them is not read. */
static int element(struct reader *d, const char *s)
{
	char name[40], number[24];
	bool vertex;

	if (sscanf(s, "%39s %23s", name, number) != 2)
		return ct_fail(d->e, CT_EINPUT, "header line 'element %.40s'", s);
	vertex = strcmp(name, "vertex") == 0;
	if (d->elements++ > 0)
		return vertex ? ct_fail(d->e, CT_EINPUT, "two elements vertex") : 0;
	if (!vertex)
		return ct_fail(d->e, CT_EINPUT, "element %s lies before the vertices", name);
	if (!ct_number_u64(&d->count, number) || d->count > INT64_MAX)
		return ct_fail(d->e, CT_EINPUT, "element %s: count '%s'", name, number);
	return 0;
}

/* One line; 1 at the end of the header. */
static int header_line(struct reader *d, char *s)
{
	if (strncmp(s, COMMENT, sizeof COMMENT - 1) == 0)
		return comment(d, s + sizeof COMMENT - 1);
	if (strcmp(s, "comment") == 0 || strncmp(s, "comment ", 8) == 0 ||
		strncmp(s, "obj_info", 8) == 0)
		return 0;
	if (strncmp(s, "format ", 7) == 0) {
		d->format = strcmp(s + 7, "binary_little_endian 1.0") == 0;
		return d->format
			       ? 0
			       : ct_fail(d->e, CT_EINPUT,
					 "PLY format '%.40s'; only binary_little_endian 1.0 is read",
					 s + 7);
	}
	if (strncmp(s, "element ", 8) == 0)
		return element(d, s + 8);
	if (strncmp(s, "property ", 9) == 0) {
		if (d->elements == 0)
			return ct_fail(d->e, CT_EINPUT, "property before any element");
		return d->elements > 1 ? 0 : property(d, s + 9);
	}
	if (strcmp(s, "end_header") == 0)
		return 1;
	return ct_fail(d->e, CT_EINPUT, "header line '%.60s'", s);
}

static int read_header(struct reader *d)
{
	int rc = 0;

	free(next_line(d));
	while (rc == 0) {
		char *line = next_line(d);

		if (!line)
			return ct_fail(d->e, CT_EINPUT, "the PLY header has no end");
		rc = header_line(d, line);
		free(line);
	}
	if (rc < 0)
		return -1;
	if (!d->format)
		return ct_fail(d->e, CT_EINPUT, "the PLY header has no format");
	for (size_t k = 0; k < FIELDS; k++)
		if (!d->type[k])
			return ct_fail(d->e, CT_EINPUT, "no vertex property %s%s", names[k],
				k == FIELDS - 1 ? ": a PLY of colours, not of signed densities"
						: "");
	if (d->count > (d->n - d->at) / d->stride)
		return ct_fail(d->e, CT_EINPUT,
			"%llu Gaussians of %zu bytes do not fit in %zu bytes",
			(unsigned long long)d->count, d->stride, d->n - d->at);
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

static int whole(const char *key, double x, size_t *out, struct ct_err *e)
{
	if (!(x >= 0 && x <= 0x1p53) || x != floor(x))
		return ct_fail(e, CT_EINPUT, "comment ct:%s: %g is not a count", key, x);
	*out = (size_t)x;
	return 0;
}

static int read_own(const struct ct_meta *keys, struct ct_gauss *g, struct ct_err *e)
{
	const char *activation = ct_meta_get(keys, ACTIVATION), *units = ct_meta_get(keys, UNITS);
	double x = 0, v[12];
	int rc, word;

	if (!activation)
		return ct_fail(e, CT_EINPUT, "no comment ct:activation");
	if (ct_words_take(&word, CT_WORDS(CT_ACTIVATION_LIST), ACTIVATION, activation, e))
		return -1;
	g->activation = (enum ct_activation)word;
	if (units && strcmp(units, "mm") != 0)
		return ct_fail(e, CT_EINPUT, "units are '%.20s', not mm", units);
	g->gamma = 1;
	rc = ct_meta_numbers(keys, GAMMA, 1, &g->gamma, e);
	if (rc < 0)
		return -1;
	if ((rc && g->activation == CT_PRELU) || !(g->gamma > 0))
		return ct_fail(e, CT_EINPUT, "comment ct:gamma is not a positive number");
	if (ct_meta_numbers(keys, STEP, 1, &x, e) < 0 || whole(STEP, x, &g->step, e))
		return -1;
	rc = ct_meta_numbers(keys, GRID, 3, v, e);
	for (int a = 0; rc == 0 && a < 3; a++)
		rc = whole(GRID, v[a], &g->grid[a], e);
	if (rc < 0)
		return -1;
	rc = ct_meta_numbers(keys, AFFINE, 12, v, e);
	for (int i = 0; rc == 0 && i < 12; i++)
		g->affine[i / 4][i % 4] = v[i];
	return rc < 0 ? -1 : 0;
}

int ct_gauss_sign(struct ct_gauss *g, const char *path, struct ct_err *e)
{
	const double head[2] = {g->gamma, (double)g->activation};
	struct ct_piece piece[FIELDS + 1] = {{head, sizeof head}};

	for (size_t k = 0; k < FIELDS; k++)
		piece[1 + k] = (struct ct_piece){g->column[k], g->n * sizeof **g->column};
	return ct_meta_input(&g->meta, path, FIELDS + 1, piece, e);
}

static int read_gauss(
	const unsigned char *data, size_t n, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_gauss *g = &a->gauss;
	struct reader d = {.data = data, .n = n, .meta = &g->meta, .e = e};
	int rc = -1;

	if (read_header(&d) == 0 && read_own(&d.own, g, e) == 0 &&
		ct_gauss_reserve(g, (size_t)d.count + 1, e) == 0) {
		g->n = (size_t)d.count;
		for (size_t k = 0; k < FIELDS; k++)
			read_field(&d, k, g->column[k]);
		rc = ct_gauss_sign(g, name, e);
	}
	ct_meta_free(&d.own);
	return rc;
}

const struct ct_format ct_format_ply = {
	.name = "PLY", .kind = CT_KIND_GAUSS, .read_bytes = read_gauss};

int ct_gauss_read(const char *path, struct ct_gauss *g, struct ct_err *e)
{
	static const struct ct_format *const list[] = {&ct_format_ply, &ct_format_r2, NULL};
	struct ct_any a = {0};
	int rc = ct_format_read(list, path, &a, e);

	*g = a.gauss;
	return rc;
}

enum { COLUMNS = 18 }; /* that are written */

static void put_escaped(FILE *f, const char *s, bool key)
{
	const bool clash = key && is_own(s);

	for (const char *p = s; *p; p++) {
		unsigned char c = (unsigned char)*p;

		if (c == '\n')
			fprintf(f, "\\n");
		else if (c == '\\')
			fprintf(f, "\\\\");
		else if (c < ' ' || c == 127 || (key && (c == '=' || (clash && p == s))))
			fprintf(f, "\\x%02x", c);
		else
			fputc(c, f);
	}
}

static int make_header(char **text, size_t *length, const struct ct_gauss *g, struct ct_err *e)
{
	static const char *const columns[COLUMNS] = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0",
		"f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
		"rot_2", "rot_3", "density"};
	FILE *f;

	if (ct_stream_open(&f, text, length, e))
		return -1;
	fprintf(f, "ply\nformat binary_little_endian 1.0\n" COMMENT "units=mm\n");
	fprintf(f, COMMENT "activation=%s\n" COMMENT "gamma=%.17g\n" COMMENT "step=%zu\n",
		CT_WORD(CT_ACTIVATION_LIST, g->activation), g->gamma, g->step);
	if (g->grid[0]) {
		fprintf(f, COMMENT "grid=%zu,%zu,%zu\n" COMMENT "affine=", g->grid[0], g->grid[1],
			g->grid[2]);
		for (int i = 0; i < 12; i++)
			fprintf(f, "%.17g%c", g->affine[i / 4][i % 4], i < 11 ? ',' : '\n');
	}
	for (size_t i = 0; i < g->meta.n; i++) {
		if (strcmp(g->meta.pair[i].key, CT_META_INPUT) == 0) /* of the file that was read */
			continue;
		fprintf(f, COMMENT);
		put_escaped(f, g->meta.pair[i].key, true);
		fputc('=', f);
		put_escaped(f, g->meta.pair[i].value, false);
		fputc('\n', f);
	}
	fprintf(f, "element vertex %zu\n", g->n);
	for (int i = 0; i < COLUMNS; i++)
		fprintf(f, "property float %s\n", columns[i]);
	fprintf(f, "end_header\n");
	return ct_stream_close(f, text, e);
}

static float density(const struct ct_gauss *g, size_t i)
{
	return (float)ct_activation_apply(g->activation, g->gamma, (double)g->raw[i]);
}

static void make_row(float row[COLUMNS], const struct ct_gauss *g, size_t i, float most)
{
	/* colour = 0.5 + f_dc times the constant spherical harmonic */
	static const float warm[3] = {0.98f, 0.62f, 0.25f}, cold[3] = {0.25f, 0.55f, 0.98f};
	const float rho = density(g, i), *colour = rho < 0 ? cold : warm;
	float strength = most > 0 ? fabsf(rho) / most : 0;

	strength = fminf(fmaxf(strength, 0.001f), 0.999f);
	for (int a = 0; a < 3; a++) {
		row[a] = g->pos[a][i];
		row[3 + a] = 0;
		row[6 + a] = (colour[a] - 0.5f) / 0.28209479f;
		row[10 + a] = g->scale[a][i];
	}
	row[9] = logf(strength / (1 - strength));
	for (int a = 0; a < 4; a++)
		row[13 + a] = g->rot[a][i];
	row[17] = g->raw[i];
}

int ct_gauss_write(
	const char *path, const struct ct_gauss *g, const struct ct_env *env, struct ct_err *e)
{
	static const size_t row = COLUMNS;
	struct ct_out out = {0};
	float *block = NULL, most = 0;
	size_t n = 0;
	char *header;
	int rc = -1;

	if (ct_ends_match(path, "pickle"))
		return ct_r2_write(path, g, env, e);
	if (make_header(&header, &n, g, e))
		return ct_blame(e, path);
	if (ct_alloc(&block, BLOCK, row * sizeof *block, e) || ct_out_open(&out, path, env, e))
		goto done;
	for (size_t i = 0; i < g->n; i++)
		most = fmaxf(most, fabsf(density(g, i)));
	rc = ct_put(&out, header, n, e);
	for (size_t i = 0; i < g->n && rc == 0; i += BLOCK) {
		const size_t rows = g->n - i < BLOCK ? g->n - i : BLOCK;

		for (size_t k = 0; k < rows; k++)
			make_row(block + k * row, g, i + k, most);
		rc = ct_put(&out, block, rows * row * sizeof *block, e);
	}
	if (rc == 0)
		rc = ct_out_commit(&out, e);
done:
	ct_out_abandon(&out);
	free(block);
	free(header);
	return rc;
}

/* All but the Gaussians goes through a file, in memory, of none. */
int ct_gauss_as_read(struct ct_gauss *g, const char *name, struct ct_err *e)
{
	struct ct_gauss none = *g;
	struct ct_any a = {0};
	char *text = NULL;
	size_t n;
	int rc = -1;

	none.n = 0;
	if (make_header(&text, &n, &none, e))
		return ct_blame(e, name);
	if (ct_format_read_bytes(&ct_format_ply, (const unsigned char *)text, n, name, &a, e) ==
		0) {
		ct_meta_free(&g->meta);
		g->meta = a.gauss.meta;
		a.gauss.meta = (struct ct_meta){0};
		rc = ct_gauss_sign(g, name, e);
	}
	ct_any_free(&a);
	free(text);
	return rc;
}
