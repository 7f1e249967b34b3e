/* pickle-objects.c: the functions and objects that a pickle may name; see pickle.h. */
#include "config.h"
#include "formats/pickle.h"

#include <string.h>

/* The functions, and the types of storages. */
enum { ORDERED_DICT, TENSOR, PARAMETER, STORAGES };
static const struct {
	const char *module, *name;
	enum ct_voxel type;
} globals[] = {
	[ORDERED_DICT] = {"collections", "OrderedDict", 0},
	[TENSOR] = {"torch._utils", "_rebuild_tensor_v2", 0},
	[PARAMETER] = {"torch._utils", "_rebuild_parameter", 0},
	[STORAGES] = {"torch", "FloatStorage", CT_V_F32},
	{"torch", "HalfStorage", CT_V_F16},
	{"torch", "BFloat16Storage", CT_V_BF16},
	{"torch", "DoubleStorage", CT_V_F64},
	{"torch", "LongStorage", CT_V_I64},
	{"torch", "IntStorage", CT_V_I32},
	{"torch", "ShortStorage", CT_V_I16},
	{"torch", "CharStorage", CT_V_I8},
	{"torch", "ByteStorage", CT_V_U8},
	{"torch", "BoolStorage", CT_V_BOOL},
};
enum { GLOBALS = sizeof globals / sizeof *globals };

static bool is_word(const char *s, size_t n, const char *word)
{
	return n == strlen(word) && memcmp(s, word, n) == 0;
}

bool ct_pickle_value_global(
	struct ct_pickle_value *out, const char *module, size_t nm, const char *name, size_t nn)
{
	for (int i = 0; i < GLOBALS; i++)
		if (is_word(module, nm, globals[i].module) && is_word(name, nn, globals[i].name)) {
			*out = (struct ct_pickle_value){
				.kind = CT_PICKLE_GLOBAL, .number = i, .type = globals[i].type};
			return true;
		}
	return false;
}

/* Part i of a tuple if it is of this kind, or NULL. */
static const struct ct_pickle_value *part(const struct ct_pickle_values *v,
	const struct ct_pickle_value *t, size_t i, enum ct_pickle_kind kind)
{
	const struct ct_pickle_value *x;

	if (t->kind != CT_PICKLE_TUPLE || i >= t->n)
		return NULL;
	x = &v->value[v->part[t->first + i]];
	return x->kind == kind ? x : NULL;
}

const char *ct_pickle_value_storage(struct ct_pickle_value *out, const struct ct_pickle_values *v,
	const struct ct_pickle_value *t)
{
	const struct ct_pickle_value *word = part(v, t, 0, CT_PICKLE_TEXT),
				     *type = part(v, t, 1, CT_PICKLE_GLOBAL),
				     *name = part(v, t, 2, CT_PICKLE_TEXT),
				     *n = part(v, t, 4, CT_PICKLE_INTEGER);

	if (t->n != 5 || !word || !is_word(word->text, word->length, "storage") || !type ||
		type->number < STORAGES || !name || !part(v, t, 3, CT_PICKLE_TEXT) || !n ||
		n->number < 0)
		return "not a storage with type, name, device and length";
	*out = (struct ct_pickle_value){.kind = CT_PICKLE_STORAGE,
		.type = type->type,
		.text = name->text,
		.length = name->length,
		.number = n->number};
	return NULL;
}

/* A tuple of sizes. */
static bool are_sizes(const struct ct_pickle_values *v, const struct ct_pickle_value *t)
{
	for (size_t i = 0; i < t->n; i++) {
		const struct ct_pickle_value *x = part(v, t, i, CT_PICKLE_INTEGER);

		if (!x || x->number < 0)
			return false;
	}
	return true;
}

/* (storage, offset, size, stride, whether it has a gradient, hooks). */
static const char *tensor(struct ct_pickle_value *out, const struct ct_pickle_values *v,
	const struct ct_pickle_value *t)
{
	const struct ct_pickle_value *at = part(v, t, 1, CT_PICKLE_INTEGER),
				     *size = part(v, t, 2, CT_PICKLE_TUPLE),
				     *stride = part(v, t, 3, CT_PICKLE_TUPLE);

	if (t->n < 6 || !part(v, t, 0, CT_PICKLE_STORAGE) || !at || at->number < 0 || !size ||
		!stride || !are_sizes(v, size) || !are_sizes(v, stride))
		return "not a tensor with storage, offset, size and stride";
	if (size->n != stride->n || size->n > CT_MAX_RANK)
		return "a tensor of too many sizes, or of other strides";
	*out = *t;
	out->kind = CT_PICKLE_TENSOR;
	return NULL;
}

const char *ct_pickle_value_call(struct ct_pickle_value *out, const struct ct_pickle_values *v,
	const struct ct_pickle_value *f, const struct ct_pickle_value *t)
{
	const struct ct_pickle_value *x;

	if (f->kind != CT_PICKLE_GLOBAL || f->number >= STORAGES || t->kind != CT_PICKLE_TUPLE)
		return "not a function and its arguments";
	if (f->number == TENSOR)
		return tensor(out, v, t);
	if (f->number == ORDERED_DICT) {
		*out = (struct ct_pickle_value){.kind = CT_PICKLE_DICT};
		return t->n ? "an ordered dictionary of something" : NULL;
	}
	x = part(v, t, 0, CT_PICKLE_TENSOR);
	if (!x)
		return "a parameter that is no tensor";
	*out = *x;
	return NULL;
}
