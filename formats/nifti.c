/* nifti.c: volumes in and out as streams. See nifti.h. */
#include "config.h"
#include "core/mem.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/nifti-impl.h"
#include "formats/nifti.h"
#include "formats/sink.h"
#include "formats/source.h"
#include "formats/voxels.h"

#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
	MAX_EXT = 1 << 26, /* bytes of all extensions of a file */
	MAX_EXTS = 1024,
	LENGTH = 4096 /* voxels that are looked at together */
};

static int read_header(struct ct_source *s, struct ct_nii *h, struct ct_err *e)
{
	unsigned char raw[CT_NII_MAX];

	if (ct_source_take(s, raw, 4, e) || ct_nii_sniff(h, raw, e) ||
		ct_source_take(s, raw + 4, ct_nii_size(h) - 4, e))
		return -1;
	return ct_nii_unpack(h, raw, e);
}

static int32_t int32_at(const unsigned char *p, bool big)
{
	uint32_t u;

	memcpy(&u, p, sizeof u);
	return (int32_t)(big ? __builtin_bswap32(u) : u);
}

/* The extensions, then whatever stands before vox_offset. */
static int read_extensions(
	struct ct_source *s, const struct ct_nii *h, struct ct_meta *m, struct ct_err *e)
{
	const uint64_t start = (uint64_t)h->start;
	unsigned char head[8], *p;
	size_t total = 0, pairs = 0;
	int rc;

	if (start > s->left)
		return ct_fail(
			e, CT_EINPUT, "vox_offset %.0f is past the end of the file", h->start);
	if (ct_source_take(s, head, 4, e))
		return -1;
	for (size_t k = 0; head[0] && s->at + 8 <= start; k++) {
		int32_t size, code;

		if (ct_source_take(s, head, 8, e))
			return -1;
		size = int32_at(head, h->big);
		code = int32_at(head + 4, h->big);
		head[0] = 1;
		if (size == 0)
			break;
		if (size < 8 || (uint64_t)size - 8 > start - s->at || k >= MAX_EXTS ||
			(total += (size_t)size) > MAX_EXT)
			return ct_fail(
				e, CT_EINPUT, "extension %zu: esize %ld is wrong", k, (long)size);
		if (ct_alloc(&p, (size_t)size, 1, e))
			return -1;
		rc = ct_source_take(s, p, (size_t)size - 8, e) ||
		     ct_nii_ext_read(m, &pairs, k, code, p, (size_t)size - 8, e);
		free(p);
		if (rc)
			return -1;
	}
	return ct_source_skip(s, start, e);
}

int ct_nifti_open(struct ct_nifti_in *in, FILE *f, struct ct_vol *head, struct ct_err *e)
{
	struct ct_source *s = &in->source;
	struct ct_nii h = {0};
	char doubt[CT_NII_DOUBT];
	int code;

	if (ct_source_open(s, f, CT_PACKING_TELL, e) || read_header(s, &h, e) ||
		ct_nii_affine(&h, head->affine, &code, e) ||
		read_extensions(s, &h, &head->meta, e) || ct_nii_dims(&h, head->n, e) ||
		ct_nii_doubt(doubt, &h, head->n, e))
		return -1;
	ct_meta_drop(&head->meta, CT_META_NIFTI_CODE);
	ct_meta_drop(&head->meta, CT_META_NIFTI_DOUBT);
	if (*doubt && ct_meta_set(&head->meta, CT_META_NIFTI_DOUBT, doubt, e))
		return -1;
	in->how = (struct ct_stored){(enum ct_voxel)(int)h.type, h.big, h.slope, h.inter};
	return code == 1 ? 0 : ct_meta_setf(&head->meta, e, CT_META_NIFTI_CODE, "%d", code);
}

static int read_volume(FILE *f, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_nifti_in in = {0};
	const int rc = ct_nifti_open(&in, f, &a->vol, e) ||
				       ct_source_volume(&in.source, &in.how, name, &a->vol, e)
			       ? -1
			       : 0;

	ct_source_close(&in.source);
	return rc;
}

int ct_nifti_is_i16(const struct ct_vol *v, enum ct_nifti_type type, bool *i16, struct ct_err *e)
{
	const size_t total = ct_vol_count(v);
	int16_t block[LENGTH];

	*i16 = type != CT_NIFTI_F32;
	for (size_t at = 0, n; at < total && *i16; at += n) {
		n = total - at < LENGTH ? total - at : LENGTH;
		*i16 = ct_voxels_i16(n, block, v->data + at, type == CT_NIFTI_AUTO);
	}
	return type == CT_NIFTI_I16 && !*i16 ? ct_fail(e, CT_ENUMERIC, "a voxel does not fit int16")
					     : 0;
}

static void fill_header(struct ct_nii *h, const struct ct_vol *v, bool i16)
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
	h->slope = 1;
	h->sform = code >= 1 && code <= 5 ? (double)code : 1;
	h->qform = h->sheared ? 0 : h->sform;
}

static int make_head(struct ct_nii_head *head, const struct ct_vol *v, bool i16, bool shear,
	const struct ct_env *env, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	const bool error = quantity && strcmp(quantity, CT_QUANTITY_ERROR) == 0;
	struct ct_nii h = {.version = 1};
	char descrip[80];
	size_t size;

	if (ct_nii_set_affine(&h, v, shear, e))
		return -1;
	fill_header(&h, v, i16);
	size = ct_nii_size(&h);
	head->n = size + 4;
	if (ct_grow(&head->p, &head->cap, head->n, 1, e))
		return -1;
	memset(head->p, 0, head->n);
	if (ct_nii_ext_write(head, &v->meta, e))
		return -1;
	h.start = (double)head->n;
	head->p[size] = head->n > size + 4;
	snprintf(descrip, sizeof descrip, "%s%.40s %s", error ? CT_QUANTITY_ERROR ", HU; " : "",
		env && env->tool ? env->tool : PACKAGE_NAME, PACKAGE_VERSION);
	ct_nii_pack(&h, descrip, head->p);
	return 0;
}

struct ct_nifti_planes {
	struct ct_sink s;
	const char *path; /* the caller's */
	enum ct_nifti_type type;
	bool shear;
	struct ct_nii_head head; /* what was written of it */
};

int ct_nifti_create(struct ct_nifti_planes **out, const char *path, const struct ct_vol *v,
	enum ct_nifti_type type, bool shear, const struct ct_env *env, struct ct_err *e)
{
	struct ct_nifti_planes *w;
	int rc = -1;

	if (ct_alloc(out, 1, sizeof *w, e))
		return -1;
	w = *out;
	*w = (struct ct_nifti_planes){.path = path, .type = type, .shear = shear};
	if (make_head(&w->head, v, type != CT_NIFTI_F32, shear, env, e))
		ct_blame(e, path);
	else if (ct_sink_open(&w->s, path, env, e) == 0)
		rc = (ct_ends_match(path, "gz") && ct_sink_pack(&w->s, true, e)) ||
				     ct_sink_give(&w->s, w->head.p, w->head.n, e)
			     ? ct_sink_close(&w->s, -1, e)
			     : 0;
	if (rc) {
		free(w->head.p);
		free(w);
		*out = NULL;
	}
	return rc;
}

int ct_nifti_put(struct ct_nifti_planes *w, size_t n, const float *x, struct ct_err *e)
{
	bool fits;

	if (ct_sink_some(&w->s, n, x, w->type != CT_NIFTI_F32, w->type == CT_NIFTI_AUTO, &fits, e))
		return -1;
	if (fits)
		return 0;
	ct_fail(e, CT_ENUMERIC, "a voxel does not fit int16");
	return ct_blame(e, w->path);
}

/* In the place of the one that was written. */
static int put_head_again(struct ct_nifti_planes *w, const struct ct_nii_head *h, struct ct_err *e)
{
	if (w->s.packed)
		return ct_fail(e, CT_EOUTPUT,
			"%s: is compressed: its header cannot change any more", w->path);
	return ct_sink_rewind(&w->s, e) || ct_sink_give(&w->s, h->p, h->n, e) ? -1 : 0;
}

int ct_nifti_close(struct ct_nifti_planes *w, const struct ct_vol *v, int rc,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_nii_head h = {0};

	if (rc == 0 && make_head(&h, v, w->type != CT_NIFTI_F32, w->shear, env, e))
		rc = ct_blame(e, w->path);
	assert(rc || h.n == w->head.n);
	if (rc == 0)
		rc = ct_sink_end(&w->s, e);
	if (rc == 0 && memcmp(h.p, w->head.p, h.n) != 0)
		rc = put_head_again(w, &h, e);
	free(h.p);
	rc = ct_sink_close(&w->s, rc, e);
	free(w->head.p);
	free(w);
	return rc;
}

int ct_nifti_write(const char *path, const struct ct_vol *v, enum ct_nifti_type type, bool shear,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_nifti_planes *w;
	bool i16;

	if (ct_nifti_is_i16(v, type, &i16, e))
		return ct_blame(e, path);
	type = i16 ? CT_NIFTI_I16 : CT_NIFTI_F32;
	return ct_nifti_create(&w, path, v, type, shear, env, e) ||
			       ct_nifti_close(w, v, ct_sink_voxels(&w->s, v, i16, env, e), env, e)
		       ? -1
		       : 0;
}

int ct_vol_write(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return ct_nifti_write(path, v, CT_NIFTI_AUTO, false, env, e);
}

/* sizeof_hdr of either version and byte order, or gzip. */
static int sniff(const unsigned char *p, size_t n)
{
	struct ct_nii h;
	struct ct_err why;

	if (n >= 2 && memcmp(p, "\x1f\x8b", 2) == 0)
		return CT_SNIFF_MAGIC;
	return n >= 4 && ct_nii_sniff(&h, p, &why) == 0 ? CT_SNIFF_NUMBER : CT_SNIFF_NO;
}

const struct ct_format ct_format_nifti = {.name = "NIfTI",
	.kind = CT_KIND_VOLUME,
	.sniff = sniff,
	.read = read_volume,
	.write = ct_vol_write,
	.ends = CT_ENDS_VOLUME};
