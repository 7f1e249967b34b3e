/* pickle-objects.c: what functions of a pickle make: tensors of PyTorch, arrays of numpy; see
 * pickle.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/pickle-impl.h"
#include "core/mem.h"
#include "core/tensors.h"

#include <stdlib.h>
#include <string.h>

/* The functions, and the types of storages; then those of arrays, which are no part of a dictionary
 * of tensors. */
enum { ORDERED_DICT, TENSOR, PARAMETER, STORAGE };
enum { RECONSTRUCT = 100, FROM_BUFFER, ARRAY_TYPE, NUMBER_TYPE, ENCODE };
static const struct {
	const char *module, *name;
	int is;
	enum ct_voxel type; /* of a storage */
} globals[] = {
	{"collections", "OrderedDict", ORDERED_DICT, 0},
	{"torch._utils", "_rebuild_tensor_v2", TENSOR, 0},
	{"torch._utils", "_rebuild_parameter", PARAMETER, 0},
	{"torch", "FloatStorage", STORAGE, CT_V_F32},
	{"torch", "HalfStorage", STORAGE, CT_V_F16},
	{"torch", "BFloat16Storage", STORAGE, CT_V_BF16},
	{"torch", "DoubleStorage", STORAGE, CT_V_F64},
	{"torch", "LongStorage", STORAGE, CT_V_I64},
	{"torch", "IntStorage", STORAGE, CT_V_I32},
	{"torch", "ShortStorage", STORAGE, CT_V_I16},
	{"torch", "CharStorage", STORAGE, CT_V_I8},
	{"torch", "ByteStorage", STORAGE, CT_V_U8},
	{"torch", "BoolStorage", STORAGE, CT_V_BOOL},
	{"numpy.core.multiarray", "_reconstruct", RECONSTRUCT, 0},
	{"numpy._core.multiarray", "_reconstruct", RECONSTRUCT, 0},
	{"numpy.core.numeric", "_frombuffer", FROM_BUFFER, 0},
	{"numpy._core.numeric", "_frombuffer", FROM_BUFFER, 0},
	{"numpy", "ndarray", ARRAY_TYPE, 0},
	{"numpy", "dtype", NUMBER_TYPE, 0},
	{"_codecs", "encode", ENCODE, 0},
};

int ct_pickle_run_global(struct ct_pickle_run *r, const struct ct_pickle_value *module,
	const struct ct_pickle_value *name)
{
	for (size_t i = 0; i < sizeof globals / sizeof *globals; i++)
		if ((globals[i].is >= RECONSTRUCT) == r->v->arrays &&
			ct_pickle_is_text(module, globals[i].module) &&
			ct_pickle_is_text(name, globals[i].name))
			return ct_pickle_run_push(
				r, (struct ct_pickle_value){.kind = CT_PICKLE_GLOBAL,
					   .number = globals[i].is,
					   .type = globals[i].type});
	return ct_fail(r->e, CT_EINPUT,
		"%s at byte %zu: %.*s.%.*s is nothing that a dictionary of %s needs", r->name,
		r->begin, (int)(module->length < 80 ? module->length : 80), module->text,
		(int)(name->length < 80 ? name->length : 80), name->text,
		r->v->arrays ? "arrays" : "tensors");
}

/* Part i of a tuple, or NULL. */
static const struct ct_pickle_value *any_part(
	const struct ct_pickle_run *r, const struct ct_pickle_value *t, size_t i)
{
	return t->kind == CT_PICKLE_TUPLE && i < t->n ? &r->v->value[r->v->part[t->first + i]]
						      : NULL;
}

/* The same, if it is of this kind. */
static const struct ct_pickle_value *part(const struct ct_pickle_run *r,
	const struct ct_pickle_value *t, size_t i, enum ct_pickle_kind kind)
{
	const struct ct_pickle_value *x = any_part(r, t, i);

	return x && x->kind == kind ? x : NULL;
}

int ct_pickle_run_storage(struct ct_pickle_run *r)
{
	const struct ct_pickle_value *t = ct_pickle_run_pop(r), *word, *type, *name, *n;

	if (!t)
		return -1;
	word = part(r, t, 0, CT_PICKLE_TEXT);
	type = part(r, t, 1, CT_PICKLE_GLOBAL);
	name = part(r, t, 2, CT_PICKLE_TEXT);
	n = part(r, t, 4, CT_PICKLE_INTEGER);
	if (t->n != 5 || !word || !ct_pickle_is_text(word, "storage") || !type ||
		type->number < STORAGE || !name || !part(r, t, 3, CT_PICKLE_TEXT) || !n ||
		n->number < 0)
		return ct_pickle_run_bad(r, "not a storage with type, name, device and length");
	return ct_pickle_run_push(r, (struct ct_pickle_value){.kind = CT_PICKLE_STORAGE,
					     .type = type->type,
					     .text = name->text,
					     .length = name->length,
					     .number = n->number});
}

/* A tuple of sizes. */
static bool are_sizes(const struct ct_pickle_run *r, const struct ct_pickle_value *t)
{
	for (size_t i = 0; i < t->n; i++) {
		const struct ct_pickle_value *x = part(r, t, i, CT_PICKLE_INTEGER);

		if (!x || x->number < 0)
			return false;
	}
	return true;
}

/* Of (storage, offset, size, stride, whether it has a gradient, hooks). */
static int tensor(struct ct_pickle_run *r, struct ct_pickle_value t)
{
	const struct ct_pickle_value *at = part(r, &t, 1, CT_PICKLE_INTEGER),
				     *size = part(r, &t, 2, CT_PICKLE_TUPLE),
				     *stride = part(r, &t, 3, CT_PICKLE_TUPLE);

	if (t.n < 6 || !part(r, &t, 0, CT_PICKLE_STORAGE) || !at || at->number < 0 || !size ||
		!stride || !are_sizes(r, size) || !are_sizes(r, stride))
		return ct_pickle_run_bad(r, "not a tensor with storage, offset, size and stride");
	if (size->n != stride->n || size->n > CT_MAX_RANK)
		return ct_pickle_run_bad(r, "a tensor of too many sizes, or of other strides");
	t.kind = CT_PICKLE_TENSOR;
	return ct_pickle_run_push(r, t);
}

static bool is_bytes(const struct ct_pickle_value *x)
{
	return x->kind == CT_PICKLE_BYTES || x->kind == CT_PICKLE_LATIN1;
}

/* The numbers and their order of a dtype's name. */
static int number_type(struct ct_pickle_run *r, const struct ct_pickle_value *t)
{
	static const struct {
		const char *name;
		enum ct_voxel type;
	} types[] = {{"f4", CT_V_F32}, {"f8", CT_V_F64}, {"f2", CT_V_F16}, {"i8", CT_V_I64},
		{"i4", CT_V_I32}, {"i2", CT_V_I16}, {"i1", CT_V_I8}, {"u1", CT_V_U8}};
	const struct ct_pickle_value *name = part(r, t, 0, CT_PICKLE_TEXT);

	for (size_t i = 0; name && i < sizeof types / sizeof *types; i++)
		if (ct_pickle_is_text(name, types[i].name))
			return ct_pickle_run_push(
				r, (struct ct_pickle_value){
					   .kind = CT_PICKLE_DTYPE, .type = types[i].type});
	return ct_pickle_run_bad(r, "a type of numbers that is not known");
}

/* Of bytes, the type of their numbers, a shape and their order. */
static int set_array(struct ct_pickle_run *r, struct ct_pickle_value *to,
	const struct ct_pickle_value *bytes, const struct ct_pickle_value *type,
	const struct ct_pickle_value *shape, bool fortran)
{
	if (!bytes || !is_bytes(bytes) || !type || type->kind != CT_PICKLE_DTYPE || !shape ||
		shape->kind != CT_PICKLE_TUPLE || !are_sizes(r, shape))
		return ct_pickle_run_bad(r, "not an array with shape, type and bytes");
	to->kind = CT_PICKLE_ARRAY;
	to->type = type->type;
	to->text = bytes->text;
	to->length = bytes->length;
	to->first = shape->first;
	to->n = shape->n;
	to->number = (fortran ? CT_PICKLE_FORTRAN : 0) | (type->number ? CT_PICKLE_BIG : 0) |
		     (bytes->kind == CT_PICKLE_LATIN1 ? CT_PICKLE_UTF8 : 0);
	return 0;
}

static int array_reduce(struct ct_pickle_run *r, const struct ct_pickle_value *t, int64_t function)
{
	const struct ct_pickle_value *x = any_part(r, t, 0), *order;
	struct ct_pickle_value made = {.kind = CT_PICKLE_ARRAY};

	switch (function) {
	case NUMBER_TYPE: return number_type(r, t);
	case ENCODE:
		if (t->n != 2 || !x || x->kind != CT_PICKLE_TEXT ||
			!ct_pickle_is_text(any_part(r, t, 1), "latin1"))
			return ct_pickle_run_bad(r, "not a text in latin1");
		made = *x;
		made.kind = CT_PICKLE_LATIN1;
		return ct_pickle_run_push(r, made);
	case RECONSTRUCT:
		return x && x->kind == CT_PICKLE_GLOBAL && x->number == ARRAY_TYPE
			       ? ct_pickle_run_push(r, made)
			       : ct_pickle_run_bad(r, "not an array");
	case FROM_BUFFER:
		order = part(r, t, 3, CT_PICKLE_TEXT);
		if (!order)
			return ct_pickle_run_bad(r, "not an array with an order");
		return ct_err_any(set_array(r, &made, x, any_part(r, t, 1), any_part(r, t, 2),
					  ct_pickle_is_text(order, "F")) ||
				  ct_pickle_run_push(r, made));
	default: return ct_pickle_run_bad(r, "not a function and its arguments");
	}
}

int ct_pickle_run_build(struct ct_pickle_run *r)
{
	const struct ct_pickle_value *t = ct_pickle_run_pop(r), *x, *truth;
	struct ct_pickle_value *to = t ? ct_pickle_run_peek(r) : NULL;

	if (!to)
		return -1;
	if (to->kind == CT_PICKLE_DICT) /* attributes of an ordered one: none that matters */
		return 0;
	if (to->kind == CT_PICKLE_DTYPE) {
		x = part(r, t, 1, CT_PICKLE_TEXT);
		if (!x || x->length != 1)
			return ct_pickle_run_bad(r, "not the state of a type of numbers");
		to->number = *x->text == '>';
		return 0;
	}
	if (to->kind != CT_PICKLE_ARRAY)
		return ct_pickle_run_bad(r, "not of a dictionary or an array");
	truth = any_part(r, t, 3);
	return set_array(r, to, any_part(r, t, 4), any_part(r, t, 2), any_part(r, t, 1),
		truth && truth->number);
}

int ct_pickle_run_reduce(struct ct_pickle_run *r)
{
	const struct ct_pickle_value *t = ct_pickle_run_pop(r),
				     *f = t ? ct_pickle_run_pop(r) : NULL, *x;

	if (!f)
		return -1;
	if (f->kind == CT_PICKLE_GLOBAL && f->number >= RECONSTRUCT && t->kind == CT_PICKLE_TUPLE)
		return array_reduce(r, t, f->number);
	if (f->kind != CT_PICKLE_GLOBAL || f->number >= STORAGE || t->kind != CT_PICKLE_TUPLE)
		return ct_pickle_run_bad(r, "not a function and its arguments");
	if (f->number == TENSOR)
		return tensor(r, *t);
	if (f->number == ORDERED_DICT)
		return t->n ? ct_pickle_run_bad(r, "an ordered dictionary of something")
			    : ct_pickle_run_push(
				      r, (struct ct_pickle_value){.kind = CT_PICKLE_DICT});
	x = part(r, t, 0, CT_PICKLE_TENSOR);
	return x ? ct_pickle_run_push(r, *x)
		 : ct_pickle_run_bad(r, "a parameter that is no tensor");
}

/* How many values an array has, or SIZE_MAX. */
static size_t count_of(const struct ct_pickle *p, const struct ct_pickle_value *a)
{
	size_t n = 1;

	for (size_t i = 0; i < a->n; i++) {
		const int64_t k = p->value[p->part[a->first + i]].number;

		if (k > 0 && n > SIZE_MAX / 16 / (size_t)k)
			return SIZE_MAX;
		n *= (size_t)k;
	}
	return n;
}

/* Bytes of an array, of a text whose letters they are. */
static int decode(unsigned char *to, size_t n, const struct ct_pickle_value *a)
{
	const unsigned char *s = (const unsigned char *)a->text;
	size_t at = 0, made = 0;

	while (at < a->length && made < n) {
		if (s[at] < 0x80)
			to[made++] = s[at++];
		else if ((s[at] & 0xfe) == 0xc2 && at + 1 < a->length &&
			 (s[at + 1] & 0xc0) == 0x80) {
			to[made++] = (unsigned char)((s[at] & 3) << 6 | (s[at + 1] & 63));
			at += 2;
		} else
			return -1;
	}
	return made == n && at == a->length ? 0 : -1;
}

int ct_pickle_array(float **out, const struct ct_pickle *p, const struct ct_pickle_value *a,
	size_t n, size_t columns, struct ct_err *e)
{
	const size_t size =
		a->kind == CT_PICKLE_ARRAY && a->text ? ct_voxel_bytes((int)a->type) : 0;
	const size_t count = size ? count_of(p, a) : 0;
	const bool flat = columns == 1 && a->n == 1;
	unsigned char *raw = NULL;
	float *all = NULL;
	int rc = -1;

	*out = NULL;
	if (!size)
		return ct_fail(e, CT_EINPUT, "is no array of numbers");
	if (count != n * columns || !(flat || a->n == 2) ||
		(a->n == 2 && n > 0 && (size_t)p->value[p->part[a->first]].number != n))
		return ct_fail(e, CT_EINPUT, "is not of shape %zux%zu", n, columns);
	if (a->number & CT_PICKLE_UTF8 ? a->length < count * size : a->length != count * size)
		return ct_fail(e, CT_EINPUT, "has %zu bytes, not %zu", a->length, count * size);
	if (ct_alloc(&raw, count + 1, size, e) || ct_alloc(&all, count + 1, sizeof *all, e) ||
		ct_alloc(out, count + 1, sizeof **out, e))
		goto out;
	if (!(a->number & CT_PICKLE_UTF8))
		memcpy(raw, a->text, count * size);
	else if (decode(raw, count * size, a)) {
		ct_fail(e, CT_EINPUT, "is of a text that has not %zu bytes", count * size);
		goto out;
	}
	if (a->number & CT_PICKLE_BIG)
		ct_voxels_swap(count, size, raw);
	ct_voxels_float(count, all, a->type, raw, 1, 0);
	for (size_t i = 0; i < count; i++)
		(*out)[i] =
			a->number & CT_PICKLE_FORTRAN ? all[i % columns * n + i / columns] : all[i];
	rc = 0;
out:
	if (rc) {
		free(*out);
		*out = NULL;
	}
	free(raw);
	free(all);
	return rc;
}
