/* ply.c: Gaussians as PLY, binary little-endian, so that 3-D Gaussian splatting viewers open them.
 *
 * Properties, all float: x y z nx ny nz f_dc_0..2 opacity scale_0..2 rot_0..3 density. Position in
 * mm, scale is ln of the standard deviation in mm, rot the quaternion w x y z, density the
 * raw signed value that the activation maps. nx..nz are 0; f_dc and opacity are for viewers
 * only: warm for positive and cold for negative density, as opaque as it is strong. What else
 * a set has stands in lines "comment ct:KEY=VALUE", with \n, \\ and \xHH for bytes that a line
 * cannot hold.
 */
#include "config.h"
#include "formats/bytes.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "core/mem.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they are");

#define COMMENT "comment ct:"
enum { FIELDS = 11, BLOCK = 1024, COLUMNS = 18, MOST_PROPERTIES = 4096 };

/* The properties we need, in the order of fields(). */
static const char *const needed[FIELDS] = {"x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0",
	"rot_1", "rot_2", "rot_3", "density"};
/* Keys of comments that are not metadata. */
static const char *const own[] = {"units", "activation", "gamma", "step", "grid", "affine"};

static void fields(const struct ct_gauss *g, float *f[FIELDS])
{
	for (int a = 0; a < 3; a++) {
		f[a] = g->pos[a];
		f[3 + a] = g->scale[a];
	}
	for (int a = 0; a < 4; a++)
		f[6 + a] = g->rot[a];
	f[10] = g->raw;
}

static bool is_own(const char *key, size_t n)
{
	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (strlen(own[i]) == n && memcmp(own[i], key, n) == 0)
			return true;
	return false;
}

/* Writing */

static void put_escaped(FILE *f, const char *s, bool key)
{
	const bool clash = key && is_own(s, strlen(s));

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

static char *make_header(const struct ct_gauss *g, size_t *length)
{
	static const char *const columns[COLUMNS] = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0",
		"f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
		"rot_2", "rot_3", "density"};
	char *text = NULL;
	FILE *f = open_memstream(&text, length);

	if (!f)
		return NULL;
	fprintf(f, "ply\nformat binary_little_endian 1.0\n" COMMENT "units=mm\n");
	fprintf(f, COMMENT "activation=%s\n" COMMENT "gamma=%.17g\n" COMMENT "step=%zu\n",
		ct_activation_name(g->activation), g->gamma, g->step);
	if (g->grid[0]) {
		fprintf(f, COMMENT "grid=%zu,%zu,%zu\n" COMMENT "affine=", g->grid[0], g->grid[1],
			g->grid[2]);
		for (int i = 0; i < 12; i++)
			fprintf(f, "%.17g%c", g->affine[i / 4][i % 4], i < 11 ? ',' : '\n');
	}
	for (size_t i = 0; i < g->meta.n; i++) {
		if (strcmp(g->meta.pair[i].key, "input") == 0) /* of the file that was read */
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
	if (fclose(f) != 0) {
		free(text);
		return NULL;
	}
	return text;
}

/* What a viewer should show: see the activations of struct ct_gauss. */
static float density(const struct ct_gauss *g, size_t i)
{
	const double z = (double)g->raw[i];

	switch (g->activation) {
	case CT_SOFTPLUS: return (float)(z > 30 ? z : log1p(exp(z)));
	case CT_RELU: return (float)(z > 0 ? z : 0);
	case CT_SINE: return (float)sin(z);
	case CT_PRELU: break;
	}
	return (float)(z > 0 ? z : g->gamma * z);
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
	char *header = make_header(g, &n);
	int rc = -1;

	if (!header)
		return ct_fail(e, CT_ENOMEM, "%s: no memory for the header", path);
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

/* Reading */

struct reader {
	const char *path;
	const unsigned char *data;
	size_t n, at;         /* bytes; start of the next header line, then of the data */
	uint64_t count, skip; /* vertices; bytes of elements before them */
	size_t stride;
	size_t offset[FIELDS], properties;
	bool format;       /* the line has been seen */
	char type[FIELDS]; /* letter of types[], 0: not there yet */
	struct ct_err *e;
};

static const struct {
	const char *name, *alias;
	char letter;
	size_t bytes;
} types[] = {{"char", "int8", 'c', 1}, {"uchar", "uint8", 'C', 1}, {"short", "int16", 's', 2},
	{"ushort", "uint16", 'S', 2}, {"int", "int32", 'i', 4}, {"uint", "uint32", 'I', 4},
	{"float", "float32", 'f', 4}, {"double", "float64", 'd', 8}};

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
	to = is_own(s, strlen(s)) ? own_keys : meta;
	if (to->n >= MOST_PROPERTIES)
		return ct_fail(d->e, CT_EINPUT, "%s: more than %d comments ct:KEY=VALUE", d->path,
			MOST_PROPERTIES);
	unescape(s);
	unescape(value);
	return *s ? ct_meta_set(to, s, value, d->e) : 0;
}

static int property(struct reader *d, const char *s, bool vertex, uint64_t *bytes)
{
	char type[20], name[80];

	if (sscanf(s, "%19s %79s", type, name) != 2)
		return ct_fail(d->e, CT_EINPUT, "%s: header line 'property %.40s'", d->path, s);
	for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
		if (strcmp(type, types[i].name) != 0 && strcmp(type, types[i].alias) != 0)
			continue;
		for (size_t k = 0; vertex && k < FIELDS; k++)
			if (strcmp(name, needed[k]) == 0) {
				d->type[k] = types[i].letter;
				d->offset[k] = d->stride;
			}
		if (vertex)
			d->stride += types[i].bytes;
		*bytes += types[i].bytes;
		if (++d->properties > MOST_PROPERTIES)
			return ct_fail(d->e, CT_EINPUT, "%s: more than %d properties", d->path,
				MOST_PROPERTIES);
		return 0;
	}
	return ct_fail(d->e, CT_EINPUT,
		"%s: property %s is of type %s; lists and other types are not read", d->path, name,
		type);
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
	if (strncmp(s, COMMENT, sizeof COMMENT - 1) == 0)
		return comment(d, s + sizeof COMMENT - 1, own_keys, meta);
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
	for (size_t k = 0; k < FIELDS; k++)
		if (!d->type[k])
			return ct_fail(d->e, CT_EINPUT, "%s: no vertex property %s%s", d->path,
				needed[k],
				k == FIELDS - 1 ? ": a PLY of colours, not of signed densities"
						: "");
	if (d->skip > d->n - d->at || d->count > (d->n - d->at - d->skip) / d->stride)
		return ct_fail(d->e, CT_EINPUT,
			"%s: %llu Gaussians of %zu bytes do not fit in %zu bytes", d->path,
			(unsigned long long)d->count, d->stride, d->n - d->at);
	d->at += (size_t)d->skip;
	return 0;
}

#define AS(T)                                                                                      \
	do {                                                                                       \
		T x;                                                                               \
		memcpy(&x, p, sizeof x);                                                           \
		return (float)x;                                                                   \
	} while (0)

static float value(const unsigned char *p, char letter)
{
	switch (letter) {
	case 'c': AS(int8_t);
	case 'C': AS(uint8_t);
	case 's': AS(int16_t);
	case 'S': AS(uint16_t);
	case 'i': AS(int32_t);
	case 'I': AS(uint32_t);
	case 'd': AS(double);
	default: AS(float);
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
	const char *activation = ct_meta_get(keys, "activation"),
		   *units = ct_meta_get(keys, "units");
	double x = 0, v[12];
	int rc;

	if (!activation)
		return ct_fail(d->e, CT_EINPUT, "%s: no comment ct:activation", d->path);
	if (ct_activation_parse(&g->activation, activation, d->e))
		return ct_blame(d->e, d->path);
	if (units && strcmp(units, "mm") != 0)
		return ct_fail(d->e, CT_EINPUT, "%s: units are '%.20s', not mm", d->path, units);
	g->gamma = 1;
	rc = numbers(d, keys, "gamma", 1, &g->gamma);
	if (rc < 0)
		return -1;
	if ((rc && g->activation == CT_PRELU) || !(g->gamma > 0))
		return ct_fail(
			d->e, CT_EINPUT, "%s: comment ct:gamma is not a positive number", d->path);
	if (numbers(d, keys, "step", 1, &x) < 0 || whole(d, "step", x, &g->step))
		return -1;
	rc = numbers(d, keys, "grid", 3, v);
	for (int a = 0; rc == 0 && a < 3; a++)
		rc = whole(d, "grid", v[a], &g->grid[a]);
	if (rc < 0)
		return -1;
	rc = numbers(d, keys, "affine", 12, v);
	for (int i = 0; rc == 0 && i < 12; i++)
		g->affine[i / 4][i % 4] = v[i];
	return rc < 0 ? -1 : 0;
}

static int sign(struct ct_gauss *g, const char *path, struct ct_err *e)
{
	const double head[2] = {g->gamma, (double)g->activation};
	struct ct_piece piece[FIELDS + 1] = {{head, sizeof head}};
	float *f[FIELDS];

	fields(g, f);
	for (size_t k = 0; k < FIELDS; k++)
		piece[1 + k] = (struct ct_piece){f[k], g->n * sizeof **f};
	return ct_meta_input(&g->meta, path, FIELDS + 1, piece, e);
}

int ct_ply_read_bytes(
	const unsigned char *data, size_t n, const char *name, struct ct_gauss *g, struct ct_err *e)
{
	struct reader d = {.path = name, .data = data, .n = n, .e = e};
	struct ct_meta keys = {0};
	float *f[FIELDS];
	int rc = -1;

	if (read_header(&d, &keys, &g->meta) || read_own(&d, &keys, g) ||
		ct_gauss_reserve(g, (size_t)d.count + 1, e))
		goto done;
	g->n = (size_t)d.count;
	fields(g, f);
	for (size_t k = 0; k < FIELDS; k++)
		for (size_t i = 0; i < g->n; i++)
			f[k][i] = value(data + d.at + i * d.stride + d.offset[k], d.type[k]);
	rc = sign(g, name, e);
done:
	ct_meta_free(&keys);
	if (rc)
		ct_gauss_free(g);
	return rc;
}

int ct_gauss_read(const char *path, struct ct_gauss *g, struct ct_err *e)
{
	unsigned char *data;
	size_t n;
	int rc;

	*g = (struct ct_gauss){0};
	if (ct_slurp(path, &data, &n, e))
		return -1;
	rc = ct_ply_read_bytes(data, n, path, g, e);
	free(data);
	return rc;
}
