/* safetensors.c: named tensors in the safetensors container (Hugging Face, format 0.4):
 *
 *   u64 length of the header, little-endian
 *   header: JSON {"__metadata__": {"key": "value"}, "name": {"dtype", "shape", "data_offsets"}}
 *   data: every tensor in C order, at its offsets from the end of the header
 *
 * The file is a stream: tensors are read in the order of their offsets, which leave nothing
 * between.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/voxels.h"
#include "formats/text.h"
#include "core/mem.h"

#include <errno.h>
#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MOST_HEADER = 100000000, MOST_TENSORS = 1 << 16, MOST_META = 4096, BLOCK = 8192 };

static const struct ct_voxel_name types[] = {{"F64", CT_V_F64}, {"F32", CT_V_F32},
	{"F16", CT_V_F16}, {"BF16", CT_V_BF16}, {"I64", CT_V_I64}, {"I32", CT_V_I32},
	{"I16", CT_V_I16}, {"I8", CT_V_I8}, {"U64", CT_V_U64}, {"U32", CT_V_U32}, {"U16", CT_V_U16},
	{"U8", CT_V_U8}, {"BOOL", CT_V_BOOL}, {NULL, 0}};

/* One entry of the header. */
struct entry {
	const char *name; /* borrowed from the JSON */
	enum ct_voxel type;
	size_t rank, dim[CT_MAX_RANK], count;
	uint64_t begin, end; /* bytes, from the end of the header */
	size_t order;
};

struct reader {
	FILE *f;
	uint64_t size; /* of the data, UINT64_MAX if it is not known: a pipe */
	json_t *header;
	struct entry *entry;
	size_t n;
	struct ct_err *e;
};

static int blame(struct ct_err *e, const struct entry *t)
{
	char what[100];

	snprintf(what, sizeof what, "tensor '%.80s'", t->name);
	return ct_blame(e, what);
}

static int read_header(struct reader *d)
{
	json_error_t why;
	unsigned char head[8];
	struct stat st;
	uint64_t n;
	char *text;
	int rc = 0;

	if (fread(head, 1, sizeof head, d->f) != sizeof head)
		return ct_fail(
			d->e, CT_EINPUT, "not a safetensors file: it ends in its first 8 bytes");
	memcpy(&n, head, sizeof n);
	if (n < 2 || n > MOST_HEADER)
		return ct_fail(d->e, CT_EINPUT, "not a safetensors file: a header of %llu bytes",
			(unsigned long long)n);
	d->size = UINT64_MAX;
	if (fstat(fileno(d->f), &st) == 0 && S_ISREG(st.st_mode) && d->f != stdin) {
		if ((uint64_t)st.st_size < 8 + n)
			return ct_fail(d->e, CT_EINPUT, "ends inside its header");
		d->size = (uint64_t)st.st_size - 8 - n;
	}
	if (ct_alloc(&text, n, 1, d->e))
		return -1;
	if (fread(text, 1, n, d->f) != n)
		rc = ct_fail(d->e, CT_EINPUT, "ends inside its header");
	else
		d->header = json_loadb(text, n, JSON_REJECT_DUPLICATES, &why);
	free(text);
	if (rc == 0 && !json_is_object(d->header))
		rc = ct_fail(d->e, CT_EINPUT, "the header is not a JSON object: %.100s",
			d->header ? "another type" : why.text);
	return rc;
}

static int read_meta(struct reader *d, json_t *all, struct ct_meta *m)
{
	const char *key;
	json_t *value;

	if (!json_is_object(all))
		return ct_fail(d->e, CT_EINPUT, "__metadata__ is not a JSON object");
	if (json_object_size(all) > MOST_META)
		return ct_fail(d->e, CT_EINPUT, "__metadata__ has %zu keys", json_object_size(all));
	json_object_foreach (all, key, value) {
		if (!json_is_string(value))
			return ct_fail(d->e, CT_EINPUT, "__metadata__ %.80s is not a string", key);
		if (*key && ct_meta_set(m, key, json_string_value(value), d->e))
			return -1;
	}
	return 0;
}

static int get_size(const json_t *v, uint64_t *out)
{
	if (!json_is_integer(v) || json_integer_value(v) < 0)
		return -1;
	*out = (uint64_t)json_integer_value(v);
	return 0;
}

static int read_entry(const json_t *v, uint64_t size, struct entry *t, struct ct_err *e)
{
	const json_t *shape = json_object_get(v, "shape"), *at = json_object_get(v, "data_offsets");
	const char *type = json_string_value(json_object_get(v, "dtype"));
	size_t bytes;

	if (!type || !ct_voxel_named(&t->type, types, type, strlen(type)))
		return ct_fail(e, CT_EINPUT, "dtype %.20s is not known", type ? type : "(none)");
	if (!json_is_array(shape) || json_array_size(shape) > CT_MAX_RANK)
		return ct_fail(
			e, CT_EINPUT, "shape is not a list of at most %d sizes", CT_MAX_RANK);
	t->rank = json_array_size(shape);
	t->count = 1;
	for (size_t i = 0; i < t->rank; i++) {
		uint64_t n;

		if (get_size(json_array_get(shape, i), &n))
			return ct_fail(e, CT_EINPUT, "shape holds something that is not a size");
		t->dim[i] = (size_t)n;
		if (__builtin_mul_overflow(t->count, t->dim[i], &t->count))
			return ct_fail(e, CT_EINPUT, "shape overflows");
	}
	if (__builtin_mul_overflow(t->count, ct_voxel_bytes(t->type), &bytes))
		return ct_fail(e, CT_EINPUT, "shape overflows");
	if (json_array_size(at) != 2 || get_size(json_array_get(at, 0), &t->begin) ||
		get_size(json_array_get(at, 1), &t->end) || t->begin > t->end)
		return ct_fail(e, CT_EINPUT, "data_offsets are not two growing sizes");
	if (t->end - t->begin != bytes)
		return ct_fail(e, CT_EINPUT,
			"shape and dtype need %zu bytes, data_offsets hold %llu", bytes,
			(unsigned long long)(t->end - t->begin));
	if (t->end > size)
		return ct_fail(e, CT_EINPUT, "ends at byte %llu of %llu",
			(unsigned long long)t->end, (unsigned long long)size);
	return 0;
}

static int by_offset(const void *a, const void *b)
{
	const struct entry *p = a, *q = b;

	if (p->begin != q->begin)
		return p->begin < q->begin ? -1 : 1;
	if (p->end != q->end) /* empty ones first: they lie before what begins there */
		return p->end < q->end ? -1 : 1;
	return (p->order > q->order) - (p->order < q->order);
}

static int read_entries(struct reader *d, struct ct_meta *m)
{
	const char *name;
	json_t *v;

	if (json_object_size(d->header) > MOST_TENSORS)
		return ct_fail(d->e, CT_EINPUT, "%zu tensors", json_object_size(d->header));
	if (ct_alloc0(&d->entry, json_object_size(d->header), sizeof *d->entry, d->e))
		return -1;
	json_object_foreach (d->header, name, v) {
		if (strcmp(name, "__metadata__") == 0) {
			if (read_meta(d, v, m))
				return -1;
			continue;
		}
		d->entry[d->n] = (struct entry){.name = name, .order = d->n};
		if (read_entry(v, d->size, &d->entry[d->n], d->e))
			return blame(d->e, &d->entry[d->n]);
		d->n++;
	}
	qsort(d->entry, d->n, sizeof *d->entry, by_offset);
	for (size_t i = 0; i < d->n; i++)
		if (d->entry[i].begin != (i ? d->entry[i - 1].end : 0)) {
			ct_fail(d->e, CT_EINPUT, "does not begin where the one before it ends");
			return blame(d->e, &d->entry[i]);
		}
	return 0;
}

static int read_data(struct reader *d, struct ct_tensors *w)
{
	_Alignas(8) unsigned char block[BLOCK * 8];
	size_t all = 0;

	for (size_t k = 0; k < d->n; k++)
		all += (d->entry[k].count + CT_TENSOR_STEP - 1) / CT_TENSOR_STEP * CT_TENSOR_STEP;
	if (w->together && d->size != UINT64_MAX && ct_tensors_room(w, all, d->e))
		return -1;
	for (size_t k = 0; k < d->n; k++) {
		const struct entry *t = &d->entry[k];
		const size_t bytes = ct_voxel_bytes(t->type);
		struct ct_tensor *out;

		if (ct_tensors_add(w, t->name, t->rank, t->dim, &out, d->e))
			return -1;
		for (size_t i = 0; i < t->count; i += BLOCK) {
			size_t n = t->count - i < BLOCK ? t->count - i : BLOCK;

			if (fread(block, bytes, n, d->f) != n) {
				ct_fail(d->e, CT_EINPUT, "the file ends inside it");
				return blame(d->e, t);
			}
			ct_voxels_float(n, out->data + i, t->type, block, 1, 0);
		}
	}
	return 0;
}

int ct_tensors_sign(struct ct_tensors *w, const char *path, struct ct_err *e)
{
	struct ct_hash h;

	ct_hash_begin(&h);
	for (size_t i = 0; i < w->n; i++) {
		const struct ct_tensor *t = &w->t[i];

		ct_hash_add(&h, t->name, strlen(t->name) + 1);
		ct_hash_add(&h, t->dim, t->rank * sizeof *t->dim);
		ct_hash_add(&h, t->data, ct_tensor_count(t) * sizeof *t->data);
	}
	return ct_hash_input(&h, &w->meta, path, e);
}

static int read_tensors(FILE *f, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_tensors *w = &a->tensors;
	struct reader d = {.f = f, .e = e};
	const int rc = ct_err_any(read_header(&d) || read_entries(&d, &w->meta) ||
				  read_data(&d, w) || ct_tensors_sign(w, name, e));

	json_decref(d.header);
	free(d.entry);
	return rc;
}

int ct_tensors_read_meta(const char *path, struct ct_meta *m, struct ct_err *e)
{
	struct reader d = {.e = e};
	json_t *all;
	int rc = -1;

	*m = (struct ct_meta){0};
	if (ct_io_open(path, &d.f, e))
		return -1;
	if (read_header(&d) == 0) {
		all = json_object_get(d.header, "__metadata__");
		rc = all ? read_meta(&d, all, m) : 0;
	}
	json_decref(d.header);
	ct_io_close(d.f);
	if (rc == 0)
		return 0;
	ct_meta_free(m);
	return ct_blame(e, path);
}

/* The header's JSON, padded with blanks to a multiple of 8 bytes. NULL: no memory. */
static char *make_header(const struct ct_tensors *w, bool half, size_t *length)
{
	json_t *all, *meta;
	size_t at = 0;
	int bad = 0;
	char *text = NULL, *padded = NULL;

	errno = 0;
	all = json_object();
	meta = json_object();
	for (size_t i = 0; i < w->meta.n; i++)
		if (strcmp(w->meta.pair[i].key, CT_META_INPUT) != 0) /* of the file that was read */
			bad |= json_object_set_new(
				meta, w->meta.pair[i].key, ct_text_json(w->meta.pair[i].value));
	if (json_object_size(meta))
		bad |= json_object_set(all, "__metadata__", meta);
	for (size_t i = 0; i < w->n; i++) {
		const struct ct_tensor *t = &w->t[i];
		const size_t end = at + ct_tensor_count(t) * (half ? 2 : 4);
		json_t *shape = json_array();

		for (size_t k = 0; k < t->rank; k++)
			bad |= json_array_append_new(shape, json_integer((json_int_t)t->dim[k]));
		bad |= json_object_set_new(all, t->name,
			json_pack("{s:s,s:o,s:[I,I]}", "dtype", half ? "F16" : "F32", "shape",
				shape, "data_offsets", (json_int_t)at, (json_int_t)end));
		at = end;
	}
	if (!bad)
		text = ct_text_of_json(all, JSON_COMPACT);
	if (text) {
		*length = (strlen(text) + 7) / 8 * 8;
		padded = malloc(*length + 1);
		if (padded)
			snprintf(padded, *length + 1, "%-*s", (int)*length, text);
	}
	free(text);
	json_decref(meta);
	json_decref(all);
	return padded;
}

static int put_data(struct ct_out *o, const struct ct_tensor *t, bool half, struct ct_err *e)
{
	const size_t count = ct_tensor_count(t);
	uint16_t block[BLOCK];

	if (!half)
		return ct_put(o, t->data, count * sizeof *t->data, e);
	for (size_t i = 0; i < count; i += BLOCK) {
		size_t n = count - i < BLOCK ? count - i : BLOCK;

		for (size_t k = 0; k < n; k++)
			block[k] = ct_voxel_half(t->data[i + k]);
		if (ct_put(o, block, n * sizeof *block, e))
			return -1;
	}
	return 0;
}

/* To an output that is open; closes it. */
static int put_all(struct ct_out *out, const char *path, const struct ct_tensors *w, bool half,
	struct ct_err *e)
{
	size_t n = 0;
	char *header = make_header(w, half, &n);
	const uint64_t length = n;
	int rc = -1;

	if (!header)
		ct_fail(e, errno == ENOMEM ? CT_ENOMEM : CT_EOUTPUT,
			"%s: no memory for the header, or a name or metadata that is not UTF-8",
			path);
	else if (n > MOST_HEADER)
		ct_fail(e, CT_EOUTPUT, "%s: a header of %zu bytes is too long", path, n);
	else {
		rc = ct_put(out, &length, sizeof length, e) || ct_put(out, header, n, e);
		for (size_t i = 0; i < w->n && rc == 0; i++)
			rc = put_data(out, &w->t[i], half, e);
		rc = rc ? -1 : ct_out_commit(out, e);
	}
	ct_out_abandon(out);
	free(header);
	return rc;
}

int ct_tensors_write(const char *path, const struct ct_tensors *w, bool half,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_out out;

	return ct_out_open(&out, path, env, e) ? -1 : put_all(&out, path, w, half, e);
}

int ct_tensors_write_private(const char *path, const struct ct_tensors *w, struct ct_err *e)
{
	struct ct_out out;

	return ct_out_open_private(&out, path, e) ? -1 : put_all(&out, path, w, false, e);
}

const struct ct_format ct_format_safetensors = {
	.name = "safetensors", .kind = CT_KIND_TENSORS, .read = read_tensors};
