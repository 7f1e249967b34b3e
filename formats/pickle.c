/* pickle.c: the stack machine; see pickle.h. Instructions are those of Python's pickle, protocols 2
 * to 5. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/pickle.h"
#include "core/mem.h"
#include "core/tensors.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_VALUES = 1 << 20 };
#define MARKED SIZE_MAX /* all above the last mark */

struct run {
	const unsigned char *data;
	size_t n, at, begin; /* begin: of the instruction */
	struct ct_pickle *v;
	size_t *stack, *mark, *memo; /* values; heights of the stack; values + 1 */
	size_t n_stack, cap_stack, n_mark, cap_mark, n_memo, cap_memo;
	const char *name; /* of the instruction */
	size_t arg;       /* its: bytes that follow, or values that it takes together */
	struct ct_err *e;
};

static int bad(const struct run *r, const char *why)
{
	return ct_fail(r->e, CT_EINPUT, "%s at byte %zu: %s", r->name, r->begin, why);
}

/* The next n bytes, or NULL. */
static const unsigned char *take(struct run *r, size_t n)
{
	const unsigned char *p = r->data + r->at;

	if (n > r->n - r->at) {
		bad(r, "the pickle ends inside it");
		return NULL;
	}
	r->at += n;
	return p;
}

/* A whole number of n bytes, at most 8. */
static int take_number(struct run *r, size_t n, bool is_signed, int64_t *x)
{
	const unsigned char *p = take(r, n);
	uint64_t u = 0;

	if (!p)
		return -1;
	for (size_t i = n; i-- > 0;)
		u = u << 8 | p[i];
	if (is_signed && n > 0 && n < 8 && p[n - 1] & 0x80)
		u |= UINT64_MAX << 8 * n;
	*x = (int64_t)u;
	return 0;
}

static int push(struct run *r, size_t value)
{
	if (ct_grow(&r->stack, &r->cap_stack, r->n_stack + 1, sizeof *r->stack, r->e))
		return -1;
	r->stack[r->n_stack++] = value;
	return 0;
}

static int push_new(struct run *r, struct ct_pickle_value value)
{
	struct ct_pickle *v = r->v;

	if (v->n_value == MOST_VALUES)
		return bad(r, "too many values");
	if (ct_grow(&v->value, &v->cap_value, v->n_value + 1, sizeof *v->value, r->e))
		return -1;
	v->value[v->n_value] = value;
	return push(r, v->n_value++);
}

/* What no mark keeps. */
static size_t height(const struct run *r)
{
	return r->n_stack - (r->n_mark ? r->mark[r->n_mark - 1] : 0);
}

/* NULL, and the failure, if there is none. */
static struct ct_pickle_value *peek(struct run *r)
{
	if (height(r) > 0)
		return &r->v->value[r->stack[r->n_stack - 1]];
	bad(r, "nothing is on the stack");
	return NULL;
}

static struct ct_pickle_value *pop(struct run *r)
{
	struct ct_pickle_value *x = peek(r);

	r->n_stack -= x != NULL;
	return x;
}

/* The values that an instruction takes together, `arg` of them or those above the last mark, which
 * is dropped: *n of them, still behind the end of the stack. */
static int pop_all(struct run *r, size_t *n)
{
	if (r->arg == MARKED && r->n_mark == 0)
		return bad(r, "there is no mark");
	*n = r->arg == MARKED ? height(r) : r->arg;
	if (*n > height(r))
		return bad(r, "too little is on the stack");
	r->n_mark -= r->arg == MARKED;
	r->n_stack -= *n;
	return 0;
}

static int skip(struct run *r)
{
	return take(r, r->arg) ? 0 : -1;
}

/* A value of no matter, behind which are `arg` bytes of it. */
static int plain(struct run *r)
{
	return take(r, r->arg) ? push_new(r, (struct ct_pickle_value){.kind = CT_PICKLE_PLAIN})
			       : -1;
}

/* Of `arg` bytes; LONG1: of as many as the first byte says. */
static int integer(struct run *r)
{
	int64_t x, n = (int64_t)r->arg;

	if (n == 0 && take_number(r, 1, false, &n))
		return -1;
	if (n > 8)
		return bad(r, "a number of more than 8 bytes");
	return take_number(r, (size_t)n, r->arg == 0 || n == 4, &x)
		       ? -1
		       : push_new(r,
				 (struct ct_pickle_value){.kind = CT_PICKLE_INTEGER, .number = x});
}

static int text(struct run *r)
{
	const unsigned char *p;
	int64_t n;

	if (take_number(r, r->arg, false, &n))
		return -1;
	p = take(r, (size_t)n);
	return p ? push_new(r, (struct ct_pickle_value){.kind = CT_PICKLE_TEXT,
				       .text = (const char *)p,
				       .length = (size_t)n})
		 : -1;
}

static int mark(struct run *r)
{
	if (ct_grow(&r->mark, &r->cap_mark, r->n_mark + 1, sizeof *r->mark, r->e))
		return -1;
	r->mark[r->n_mark++] = r->n_stack;
	return 0;
}

static int tuple(struct run *r)
{
	struct ct_pickle *v = r->v;
	const size_t first = v->n_part;
	size_t n = 0;

	if (pop_all(r, &n) || ct_grow(&v->part, &v->cap_part, first + n + 1, sizeof *v->part, r->e))
		return -1;
	if (n)
		memcpy(v->part + first, r->stack + r->n_stack, n * sizeof *v->part);
	v->n_part += n;
	return push_new(
		r, (struct ct_pickle_value){.kind = CT_PICKLE_TUPLE, .first = first, .n = n});
}

/* Of kind `arg`. */
static int empty(struct run *r)
{
	return push_new(r, (struct ct_pickle_value){.kind = (enum ct_pickle_kind)r->arg});
}

static int append(struct run *r)
{
	const struct ct_pickle_value *to;
	size_t n = 0;

	if (pop_all(r, &n) || !(to = peek(r)))
		return -1;
	return to->kind == CT_PICKLE_LIST ? 0 : bad(r, "not to a list");
}

static int put_pair(struct run *r, struct ct_pickle_value *to, size_t key, size_t x)
{
	struct ct_pickle *v = r->v;
	const size_t at = v->n_pair ? v->n_pair : 1;

	if (ct_grow(&v->pair, &v->cap_pair, at + 1, sizeof *v->pair, r->e))
		return -1;
	v->pair[at] = (struct ct_pickle_pair){key, x, 0};
	v->n_pair = at + 1;
	if (to->first)
		v->pair[to->n].next = at;
	else
		to->first = at;
	to->n = at;
	return 0;
}

/* Pairs; of BUILD one value alone, the attributes of an ordered dictionary: none that matters. */
static int set_items(struct run *r)
{
	struct ct_pickle_value *to;
	size_t n = 0;

	if (pop_all(r, &n) || !(to = peek(r)))
		return -1;
	if (to->kind != CT_PICKLE_DICT)
		return bad(r, "not of a dictionary");
	if (n % 2 && r->arg == MARKED)
		return bad(r, "a key without a value");
	for (size_t i = 0; i + 1 < n; i += 2)
		if (put_pair(r, to, r->stack[r->n_stack + i], r->stack[r->n_stack + i + 1]))
			return -1;
	return 0;
}

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

static int find_global(
	struct run *r, const struct ct_pickle_value *module, const struct ct_pickle_value *name)
{
	for (int i = 0; i < GLOBALS; i++)
		if (ct_pickle_is_text(module, globals[i].module) &&
			ct_pickle_is_text(name, globals[i].name))
			return push_new(r, (struct ct_pickle_value){.kind = CT_PICKLE_GLOBAL,
						   .number = i,
						   .type = globals[i].type});
	return ct_fail(r->e, CT_EINPUT,
		"%s at byte %zu: %.*s.%.*s is nothing that a dictionary of tensors needs", r->name,
		r->begin, (int)(module->length < 80 ? module->length : 80), module->text,
		(int)(name->length < 80 ? name->length : 80), name->text);
}

/* GLOBAL: two lines. */
static int global(struct run *r)
{
	struct ct_pickle_value line[2];

	for (int i = 0; i < 2; i++) {
		const char *at = (const char *)r->data + r->at,
			   *end = memchr(at, '\n', r->n - r->at);

		if (!end)
			return bad(r, "the pickle ends inside it");
		line[i] = (struct ct_pickle_value){
			.kind = CT_PICKLE_TEXT, .text = at, .length = (size_t)(end - at)};
		r->at += line[i].length + 1;
	}
	return find_global(r, &line[0], &line[1]);
}

static int stack_global(struct run *r)
{
	const struct ct_pickle_value *name = pop(r), *module = name ? pop(r) : NULL;

	if (!module)
		return -1;
	if (module->kind != CT_PICKLE_TEXT || name->kind != CT_PICKLE_TEXT)
		return bad(r, "not of two words");
	return find_global(r, module, name);
}

/* Part i of a tuple if it is of this kind, or NULL. */
static const struct ct_pickle_value *part(
	const struct run *r, const struct ct_pickle_value *t, size_t i, enum ct_pickle_kind kind)
{
	const struct ct_pickle_value *x;

	if (t->kind != CT_PICKLE_TUPLE || i >= t->n)
		return NULL;
	x = &r->v->value[r->v->part[t->first + i]];
	return x->kind == kind ? x : NULL;
}

static int storage(struct run *r)
{
	const struct ct_pickle_value *t = pop(r), *word, *type, *name, *n;

	if (!t)
		return -1;
	word = part(r, t, 0, CT_PICKLE_TEXT);
	type = part(r, t, 1, CT_PICKLE_GLOBAL);
	name = part(r, t, 2, CT_PICKLE_TEXT);
	n = part(r, t, 4, CT_PICKLE_INTEGER);
	if (t->n != 5 || !word || !ct_pickle_is_text(word, "storage") || !type ||
		type->number < STORAGES || !name || !part(r, t, 3, CT_PICKLE_TEXT) || !n ||
		n->number < 0)
		return bad(r, "not a storage with type, name, device and length");
	return push_new(r, (struct ct_pickle_value){.kind = CT_PICKLE_STORAGE,
				   .type = type->type,
				   .text = name->text,
				   .length = name->length,
				   .number = n->number});
}

/* A tuple of sizes. */
static bool are_sizes(const struct run *r, const struct ct_pickle_value *t)
{
	for (size_t i = 0; i < t->n; i++) {
		const struct ct_pickle_value *x = part(r, t, i, CT_PICKLE_INTEGER);

		if (!x || x->number < 0)
			return false;
	}
	return true;
}

/* Of (storage, offset, size, stride, whether it has a gradient, hooks). */
static int tensor(struct run *r, struct ct_pickle_value t)
{
	const struct ct_pickle_value *at = part(r, &t, 1, CT_PICKLE_INTEGER),
				     *size = part(r, &t, 2, CT_PICKLE_TUPLE),
				     *stride = part(r, &t, 3, CT_PICKLE_TUPLE);

	if (t.n < 6 || !part(r, &t, 0, CT_PICKLE_STORAGE) || !at || at->number < 0 || !size ||
		!stride || !are_sizes(r, size) || !are_sizes(r, stride))
		return bad(r, "not a tensor with storage, offset, size and stride");
	if (size->n != stride->n || size->n > CT_MAX_RANK)
		return bad(r, "a tensor of too many sizes, or of other strides");
	t.kind = CT_PICKLE_TENSOR;
	return push_new(r, t);
}

static int reduce(struct run *r)
{
	const struct ct_pickle_value *t = pop(r), *f = t ? pop(r) : NULL, *x;

	if (!f)
		return -1;
	if (f->kind != CT_PICKLE_GLOBAL || f->number >= STORAGES || t->kind != CT_PICKLE_TUPLE)
		return bad(r, "not a function and its arguments");
	if (f->number == TENSOR)
		return tensor(r, *t);
	if (f->number == ORDERED_DICT)
		return t->n ? bad(r, "an ordered dictionary of something")
			    : push_new(r, (struct ct_pickle_value){.kind = CT_PICKLE_DICT});
	x = part(r, t, 0, CT_PICKLE_TENSOR);
	return x ? push_new(r, *x) : bad(r, "a parameter that is no tensor");
}

static int remember(struct run *r, uint64_t at)
{
	const struct ct_pickle_value *it = peek(r);
	const size_t was = r->n_memo;

	if (!it)
		return -1;
	if (at > r->n)
		return bad(r, "remembers more than it can have made");
	if (at >= was) {
		if (ct_grow(&r->memo, &r->cap_memo, (size_t)at + 1, sizeof *r->memo, r->e))
			return -1;
		r->n_memo = (size_t)at + 1;
		memset(r->memo + was, 0, (r->n_memo - was) * sizeof *r->memo);
	}
	r->memo[at] = (size_t)(it - r->v->value) + 1;
	return 0;
}

static int put_at(struct run *r)
{
	int64_t at;

	return take_number(r, r->arg, false, &at) ? -1 : remember(r, (uint64_t)at);
}

static int memoize(struct run *r)
{
	return remember(r, r->n_memo);
}

static int get_at(struct run *r)
{
	int64_t at;

	if (take_number(r, r->arg, false, &at))
		return -1;
	if ((uint64_t)at >= r->n_memo || r->memo[at] == 0)
		return bad(r, "nothing is remembered there");
	return push(r, r->memo[at] - 1);
}

/* By their first byte. */
static const struct {
	const char *name;
	int (*run)(struct run *r);
	size_t arg;
} instructions[256] = {
	['('] = {"MARK", mark, 0},
	['G'] = {"BINFLOAT", plain, 8},
	['J'] = {"BININT", integer, 4},
	['K'] = {"BININT1", integer, 1},
	['M'] = {"BININT2", integer, 2},
	['N'] = {"NONE", plain, 0},
	['Q'] = {"BINPERSID", storage, 0},
	['R'] = {"REDUCE", reduce, 0},
	['X'] = {"BINUNICODE", text, 4},
	['a'] = {"APPEND", append, 1},
	['b'] = {"BUILD", set_items, 1},
	['c'] = {"GLOBAL", global, 0},
	['e'] = {"APPENDS", append, MARKED},
	['h'] = {"BINGET", get_at, 1},
	['j'] = {"LONG_BINGET", get_at, 4},
	['q'] = {"BINPUT", put_at, 1},
	['r'] = {"LONG_BINPUT", put_at, 4},
	['s'] = {"SETITEM", set_items, 2},
	['t'] = {"TUPLE", tuple, MARKED},
	['u'] = {"SETITEMS", set_items, MARKED},
	['}'] = {"EMPTY_DICT", empty, CT_PICKLE_DICT},
	[']'] = {"EMPTY_LIST", empty, CT_PICKLE_LIST},
	[')'] = {"EMPTY_TUPLE", tuple, 0},
	[0x80] = {"PROTO", skip, 1},
	[0x85] = {"TUPLE1", tuple, 1},
	[0x86] = {"TUPLE2", tuple, 2},
	[0x87] = {"TUPLE3", tuple, 3},
	[0x88] = {"NEWTRUE", plain, 0},
	[0x89] = {"NEWFALSE", plain, 0},
	[0x8a] = {"LONG1", integer, 0},
	[0x8c] = {"SHORT_BINUNICODE", text, 1},
	[0x93] = {"STACK_GLOBAL", stack_global, 0},
	[0x94] = {"MEMOIZE", memoize, 0},
	[0x95] = {"FRAME", skip, 8},
};

/* To the end, which leaves one value. */
static int execute(struct run *r)
{
	unsigned char code = 0;

	while (r->at < r->n && (code = r->data[r->at]) != '.') {
		r->begin = r->at++;
		r->name = instructions[code].name;
		r->arg = instructions[code].arg;
		if (!r->name)
			return ct_fail(r->e, CT_EINPUT,
				"instruction 0x%02x at byte %zu: a dictionary of tensors needs no such",
				code, r->begin);
		if (instructions[code].run(r))
			return -1;
	}
	if (r->at == r->n)
		return ct_fail(r->e, CT_EINPUT, "ends without STOP");
	if (r->n_mark || r->n_stack != 1)
		return ct_fail(r->e, CT_EINPUT, "leaves more or less than one value");
	r->v->root = r->stack[0];
	return 0;
}

int ct_pickle_read(struct ct_pickle *p, const unsigned char *data, size_t n, struct ct_err *e)
{
	struct run r = {.data = data, .n = n, .v = p, .e = e};
	const int rc = execute(&r);

	free(r.stack);
	free(r.mark);
	free(r.memo);
	return rc;
}

void ct_pickle_free(struct ct_pickle *p)
{
	free(p->value);
	free(p->part);
	free(p->pair);
	*p = (struct ct_pickle){0};
}
