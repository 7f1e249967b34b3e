/* exr-write.c: projections to OpenEXR; layout in exr.h. OpenEXRCore, a C library, makes headers
 * and tables, and chunks are made here, on all threads of the environment.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/any.h"
#include "formats/exr.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/text.h"
#include "core/mem.h"

#include <jansson.h>
#include <libdeflate.h>
#include <limits.h>
#include <openexr.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 16 }; /* of a ZIP chunk */

/* libdeflate's level: projections in float hardly shrink further above it, and it takes less time.
 */
enum { LEVEL = 2 };
enum { BIAS = 128 };

/* Where byte i of a chunk goes: those at even places come first, then those at odd ones. */
static size_t place(size_t n, size_t i)
{
	const size_t even = n - n / 2;

	return i < even ? 2 * i : 2 * (i - even) + 1;
}

static void split(size_t n, unsigned char *restrict dst, const unsigned char *restrict src)
{
	unsigned char last = BIAS;

	for (size_t i = 0; i < n; i++) {
		const unsigned char b = src[place(n, i)];

		dst[i] = (unsigned char)(b - last + BIAS);
		last = b;
	}
}

static void join(size_t n, unsigned char *restrict dst, const unsigned char *restrict src)
{
	unsigned char last = BIAS;

	for (size_t i = 0; i < n; i++) {
		last = (unsigned char)(last + src[i] - BIAS);
		dst[place(n, i)] = last;
	}
}

size_t ct_exr_zip_room(size_t n)
{
	return libdeflate_zlib_compress_bound(NULL, n);
}

size_t ct_exr_zip(unsigned char *dst, const unsigned char *src, size_t n, unsigned char *scratch)
{
	struct libdeflate_compressor *z = libdeflate_alloc_compressor(LEVEL);
	size_t m;

	if (!z)
		return 0;
	split(n, scratch, src);
	m = libdeflate_zlib_compress(z, scratch, n, dst, ct_exr_zip_room(n));
	libdeflate_free_compressor(z);
	if (m > 0 && m < n)
		return m;
	memcpy(dst, src, n);
	return n;
}

int ct_exr_zip_undo(
	unsigned char *dst, size_t n, const unsigned char *src, size_t m, unsigned char *scratch)
{
	struct libdeflate_decompressor *z;
	enum libdeflate_result r;

	if (m == n) {
		memcpy(dst, src, n);
		return 0;
	}
	z = m < n ? libdeflate_alloc_decompressor() : NULL;
	if (!z)
		return -1;
	r = libdeflate_zlib_decompress(z, src, m, scratch, n, NULL);
	libdeflate_free_decompressor(z);
	if (r != LIBDEFLATE_SUCCESS)
		return -1;
	join(n, dst, scratch);
	return 0;
}

/* The library goes back to fill in its tables, so the file is made in memory. */
struct file {
	unsigned char *data;
	size_t n, cap;
	struct ct_err *e;
	bool starved; /* of memory */
};

bool ct_exr_reserved(const char *name)
{
	static const char *const ours[] = {CT_EXR_VERSION, CT_EXR_META, "ct:input", "ct:beam",
		"ct:angleDeg", "ct:source", "ct:detCentre", "ct:detU", "ct:detV"};

	for (size_t i = 0; i < sizeof ours / sizeof *ours; i++)
		if (strcmp(name, ours[i]) == 0)
			return true;
	return false;
}

static int64_t put(exr_const_context_t c, void *user, const void *from, uint64_t n, uint64_t at,
	exr_stream_error_func_ptr_t complain)
{
	struct file *f = user;

	if (at > CT_MAX_BYTES || n > CT_MAX_BYTES || ct_grow(&f->data, &f->cap, at + n, 1, f->e)) {
		f->starved = true;
		complain(c, EXR_ERR_OUT_OF_MEMORY, "no memory for %llu bytes of EXR",
			(unsigned long long)(at + n));
		return -1;
	}
	memcpy(f->data + at, from, n);
	if (at + n > f->n)
		f->n = at + n;
	return (int64_t)n;
}

static exr_result_t put_vector(exr_context_t c, int part, const char *name, const double v[3])
{
	char text[100];

	snprintf(text, sizeof text, "%.17g,%.17g,%.17g", v[0], v[1], v[2]);
	return exr_attr_set_string(c, part, name, text);
}

/* The first error of the calls, as libraries of return codes want it. */
#define TRY(call)                                                                                  \
	do {                                                                                       \
		if (r == EXR_ERR_SUCCESS)                                                          \
			r = (call);                                                                \
	} while (0)

static exr_result_t put_geometry(exr_context_t c, int part, const struct ct_stack *s, size_t k)
{
	const struct ct_view *v = &s->view[k];
	exr_result_t r = EXR_ERR_SUCCESS;
	char angle[32];

	snprintf(angle, sizeof angle, "%.17g", v->angle);
	TRY(exr_attr_set_string(c, part, "ct:beam", CT_WORD(CT_BEAM_LIST, s->beam)));
	TRY(exr_attr_set_string(c, part, "ct:angleDeg", angle));
	TRY(put_vector(c, part, "ct:source", v->source));
	TRY(put_vector(c, part, "ct:detCentre", v->centre));
	TRY(put_vector(c, part, "ct:detU", v->u));
	TRY(put_vector(c, part, "ct:detV", v->v));
	return r;
}

/* Metadata as "ct:KEY" strings of part 0; what does not fit a name goes into one JSON object. */
static exr_result_t put_meta(exr_context_t c, const struct ct_meta *m)
{
	exr_result_t r = exr_attr_set_string(c, 0, CT_EXR_VERSION, "1");
	json_t *rest = json_object();
	char name[CT_EXR_NAME + 1], *text = NULL;

	for (size_t i = 0; i < m->n && r == EXR_ERR_SUCCESS; i++) {
		const char *key = m->pair[i].key, *value = m->pair[i].value;
		int len = snprintf(name, sizeof name, CT_EXR_PREFIX "%s", key);

		if (strcmp(key, CT_META_INPUT) ==
			0) /* of the file that was read, not of this one */
			continue;
		if (len <= CT_EXR_NAME && !ct_exr_reserved(name))
			r = exr_attr_set_string(c, 0, name, value);
		else if (json_object_set_new(rest, key, ct_text_json(value)) != 0)
			r = EXR_ERR_OUT_OF_MEMORY;
	}
	if (r == EXR_ERR_SUCCESS && json_object_size(rest)) {
		text = ct_text_of_json(rest, JSON_COMPACT);
		r = text ? exr_attr_set_string(c, 0, CT_EXR_META, text) : EXR_ERR_OUT_OF_MEMORY;
	}
	free(text);
	json_decref(rest);
	return r;
}

static exr_result_t put_header(exr_context_t c, const struct ct_stack *s)
{
	exr_result_t r = EXR_ERR_SUCCESS;

	for (size_t k = 0; k < s->views && r == EXR_ERR_SUCCESS; k++) {
		char name[32];
		int part = 0;

		snprintf(name, sizeof name, "view.%04zu", k);
		TRY(exr_add_part(c, name, EXR_STORAGE_SCANLINE, &part));
		TRY(exr_initialize_required_attr_simple(
			c, part, (int32_t)s->w, (int32_t)s->h, EXR_COMPRESSION_ZIP));
		TRY(exr_add_channel(c, part, "Y", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1));
		if (s->deviation)
			TRY(exr_add_channel(c, part, CT_EXR_DEVIATION, EXR_PIXEL_FLOAT,
				EXR_PERCEPTUALLY_LINEAR, 1, 1));
		TRY(exr_set_version(c, part, 1));
		TRY(put_geometry(c, part, s, k));
	}
	TRY(put_meta(c, &s->meta));
	TRY(exr_write_header(c));
	return r;
}

/* Chunks of one view: room for each, scratch for each worker. */
struct packer {
	const float *from, *also; /* [h][w]; also: NULL, or a second channel */
	size_t h, w, n, room;     /* n chunks, room bytes for each */
	unsigned char *out, *scratch;
	size_t *bytes; /* of each chunk */
};

static void pack(void *arg, size_t i, size_t worker)
{
	const struct packer *p = arg;
	const size_t row = p->w * sizeof *p->from, all = p->also ? 2 * row : row;
	const size_t rows = p->h - i * ROWS < ROWS ? p->h - i * ROWS : ROWS;
	unsigned char *scratch = p->scratch + 2 * worker * ROWS * all, *both = scratch + ROWS * all;
	const void *from = p->from + i * ROWS * p->w;

	for (size_t y = 0; p->also && y < rows; y++) { /* channels in turn, row by row */
		memcpy(both + y * all, p->from + (i * ROWS + y) * p->w, row);
		memcpy(both + y * all + row, p->also + (i * ROWS + y) * p->w, row);
		from = both;
	}
	p->bytes[i] = ct_exr_zip(p->out + i * p->room, from, rows * all, scratch);
}

static exr_result_t put_pixels(
	exr_context_t c, int part, struct packer *p, const struct ct_env *env)
{
	exr_result_t r = EXR_ERR_SUCCESS;

	ct_par_for(env ? env->par : NULL, p->n, pack, p);
	for (size_t i = 0; i < p->n && r == EXR_ERR_SUCCESS; i++)
		r = p->bytes[i] ? exr_write_scanline_chunk(c, part, (int)(i * ROWS),
					  p->out + i * p->room, p->bytes[i])
				: EXR_ERR_OUT_OF_MEMORY;
	return r;
}

static int packer_alloc(
	struct packer *p, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e)
{
	const size_t whole = ROWS * s->w * sizeof *s->data * (s->deviation ? 2 : 1);

	*p = (struct packer){.h = s->h,
		.w = s->w,
		.n = (s->h + ROWS - 1) / ROWS,
		.room = ct_exr_zip_room(whole)};
	return ct_err_any(
		ct_alloc(&p->out, p->n, p->room, e) ||
		ct_alloc(&p->scratch, ct_par_threads(env ? env->par : NULL), 2 * whole, e) ||
		ct_alloc(&p->bytes, p->n, sizeof *p->bytes, e));
}

static void packer_free(struct packer *p)
{
	free(p->out);
	free(p->scratch);
	free(p->bytes);
}

/* A context that writes may be locked while it complains, and asking it for its user data would
 * wait for ever: the code alone is told. */
static void no_complaint(exr_const_context_t c, exr_result_t code, const char *msg)
{
	(void)c;
	(void)code;
	(void)msg;
}

static int build(struct file *f, const char *path, const struct ct_stack *s,
	const struct ct_env *env, struct ct_err *e)
{
	exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
	struct packer p = {0};
	exr_context_t c = NULL;
	exr_result_t r;

	if (packer_alloc(&p, s, env, e)) {
		packer_free(&p);
		return -1;
	}
	init.error_handler_fn = no_complaint;
	init.user_data = f;
	init.write_fn = put;
	r = exr_start_write(&c, path, EXR_WRITE_FILE_DIRECTLY, &init);
	TRY(put_header(c, s));
	for (size_t k = 0; k < s->views && r == EXR_ERR_SUCCESS && !ct_stopping(env); k++) {
		ct_progress(env, "writing", k, s->views);
		p.from = ct_stack_view(s, k);
		p.also = s->deviation ? s->deviation + k * s->h * s->w : NULL;
		r = put_pixels(c, (int)k, &p, env);
	}
	if (c && r == EXR_ERR_SUCCESS)
		r = exr_finish(&c);
	else if (c) /* the first error is the one to tell */
		exr_finish(&c);
	packer_free(&p);
	if (ct_stopping(env)) /* it is not whole */
		return ct_check_stop(env, e);
	if (r == EXR_ERR_SUCCESS)
		return 0;
	if (!f->starved)
		ct_fail(e, r == EXR_ERR_OUT_OF_MEMORY ? CT_ENOMEM : CT_EFAIL, "%s",
			exr_get_default_error_message(r));
	return ct_blame(e, path);
}

int ct_stack_write(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e)
{
	struct file f = {.e = e};
	struct ct_out out = {0};
	int rc = -1;

	if (s->w > INT_MAX / 4 || s->h > INT_MAX)
		return ct_fail(e, CT_EOUTPUT, "%s: %zu views of %zux%zu do not fit an EXR file",
			path, s->views, s->w, s->h);
	if (ct_stack_check(s, e))
		return ct_blame(e, path);
	if (ct_out_open(&out, path, env, e))
		return -1;
	if (build(&f, path, s, env, e) == 0 && ct_put(&out, f.data, f.n, e) == 0)
		rc = ct_out_commit(&out, e);
	ct_out_abandon(&out);
	free(f.data);
	return rc;
}

int ct_stack_sign(struct ct_stack *s, const char *path, struct ct_err *e)
{
	const uint64_t head[4] = {s->views, s->h, s->w, (uint64_t)s->beam};
	const size_t bytes = ct_stack_count(s) * sizeof *s->data;
	const struct ct_piece piece[] = {{head, sizeof head}, {s->view, s->views * sizeof *s->view},
		{s->data, bytes}, {s->deviation, bytes}};

	return ct_meta_input(&s->meta, path, s->deviation ? 4 : 3, piece, e);
}

/* All but the pixels goes through a file, in memory, of one. */
int ct_stack_as_read(struct ct_stack *s, const char *name, struct ct_err *e)
{
	const struct ct_stack one = {1, 1, 1, s->beam, s->view, s->data, s->meta, NULL};
	struct file f = {.e = e};
	struct ct_any a = {0};
	int rc = -1;

	if (ct_stack_check(s, e))
		ct_blame(e, name);
	else if (build(&f, name, &one, NULL, e) == 0 &&
		 ct_format_read_bytes(&ct_format_exr, f.data, f.n, name, &a, e) == 0) {
		ct_meta_free(&s->meta);
		s->meta = a.stack.meta;
		a.stack.meta = (struct ct_meta){0};
		rc = ct_stack_sign(s, name, e);
	}
	ct_any_free(&a);
	free(f.data);
	return rc;
}
