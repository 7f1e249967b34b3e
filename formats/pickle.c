/* pickle.c: the stack machine; see pickle.h. Instructions are those of Python's pickle, protocols 2
 * to 5. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/pickle-impl.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_VALUES = 1 << 20 };
#define MARKED SIZE_MAX /* all above the last mark */

int ct_pickle_run_bad(const struct ct_pickle_run *r, const char *why)
{
	return ct_fail(r->e, CT_EINPUT, "%s at byte %zu: %s", r->name, r->begin, why);
}

/* The next n bytes, or NULL. */
static const unsigned char *take(struct ct_pickle_run *r, size_t n)
{
	const unsigned char *p = r->data + r->at;

	if (n > r->n - r->at) {
		ct_pickle_run_bad(r, "the pickle ends inside it");
		return NULL;
	}
	r->at += n;
	return p;
}

/* A whole number of n bytes, at most 8. */
static int take_number(struct ct_pickle_run *r, size_t n, bool is_signed, int64_t *x)
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

static int push(struct ct_pickle_run *r, size_t value)
{
	if (ct_grow(&r->stack, &r->cap_stack, r->n_stack + 1, sizeof *r->stack, r->e))
		return -1;
	r->stack[r->n_stack++] = value;
	return 0;
}

int ct_pickle_run_push(struct ct_pickle_run *r, struct ct_pickle_value value)
{
	struct ct_pickle *v = r->v;

	if (v->n_value == MOST_VALUES)
		return ct_pickle_run_bad(r, "too many values");
	if (ct_grow(&v->value, &v->cap_value, v->n_value + 1, sizeof *v->value, r->e))
		return -1;
	v->value[v->n_value] = value;
	return push(r, v->n_value++);
}

/* What no mark keeps. */
static size_t height(const struct ct_pickle_run *r)
{
	return r->n_stack - (r->n_mark ? r->mark[r->n_mark - 1] : 0);
}

/* NULL, and the failure, if there is none. */
struct ct_pickle_value *ct_pickle_run_peek(struct ct_pickle_run *r)
{
	if (height(r) > 0)
		return &r->v->value[r->stack[r->n_stack - 1]];
	ct_pickle_run_bad(r, "nothing is on the stack");
	return NULL;
}

struct ct_pickle_value *ct_pickle_run_pop(struct ct_pickle_run *r)
{
	struct ct_pickle_value *x = ct_pickle_run_peek(r);

	r->n_stack -= x != NULL;
	return x;
}

/* The values that an instruction takes together, `arg` of them or those above the last mark, which
 * is dropped: *n of them, still behind the end of the stack. */
static int pop_all(struct ct_pickle_run *r, size_t *n)
{
	if (r->arg == MARKED && r->n_mark == 0)
		return ct_pickle_run_bad(r, "there is no mark");
	*n = r->arg == MARKED ? height(r) : r->arg;
	if (*n > height(r))
		return ct_pickle_run_bad(r, "too little is on the stack");
	r->n_mark -= r->arg == MARKED;
	r->n_stack -= *n;
	return 0;
}

static int skip(struct ct_pickle_run *r)
{
	return take(r, r->arg) ? 0 : -1;
}

/* A value of no matter, behind which are `arg` bytes of it. */
static int plain(struct ct_pickle_run *r)
{
	return take(r, r->arg)
		       ? ct_pickle_run_push(r, (struct ct_pickle_value){.kind = CT_PICKLE_PLAIN})
		       : -1;
}

/* Of `arg` bytes; LONG1: of as many as the first byte says. */
static int integer(struct ct_pickle_run *r)
{
	int64_t x, n = (int64_t)r->arg;

	if (n == 0 && take_number(r, 1, false, &n))
		return -1;
	if (n > 8)
		return ct_pickle_run_bad(r, "a number of more than 8 bytes");
	return take_number(r, (size_t)n, r->arg == 0 || n == 4, &x)
		       ? -1
		       : ct_pickle_run_push(r,
				 (struct ct_pickle_value){.kind = CT_PICKLE_INTEGER, .number = x});
}

static int truth(struct ct_pickle_run *r)
{
	return ct_pickle_run_push(
		r, (struct ct_pickle_value){.kind = CT_PICKLE_PLAIN, .number = (int64_t)r->arg});
}

static int text_of(struct ct_pickle_run *r, enum ct_pickle_kind kind)
{
	const unsigned char *p;
	int64_t n;

	if (take_number(r, r->arg, false, &n))
		return -1;
	p = take(r, (size_t)n);
	return p ? ct_pickle_run_push(r,
			   (struct ct_pickle_value){
				   .kind = kind, .text = (const char *)p, .length = (size_t)n})
		 : -1;
}

static int text(struct ct_pickle_run *r)
{
	return text_of(r, CT_PICKLE_TEXT);
}

static int bytes(struct ct_pickle_run *r)
{
	return text_of(r, CT_PICKLE_BYTES);
}

static int mark(struct ct_pickle_run *r)
{
	if (ct_grow(&r->mark, &r->cap_mark, r->n_mark + 1, sizeof *r->mark, r->e))
		return -1;
	r->mark[r->n_mark++] = r->n_stack;
	return 0;
}

static int tuple(struct ct_pickle_run *r)
{
	struct ct_pickle *v = r->v;
	const size_t first = v->n_part;
	size_t n = 0;

	if (pop_all(r, &n) || ct_grow(&v->part, &v->cap_part, first + n + 1, sizeof *v->part, r->e))
		return -1;
	if (n)
		memcpy(v->part + first, r->stack + r->n_stack, n * sizeof *v->part);
	v->n_part += n;
	return ct_pickle_run_push(
		r, (struct ct_pickle_value){.kind = CT_PICKLE_TUPLE, .first = first, .n = n});
}

/* Of kind `arg`. */
static int empty(struct ct_pickle_run *r)
{
	return ct_pickle_run_push(r, (struct ct_pickle_value){.kind = (enum ct_pickle_kind)r->arg});
}

static int append(struct ct_pickle_run *r)
{
	const struct ct_pickle_value *to;
	size_t n = 0;

	if (pop_all(r, &n) || !(to = ct_pickle_run_peek(r)))
		return -1;
	return to->kind == CT_PICKLE_LIST ? 0 : ct_pickle_run_bad(r, "not to a list");
}

static int put_pair(struct ct_pickle_run *r, struct ct_pickle_value *to, size_t key, size_t x)
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

static int set_items(struct ct_pickle_run *r)
{
	struct ct_pickle_value *to;
	size_t n = 0;

	if (pop_all(r, &n) || !(to = ct_pickle_run_peek(r)))
		return -1;
	if (to->kind != CT_PICKLE_DICT)
		return ct_pickle_run_bad(r, "not of a dictionary");
	if (n % 2)
		return ct_pickle_run_bad(r, "a key without a value");
	for (size_t i = 0; i + 1 < n; i += 2)
		if (put_pair(r, to, r->stack[r->n_stack + i], r->stack[r->n_stack + i + 1]))
			return -1;
	return 0;
}

/* GLOBAL: two lines. */
static int global(struct ct_pickle_run *r)
{
	struct ct_pickle_value line[2];

	for (int i = 0; i < 2; i++) {
		const char *at = (const char *)r->data + r->at,
			   *end = memchr(at, '\n', r->n - r->at);

		if (!end)
			return ct_pickle_run_bad(r, "the pickle ends inside it");
		line[i] = (struct ct_pickle_value){
			.kind = CT_PICKLE_TEXT, .text = at, .length = (size_t)(end - at)};
		r->at += line[i].length + 1;
	}
	return ct_pickle_run_global(r, &line[0], &line[1]);
}

static int stack_global(struct ct_pickle_run *r)
{
	const struct ct_pickle_value *name = ct_pickle_run_pop(r),
				     *module = name ? ct_pickle_run_pop(r) : NULL;

	if (!module)
		return -1;
	if (module->kind != CT_PICKLE_TEXT || name->kind != CT_PICKLE_TEXT)
		return ct_pickle_run_bad(r, "not of two words");
	return ct_pickle_run_global(r, module, name);
}

static int remember(struct ct_pickle_run *r, uint64_t at)
{
	const struct ct_pickle_value *it = ct_pickle_run_peek(r);
	const size_t was = r->n_memo;

	if (!it)
		return -1;
	if (at > r->n)
		return ct_pickle_run_bad(r, "remembers more than it can have made");
	if (at >= was) {
		if (ct_grow(&r->memo, &r->cap_memo, (size_t)at + 1, sizeof *r->memo, r->e))
			return -1;
		r->n_memo = (size_t)at + 1;
		memset(r->memo + was, 0, (r->n_memo - was) * sizeof *r->memo);
	}
	r->memo[at] = (size_t)(it - r->v->value) + 1;
	return 0;
}

static int put_at(struct ct_pickle_run *r)
{
	int64_t at;

	return take_number(r, r->arg, false, &at) ? -1 : remember(r, (uint64_t)at);
}

static int memoize(struct ct_pickle_run *r)
{
	return remember(r, r->n_memo);
}

static int get_at(struct ct_pickle_run *r)
{
	int64_t at;

	if (take_number(r, r->arg, false, &at))
		return -1;
	if ((uint64_t)at >= r->n_memo || r->memo[at] == 0)
		return ct_pickle_run_bad(r, "nothing is remembered there");
	return push(r, r->memo[at] - 1);
}

/* By their first byte. */
static const struct {
	const char *name;
	int (*run)(struct ct_pickle_run *r);
	size_t arg;
} instructions[256] = {
	['('] = {"MARK", mark, 0},
	['B'] = {"BINBYTES", bytes, 4},
	['C'] = {"SHORT_BINBYTES", bytes, 1},
	['G'] = {"BINFLOAT", plain, 8},
	['J'] = {"BININT", integer, 4},
	['K'] = {"BININT1", integer, 1},
	['M'] = {"BININT2", integer, 2},
	['N'] = {"NONE", plain, 0},
	['Q'] = {"BINPERSID", ct_pickle_run_storage, 0},
	['R'] = {"REDUCE", ct_pickle_run_reduce, 0},
	['X'] = {"BINUNICODE", text, 4},
	['a'] = {"APPEND", append, 1},
	['b'] = {"BUILD", ct_pickle_run_build, 1},
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
	[0x88] = {"NEWTRUE", truth, 1},
	[0x89] = {"NEWFALSE", truth, 0},
	[0x8a] = {"LONG1", integer, 0},
	[0x8c] = {"SHORT_BINUNICODE", text, 1},
	[0x8e] = {"BINBYTES8", bytes, 8},
	[0x93] = {"STACK_GLOBAL", stack_global, 0},
	[0x94] = {"MEMOIZE", memoize, 0},
	[0x95] = {"FRAME", skip, 8},
	[0x96] = {"BYTEARRAY8", bytes, 8},
};

/* To the end, which leaves one value. */
static int execute(struct ct_pickle_run *r)
{
	unsigned char code = 0;

	while (r->at < r->n && (code = r->data[r->at]) != '.') {
		r->begin = r->at++;
		r->name = instructions[code].name;
		r->arg = instructions[code].arg;
		if (!r->name || (instructions[code].run == bytes && !r->v->arrays))
			return ct_fail(r->e, CT_EINPUT,
				"instruction 0x%02x at byte %zu: a dictionary of %s needs no such",
				code, r->begin, r->v->arrays ? "arrays" : "tensors");
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
	struct ct_pickle_run r = {.data = data, .n = n, .v = p, .e = e};
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
