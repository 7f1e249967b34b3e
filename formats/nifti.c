/* nifti.c: volumes in and out as streams. See nifti.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/mem.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/nifti-impl.h"
#include "formats/nifti.h"
#include "formats/source.h"
#include "formats/text.h"
#include "formats/voxels.h"

#include <assert.h>
#include <jansson.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
	MAX_EXT = 1 << 26, /* bytes of all extensions of a file */
	MAX_EXTS = 1024,
	COMMENT = 6, /* ecode */
	MAX_PAIRS = 4096,
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

static const char foreign[] = "nifti.ext.";

/* Our object, or NULL: all keys "ct:...", all values text. */
static json_t *ours(int ecode, const unsigned char *p, size_t bytes)
{
	json_t *o, *value;
	const char *key;
	bool all;

	while (bytes && p[bytes - 1] == 0)
		bytes--;
	if (ecode != COMMENT || !bytes || p[0] != '{')
		return NULL;
	o = json_loadb((const char *)p, bytes, 0, NULL);
	all = o && json_is_object(o) && json_object_size(o) > 0;
	if (all)
		json_object_foreach (o, key, value)
			all = all && strncmp(key, "ct:", 3) == 0 && key[3] && json_is_string(value);
	if (!all) {
		json_decref(o);
		return NULL;
	}
	return o;
}

/* Extension number k, `bytes` of content (without the 8 of its head), into the metadata. *pairs
 * counts those of all extensions of a file. */
static int read_extension(struct ct_meta *m, size_t *pairs, size_t k, int ecode,
	const unsigned char *p, size_t bytes, struct ct_err *e)
{
	json_t *o = ours(ecode, p, bytes), *value;
	const char *key;
	char name[40], *text;
	int rc = 0, head;

	if (o) {
		*pairs += json_object_size(o);
		if (*pairs > MAX_PAIRS)
			rc = ct_fail(e, CT_EINPUT, "more than %d pairs up to extension %zu",
				MAX_PAIRS, k);
		else
			json_object_foreach (o, key, value)
				if (!rc)
					rc = ct_meta_set(m, key + 3, json_string_value(value), e);
		json_decref(o);
		return rc;
	}
	if (ct_alloc(&text, 16 + CT_TEXT_BASE64(bytes), 1, e))
		return -1;
	snprintf(name, sizeof name, "%s%zu", foreign, k);
	head = snprintf(text, 14, "%d ", ecode);
	ct_text_base64(text + head, p, bytes);
	rc = ct_meta_set(m, name, text, e);
	free(text);
	return rc;
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
		     read_extension(m, &pairs, k, code, p, (size_t)size - 8, e);
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
	in->how = (struct ct_stored){(enum ct_voxel)(int)h.type, h.big, h.slope, h.inter};
	ct_meta_drop(&head->meta, CT_META_NIFTI_CODE);
	ct_meta_drop(&head->meta, CT_META_NIFTI_DOUBT);
	if (*doubt && ct_meta_set(&head->meta, CT_META_NIFTI_DOUBT, doubt, e))
		return -1;
	return code == 1 ? 0 : ct_meta_setf(&head->meta, e, CT_META_NIFTI_CODE, "%d", code);
}

/* As many bytes as a plane has, or more, stand behind the voxels: a dimension may be wrong. */
static int doubt_size(const struct ct_nifti_in *in, struct ct_vol *v, struct ct_err *e)
{
	const uint64_t more = ct_source_behind(&in->source);

	if (ct_meta_get(&v->meta, CT_META_NIFTI_DOUBT) ||
		more < v->n[0] * v->n[1] * ct_voxel_bytes((int)in->how.type))
		return 0;
	return ct_meta_setf(&v->meta, e, CT_META_NIFTI_DOUBT,
		"%llu more bytes follow %zux%zux%zu voxels", (unsigned long long)more, v->n[0],
		v->n[1], v->n[2]);
}

static int read_volume(FILE *f, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_nifti_in in = {0};
	const int rc = ct_err_any(ct_nifti_open(&in, f, &a->vol, e) ||
				  ct_source_volume(&in.source, &in.how, name, &a->vol, e) ||
				  doubt_size(&in, &a->vol, e));

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

/* What stands before the voxels; p is owned. */
struct head {
	unsigned char *p;
	size_t n, cap;
};

/* A copy of prefix + s in which every byte in error is U+FFFD; NULL without memory. */
static char *clean(const char *prefix, const char *s)
{
	char *text = malloc(strlen(prefix) + 3 * strlen(s) + 1), *out = text;

	if (!text)
		return NULL;
	out = stpcpy(out, prefix);
	while (*s) {
		size_t n = ct_text_character(s);

		if (n)
			memcpy(out, s, n);
		else
			memcpy(out, "\xef\xbf\xbd", 3);
		out += n ? n : 3;
		s += n ? n : 1;
	}
	*out = '\0';
	return text;
}

static bool is_foreign(const char *key)
{
	return strncmp(key, foreign, sizeof foreign - 1) == 0;
}

/* One extension, padded with NUL to a multiple of 16 bytes. */
static int append(struct head *to, int ecode, const void *data, size_t bytes, struct ct_err *e)
{
	const size_t size = (bytes + 8 + 15) / 16 * 16;
	const uint32_t head[2] = {(uint32_t)size, (uint32_t)ecode};
	unsigned char *at;

	if (size > INT32_MAX)
		return ct_fail(e, CT_EOUTPUT, "metadata of %zu bytes", bytes);
	if (ct_grow(&to->p, &to->cap, to->n + size, 1, e))
		return -1;
	at = to->p + to->n;
	memset(at, 0, size);
	memcpy(at, head, sizeof head);
	memcpy(at + 8, data, bytes);
	to->n += size;
	return 0;
}

static int append_foreign(struct head *to, const struct ct_pair *pair, struct ct_err *e)
{
	unsigned char *bytes;
	size_t count = SIZE_MAX;
	const char *end;
	const double ecode = ct_number_begin(pair->value, &end);
	int rc;

	if (ct_alloc(&bytes, strlen(pair->value) + 1, 1, e))
		return -1;
	if (*end == ' ' && ecode >= INT32_MIN && ecode <= INT32_MAX && ecode == floor(ecode))
		count = ct_text_of_base64(bytes, end + 1);
	if (count == SIZE_MAX)
		rc = ct_fail(e, CT_EINPUT, "metadata %s is not \"ECODE BASE64\"", pair->key);
	else
		rc = append(to, (int)ecode, bytes, count, e);
	free(bytes);
	return rc;
}

/* The pairs that are ours, as one extension, if there are any. */
static int append_ours(struct head *to, const struct ct_meta *m, struct ct_err *e)
{
	json_t *o = json_object();
	char *text = NULL;
	bool bad = !o;
	int rc = 0;

	for (size_t i = 0; i < m->n && !bad; i++) {
		const char *key = m->pair[i].key;
		char *k, *v;

		if (is_foreign(key) || strcmp(key, CT_META_INPUT) == 0 ||
			strcmp(key, CT_META_NIFTI_CODE) == 0 ||
			strcmp(key, CT_META_NIFTI_DOUBT) == 0)
			continue;
		k = clean("ct:", key);
		v = clean("", m->pair[i].value);
		bad = !k || !v || json_object_set_new(o, k, json_string(v)) != 0;
		free(k);
		free(v);
	}
	if (!bad && json_object_size(o))
		bad = !(text = ct_text_of_json(o, JSON_COMPACT));
	if (bad)
		rc = ct_fail(e, CT_ENOMEM, "no memory for metadata");
	else if (text)
		rc = append(to, COMMENT, text, strlen(text), e);
	free(text);
	json_decref(o);
	return rc;
}

/* All extensions of m, each padded to 16 bytes, behind the header. */
static int append_extensions(struct head *to, const struct ct_meta *m, struct ct_err *e)
{
	int rc = append_ours(to, m, e);

	for (size_t i = 0; i < m->n && !rc; i++)
		if (is_foreign(m->pair[i].key))
			rc = append_foreign(to, &m->pair[i], e);
	return rc;
}

static void fill_header(struct ct_nii *h, const struct ct_vol *v, bool i16)
{
	const char *kept = ct_meta_get(&v->meta, CT_META_NIFTI_CODE);
	long long code = 1;

	if (kept && !ct_number_whole(&code, kept, 0, 5))
		code = 1;

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

static int make_head(struct head *head, const struct ct_vol *v, bool i16, bool shear,
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
	if (append_extensions(head, &v->meta, e))
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
	struct head head; /* what was written of it */
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
static int put_head_again(struct ct_nifti_planes *w, const struct head *h, struct ct_err *e)
{
	if (w->s.packed)
		return ct_fail(e, CT_EOUTPUT,
			"%s: is compressed: its header cannot change any more", w->path);
	return ct_err_any(ct_sink_rewind(&w->s, e) || ct_sink_give(&w->s, h->p, h->n, e));
}

int ct_nifti_close(struct ct_nifti_planes *w, const struct ct_vol *v, int rc,
	const struct ct_env *env, struct ct_err *e)
{
	struct head h = {0};

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
	return ct_err_any(ct_nifti_create(&w, path, v, type, shear, env, e) ||
			  ct_nifti_close(w, v, ct_sink_voxels(&w->s, v, i16, env, e), env, e));
}

/* The header goes through a file in memory. int16 has one zero. */
int ct_vol_as_read(struct ct_vol *v, const char *name, struct ct_err *e)
{
	struct ct_nifti_in in = {0};
	struct ct_vol is = {0};
	struct head h = {0};
	FILE *f = NULL;
	bool i16;
	int rc =
		ct_nifti_is_i16(v, CT_NIFTI_AUTO, &i16, e) || make_head(&h, v, i16, false, NULL, e);

	if (rc == 0 && !(f = fmemopen(h.p, h.n, "rb")))
		rc = ct_fail(e, CT_ENOMEM, "no memory for a header");
	if (rc == 0 && ct_nifti_open(&in, f, &is, e) == 0) {
		for (size_t i = 0, n = ct_vol_count(v); i16 && i < n; i++)
			v->data[i] += 0.0f;
		memcpy(v->affine, is.affine, sizeof is.affine);
		ct_meta_free(&v->meta);
		v->meta = is.meta;
		is.meta = (struct ct_meta){0};
		rc = ct_source_sign(v, name, e);
	} else
		rc = -1;
	ct_source_close(&in.source);
	ct_vol_free(&is);
	if (f)
		fclose(f);
	free(h.p);
	return rc ? ct_blame(e, name) : 0;
}

static int write_volume(const char *path, const struct ct_any *a, const struct ct_format_how *how,
	const struct ct_env *env, struct ct_err *e)
{
	return ct_nifti_write(path, &a->vol, how->type, how->shear, env, e);
}

const struct ct_format ct_format_nifti = {.name = "NIfTI",
	.kind = CT_KIND_VOLUME,
	.read = read_volume,
	.write = write_volume,
	.ends = CT_ENDS_VOLUME};
