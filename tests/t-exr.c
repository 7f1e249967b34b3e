/* EXR stacks: bit-exact round trips, any order of parts, damaged and hostile files.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bound.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/rng.h"
#include "formats/any.h"
#include "formats/exr.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tap.h"

#include <openexr.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}};

static void fill(struct ct_stack *s, size_t views, size_t h, size_t w)
{
	struct ct_err e = {0};

	*s = (struct ct_stack){0};
	if (ct_stack_alloc(s, views, h, w, &e))
		exit(99);
	for (size_t k = 0; k < views; k++) {
		double a = 2 * 3.14159265358979323846 * (double)k / (double)views;
		struct ct_view *v = &s->view[k];

		*v = (struct ct_view){.angle = a * 57.3,
			.source = {1000 * cos(a), 1000 * sin(a), 1.0 / 3},
			.centre = {-500 * cos(a), -500 * sin(a), 1e-7},
			.u = {-0.7 * sin(a), 0.7 * cos(a), 0},
			.v = {0, 0, -0.7}};
	}
	for (size_t i = 0; i < ct_stack_count(s); i++)
		s->data[i] = (float)(sin((double)i * 0.01) * 37 - 1e-6 * (double)i);
	ct_meta_set(&s->meta, "quantity", "lineIntegral", &e);
	ct_meta_set(&s->meta, "history", "ct-project 1 a b\nct-ddnm 1 'c d' \"e\"", &e);
	ct_meta_set(&s->meta, "a key that is longer than the 31 characters", "v\n\xc3\xa4", &e);
	ct_meta_set(&s->meta, "beam", "a key that is geometry in the file", &e);
}

static bool same(const struct ct_stack *a, const struct ct_stack *b)
{
	return a->views == b->views && a->h == b->h && a->w == b->w && a->beam == b->beam &&
	       memcmp(a->view, b->view, a->views * sizeof *a->view) == 0 &&
	       memcmp(a->data, b->data, ct_stack_count(a) * sizeof *a->data) == 0;
}

static unsigned char *load(const char *path, size_t *n)
{
	unsigned char *p = malloc(1 << 22);
	FILE *f = fopen(path, "rb");

	if (!p || !f)
		exit(99);
	*n = fread(p, 1, 1 << 22, f);
	fclose(f);
	return p;
}

static void save(const char *path, const unsigned char *p, size_t n)
{
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(p, 1, n, f) != n || fclose(f) != 0)
		exit(99);
}

static void test_round_trip(const char *path, size_t views, size_t h, size_t w, enum ct_beam beam)
{
	struct ct_err e = {0};
	struct ct_stack s, t;
	unsigned char *p, *q;
	size_t n, m;

	fill(&s, views, h, w);
	s.beam = beam;
	s.data[0] = NAN;
	s.data[1] = -0.0f;
	s.data[2] = -INFINITY;
	OK(ct_stack_write(path, &s, &force, &e) == 0, "%zu views of %zux%zu are written %s", views,
		w, h, e.msg);
	OK(ct_stack_read(path, &t, &e) == 0, "and read %s", e.msg);
	OK(same(&s, &t), "geometry and pixels to the bit, NaN and -0 too");
	for (size_t i = 0; i < s.meta.n; i++) {
		const char *v = ct_meta_get(&t.meta, s.meta.pair[i].key);

		OK(v && strcmp(v, s.meta.pair[i].value) == 0, "metadata '%s'", s.meta.pair[i].key);
	}
	OK(ct_meta_get(&t.meta, "input") && t.meta.n == s.meta.n + 1, "and the hash of the input");
	p = load(path, &n);
	OK(ct_stack_write(path, &t, &force, &e) == 0, "written again");
	q = load(path, &m);
	OK(n == m && memcmp(p, q, n) == 0, "the same bytes");
	free(p);
	free(q);
	ct_stack_free(&s);
	ct_stack_free(&t);
}

/* A file of our own making: order of parts, channels and types as the test wants them. */
struct odd {
	exr_pixel_type_t type;
	exr_storage_t storage;
	exr_compression_t codec;
	const char *channel[2];
	const char *skip; /* attribute left out of part 1 */
	const char *bad;  /* value of its ct:detU */
	const char *beam; /* its ct:beam, unless NULL */
	bool other_size;
};

static void put_part(
	exr_context_t c, const struct odd *o, const struct ct_stack *s, size_t k, size_t number)
{
	const struct ct_view *v = &s->view[number];
	const double *vec[] = {v->source, v->centre, v->u, v->v};
	static const char *const names[] = {"ct:source", "ct:detCentre", "ct:detU", "ct:detV"};
	char text[100];
	int part, h = (int)s->h + (o->other_size && k == 1);

	snprintf(text, sizeof text, "view.%04zu", number);
	exr_add_part(c, text, o->storage, &part);
	exr_initialize_required_attr_simple(c, part, (int)s->w, h, o->codec);
	for (int i = 0; i < 2; i++)
		if (o->channel[i])
			exr_add_channel(
				c, part, o->channel[i], o->type, EXR_PERCEPTUALLY_LINEAR, 1, 1);
	exr_set_version(c, part, 1);
	if (o->storage == EXR_STORAGE_TILED)
		exr_set_tile_descriptor(c, part, 64, 64, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN);
	if (!o->skip || k != 1 || strcmp(o->skip, "ct:beam") != 0)
		exr_attr_set_string(c, part, "ct:beam", o->beam && k == 1 ? o->beam : "cone");
	exr_attr_set_double(c, part, "ct:angleDeg", v->angle);
	for (int i = 0; i < 4; i++) {
		snprintf(text, sizeof text, "%.17g,%.17g,%.17g", vec[i][0], vec[i][1], vec[i][2]);
		if (!o->skip || k != 1 || strcmp(o->skip, names[i]) != 0)
			exr_attr_set_string(
				c, part, names[i], o->bad && k == 1 && i == 2 ? o->bad : text);
	}
}

static void put_pixels(
	exr_context_t c, const struct odd *o, const struct ct_stack *s, size_t k, size_t number)
{
	exr_encode_pipeline_t enc = EXR_ENCODE_PIPELINE_INITIALIZER;
	int32_t rows = 0, part = (int32_t)k, h = (int)s->h + (o->other_size && k == 1);
	float *row = calloc(s->w * (s->h + 1), sizeof *row);

	if (!row)
		exit(99);
	memcpy(row, ct_stack_view(s, number), s->w * s->h * sizeof *row);
	if (exr_get_scanlines_per_chunk(c, part, &rows) != EXR_ERR_SUCCESS)
		rows = h; /* one tile */
	for (int y = 0; y < h; y += rows) {
		exr_chunk_info_t ci;
		void *from = row + (size_t)y * s->w;

		if (o->storage == EXR_STORAGE_TILED)
			exr_write_tile_chunk_info(c, part, 0, 0, 0, 0, &ci);
		else
			exr_write_scanline_chunk_info(c, part, y, &ci);
		if (y)
			exr_encoding_update(c, part, &ci, &enc);
		else
			exr_encoding_initialize(c, part, &ci, &enc);
		for (int i = 0; i < enc.channel_count; i++) {
			enc.channels[i].encode_from_ptr = from;
			enc.channels[i].user_pixel_stride = 4;
			enc.channels[i].user_line_stride = (int)s->w * 4;
			enc.channels[i].user_bytes_per_element = 4;
			enc.channels[i].user_data_type = EXR_PIXEL_FLOAT;
		}
		if (y == 0)
			exr_encoding_choose_default_routines(c, part, &enc);
		exr_encoding_run(c, part, &enc);
	}
	exr_encoding_destroy(c, &enc);
	free(row);
}

static void quiet(exr_const_context_t c, exr_result_t code, const char *msg)
{
	(void)c;
	(void)code;
	(void)msg;
}

static void write_odd(
	const char *path, const struct odd *o, const struct ct_stack *s, const size_t *order)
{
	exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
	exr_context_t c;

	init.error_handler_fn = quiet;
	unlink(path);
	if (exr_start_write(&c, path, EXR_WRITE_FILE_DIRECTLY, &init) != EXR_ERR_SUCCESS)
		exit(99);
	for (size_t k = 0; k < s->views; k++)
		put_part(c, o, s, k, order[k]);
	if (exr_write_header(c) != EXR_ERR_SUCCESS)
		exit(99);
	for (size_t k = 0; k < s->views; k++)
		put_pixels(c, o, s, k, order[k]);
	exr_finish(&c);
}

/* The file must be refused with these words. */
static void refused(const char *path, const char *words, enum ct_code code, const char *what)
{
	struct ct_err e = {0};
	struct ct_stack t;
	int rc = ct_stack_read(path, &t, &e);

	OK(rc < 0 && e.code == code && strstr(e.msg, path) && strstr(e.msg, words), "%s: %s", what,
		e.msg);
	OK(!t.data && !t.view, "and nothing is left");
}

static void test_odd(const char *path)
{
	static const size_t order[] = {2, 0, 3, 1};
	const struct odd plain = {
		.type = EXR_PIXEL_FLOAT, .codec = EXR_COMPRESSION_ZIP, .channel = {"Y"}};
	static const exr_compression_t codecs[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_ZIPS};
	struct ct_err e = {0};
	struct ct_stack s, t;
	struct odd o = plain;
	float worst = 0;

	fill(&s, 4, 19, 23);
	write_odd(path, &o, &s, order);
	OK(ct_stack_read(path, &t, &e) == 0 && same(&s, &t), "parts in any order %s", e.msg);
	ct_stack_free(&t);
	for (size_t i = 0; i < sizeof codecs / sizeof *codecs; i++) {
		o.codec = codecs[i];
		write_odd(path, &o, &s, order);
		OK(ct_stack_read(path, &t, &e) == 0 && same(&s, &t), "compression %d %s",
			(int)codecs[i], e.msg);
		ct_stack_free(&t);
	}
	o.codec = EXR_COMPRESSION_PIZ;
	write_odd(path, &o, &s, order);
	refused(path, "neither ZIP nor ZIPS", CT_EINPUT, "another compression");
	o = plain;
	o.channel[0] = "density";
	write_odd(path, &o, &s, order);
	OK(ct_stack_read(path, &t, &e) == 0 && same(&s, &t), "the only channel, of any name");
	ct_stack_free(&t);
	o.channel[1] = "Y";
	write_odd(path, &o, &s, order);
	OK(ct_stack_read(path, &t, &e) == 0 && same(&s, &t), "Y among others %s", e.msg);
	ct_stack_free(&t);
	o.codec = EXR_COMPRESSION_NONE;
	o.channel[0] = "Z";
	write_odd(path, &o, &s, order);
	OK(ct_stack_read(path, &t, &e) == 0 && same(&s, &t), "not compressed either %s", e.msg);
	ct_stack_free(&t);
	o.codec = EXR_COMPRESSION_ZIP;
	o.channel[0] = "Y";
	o.channel[1] = "deviation";
	write_odd(path, &o, &s, order);
	OK(ct_stack_read(path, &t, &e) == 0 && same(&s, &t) && t.deviation &&
			memcmp(t.deviation, s.data, ct_stack_count(&s) * sizeof *s.data) == 0,
		"a channel of deviations is read beside Y %s", e.msg);
	ct_stack_free(&t);
	o.channel[0] = "Z";
	o.channel[1] = "other";
	write_odd(path, &o, &s, order);
	refused(path, "none is named Y", CT_EINPUT, "two channels, no Y");
	o = plain;
	o.type = EXR_PIXEL_HALF;
	write_odd(path, &o, &s, order);
	OK(ct_stack_read(path, &t, &e) == 0, "HALF is read %s", e.msg);
	for (size_t i = 0; t.data && i < ct_stack_count(&s); i++)
		worst = fmaxf(worst, fabsf(s.data[i] - t.data[i]));
	NEAR((double)worst, 0, 32.0 / 2048, "to half precision");
	ct_stack_free(&t);
	o.type = EXR_PIXEL_UINT;
	write_odd(path, &o, &s, order);
	refused(path, "not FLOAT or HALF", CT_EINPUT, "UINT pixels");
	o = plain;
	o.storage = EXR_STORAGE_TILED;
	write_odd(path, &o, &s, order);
	refused(path, "tiles", CT_EINPUT, "tiles");
	o = plain;
	o.other_size = true;
	write_odd(path, &o, &s, order);
	refused(path, "is 23x20", CT_EINPUT, "parts of two sizes");
	o = plain;
	o.skip = "ct:detV";
	write_odd(path, &o, &s, order);
	refused(path, "part 'view.0000' has no attribute ct:detV", CT_EINPUT, "missing vector");
	o.skip = "ct:beam";
	write_odd(path, &o, &s, order);
	refused(path, "part 'view.0000' has no attribute ct:beam", CT_EINPUT, "missing beam");
	o = plain;
	o.beam = "parallel";
	write_odd(path, &o, &s, order);
	refused(path, "part 'view.0001' has a cone beam, part 'view.0000' a parallel beam",
		CT_EINPUT, "two beams");
	o.beam = "laser";
	write_odd(path, &o, &s, order);
	refused(path, "'laser'", CT_EINPUT, "no beam");
	o = plain;
	o.bad = "0,nan,0";
	write_odd(path, &o, &s, order);
	refused(path, "part 'view.0000': attribute ct:detU", CT_EINPUT, "NaN in the geometry");
	o.bad = "0,1";
	write_odd(path, &o, &s, order);
	refused(path, "attribute ct:detU", CT_EINPUT, "two numbers");
	o.bad = "0,0,0";
	write_odd(path, &o, &s, order);
	refused(path, "view 0", CT_EGEOM, "a detector without width");
	ct_stack_free(&s);
}

static void test_deviation(const char *path)
{
	struct ct_err e = {0};
	struct ct_stack s, t = {0};
	char one[100] = "", other[100] = "";
	bool back;

	fill(&s, 3, 37, 5);
	if (!(s.deviation = malloc(ct_stack_count(&s) * sizeof *s.deviation)))
		exit(99);
	for (size_t i = 0; i < ct_stack_count(&s); i++)
		s.deviation[i] = (float)i + 0.25f;
	OK(ct_stack_write(path, &s, &force, &e) == 0 && ct_stack_read(path, &t, &e) == 0,
		"views that carry deviations are written and read %s", e.msg);
	back = t.deviation && same(&s, &t) &&
	       memcmp(t.deviation, s.deviation, ct_stack_count(&s) * sizeof *s.deviation) == 0;
	OK(back, "views and deviations come back to the bit");
	snprintf(one, sizeof one, "%s", ct_meta_get(&t.meta, CT_META_INPUT));
	ct_stack_free(&t);
	s.deviation[7] = 0;
	if (ct_stack_write(path, &s, &force, &e) || ct_stack_read(path, &t, &e))
		exit(99);
	snprintf(other, sizeof other, "%s", ct_meta_get(&t.meta, CT_META_INPUT));
	OK(strcmp(one, other) != 0, "the hash of the views is of their deviations too");
	ct_stack_free(&t);
	ct_stack_free(&s);
}

static void test_damage(const char *path)
{
	struct ct_err e = {0};
	struct ct_stack s, t;
	unsigned char *p;
	size_t n, read = 0, unnamed = 0, first = 0;

	fill(&s, 2, 5, 7);
	if (ct_stack_write(path, &s, &force, &e))
		exit(99);
	p = load(path, &n);
	for (size_t cut = 0; cut < n; cut++) {
		save(path, p, cut);
		e = (struct ct_err){0};
		if (ct_stack_read(path, &t, &e) == 0) {
			read++;
			ct_stack_free(&t);
		}
		unnamed += !strstr(e.msg, path) || e.code != CT_EINPUT;
		first += strstr(e.msg, "Invalid size") != NULL; /* of several complaints */
	}
	OK(read == 0, "cut at any of %zu bytes it is refused", n);
	OK(unnamed == 0, "with the name of the file");
	OK(first > 0, "and the first complaint of the library");
	for (size_t i = 0; i + 22 < n; i++) /* the data windows grow to 2^20 squared */
		if (memcmp(p + i, "dataWindow\0box2i", 17) == 0)
			memcpy(p + i + 17 + 4 + 8, "\xff\xff\x0f\x00\xff\xff\x0f\x00", 8);
	save(path, p, n);
	OK(ct_stack_read(path, &t, &e) < 0 && e.code == CT_EINPUT, "a hostile size: %s", e.msg);
	free(p);
	ct_stack_free(&s);
	refused("/dev/null", "not an EXR file", CT_EINPUT, "an empty file");
	refused("no-such.exr", "No such file", CT_EINPUT, "no file");
}

#ifndef BOUND_NONE
/* The code of what is refused, in MiB of memory more than there is now. */
static enum ct_code code_within(long mib, const unsigned char *p, size_t n)
{
	struct ct_err e = {0};
	struct ct_any a = {0};
	const pid_t child = fork();
	int got = -1;

	if (child == 0)
		_exit(bound_memory(mib) && ct_format_read_bytes(
						   &ct_format_exr, p, n, "x.exr", &a, &e) == -1
				? (int)e.code
				: 99);
	waitpid(child, &got, 0);
	return WIFEXITED(got) ? (enum ct_code)WEXITSTATUS(got) : CT_OK;
}

/* No room for an attribute is no error of the file. */
static void test_memory(void)
{
	static const char head[] = "\x76\x2f\x31\1\2\0\0\0a\0string\0\0\0\0\2"; /* of 32 MiB */
	const size_t n = sizeof head - 1 + (32 << 20);
	unsigned char *p = calloc(n, 1);

	if (!p)
		exit(99);
	memcpy(p, head, sizeof head - 1);
	OK(code_within(16, p, n) == CT_ENOMEM, "too little memory");
	OK(code_within(200, p, n) == CT_EINPUT, "enough, and a file that ends too early");
	free(p);
}
#endif

/* Chunks at the edge of shrinking: the deflated size is often exactly the plain one. */
static void test_zip(void)
{
	enum { N = 700, ROUNDS = 3000 };
	unsigned char in[N], back[N], scratch[N], *packed = malloc(ct_exr_zip_room(N));
	size_t bad = 0, edge = 0, grown = 0, short_read = 0;
	uLongf room = ct_exr_zip_room(N);

	if (!packed)
		exit(99);
	for (size_t k = 0; k < ROUNDS; k++) {
		size_t n = N - k % 7, m;

		for (size_t i = 0; i < n; i++) /* just enough order to make up for zlib's frame */
			in[i] = i < k % 97 ? 7 : (unsigned char)ct_rng_below(1, k, i, 256);
		m = ct_exr_zip(packed, in, n, scratch);
		grown += m > n;
		edge += m + 1 == n;
		bad += m == 0 || ct_exr_zip_undo(back, n, packed, m, scratch) ||
		       memcmp(in, back, n) != 0;
		if (m + 1 < n) /* a stream that ends early or holds more is damaged */
			short_read +=
				ct_exr_zip_undo(back, n, packed, m - 9, scratch) == 0 ||
				ct_exr_zip_undo(back, n - 1, packed, m, scratch) == 0 ||
				(n < N && ct_exr_zip_undo(back, n + 1, packed, m, scratch) == 0);
	}
	OK(bad == 0, "%d chunks come back", ROUNDS);
	OK(grown == 0, "none is larger than its bytes");
	OK(edge > 0, "%zu are one byte from not shrinking", edge);
	OK(short_read == 0, "damaged streams are noticed");
	for (size_t i = 0; i < N; i++)
		in[i] = (unsigned char)ct_rng_below(2, 0, i, 256);
	must(compress(packed, &room, in, N) != Z_OK);
	OK(room > N && ct_exr_zip_undo(back, N, packed, room, scratch) == -1,
		"a chunk of %lu bytes for %d is none", room, N);
	free(packed);
}

static void test_threads(const char *path)
{
	struct ct_err e = {0};
	struct ct_env env = force;
	struct ct_stack s;
	unsigned char *p, *q;
	size_t n, m;

	fill(&s, 3, 70, 41);
	if (ct_par_alloc(&env.par, 4, &e) || ct_stack_write(path, &s, &force, &e))
		exit(99);
	p = load(path, &n);
	OK(ct_stack_write(path, &s, &env, &e) == 0, "written by four threads");
	q = load(path, &m);
	OK(n == m && memcmp(p, q, n) == 0, "the same bytes");
	ct_par_free(env.par);
	ct_stack_free(&s);
	free(p);
	free(q);
}

static void test_refused_writes(const char *path)
{
	struct ct_err e = {0};
	struct ct_stack s;

	unlink(path);
	fill(&s, 2, 5, 7);
	s.view[1].u[0] = (double)NAN;
	OK(ct_stack_write(path, &s, &force, &e) < 0 && e.code == CT_EGEOM, "NaN geometry: %s",
		e.msg);
	OK(access(path, F_OK) != 0, "leaves no file");
	ct_stack_free(&s);
}

static void test_speed(const char *path)
{
	struct ct_err e = {0};
	struct ct_stack s, t;
	double begin, write, read;

	fill(&s, 50, 256, 256);
	begin = ct_clock_wall();
	if (ct_stack_write(path, &s, &force, &e))
		exit(99);
	write = ct_clock_wall() - begin;
	begin = ct_clock_wall();
	if (ct_stack_read(path, &t, &e))
		exit(99);
	read = ct_clock_wall() - begin;
	OK(same(&s, &t), "50 views of 256x256");
	printf("# written in %.2f s, read in %.2f s\n", write, read);
	ct_stack_free(&s);
	ct_stack_free(&t);
}

/* Parts of t-formats.sh: "keep FILE" writes a stack, "means FILE" prints the mean of every view,
 * "same A B" compares two. */
static int command(char **argv)
{
	struct ct_err e = {0};
	struct ct_stack s = {0}, t = {0};
	bool good;

	if (strcmp(argv[1], "keep") == 0) {
		fill(&s, 4, 48, 40);
		good = ct_stack_write(argv[2], &s, &force, &e) == 0;
	} else if (strcmp(argv[1], "means") == 0) {
		good = ct_stack_read(argv[2], &s, &e) == 0;
		for (size_t k = 0; k < s.views; k++) {
			double sum = 0;

			for (size_t i = 0; i < s.h * s.w; i++)
				sum += (double)ct_stack_view(&s, k)[i];
			printf("%.9f\n", sum / (double)(s.h * s.w));
		}
	} else {
		good = ct_stack_read(argv[2], &s, &e) == 0 && ct_stack_read(argv[3], &t, &e) == 0 &&
		       same(&s, &t);
		for (size_t i = 0; good && i < s.meta.n; i++) {
			const char *key = s.meta.pair[i].key, *v = ct_meta_get(&t.meta, key);

			good = strcmp(key, "input") == 0 ||
			       (v && strcmp(v, s.meta.pair[i].value) == 0);
		}
	}
	ct_stack_free(&s);
	ct_stack_free(&t);
	if (e.code)
		fprintf(stderr, "%s\n", e.msg);
	return good ? 0 : e.code ? (int)e.code : 1;
}

int main(int argc, char **argv)
{
	char path[] = "/tmp/t-exr-XXXXXX";
	int fd;

	if (argc > 2)
		return command(argv);
	fd = mkstemp(path);
	if (fd < 0)
		exit(99);
	close(fd);
#ifndef BOUND_NONE
	test_memory(); /* first: malloc keeps what was freed */
#endif
	test_round_trip(path, 1, 1, 3, CT_CONE);
	test_round_trip(path, 3, 33, 17, CT_PARALLEL);
	test_zip();
	test_threads(path);
	test_odd(path);
	test_deviation(path);
	test_damage(path);
	test_refused_writes(path);
	test_speed(path);
	unlink(path);
	return tap_done();
}
