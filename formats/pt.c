/* pt.c: named tensors in a checkpoint of PyTorch (torch.save since 1.6):
 *
 *   a zip archive of stored members under one folder:
 *   data.pkl    a pickle of the dictionary; where a tensor should be, the name of its storage
 *   data/NAME   the numbers of a storage
 *   byteorder   "little"; not in old ones
 *
 * The pickle is read as pickle.h says, never executed. A tensor that is a part of its storage, or
 * goes through it in another order, is gathered.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/pickle.h"
#include "formats/zip.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PICKLE = 1 << 24, MOST_TENSORS = 1 << 16, DEPTH = 4, BLOCK = 8192 };

/* Numbers that lie elsewhere: storages are named, and tensors are parts of them. */
struct tensor {
	char *name;    /* its key in the dictionary; owned */
	char *storage; /* owned */
	enum ct_voxel type;
	uint64_t length; /* of the storage, numbers */
	uint64_t offset; /* of the first number */
	size_t rank;
	uint64_t dim[CT_MAX_RANK], stride[CT_MAX_RANK]; /* in numbers */
};

struct reader {
	struct ct_zip zip;
	struct tensor *tensor; /* in the order of the dictionary; names are unique */
	size_t n;
	char *folder; /* of the members, with its slash */
	float *storage;
	struct ct_err *e;
};

static int bad(const struct reader *d, const struct tensor *t, const char *why)
{
	return ct_fail(d->e, CT_EINPUT, "tensor '%.80s': %s", t->name, why);
}

/* The member of this name in the folder; NULL if there is none. */
static const struct ct_zip_member *member(const struct reader *d, const char *sub, const char *name)
{
	const struct ct_zip_member *m;
	char *full;

	if (asprintf(&full, "%s%s%s", d->folder, sub, name) < 0)
		return NULL;
	m = ct_zip_find(&d->zip, full);
	free(full);
	return m;
}

/* The folder of the first member is that of all. */
static int find_folder(struct reader *d)
{
	const char *name = d->zip.n ? d->zip.member->name : "", *slash = strchr(name, '/');

	d->folder = strndup(name, slash ? (size_t)(slash - name) + 1 : 0);
	return d->folder ? 0 : ct_fail(d->e, CT_ENOMEM, "no memory for a file name");
}

static int check_order(struct reader *d)
{
	const struct ct_zip_member *m = member(d, "", "byteorder");
	char word[7] = "";

	if (!m)
		return 0;
	if (m->size >= sizeof word || ct_zip_read(&d->zip, m, word, d->e) ||
		strcmp(word, "little") != 0)
		return ct_fail(d->e, CT_EINPUT, "byteorder is not little");
	return 0;
}

/* Where checkpoints keep the weights of a network. */
static const char *const places[] = {"state_dict", "model", "model_state_dict", "ema"};
enum { PLACES = sizeof places / sizeof *places };

static const struct ct_pickle_value *tensor_of(
	const struct ct_pickle *v, const struct ct_pickle_pair *pair)
{
	const struct ct_pickle_value *x = &v->value[pair->value];

	return x->kind == CT_PICKLE_TENSOR ? x : NULL;
}

static size_t count_tensors(const struct ct_pickle *v, const struct ct_pickle_value *dict)
{
	size_t n = 0;

	for (size_t i = dict->first; i; i = v->pair[i].next)
		n += tensor_of(v, &v->pair[i]) != NULL;
	return n;
}

/* The value of a key, of several the last, as in Python; NULL if there is none. */
static const struct ct_pickle_value *get(
	const struct ct_pickle *v, const struct ct_pickle_value *dict, const char *word)
{
	const struct ct_pickle_value *found = NULL;

	for (size_t i = dict->first; i; i = v->pair[i].next)
		if (ct_pickle_is_text(&v->value[v->pair[i].key], word))
			found = &v->value[v->pair[i].value];
	return found;
}

/* The dictionary of tensors that d is or that is in it, NULL if there is none; those that are found
 * are counted. */
static const struct ct_pickle_value *find(
	const struct ct_pickle *v, const struct ct_pickle_value *d, int depth, size_t *n)
{
	const struct ct_pickle_value *found = NULL, *x;

	if (!d || d->kind != CT_PICKLE_DICT || depth == 0)
		return NULL;
	if (count_tensors(v, d)) {
		++*n;
		return d;
	}
	for (int k = 0; k < PLACES; k++) {
		x = find(v, get(v, d, places[k]), depth - 1, n);
		found = x ? x : found;
	}
	return found;
}

static int copy_text(
	char **out, const struct ct_pickle_value *x, const char *what, struct ct_err *e)
{
	if (!x->text || x->length == 0 || memchr(x->text, 0, x->length))
		return ct_fail(e, CT_EINPUT, "a tensor whose %s is no word", what);
	*out = strndup(x->text, x->length);
	return *out ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a tensor name");
}

static int copy_tensor(struct tensor *t, const struct ct_pickle *v,
	const struct ct_pickle_pair *pair, struct ct_err *e)
{
	const size_t *part = v->part + v->value[pair->value].first;
	const struct ct_pickle_value *storage = &v->value[part[0]], *size = &v->value[part[2]],
				     *stride = &v->value[part[3]];

	t->type = storage->type;
	t->length = (uint64_t)storage->number;
	t->offset = (uint64_t)v->value[part[1]].number;
	t->rank = size->n;
	for (size_t i = 0; i < t->rank; i++) {
		t->dim[i] = (uint64_t)v->value[v->part[size->first + i]].number;
		t->stride[i] = (uint64_t)v->value[v->part[stride->first + i]].number;
	}
	return ct_err_any(copy_text(&t->name, &v->value[pair->key], "name", e) ||
			  copy_text(&t->storage, storage, "storage", e));
}

static int by_name(const void *a, const void *b)
{
	const char *const *p = a, *const *q = b;

	return strcmp(*p, *q);
}

static int check_names(const struct reader *d)
{
	const char **name;
	int rc = 0;

	if (ct_alloc(&name, d->n, sizeof *name, d->e))
		return -1;
	for (size_t i = 0; i < d->n; i++)
		name[i] = d->tensor[i].name;
	qsort(name, d->n, sizeof *name, by_name);
	for (size_t i = 1; i < d->n && !rc; i++)
		if (strcmp(name[i - 1], name[i]) == 0)
			rc = ct_fail(d->e, CT_EINPUT, "tensor '%.80s' is there twice", name[i]);
	free(name);
	return rc;
}

/* The tensors of the one dictionary of them: the outermost, or that under one of the places in it,
 * as deep as that goes. */
static int list_tensors(struct reader *d, const struct ct_pickle *v)
{
	size_t found = 0, n;
	const struct ct_pickle_value *dict = find(v, &v->value[v->root], DEPTH, &found);

	if (!dict)
		return ct_fail(d->e, CT_EINPUT,
			"no dictionary of tensors, nor one under state_dict, model or ema");
	if (found > 1)
		return ct_fail(d->e, CT_EINPUT,
			"more than one dictionary of tensors under state_dict, model and ema: "
			"save one");
	n = count_tensors(v, dict);
	if (n > MOST_TENSORS)
		return ct_fail(d->e, CT_EINPUT, "%zu tensors", n);
	if (ct_alloc0(&d->tensor, n, sizeof *d->tensor, d->e))
		return -1;
	for (size_t i = dict->first; i; i = v->pair[i].next)
		if (tensor_of(v, &v->pair[i]) &&
			copy_tensor(&d->tensor[d->n++], v, &v->pair[i], d->e))
			return -1;
	return check_names(d);
}

static int read_pickle(struct reader *d)
{
	const struct ct_zip_member *m = member(d, "", "data.pkl");
	struct ct_pickle pickle = {0};
	unsigned char *data = NULL;
	int rc;

	if (!m)
		return ct_fail(d->e, CT_EINPUT,
			"a zip without %sdata.pkl: no checkpoint of PyTorch", d->folder);
	if (m->size > MOST_PICKLE)
		return ct_fail(d->e, CT_EINPUT, "%.100s has %llu bytes, more than %d", m->name,
			(unsigned long long)m->size, MOST_PICKLE);
	if (ct_alloc(&data, (size_t)m->size, 1, d->e))
		return -1;
	rc = ct_zip_read(&d->zip, m, data, d->e);
	if (rc == 0 &&
		(ct_pickle_read(&pickle, data, (size_t)m->size, d->e) || list_tensors(d, &pickle)))
		rc = ct_blame(d->e, m->name);
	ct_pickle_free(&pickle);
	free(data);
	return rc;
}

/* How many numbers a tensor has: all in its storage, and no more than that has. */
static int check_tensor(const struct reader *d, const struct tensor *t, uint64_t *count)
{
	uint64_t last = t->offset, step;

	*count = 1;
	for (size_t i = 0; i < t->rank; i++)
		if (__builtin_mul_overflow(*count, t->dim[i], count))
			return bad(d, t, "size overflows");
	for (size_t i = 0; i < t->rank && *count; i++)
		if (__builtin_mul_overflow(t->dim[i] - 1, t->stride[i], &step) ||
			__builtin_add_overflow(last, step, &last))
			return bad(d, t, "stride overflows");
	if (*count > t->length)
		return bad(d, t, "size is more than its storage holds");
	if (*count ? last >= t->length : last > t->length)
		return bad(d, t, "offset, size and stride lead out of its storage");
	return 0;
}

/* All tensors in the order of the dictionary, without their numbers. Several may share a storage,
 * but they are no more than the file could hold. */
static int add_tensors(struct reader *d, struct ct_tensors *w)
{
	uint64_t total = 0, count;

	for (size_t i = 0; i < d->n; i++) {
		const struct tensor *t = &d->tensor[i];
		struct ct_tensor *out;
		size_t dim[CT_MAX_RANK];

		if (check_tensor(d, t, &count))
			return -1;
		total += count;
		if (total > d->zip.size)
			return bad(d, t,
				"with it the tensors hold more numbers than the file has bytes");
		for (size_t k = 0; k < t->rank; k++)
			dim[k] = (size_t)t->dim[k];
		if (ct_tensors_add(w, t->name, t->rank, dim, &out, d->e))
			return -1;
	}
	return 0;
}

/* The numbers of the storage of t. */
static int read_storage(struct reader *d, const struct tensor *t)
{
	const struct ct_zip_member *m = member(d, "data/", t->storage);
	const size_t bytes = ct_voxel_bytes(t->type);
	_Alignas(8) unsigned char block[BLOCK * 8];
	uint64_t size;

	free(d->storage);
	d->storage = NULL;
	if (!m)
		return ct_fail(d->e, CT_EINPUT, "tensor '%.80s': there is no %sdata/%.80s", t->name,
			d->folder, t->storage);
	if (__builtin_mul_overflow(t->length, bytes, &size) || size != m->size)
		return ct_fail(d->e, CT_EINPUT,
			"tensor '%.80s': %.100s has %llu bytes, not %llu numbers of %zu", t->name,
			m->name, (unsigned long long)m->size, (unsigned long long)t->length, bytes);
	if (ct_alloc(&d->storage, (size_t)t->length, sizeof *d->storage, d->e) ||
		ct_zip_begin(&d->zip, m, d->e))
		return -1;
	for (size_t i = 0; i < t->length; i += BLOCK) {
		size_t n = t->length - i < BLOCK ? (size_t)t->length - i : BLOCK;

		if (ct_zip_take(&d->zip, block, n * bytes, d->e))
			return -1;
		ct_voxels_float(n, d->storage + i, t->type, block, 1, 0);
	}
	return ct_zip_end(&d->zip, d->e);
}

static bool is_contiguous(const struct tensor *t)
{
	uint64_t step = 1;

	for (size_t i = t->rank; i-- > 0; step *= t->dim[i])
		if (t->dim[i] != 1 && t->stride[i] != step)
			return false;
	return true;
}

/* The numbers of the axes from `axis` on; the end of what was written. */
static float *gather(float *out, const float *from, const struct tensor *t, size_t axis)
{
	if (axis == t->rank) {
		*out = *from;
		return out + 1;
	}
	for (uint64_t i = 0; i < t->dim[axis]; i++)
		out = gather(out, from + i * t->stride[axis], t, axis + 1);
	return out;
}

static int by_storage(const void *a, const void *b)
{
	const struct tensor *const *p = a, *const *q = b;
	const int order = strcmp((*p)->storage, (*q)->storage);

	return order ? order : (*p > *q) - (*p < *q);
}

/* Storage by storage, each read once. */
static int fill(struct reader *d, struct ct_tensors *w)
{
	const struct tensor *const tensor = d->tensor, **t;
	int rc = -1;

	if (ct_alloc(&t, d->n, sizeof *t, d->e))
		return -1;
	for (size_t i = 0; i < d->n; i++)
		t[i] = &tensor[i];
	qsort(t, d->n, sizeof *t, by_storage);
	for (size_t i = 0; i < d->n; i++) {
		struct ct_tensor *out = &w->t[t[i] - tensor];

		if (i == 0 || strcmp(t[i]->storage, t[i - 1]->storage) != 0) {
			if (read_storage(d, t[i]))
				goto out;
		} else if (t[i]->type != t[i - 1]->type || t[i]->length != t[i - 1]->length) {
			bad(d, t[i], "its storage has another type or length elsewhere");
			goto out;
		}
		if (is_contiguous(t[i]))
			memcpy(out->data, d->storage + t[i]->offset,
				ct_tensor_count(out) * sizeof *out->data);
		else if (ct_tensor_count(out))
			gather(out->data, d->storage + t[i]->offset, t[i], 0);
	}
	rc = 0;
out:
	free(t);
	return rc;
}

static int read_tensors(FILE *f, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_tensors *w = &a->tensors;
	struct reader d = {.e = e};
	unsigned char head[CT_SNIFF];
	const struct ct_signature *is =
		ct_signature_next(NULL, head, fread(head, 1, sizeof head, f));
	int rc;

	if (is && strcmp(is->format, "PyTorch") == 0 && head[0] != 'P')
		return ct_fail(e, CT_EINPUT,
			"a checkpoint of PyTorch before 1.6, no zip: load it there and save it anew");
	rc = ct_err_any(ct_zip_open(&d.zip, f, e) || find_folder(&d) || check_order(&d) ||
			read_pickle(&d) || add_tensors(&d, w) || fill(&d, w) ||
			ct_tensors_sign(w, name, e));
	ct_zip_free(&d.zip);
	for (size_t i = 0; i < d.n; i++) {
		free(d.tensor[i].name);
		free(d.tensor[i].storage);
	}
	free(d.tensor);
	free(d.folder);
	free(d.storage);
	return rc;
}

const struct ct_format ct_format_pytorch = {
	.name = "PyTorch", .kind = CT_KIND_TENSORS, .read = read_tensors};

int ct_tensors_read(const char *path, struct ct_tensors *w, struct ct_err *e)
{
	static const struct ct_format *const list[] = {
		&ct_format_safetensors, &ct_format_pytorch, NULL};
	struct ct_any a = {.tensors.together = w->together};
	int rc = ct_format_read(list, path, &a, e);

	*w = a.tensors;
	return rc;
}
