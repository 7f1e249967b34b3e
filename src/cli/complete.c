/* complete.c: what a shell offers when a tab is pressed behind a command: see table.h.
 *
 * A value is one of the words of a choice, a file, or a folder; of the files that are written those
 * are offered that end as the row says, and folders on the way to them. What is read is told by its
 * content, so that any file may be meant. An option is not offered beside itself, but --expert, nor
 * beside one that excludes it. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/table.h"

#include <stdio.h>
#include <string.h>

enum { MOST = 64 }; /* options of a line that are looked at */

/* A line up to the word at the cursor. */
struct line {
	const struct ct_tool *t;
	const struct ct_opt *given[MOST];
	size_t n, operands;
	const struct ct_opt *pending; /* whose value stands at the cursor */
	bool only;                    /* operands: behind "--" */
};

/* The option is given; is its value the next word? */
static const struct ct_opt *see(struct line *l, const struct ct_opt *o, bool whole)
{
	if (o && l->n < MOST)
		l->given[l->n++] = o;
	return o && o->type != CT_T_FLAG && !o->alone && !whole ? o : NULL;
}

static void take(struct line *l, const char *w)
{
	if (l->pending)
		l->pending = NULL;
	else if (l->only || w[0] != '-' || !w[1])
		l->operands++;
	else if (strcmp(w, "--") == 0)
		l->only = true;
	else if (w[1] == '-')
		l->pending = see(l, ct_table_find(l->t, w + 2, strcspn(w + 2, "="), 0),
			strchr(w, '=') != NULL);
	else
		for (w++; *w; w++) { /* -fq is -f -q, -x4 is -x 4 */
			const struct ct_opt *o = ct_table_find(l->t, NULL, 0, *w);

			l->pending = see(l, o, w[1] != '\0');
			if (!o || o->type != CT_T_FLAG)
				break;
		}
}

static bool excludes(const struct ct_opt *o, const struct ct_opt *other)
{
	for (const struct ct_when *w = o->when; w < o->when + CT_WHENS; w++)
		if (w->kind == CT_WHEN_UNSET && w->at == other->at)
			return !o->common && !other->common;
	return false;
}

static bool is_expert(const struct ct_opt *o)
{
	return o->common && strcmp(o->name, "expert") == 0;
}

static bool may_stand(const struct line *l, const struct ct_opt *o)
{
	for (size_t i = 0; i < l->n; i++)
		if ((l->given[i] == o && !is_expert(o)) || excludes(o, l->given[i]) ||
			excludes(l->given[i], o))
			return false;
	return true;
}

/* A name with the help up to its first remark. */
static void put_name(const char *dashes, const char *name, const char *sign, const char *help)
{
	const char *dot = strstr(help, ". "), *semicolon = strchr(help, ';');
	size_t n = strlen(help);

	n = dot ? (size_t)(dot - help) : n;
	n = semicolon && (size_t)(semicolon - help) < n ? (size_t)(semicolon - help) : n;
	printf("%s%s%s\t%.*s\n", dashes, name, sign, (int)n, help);
}

static void put_option(const struct ct_opt *o)
{
	put_name("--", o->name, o->type == CT_T_FLAG || o->alone ? "" : "=", o->help);
	if (o->c)
		put_name("-", (char[]){o->c, '\0'}, "", o->help);
}

/* `begun` is what stands of it. */
static void put_value(const struct ct_tool *t, const struct ct_opt *o, const char *begun)
{
	const struct ct_opt *key;

	if (!o)
		return;
	if (is_expert(o) && !strchr(begun, '=')) {
		puts("words");
		for (size_t k = 0; (key = ct_table_expert(t, k)); k++)
			put_name("", key->name, "=", key->help);
	} else if (o->choice) {
		puts("words");
		for (const char *c = o->arg; *c; c++)
			putchar(*c == '|' ? '\n' : *c);
		putchar('\n');
	} else if (o->role != CT_NO_FILE && o->role != CT_READS_WRITES && o->ends[0].ends) {
		printf("files"); /* all that the row writes, whatever the mode */
		for (const struct ct_ends *x = o->ends; x < o->ends + CT_ENDINGS && x->ends; x++)
			printf("%c%s", x == o->ends ? ' ' : '|', x->ends);
		putchar('\n');
	} else if (o->role != CT_NO_FILE)
		puts("files");
	else if (o->arg && strcmp(o->arg, "DIR") == 0)
		puts("folder");
}

void ct_table_complete(const struct ct_tool *t, int n, char **word)
{
	struct line l = {.t = t};
	const char *at = word[n - 1];
	const struct ct_opt *o;
	size_t operand = 0;

	for (int i = 0; i < n - 1; i++)
		take(&l, word[i]);
	if (l.pending || (!l.only && strncmp(at, "--", 2) == 0 && strchr(at, '='))) {
		if (l.pending)
			put_value(t, l.pending, at);
		else
			put_value(t, ct_table_find(t, at + 2, strcspn(at + 2, "="), 0),
				strchr(at, '=') + 1);
		return;
	}
	if (!l.only && *at == '-') {
		puts("words");
		for (size_t k = 0; (o = ct_table_row(t, k)); k++)
			if (o->name && may_stand(&l, o))
				put_option(o);
		return;
	}
	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		if (!o->name && (operand++ == l.operands || o->type == CT_T_LIST)) {
			put_value(t, o, at);
			return;
		}
}
