/* nifti.c: volumes in and out as streams. See nifti.h. */
#include "config.h"
#include "core/mem.h"
#include "core/room.h"
#include "formats/ends.h"
#include "formats/hash.h"
#include "core/inflate.h"
#include "formats/io.h"
#include "formats/nifti-impl.h"
#include "formats/nifti.h"
#include "formats/voxels.h"

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <zlib.h>

enum {
	BLOCK = 1 << 18,   /* bytes converted at a time: stays in the second-level cache */
	MAX_EXT = 1 << 26, /* bytes of all extensions of a file */
	MAX_EXTS = 1024,
	DEFLATE_MOST = 1032 /* no byte of deflate stands for more */
};

struct source {
	FILE *f;
	bool gz, ended;
	z_stream z;
	unsigned char *in; /* [BLOCK] compressed bytes */
	unsigned char head[2];
	size_t held, at;           /* of head not yet given out; bytes given out so far */
	uint64_t left;             /* no more than this can come, UINT64_MAX if unknown */
	uint64_t size;             /* bytes of the file, UINT64_MAX if unknown */
	uint64_t packed, unpacked; /* compressed bytes read so far, and what became of them */
};

static int read_error(const struct source *s, struct ct_err *e)
{
	return ct_fail(e, CT_EINPUT, "%s", ferror(s->f) ? strerror(errno) : "truncated file");
}

static int source_open(struct source *s, FILE *f, struct ct_err *e)
{
	off_t here = ftello(f), end;

	*s = (struct source){.f = f, .left = UINT64_MAX, .size = UINT64_MAX};
	if (here >= 0 && fseeko(f, 0, SEEK_END) == 0) {
		end = ftello(f);
		if (fseeko(f, here, SEEK_SET) != 0 || end < here)
			return ct_fail(e, CT_EINPUT, "cannot seek: %s", strerror(errno));
		s->left = s->size = (uint64_t)(end - here);
	}
	s->held = fread(s->head, 1, 2, f);
	if (s->held < 2)
		return read_error(s, e);
	s->gz = s->head[0] == 0x1f && s->head[1] == 0x8b;
	if (!s->gz)
		return 0;
	s->left = s->left < UINT64_MAX / DEFLATE_MOST ? s->left * DEFLATE_MOST : UINT64_MAX;
	if (ct_alloc(&s->in, BLOCK, 1, e))
		return -1;
	if (inflateInit2(&s->z, 15 + 16) != Z_OK) {
		free(s->in);
		s->in = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for zlib");
	}
	memcpy(s->in, s->head, 2);
	s->z.next_in = s->in;
	s->z.avail_in = 2;
	s->packed = 2;
	return 0;
}

static void source_close(struct source *s)
{
	if (s->in)
		inflateEnd(&s->z);
	free(s->in);
}

/* The next block of the compressed file. */
static void refill(struct source *s)
{
	s->z.next_in = s->in;
	s->z.avail_in = (uInt)fread(s->in, 1, BLOCK, s->f);
	s->packed += s->z.avail_in;
}

/* Up to n bytes of the compressed file; fewer only at its end. */
static int inflate_some(
	struct source *s, unsigned char *dst, size_t n, size_t *got, struct ct_err *e)
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
		s->unpacked += want - s->z.avail_out;
		if (ct_inflate_check(s->packed, s->unpacked, e))
			return -1;
		if (z == Z_STREAM_END) { /* another member may follow; anything else is padding */
			if (s->z.avail_in == 0)
				refill(s);
			s->ended = s->z.avail_in == 0 || s->z.next_in[0] != 0x1f;
			if (!s->ended)
				inflateReset(&s->z);
		} else if (z != Z_OK && z != Z_BUF_ERROR)
			return ct_fail(e, CT_EINPUT, "damaged gzip data (%s)",
				s->z.msg ? s->z.msg : "zlib");
	}
	return 0;
}

/* Exactly n bytes. */
static int take(struct source *s, void *dst, size_t n, struct ct_err *e)
{
	unsigned char *p = dst;
	size_t got = 0;

	if (s->gz) {
		if (inflate_some(s, p, n, &got, e))
			return -1;
	} else {
		for (; s->held && got < n; s->held--)
			p[got++] = s->head[2 - s->held];
		got += fread(p + got, 1, n - got, s->f);
	}
	s->at += got;
	return got < n ? read_error(s, e) : 0;
}

/* The rest of a gzip file, for its check sum. */
static int drain(struct source *s, unsigned char *block, struct ct_err *e)
{
	size_t got;

	while (s->gz && !s->ended)
		if (inflate_some(s, block, BLOCK, &got, e))
			return -1;
	return 0;
}

static int read_header(struct source *s, struct ct_nii *h, struct ct_err *e)
{
	unsigned char raw[CT_NII_MAX];

	if (take(s, raw, 4, e) || ct_nii_sniff(h, raw, e) ||
		take(s, raw + 4, ct_nii_size(h) - 4, e))
		return -1;
	return ct_nii_unpack(h, raw, e);
}

static int skip_to(struct source *s, uint64_t at, unsigned char *block, struct ct_err *e)
{
	while (s->at < at) {
		uint64_t n = at - s->at;

		if (take(s, block, n < BLOCK ? (size_t)n : BLOCK, e))
			return -1;
	}
	return 0;
}

static int32_t int32_at(const unsigned char *p, bool swap)
{
	uint32_t u;

	memcpy(&u, p, sizeof u);
	return (int32_t)(swap ? __builtin_bswap32(u) : u);
}

/* The extensions, then whatever stands before vox_offset. */
static int read_extensions(struct source *s, const struct ct_nii *h, struct ct_meta *m,
	unsigned char *block, struct ct_err *e)
{
	const uint64_t start = (uint64_t)h->start;
	unsigned char head[8], *p;
	size_t total = 0, pairs = 0;
	int rc;

	if (start > s->left)
		return ct_fail(
			e, CT_EINPUT, "vox_offset %.0f is past the end of the file", h->start);
	if (take(s, head, 4, e))
		return -1;
	for (size_t k = 0; head[0] && s->at + 8 <= start; k++) {
		int32_t size, code;

		if (take(s, head, 8, e))
			return -1;
		size = int32_at(head, h->swap);
		code = int32_at(head + 4, h->swap);
		head[0] = 1;
		if (size == 0)
			break;
		if (size < 8 || (uint64_t)size - 8 > start - s->at || k >= MAX_EXTS ||
			(total += (size_t)size) > MAX_EXT)
			return ct_fail(
				e, CT_EINPUT, "extension %zu: esize %ld is wrong", k, (long)size);
		if (ct_alloc(&p, (size_t)size, 1, e))
			return -1;
		rc = take(s, p, (size_t)size - 8, e) ||
		     ct_nii_ext_read(m, &pairs, k, code, p, (size_t)size - 8, e);
		free(p);
		if (rc)
			return -1;
	}
	return skip_to(s, start, block, e);
}

/* The voxels go into the hash while they are in the cache. */
static int read_voxels(struct source *s, const struct ct_nii *h, struct ct_vol *v,
	struct ct_hash *hash, unsigned char *block, struct ct_err *e)
{
	const size_t bytes = ct_voxel_bytes((int)h->type), total = ct_vol_count(v);
	const bool as_is = (int)h->type == CT_V_F32 && !h->swap && h->slope == 1 && h->inter == 0;

	for (size_t done = 0, n; done < total; done += n) {
		float *out = v->data + done;

		n = total - done < BLOCK / bytes ? total - done : BLOCK / bytes;
		ct_mem_touch(out, n * sizeof *out);
		if (take(s, as_is ? (void *)out : block, n * bytes, e))
			return -1;
		if (h->swap)
			ct_voxels_swap(n, bytes, block);
		if (!as_is)
			ct_voxels_float(
				n, out, (enum ct_voxel)(int)h->type, block, h->slope, h->inter);
		CT_SIMD(ct_hash_add)(hash, out, n * sizeof *out);
		ct_room_trim();
	}
	return 0;
}

/* Room for the voxels, unless the file is too short for them. */
static int make_volume(
	const struct source *s, const struct ct_nii *h, struct ct_vol *v, struct ct_err *e)
{
	size_t n[3], count;

	if (ct_nii_dims(h, n, e) || ct_size_mul(&count, n[0], n[1], "dimensions", e) ||
		ct_size_mul(&count, count, n[2], "dimensions", e) ||
		ct_size_mul(&count, count, ct_voxel_bytes((int)h->type), "voxels", e))
		return -1;
	if (s->left != UINT64_MAX && count > s->left - (uint64_t)h->start)
		return ct_fail(e, CT_EINPUT, "truncated file: %zux%zux%zu voxels need %zu bytes",
			n[0], n[1], n[2], count);
	if (s->gz && ct_inflate_check(s->size, count, e))
		return -1;
	return ct_vol_alloc(v, n, e);
}

/* What stands before the voxels in the hash: sizes and geometry. */
static int start_hash(struct ct_hash **hash, const struct ct_vol *v, struct ct_err *e)
{
	const uint64_t n[3] = {v->n[0], v->n[1], v->n[2]};

	if (ct_hash_alloc(hash, e))
		return -1;
	CT_SIMD(ct_hash_add)(*hash, n, sizeof n);
	CT_SIMD(ct_hash_add)(*hash, v->affine, sizeof v->affine);
	return 0;
}

int ct_nifti_read_stream(FILE *f, const char *name, struct ct_vol *v, struct ct_err *e)
{
	struct source s = {0};
	struct ct_nii h = {0};
	double affine[3][4];
	unsigned char *block = NULL;
	struct ct_hash *hash = NULL;
	int rc = -1, code;

	if (ct_alloc(&block, BLOCK, 1, e) || source_open(&s, f, e) || read_header(&s, &h, e) ||
		ct_nii_affine(&h, affine, &code, e) ||
		read_extensions(&s, &h, &v->meta, block, e) || make_volume(&s, &h, v, e))
		goto out;
	memcpy(v->affine, affine, sizeof affine);
	ct_meta_drop(&v->meta, CT_META_NIFTI_CODE);
	if (ct_vol_check_grid(v, e) || start_hash(&hash, v, e) ||
		read_voxels(&s, &h, v, hash, block, e) || drain(&s, block, e) ||
		(code != 1 && ct_meta_setf(&v->meta, e, CT_META_NIFTI_CODE, "%d", code)) ||
		ct_hash_input(hash, &v->meta, name, e))
		goto out;
	rc = 0;
out:
	source_close(&s);
	free(block);
	free(hash);
	if (rc) {
		ct_vol_free(v);
		ct_blame(e, name);
	}
	return rc;
}

struct sink {
	struct ct_out out;
	bool gz;
	z_stream z;
	unsigned char *buf; /* [BLOCK] compressed bytes */
};

static int sink_open(struct sink *s, const char *path, const struct ct_env *env, struct ct_err *e)
{
	*s = (struct sink){.gz = ct_ends_match(path, "gz")};
	if (s->gz && ct_alloc(&s->buf, BLOCK, 1, e))
		return -1;
	if (s->gz && deflateInit2(&s->z, 1, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY) != Z_OK) {
		free(s->buf);
		return ct_fail(e, CT_ENOMEM, "no memory for zlib");
	}
	if (ct_out_open(&s->out, path, env, e) == 0)
		return 0;
	if (s->gz)
		deflateEnd(&s->z);
	free(s->buf);
	return -1;
}

/* n <= BLOCK bytes; the last call says so. */
static int give(struct sink *s, const void *data, size_t n, bool last, struct ct_err *e)
{
	int z = Z_OK;

	if (!s->gz)
		return n ? ct_put(&s->out, data, n, e) : 0;
	s->z.next_in = (z_const Bytef *)(uintptr_t)data;
	s->z.avail_in = (uInt)n;
	do {
		s->z.next_out = s->buf;
		s->z.avail_out = BLOCK;
		z = deflate(&s->z, last ? Z_FINISH : Z_NO_FLUSH);
		if (z == Z_STREAM_ERROR)
			return ct_fail(e, CT_EOUTPUT, "zlib failed");
		if (ct_put(&s->out, s->buf, BLOCK - s->z.avail_out, e))
			return -1;
	} while (last ? z != Z_STREAM_END : s->z.avail_out == 0);
	return 0;
}

/* Whether the volume is stored as int16; block is scratch. */
static int choose_type(const struct ct_vol *v, enum ct_nifti_type type, int16_t *block, bool *i16,
	struct ct_err *e)
{
	const size_t total = ct_vol_count(v), step = BLOCK / sizeof *block;

	*i16 = type != CT_NIFTI_F32;
	for (size_t at = 0; at < total && *i16; at += step) {
		*i16 = ct_voxels_i16(total - at < step ? total - at : step, block, v->data + at,
			type == CT_NIFTI_AUTO);
		ct_room_trim();
	}
	return type == CT_NIFTI_I16 && !*i16 ? ct_fail(e, CT_ENUMERIC, "a voxel does not fit int16")
					     : 0;
}

static void fill_header(struct ct_nii *h, const struct ct_vol *v, bool i16, size_t ext)
{
	const char *kept = ct_meta_get(&v->meta, CT_META_NIFTI_CODE);
	const long code = kept ? strtol(kept, NULL, 10) : 1;

	h->dim[0] = 3;
	for (int a = 1; a < 8; a++) {
		h->dim[a] = a <= 3 ? (double)v->n[a - 1] : 1;
		h->pixdim[a] = a <= 3 ? h->pixdim[a] : 0;
		if (h->dim[a] > 32767)
			h->version = 2;
	}
	h->type = i16 ? CT_V_I16 : CT_V_F32;
	h->bits = i16 ? 16 : 32;
	h->start = (double)(ct_nii_size(h) + 4 + ext);
	h->slope = 1;
	h->sform = code >= 1 && code <= 5 ? (double)code : 1;
	h->qform = h->sheared ? 0 : h->sform;
}

static int write_voxels(struct sink *s, const struct ct_vol *v, bool i16, void *block,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t bytes = i16 ? 2 : 4, total = ct_vol_count(v), step = BLOCK / bytes;

	for (size_t at = 0, n; at < total; at += n) {
		n = total - at < step ? total - at : step;
		if (i16)
			ct_voxels_i16(n, block, v->data + at, false);
		else
			memcpy(block, v->data + at, n * bytes);
		if (ct_voxel_host_is_big())
			ct_voxels_swap(n, bytes, block);
		if (ct_check_stop(env, e) || give(s, block, n * bytes, at + n == total, e))
			return -1;
		ct_room_trim();
	}
	return 0;
}

int ct_nifti_write(const char *path, const struct ct_vol *v, enum ct_nifti_type type, bool shear,
	const struct ct_env *env, struct ct_err *e)
{
	unsigned char raw[CT_NII_MAX + 4] = {0}, *ext = NULL;
	struct ct_nii h = {.version = 1};
	struct sink s = {0};
	char descrip[80];
	void *block = NULL;
	size_t bytes = 0;
	bool i16;
	int rc = -1;

	if (ct_alloc(&block, BLOCK, 1, e))
		return -1;
	if (ct_nii_set_affine(&h, v, shear, e) || choose_type(v, type, block, &i16, e) ||
		ct_nii_ext_write(&v->meta, &ext, &bytes, e)) {
		ct_blame(e, path);
		goto out;
	}
	fill_header(&h, v, i16, bytes);
	snprintf(descrip, sizeof descrip, "%.60s %s", env && env->tool ? env->tool : PACKAGE_NAME,
		PACKAGE_VERSION);
	ct_nii_pack(&h, descrip, raw);
	raw[ct_nii_size(&h)] = bytes > 0;
	if (sink_open(&s, path, env, e))
		goto out;
	rc = give(&s, raw, ct_nii_size(&h) + 4, false, e);
	for (size_t at = 0; at < bytes && !rc; at += BLOCK)
		rc = give(&s, ext + at, bytes - at < BLOCK ? bytes - at : BLOCK, false, e);
	if (!rc)
		rc = write_voxels(&s, v, i16, block, env, e);
	if (!rc)
		rc = ct_out_commit(&s.out, e);
	else
		ct_out_abandon(&s.out);
	if (s.gz)
		deflateEnd(&s.z);
	free(s.buf);
out:
	free(block);
	free(ext);
	return rc;
}
