/* modes.c: see modes.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/modes.h"
#include "cli/table.h"

#include <stdio.h>
#include <string.h>

const struct ct_opt *ct_modes_row(const struct ct_tool *t, const struct ct_when *w)
{
	const struct ct_opt *o = t->opts;

	while (o->type != CT_T_END && o->at != w->at)
		o++;
	return o;
}

static bool same_text(const char *a, const char *b)
{
	return a && b ? strcmp(a, b) == 0 : a == b;
}

/* Is the field not at its default? */
static bool is_set(const struct ct_tool *t, const struct ct_opt *o, const void *params)
{
	const void *p = (const char *)params + o->at, *d = (const char *)t->defaults + o->at;

	switch (o->type) {
	case CT_T_STR: return !same_text(*(const char *const *)p, *(const char *const *)d);
	case CT_T_LIST: return ((const struct ct_list *)p)->n > 0;
	case CT_T_FLAG: return *(const bool *)p != *(const bool *)d;
	case CT_T_INT: return *(const int *)p != *(const int *)d;
	case CT_T_REAL: return memcmp(p, d, sizeof(double)) != 0;
	case CT_T_END: break;
	}
	return false;
}

bool ct_modes_excludes(const struct ct_when *w)
{
	return w->kind == CT_WHEN_UNSET || w->kind == CT_WHEN_OTHER;
}

bool ct_modes_hold(const struct ct_when *w, const struct ct_tool *t, const void *params)
{
	const struct ct_opt *o = ct_modes_row(t, w);
	const void *p = (const char *)params + w->at;

	switch (w->kind) {
	case CT_WHEN_SET: return is_set(t, o, params);
	case CT_WHEN_UNSET: return !is_set(t, o, params);
	case CT_WHEN_WORD: return w->words & CT_BIT(*(const int *)p);
	case CT_WHEN_OTHER: return !(w->words & CT_BIT(*(const int *)p));
	case CT_WHEN_FILE: return !same_text(*(const char *const *)p, "-");
	case CT_WHEN_ALWAYS: break;
	}
	return true;
}

static bool is_taken(const struct ct_opt *o, const struct ct_tool *t, const void *params)
{
	bool asked = false, any = false;

	for (const struct ct_when *w = o->when; w < o->when + CT_WHENS; w++) {
		if (ct_modes_excludes(w) && !ct_modes_hold(w, t, params))
			return false;
		if (ct_modes_excludes(w) || w->kind == CT_WHEN_ALWAYS)
			continue;
		asked = true;
		any |= ct_modes_hold(w, t, params);
	}
	return any || !asked;
}

/* The words of a choice whose bits are set, with a bar between. */
static void put_words(FILE *f, const char *words, unsigned bits)
{
	const char *bar = "", *word;
	size_t n;

	for (int i = 0; (word = ct_words_at(words, i, &n)); i++)
		if (bits & CT_BIT(i)) {
			fprintf(f, "%s%.*s", bar, (int)n, word);
			bar = "|";
		}
}

static void put_when(FILE *f, const struct ct_tool *t, const struct ct_when *w)
{
	const struct ct_opt *o = ct_modes_row(t, w);
	const bool needs = w->kind == CT_WHEN_SET; /* an operand: so those before it */
	char name[CT_TABLE_NAME];

	for (const struct ct_opt *before = t->opts; needs && !o->name && before < o; before++)
		if (!before->name)
			fprintf(f, "%s and ", ct_table_operand(before));
	ct_table_name(name, o);
	fputs(name, f);
	if (w->words) {
		fputc('=', f);
		put_words(f, o->arg, w->words);
	}
	if (w->kind == CT_WHEN_FILE)
		fputs(" to be a file", f);
}

/* The conditions of a row that exclude, or the others, behind `first`: how many there are. */
static size_t put_all(
	FILE *f, const struct ct_tool *t, const struct ct_opt *o, bool exclude, const char *first)
{
	const struct ct_when *some[CT_WHENS];
	size_t n = 0;

	for (const struct ct_when *w = o->when; w < o->when + CT_WHENS; w++)
		if (w->kind != CT_WHEN_ALWAYS && ct_modes_excludes(w) == exclude)
			some[n++] = w;
	for (size_t i = 0; i < n; i++) {
		fputs(i == 0 ? first : i + 1 < n ? ", " : " or ", f);
		put_when(f, t, some[i]);
	}
	return n;
}

void ct_modes_text(char *out, size_t room, const struct ct_tool *t, const struct ct_opt *o)
{
	FILE *f = fmemopen(out, room, "w");

	*out = '\0';
	if (!f)
		return;
	if (put_all(f, t, o, false, "needs "))
		put_all(f, t, o, true, "; not with ");
	else
		put_all(f, t, o, true, "not with ");
	fclose(f);
}

void ct_modes_when(char *out, size_t room, const struct ct_tool *t, const struct ct_when *w)
{
	FILE *f = fmemopen(out, room, "w");

	*out = '\0';
	if (f && w->kind != CT_WHEN_ALWAYS)
		put_when(f, t, w);
	if (f)
		fclose(f);
}

int ct_modes_check(const struct ct_given *given, const void *params, struct ct_err *e)
{
	const struct ct_tool *t = given->tool;

	for (const struct ct_opt *o = t->opts; o->type != CT_T_END; o++) {
		char text[400], name[CT_TABLE_NAME];

		if (!given->row[o - t->opts] || is_taken(o, t, params))
			continue;
		ct_modes_text(text, sizeof text, t, o);
		ct_table_name(name, o);
		return ct_fail(e, CT_EUSAGE, "%s: %s", name, text);
	}
	return 0;
}

bool ct_modes_given(const struct ct_given *given, const char *name)
{
	for (const struct ct_opt *o = given->tool->opts; o->type != CT_T_END; o++)
		if (o->name && strcmp(o->name, name) == 0)
			return given->row[o - given->tool->opts];
	return false;
}
