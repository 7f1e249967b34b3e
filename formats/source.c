/* source.c: see source.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/source.h"
#include "core/inflate.h"
#include "core/mem.h"
#include "formats/hash.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

enum {
	BLOCK = CT_SOURCE_BLOCK,
	DEFLATE_MOST = 1032 /* no byte of deflate stands for more */
};

static int read_error(const struct ct_source *s, struct ct_err *e)
{
	return ct_fail(e, CT_EINPUT, "%s", ferror(s->f) ? strerror(errno) : "truncated file");
}

/* How many bytes are left, where that can be told. */
static int measure(struct ct_source *s, struct ct_err *e)
{
	const off_t here = ftello(s->f);
	off_t end;

	s->left = s->size = UINT64_MAX;
	if (here < 0 || fseeko(s->f, 0, SEEK_END) != 0)
		return 0;
	end = ftello(s->f);
	if (fseeko(s->f, here, SEEK_SET) != 0 || end < here)
		return ct_fail(e, CT_EINPUT, "cannot seek: %s", strerror(errno));
	s->left = s->size = (uint64_t)(end - here);
	return 0;
}

/* The next block of the compressed file. */
static void refill(struct ct_source *s)
{
	s->z.next_in = s->in;
	s->z.avail_in = (uInt)fread(s->in, 1, BLOCK, s->f);
	s->from += s->z.avail_in;
}

/* What begins with the first byte of gzip. */
static int check_gzip(struct ct_source *s, struct ct_err *e)
{
	refill(s);
	if (s->z.avail_in < 2)
		return read_error(s, e);
	return s->in[1] == 0x8b ? 0 : ct_fail(e, CT_EINPUT, "not a NIfTI file");
}

int ct_source_open(struct ct_source *s, FILE *f, enum ct_packing packing, struct ct_err *e)
{
	*s = (struct ct_source){.f = f, .packed = packing == CT_PACKING_ZLIB};
	if (ct_alloc(&s->block, BLOCK, 1, e) || measure(s, e))
		return -1;
	if (packing == CT_PACKING_TELL) {
		const int first = getc(f);

		if (first == EOF)
			return read_error(s, e);
		ungetc(first, f);
		s->packed = first == 0x1f;
	}
	if (!s->packed)
		return 0;
	s->left = s->left < UINT64_MAX / DEFLATE_MOST ? s->left * DEFLATE_MOST : UINT64_MAX;
	if (ct_alloc(&s->in, BLOCK, 1, e))
		return -1;
	if (inflateInit2(&s->z, 15 + 32) != Z_OK) {
		free(s->in);
		s->in = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for zlib");
	}
	return packing == CT_PACKING_TELL ? check_gzip(s, e) : 0;
}

void ct_source_close(struct ct_source *s)
{
	if (s->in)
		inflateEnd(&s->z);
	free(s->in);
	free(s->block);
	*s = (struct ct_source){0};
}

/* Up to n bytes of the compressed file; fewer only at its end. */
static int inflate_some(
	struct ct_source *s, unsigned char *dst, size_t n, size_t *got, struct ct_err *e)
{
	*got = 0;
	while (*got < n && !s->ended) {
		const size_t want = n - *got < BLOCK ? n - *got : BLOCK;
		int z;

		if (s->z.avail_in == 0) {
			refill(s);
			if (s->z.avail_in == 0)
				return read_error(s, e);
		}
		s->z.next_out = dst + *got;
		s->z.avail_out = (uInt)want;
		z = inflate(&s->z, Z_NO_FLUSH);
		*got += want - s->z.avail_out;
		s->to += want - s->z.avail_out;
		if (ct_inflate_check(s->from, s->to, e))
			return -1;
		if (z == Z_STREAM_END) { /* another member may follow; anything else is padding */
			if (s->z.avail_in == 0)
				refill(s);
			s->ended = s->z.avail_in == 0 || s->z.next_in[0] != 0x1f;
			if (!s->ended)
				inflateReset(&s->z);
		} else if (z != Z_OK && z != Z_BUF_ERROR)
			return ct_fail(e, CT_EINPUT, "damaged compressed data (%s)",
				s->z.msg ? s->z.msg : "zlib");
	}
	return 0;
}

int ct_source_take(struct ct_source *s, void *dst, size_t n, struct ct_err *e)
{
	size_t got;

	if (s->packed) {
		if (inflate_some(s, dst, n, &got, e))
			return -1;
	} else
		got = fread(dst, 1, n, s->f);
	s->at += got;
	return got < n ? read_error(s, e) : 0;
}

int ct_source_skip(struct ct_source *s, uint64_t at, struct ct_err *e)
{
	while (s->at < at) {
		const uint64_t n = at - s->at;

		if (ct_source_take(s, s->block, n < BLOCK ? (size_t)n : BLOCK, e))
			return -1;
	}
	return 0;
}

/* The rest of a compressed file, for its check sum. */
static int drain(struct ct_source *s, struct ct_err *e)
{
	size_t got;

	while (s->packed && !s->ended)
		if (inflate_some(s, s->block, BLOCK, &got, e))
			return -1;
	return 0;
}

int ct_stored_bytes(
	const struct ct_stored *how, const size_t n[static 3], size_t *bytes, struct ct_err *e)
{
	return ct_err_any(ct_size_mul(bytes, n[0], n[1], "dimensions", e) ||
			  ct_size_mul(bytes, *bytes, n[2], "dimensions", e) ||
			  ct_size_mul(bytes, *bytes, ct_voxel_bytes((int)how->type), "voxels", e));
}

/* CT_EINPUT if the file is too short for n voxels. */
static int check_length(
	const struct ct_source *s, const struct ct_stored *how, const size_t n[3], struct ct_err *e)
{
	size_t bytes;

	if (ct_stored_bytes(how, n, &bytes, e))
		return -1;
	if (s->left != UINT64_MAX && bytes > s->left - s->at)
		return ct_fail(e, CT_EINPUT, "truncated file: %zux%zux%zu voxels need %zu bytes",
			n[0], n[1], n[2], bytes);
	return s->packed ? ct_inflate_check(s->size, bytes, e) : 0;
}

/* What stands before the voxels in the hash: sizes and geometry. */
static void start_hash(struct ct_hash *hash, const struct ct_vol *v)
{
	const uint64_t n[3] = {v->n[0], v->n[1], v->n[2]};

	ct_hash_begin(hash);
	ct_hash_add(hash, n, sizeof n);
	ct_hash_add(hash, v->affine, sizeof v->affine);
}

/* The next n numbers into out, and into the hash, if that is not NULL, while they are in the cache.
 */
static int take_numbers(struct ct_source *s, const struct ct_stored *how, size_t n, float *out,
	struct ct_hash *hash, struct ct_err *e)
{
	const size_t bytes = ct_voxel_bytes((int)how->type), most = BLOCK / bytes;
	const bool as_is = how->type == CT_V_F32 && !how->big && how->slope == 1 && how->inter == 0;

	for (size_t some; n > 0; n -= some, out += some) {
		some = n < most ? n : most;
		if (ct_source_take(s, as_is ? (void *)out : s->block, some * bytes, e))
			return s->packed || ferror(s->f)
				       ? -1
				       : ct_fail(e, CT_EINPUT,
						 "truncated file: shorter than its sizes and type say");
		if (how->big)
			ct_voxels_swap(some, bytes, s->block);
		if (!as_is)
			ct_voxels_float(some, out, how->type, s->block, how->slope, how->inter);
		if (hash)
			ct_hash_add(hash, out, some * sizeof *out);
	}
	return 0;
}

int ct_source_volume(struct ct_source *s, const struct ct_stored *how, const char *name,
	struct ct_vol *v, struct ct_err *e)
{
	const struct ct_vol head = *v;
	struct ct_hash hash;

	if (check_length(s, how, head.n, e) || ct_vol_alloc(v, head.n, e))
		return -1;
	memcpy(v->affine, head.affine, sizeof v->affine);
	start_hash(&hash, v);
	return ct_err_any(ct_vol_check_grid(v, e) ||
			  take_numbers(s, how, ct_vol_count(v), v->data, &hash, e) || drain(s, e) ||
			  ct_hash_input(&hash, &v->meta, name, e));
}

uint64_t ct_source_behind(const struct ct_source *s)
{
	const uint64_t all = s->packed ? s->to : s->size;

	return all == UINT64_MAX ? 0 : all - s->at;
}

int ct_source_sign(struct ct_vol *v, const char *name, struct ct_err *e)
{
	struct ct_hash hash;

	start_hash(&hash, v);
	ct_hash_add(&hash, v->data, ct_vol_count(v) * sizeof *v->data);
	return ct_vol_check_grid(v, e) ? -1 : ct_hash_input(&hash, &v->meta, name, e);
}

int ct_source_whole(FILE *f, const struct ct_stored *how, size_t n, float *out, const char *longer,
	struct ct_err *e)
{
	struct ct_source s = {0};
	int rc = ct_err_any(ct_source_open(&s, f, CT_PACKING_NONE, e) ||
			    take_numbers(&s, how, n, out, NULL, e));

	ct_source_close(&s);
	return rc == 0 && getc(f) != EOF ? ct_fail(e, CT_EINPUT, "longer than %s", longer) : rc;
}

int ct_sink_open(struct ct_sink *s, const char *path, const struct ct_env *env, struct ct_err *e)
{
	*s = (struct ct_sink){0};
	return ct_out_open(&s->out, path, env, e);
}

int ct_sink_pack(struct ct_sink *s, bool gzip, struct ct_err *e)
{
	if (ct_alloc(&s->buf, BLOCK, 1, e))
		return -1;
	if (deflateInit2(&s->z, 1, Z_DEFLATED, 15 + (gzip ? 16 : 0), 9, Z_DEFAULT_STRATEGY) != Z_OK)
		return ct_fail(e, CT_ENOMEM, "no memory for zlib");
	s->packed = true;
	return 0;
}

static void end_packing(struct ct_sink *s)
{
	if (s->packed)
		deflateEnd(&s->z);
	s->packed = false;
}

static int put(struct ct_sink *s, const void *data, size_t n, struct ct_err *e)
{
	s->at += n;
	return n ? ct_put(&s->out, data, n, e) : 0;
}

/* The last call says so. */
static int give(struct ct_sink *s, const void *data, size_t n, bool last, struct ct_err *e)
{
	int z = Z_OK;

	assert(n <= UINT_MAX);
	if (!s->packed)
		return put(s, data, n, e);
	s->z.next_in = (z_const Bytef *)(uintptr_t)data;
	s->z.avail_in = (uInt)n;
	do {
		s->z.next_out = s->buf;
		s->z.avail_out = BLOCK;
		z = deflate(&s->z, last ? Z_FINISH : Z_NO_FLUSH);
		if (z == Z_STREAM_ERROR)
			return ct_fail(e, CT_EOUTPUT, "zlib failed");
		if (put(s, s->buf, BLOCK - s->z.avail_out, e))
			return -1;
	} while (last ? z != Z_STREAM_END : s->z.avail_out == 0);
	return 0;
}

int ct_sink_give(struct ct_sink *s, const void *data, size_t n, struct ct_err *e)
{
	return give(s, data, n, false, e);
}

int ct_sink_some(struct ct_sink *s, size_t n, const float *x, bool i16, bool exact, bool *fits,
	struct ct_err *e)
{
	const size_t bytes = i16 ? 2 : 4, step = BLOCK / bytes;

	*fits = true;
	if (!s->block && ct_alloc(&s->block, BLOCK, 1, e))
		return -1;
	for (size_t at = 0, m; at < n; at += m) {
		m = n - at < step ? n - at : step;
		if (i16)
			*fits &= ct_voxels_i16(m, s->block, x + at, exact);
		else
			memcpy(s->block, x + at, m * bytes);
		if (give(s, s->block, m * bytes, false, e))
			return -1;
	}
	return 0;
}

int ct_sink_end(struct ct_sink *s, struct ct_err *e)
{
	return give(s, NULL, 0, true, e);
}

int ct_sink_voxels(struct ct_sink *s, const struct ct_vol *v, bool i16, const struct ct_env *env,
	struct ct_err *e)
{
	const size_t total = ct_vol_count(v), step = BLOCK / sizeof(int16_t);
	bool fits;

	for (size_t at = 0; at < total; at += step) {
		if (ct_check_stop(env, e) || ct_sink_some(s, total - at < step ? total - at : step,
						     v->data + at, i16, false, &fits, e))
			return -1;
	}
	return 0;
}

int ct_sink_rewind(struct ct_sink *s, struct ct_err *e)
{
	end_packing(s);
	return fseeko(s->out.f, 0, SEEK_SET) == 0
		       ? 0
		       : ct_fail_errno(
				 e, CT_EOUTPUT, s->out.path ? s->out.path : "standard output");
}

int ct_sink_close(struct ct_sink *s, int rc, struct ct_err *e)
{
	end_packing(s);
	free(s->buf);
	free(s->block);
	if (rc == 0)
		return ct_out_commit(&s->out, e);
	ct_out_abandon(&s->out);
	return rc;
}
