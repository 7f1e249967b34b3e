/* EXR stacks of other programs, byte by byte: names, windows, channels, attributes; the bytes of a
 * ZIP chunk against a plain twin; which attributes are written.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/exr.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tap.h"

#include <openexr.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

enum { W = 9, H = 21, PARTS = 4 };
static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}};

/* What a file is made of; zero is what our writer makes. */
struct how {
	const char *names[PARTS]; /* of the parts, NULL for view.0000, ... */
	const char *channels;     /* a letter each, "Y" if NULL */
	const char *types;        /* f, h or u of each */
	exr_compression_t codec;
	int x0, y0;
	const char *skip;                   /* attribute that is not there */
	const char *detu;                   /* ct:detU as text */
	void (*more)(exr_context_t, int k); /* what else a part has */
	bool vectors;                       /* geometry as numbers, not as text */
};

static float pixel(size_t part, size_t y, size_t x)
{
	return (float)part * 64 + (float)y * 2 + (float)x / 8;
}

/* Of a number that a half holds: no rounding. */
static uint16_t half(float x)
{
	int e = 0;
	const float m = frexpf(x, &e);

	return x > 0 ? (uint16_t)((e + 14) << 10 | ((int)(m * 2048) - 1024)) : 0;
}

static size_t width_of(const struct how *o, size_t i)
{
	return o->types && o->types[i] == 'h' ? 2 : 4;
}

/* Split, differences, biased: as OpenEXR's technical introduction has it. */
static void split(size_t n, unsigned char *out, const unsigned char *in)
{
	unsigned char last = 0;

	for (size_t i = 0; i < n; i++)
		out[i] = in[i < (n + 1) / 2 ? 2 * i : 2 * (i - (n + 1) / 2) + 1];
	for (size_t i = 0; i < n; i++) {
		const unsigned char now = out[i];

		if (i)
			out[i] = (unsigned char)(now - last + 128);
		last = now;
	}
}

static void put_rows(exr_context_t c, const struct how *o, size_t k)
{
	const char *channels = o->channels ? o->channels : "Y";
	const size_t rows = o->codec == EXR_COMPRESSION_ZIP ? 16 : 1;
	unsigned char plain[16 * W * 16], packed[16 * W * 16], mixed[16 * W * 16];

	for (size_t y = 0; y < H; y += rows) {
		uLongf m = sizeof packed;
		size_t n = 0;

		for (size_t r = y; r < H && r < y + rows; r++)
			for (size_t i = 0; channels[i]; i++)
				for (size_t x = 0; x < W; x++) {
					const bool ours = channels[i] == 'Y' || !channels[1];
					const float v = ours ? pixel(k, r, x) : 7;
					const uint16_t h = half(v);

					memcpy(plain + n,
						width_of(o, i) == 2 ? (const void *)&h : &v,
						width_of(o, i));
					n += width_of(o, i);
				}
		split(n, mixed, plain);
		if (o->codec == EXR_COMPRESSION_NONE ||
			compress2(packed, &m, mixed, n, 9) != Z_OK || m >= n) {
			memcpy(packed, plain, n);
			m = n;
		}
		if (exr_write_scanline_chunk(c, (int)k, o->y0 + (int)y, packed, m))
			exit(99);
	}
}

static void put_geometry(exr_context_t c, const struct how *o, int k)
{
	static const char *const names[] = {"ct:source", "ct:detCentre", "ct:detU", "ct:detV"};
	static const double v[4][3] = {{0, 1000, 0}, {0, -500, 1}, {0.5, 0, 0}, {0, 0, -0.25}};
	char text[100];

	if (!o->skip || strcmp(o->skip, "ct:beam") != 0)
		exr_attr_set_string(c, k, "ct:beam", "cone");
	snprintf(text, sizeof text, "%d", k);
	if (o->vectors)
		exr_attr_set_float(c, k, "ct:angleDeg", (float)k);
	else
		exr_attr_set_string(c, k, "ct:angleDeg", text);
	for (int i = 0; i < 4; i++) {
		const exr_attr_v3d_t w = {{{v[i][0], v[i][1], v[i][2]}}};

		snprintf(text, sizeof text, "%g,%g,%g", v[i][0], v[i][1], v[i][2]);
		if (o->skip && strcmp(o->skip, names[i]) == 0)
			continue;
		if (o->vectors)
			exr_attr_set_v3d(c, k, names[i], &w);
		else
			exr_attr_set_string(c, k, names[i], i == 2 && o->detu ? o->detu : text);
	}
}

static void quiet(exr_const_context_t c, exr_result_t code, const char *msg)
{
	(void)c;
	(void)code;
	(void)msg;
}

static void put_part(exr_context_t c, const struct how *o, int k)
{
	const char *channels = o->channels ? o->channels : "Y";
	const exr_attr_box2i_t box = {{{{o->x0, o->y0}}}, {{{o->x0 + W - 1, o->y0 + H - 1}}}};
	const exr_attr_v2f_t centre = {{{0, 0}}};
	char name[40];
	int part;

	snprintf(name, sizeof name, "view.%04d", k);
	exr_add_part(c, o->names[k] ? o->names[k] : name, EXR_STORAGE_SCANLINE, &part);
	exr_initialize_required_attr(
		c, part, &box, &box, 1, &centre, 1, EXR_LINEORDER_INCREASING_Y, o->codec);
	for (size_t i = 0; channels[i]; i++) {
		const char label[2] = {channels[i], 0};
		const char type = o->types ? o->types[i] : 'f';

		exr_add_channel(c, part, label,
			type == 'f'   ? EXR_PIXEL_FLOAT
			: type == 'h' ? EXR_PIXEL_HALF
				      : EXR_PIXEL_UINT,
			EXR_PERCEPTUALLY_LINEAR, 1, 1);
	}
	exr_set_version(c, part, 1);
	put_geometry(c, o, part);
	if (o->more)
		o->more(c, part);
}

static void make(const char *path, const struct how *o)
{
	exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
	exr_context_t c;

	init.error_handler_fn = quiet;
	unlink(path);
	if (exr_start_write(&c, path, EXR_WRITE_FILE_DIRECTLY, &init) != EXR_ERR_SUCCESS)
		exit(99);
	for (int k = 0; k < PARTS; k++)
		put_part(c, o, k);
	if (exr_write_header(c) != EXR_ERR_SUCCESS) {
		printf("Bail out! no header\n");
		exit(99);
	}
	for (size_t k = 0; k < PARTS; k++)
		put_rows(c, o, k);
	exr_finish(&c);
}

/* The file is read, its views in this order of its parts, each pixel as it should be. */
static bool reads(const char *path, const struct how *o, const char *order)
{
	struct ct_stack s;
	size_t bad = 0;

	make(path, o);
	if (ct_stack_read(path, &s, &err)) {
		printf("# %s\n", err.msg);
		return false;
	}
	for (size_t k = 0; k < PARTS; k++) {
		const size_t part = (size_t)(order[k] - '0');
		const struct ct_view *v = &s.view[k];

		bad += v->angle != (double)part || v->source[1] != 1000 || v->centre[2] != 1 ||
		       v->u[0] != 0.5 || v->v[2] != -0.25 || v->centre[1] != -500;
		for (size_t i = 0; i < W * H; i++)
			bad += ct_stack_view(&s, k)[i] != pixel(part, i / W, i % W);
	}
	bad += s.views != PARTS || s.h != H || s.w != W;
	ct_stack_free(&s);
	return bad == 0;
}

static void test_names(const char *path)
{
	static const struct {
		const char *names[PARTS], *order;
	} c[] = {{{"v.0", "v.1", "v.2", "v.3"}, "0123"}, {{"v.10", "v.9", "v.8", "v.11"}, "2103"},
		{{"a.2", "b.2", "c.1", "d.2"}, "2013"}, {{"4", "3", "2", "1"}, "3210"},
		{{"v.3", "v", "v.2", "v.1"}, "0123"}, {{"v.3", "v.1", "v.2", "x"}, "0123"},
		{{"9", "100000000000000000", "8", "7"}, "3201"},
		{{"9", "1000000000000000000", "8", "7"}, "0123"},
		{{"v9x", "v.1", "v.0", "v.3"}, "0123"}};

	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		struct how o = {.codec = EXR_COMPRESSION_ZIP};

		memcpy(o.names, c[i].names, sizeof o.names);
		OK(reads(path, &o, c[i].order), "parts %s, %s, ... in order %s", c[i].names[0],
			c[i].names[1], c[i].order);
	}
}

static void test_layouts(const char *path)
{
	static const exr_compression_t codecs[] = {
		EXR_COMPRESSION_NONE, EXR_COMPRESSION_ZIPS, EXR_COMPRESSION_ZIP};
	static const char *const c[][2] = {{"Y", "f"}, {"Y", "h"}, {"AYZ", "hfh"}, {"AYZ", "fhu"},
		{"AY", "uf"}, {"YZ", "hu"}, {"Q", "h"}};
	struct how o = {.vectors = true};

	for (size_t k = 0; k < 3; k++)
		for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
			o.codec = codecs[k];
			o.channels = c[i][0];
			o.types = c[i][1];
			o.x0 = (int)i - 3;
			o.y0 = 5 * (int)i - 10;
			OK(reads(path, &o, "0123"), "channels %s of %s at %d, %d, compression %d",
				c[i][0], c[i][1], o.x0, o.y0, (int)codecs[k]);
		}
}

static void is_refused(const char *path, const char *words)
{
	struct ct_stack s;
	int rc;

	err = (struct ct_err){0};
	rc = ct_stack_read(path, &s, &err);
	OK(rc == -1 && err.code == CT_EINPUT && strncmp(err.msg, path, strlen(path)) == 0 &&
			strstr(err.msg, words) && !s.data && !s.meta.pair,
		"refused: %s", err.msg);
	if (!rc)
		ct_stack_free(&s);
}

static void refused(const char *path, const struct how *o, const char *words)
{
	make(path, o);
	is_refused(path, words);
}

/* The file with the bytes `is` behind each of the n that are `was`; how often that was. */
static size_t patch(
	const char *path, const char *was, size_t n, size_t at, const char *is, size_t m)
{
	char p[1 << 16];
	size_t size, found = 0;
	FILE *f = fopen(path, "r+b");

	if (!f)
		exit(99);
	size = fread(p, 1, sizeof p, f);
	for (size_t i = 0; i + n <= size; i++)
		if (memcmp(p + i, was, n) == 0) {
			memcpy(p + i + at, is, m);
			found++;
		}
	rewind(f);
	if (fwrite(p, 1, size, f) != size || fclose(f) != 0)
		exit(99);
	return found;
}

/* The channel Y of each part is of every third pixel along x (axis 0) or y. */
static void test_sampling(const char *path)
{
	static const char channel[] = "Y\0\2\0\0\0\1\0\0\0\1\0\0\0\1\0\0";
	const struct how o = {.codec = EXR_COMPRESSION_NONE};

	for (size_t axis = 0; axis < 2; axis++) {
		make(path, &o);
		OK(patch(path, channel, sizeof channel, 10 + 4 * axis, "\3", 1) == PARTS,
			"the parts have a channel");
		is_refused(path, "subsampled channel");
	}
}

/* The first row of the first part: of another place, of another length. */
static void test_chunks(const char *path)
{
	static const char row[12] = "\0\0\0\0\0\0\0\0\x24\0\0\0";
	const struct how o = {.codec = EXR_COMPRESSION_NONE};
	const struct {
		size_t at;
		char is;
	} c[] = {{0, 1}, {4, 1}, {4, H}, {8, 0x23}, {8, 0x25}, {8, 0x70}, {10, 1}};

	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		make(path, &o);
		OK(patch(path, row, sizeof row, c[i].at, &c[i].is, 1) == 1, "there is a first row");
		is_refused(path, "");
		OK(!strstr(err.msg, exr_get_default_error_message(EXR_ERR_BAD_CHUNK_LEADER)),
			"in the library's own words");
	}
}

static void bad_angle(exr_context_t c, int k)
{
	if (k == 3)
		exr_attr_set_string(c, k, "ct:angleDeg", "1,2");
}

static void other_u(exr_context_t c, int k)
{
	exr_attr_set_double(c, k, "ct:detU", 1);
}

static void other_v(exr_context_t c, int k)
{
	const exr_attr_v3d_t v = {{{0, (double)INFINITY, 1}}};

	exr_attr_set_v3d(c, k, "ct:detV", &v);
}

static void newer(exr_context_t c, int k)
{
	exr_attr_set_string(c, k, "ct:version", k == 2 ? "2" : "1");
}

static void no_json(exr_context_t c, int k)
{
	exr_attr_set_string(c, k, "ct:meta", k == 1 ? "[\"a\"]" : "{}");
}

static void test_refusals(const char *path)
{
	static const char *const vectors[] = {"0,1", "0,1,", "0,1,2,", "0,1,2,3", "0,1,2 ", "",
		"0;1;2", "a,1,2", "0,1,inf", "0,nan,1", "inf,0,1", "0,,1"};
	struct how o = {.codec = EXR_COMPRESSION_ZIP};

	for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
		o.detu = vectors[i];
		refused(path, &o,
			"part 'view.0000': attribute ct:detU is not three finite numbers");
	}
	o.detu = NULL;
	o.skip = "ct:source";
	refused(path, &o, "part 'view.0000' has no attribute ct:source");
	o.skip = "ct:detU";
	o.more = other_u;
	refused(path, &o, "attribute ct:detU is not three finite numbers");
	o.skip = "ct:detV";
	o.more = other_v;
	refused(path, &o, "attribute ct:detV is not three finite numbers");
	o.skip = NULL;
	o.more = bad_angle;
	refused(path, &o, "part 'view.0003': attribute ct:angleDeg is not a finite number");
	o.more = newer;
	refused(path, &o, "ct:version 2 is newer");
	o.more = no_json;
	refused(path, &o, "ct:meta is not a JSON object");
	o.more = NULL;
	o.channels = "AB";
	refused(path, &o, "has 2 channels and none is named Y");
	o.channels = "YZ";
	o.types = "uf";
	refused(path, &o, "channel is not FLOAT or HALF");
}

static void meta_of(exr_context_t c, int k)
{
	char text[40];

	snprintf(text, sizeof text, "of part %d", k);
	exr_attr_set_string(c, k, "ct:each", text);
	exr_attr_set_string(c, k, "ct:version", "1");
	exr_attr_set_string(c, k, "foreign", "not ours");
	exr_attr_set_string(c, k, "ct:", "no name");
	exr_attr_set_int(c, k, "ct:number", 3);
	exr_attr_set_string(c, k, "ct:input", "of another file");
	if (k == 2)
		exr_attr_set_string(c, k, "ct:late", "here");
	exr_attr_set_string(
		c, k, "ct:meta", "{\"each\":\"no\",\"n\":1,\"\":\"x\",\"rest\":\"yes\"}");
}

static void test_meta(const char *path)
{
	const struct how o = {.codec = EXR_COMPRESSION_ZIP, .more = meta_of};
	struct ct_stack s;

	make(path, &o);
	must(ct_stack_read(path, &s, &err));
	OK(s.meta.n == 4, "%zu metadata", s.meta.n);
	OK(strcmp(ct_meta_get(&s.meta, "each"), "of part 0") == 0, "the first of a key");
	OK(strcmp(ct_meta_get(&s.meta, "late"), "here") == 0, "of any part");
	OK(strcmp(ct_meta_get(&s.meta, "rest"), "yes") == 0, "and of the object");
	OK(strstr(ct_meta_get(&s.meta, "input"), " xxh3:") != NULL, "the hash is of this file");
	ct_stack_free(&s);
}

static void fill(struct ct_stack *s)
{
	*s = (struct ct_stack){0};
	must(ct_stack_alloc(s, 2, 5, 3, &err));
	for (size_t k = 0; k < 2; k++)
		s->view[k] = (struct ct_view){.source = {0, 100, 0},
			.centre = {0, -50, 0},
			.u = {1, 0, 0},
			.v = {0, 0, -1}};
	for (size_t i = 0; i < 30; i++)
		s->data[i] = (float)i;
}

/* Does the file hold the attribute? */
static bool holds(const char *path, const char *name)
{
	char want[80], *p = malloc(1 << 20);
	FILE *f = fopen(path, "rb");
	size_t n, len = (size_t)snprintf(want, sizeof want, "%s%cstring", name, 0);
	bool found = false;

	if (!f || !p)
		exit(99);
	n = fread(p, 1, 1 << 20, f);
	for (size_t i = 0; i + len <= n; i++)
		found |= memcmp(p + i, want, len) == 0;
	fclose(f);
	free(p);
	return found;
}

static void test_keys(const char *path)
{
	static const char key[] = "a.key.of.twenty-nine.letters.";
	struct ct_stack s, t;

	fill(&s);
	must(ct_meta_set(&s.meta, key, "long", &err) ||
		ct_meta_set(&s.meta, key + 1, "short", &err) ||
		ct_meta_set(&s.meta, "detU", "taken", &err) ||
		ct_meta_set(&s.meta, "input", "none of ours", &err) ||
		ct_stack_write(path, &s, &force, &err) || ct_stack_read(path, &t, &err));
	OK(holds(path, "ct:.key.of.twenty-nine.letters."), "a name of 31 letters is an attribute");
	OK(!holds(path, "ct:a.key.of.twenty-nine.letters."), "of 32 none");
	OK(holds(path, "ct:meta") && !holds(path, "ct:input"), "but there is the rest");
	OK(strcmp(ct_meta_get(&t.meta, key), "long") == 0 &&
			strcmp(ct_meta_get(&t.meta, key + 1), "short") == 0 &&
			strcmp(ct_meta_get(&t.meta, "detU"), "taken") == 0,
		"all come back");
	ct_stack_free(&t);
	ct_meta_free(&s.meta);
	must(ct_stack_write(path, &s, &force, &err));
	OK(!holds(path, "ct:meta") && holds(path, "ct:version"), "without any there is no object");
	ct_stack_free(&s);
}

/* The hash is of each size, each number of the geometry, each pixel. */
static void test_hash(const char *path)
{
	char hash[2][80];
	struct ct_stack s, t;
	size_t same = 0, numbers;

	fill(&s);
	numbers = 2 * sizeof *s.view / sizeof(double);
	for (size_t i = 0; i <= numbers + 30; i++) {
		double *v = i && i <= numbers ? (double *)(void *)s.view + i - 1 : NULL;
		float *x = i > numbers ? s.data + i - 1 - numbers : NULL;

		if (v)
			*v += 0.125;
		if (x)
			*x += 0.125f;
		must(ct_stack_write(path, &s, &force, &err) || ct_stack_read(path, &t, &err));
		snprintf(hash[i > 0], sizeof hash[0], "%s", ct_meta_get(&t.meta, "input"));
		same += i && strcmp(hash[0], hash[1]) == 0;
		ct_stack_free(&t);
		if (v)
			*v -= 0.125;
		if (x)
			*x -= 0.125f;
	}
	s.beam = CT_PARALLEL;
	must(ct_stack_write(path, &s, &force, &err) || ct_stack_read(path, &t, &err));
	same += strcmp(hash[0], ct_meta_get(&t.meta, "input")) == 0;
	OK(same == 0, "each of %zu numbers and the beam change the hash", numbers + 30);
	ct_stack_free(&t);
	ct_stack_free(&s);
}

static void count_views(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	size_t *seen = env->ctx;

	if (strcmp(what, "writing") == 0 && likely == 0 && done == *seen && total == 2)
		++*seen;
}

static void test_progress(const char *path)
{
	size_t seen = 0;
	const struct ct_env env = {.files = &(const struct ct_io_rule){.force = true},
		.progress = count_views,
		.ctx = &seen};
	struct ct_stack s;

	fill(&s);
	OK(ct_stack_write(path, &s, &env, &err) == 0 && seen == 2, "each view is told");
	ct_stack_free(&s);
}

static void test_limits(const char *path)
{
	struct ct_stack s = {.views = 1, .h = 1, .w = ((size_t)1 << 29) + 1};

	unlink(path);
	OK(ct_stack_write(path, &s, &force, &err) == -1 && err.code == CT_EOUTPUT &&
			strstr(err.msg, "do not fit an EXR file"),
		"too wide: %s", err.msg);
	s.w = 1;
	s.h = (size_t)1 << 31;
	OK(ct_stack_write(path, &s, &force, &err) == -1 && strstr(err.msg, "do not fit"),
		"too high");
	OK(access(path, F_OK) != 0, "and nothing is written");
}

int main(void)
{
	char path[] = "/tmp/t-exr-parts-XXXXXX";
	const int fd = mkstemp(path);

	if (fd < 0)
		exit(99);
	close(fd);
	test_names(path);
	test_layouts(path);
	test_refusals(path);
	test_sampling(path);
	test_chunks(path);
	test_meta(path);
	test_keys(path);
	test_hash(path);
	test_progress(path);
	test_limits(path);
	unlink(path);
	return tap_done();
}
