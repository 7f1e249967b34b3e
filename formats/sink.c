/* sink.c: see sink.h. */
#include "config.h"
#include "formats/sink.h"
#include "core/mem.h"
#include "formats/source.h"
#include "formats/voxels.h"

#include <assert.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = CT_SOURCE_BLOCK };

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
