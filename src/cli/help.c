/* help.c: --help and the man page: see table.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/modes.h"
#include "cli/table.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

static void put_default(const struct ct_tool *t, const struct ct_opt *o)
{
	char text[200];

	if (!o->name || o->type == CT_T_FLAG || !ct_table_has_default(t, o))
		return;
	ct_table_text(text, sizeof text, o, ct_table_defaults(t, o), 6);
	if (*text)
		printf(" (default %s)", text);
}

static void synopsis(const struct ct_tool *t)
{
	printf("Usage: %s [OPTION]...", t->name);
	for (const struct ct_opt *o = t->opts; o->type != CT_T_END; o++)
		if (!o->name)
			printf(o->optional ? " [%s]%s" : " %s%s", ct_table_operand(o),
				o->type == CT_T_LIST ? "..." : "");
}

/* Words of text at column `from`, folded before column 79. */
static void fold(size_t from, size_t at, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, " ");

		if (at + 1 + n > 79) {
			printf("\n%*s", (int)from, "");
			at = from;
		}
		at += (size_t)printf(" %.*s", (int)n, text);
		text += n + strspn(text + n, " ");
	}
}

/* How the names of what the row writes end, "..."; empty if it writes nothing. */
static void ends_text(char *out, size_t room, const struct ct_tool *t, const struct ct_opt *o)
{
	char ends[160], when[160];
	size_t at = 0;

	*out = '\0';
	for (const struct ct_ends *x = o->ends; x < o->ends + CT_ENDINGS && x->ends; x++) {
		ct_ends_text(ends, sizeof ends, x->ends);
		ct_modes_when(when, sizeof when, t, &x->when);
		at += (size_t)snprintf(out + at, room - at, "%s%s%s%s", at ? ", else " : "ends in ",
			ends, *when ? " with " : "", when);
	}
}

/* A remark on a line of its own. */
static void put_line(const char *text, size_t from)
{
	char shown[420];

	if (!*text)
		return;
	snprintf(shown, sizeof shown, "[%s]", text);
	printf("\n%*s", (int)from, "");
	fold(from, from, shown);
}

/* A row: what it is called, what it is, its default. */
static void put_row(const struct ct_tool *t, const struct ct_opt *o, const char *left)
{
	fold(25, (size_t)printf("%-25s", left), o->help);
	put_default(t, o);
}

int ct_table_show_help(const struct ct_tool *t, struct ct_err *e)
{
	const struct ct_table_exits *x;
	const struct ct_opt *o;
	char left[80], text[400];

	(void)e;
	synopsis(t);
	printf("\n%s\n\n", t->brief);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (!o->name)
			snprintf(left, sizeof left, "  %s", ct_table_operand(o));
		else
			snprintf(left, sizeof left, "  %c%c%c --%s%s%s%s", o->c ? '-' : ' ',
				o->c ? o->c : ' ', o->c ? ',' : ' ', o->name,
				o->alone ? "[="
				: o->arg ? "="
					 : "",
				o->arg ? o->arg : "", o->alone ? "]" : "");
		put_row(t, o, left);
		ends_text(text, sizeof text, t, o);
		put_line(text, 25);
		ct_modes_text(text, sizeof text, t, o);
		put_line(text, 25);
		putchar('\n');
	}
	if (ct_table_expert(t, 0))
		puts("\nKeys of --expert:");
	for (size_t k = 0; (o = ct_table_expert(t, k)); k++) {
		snprintf(left, sizeof left, "      %s=%s", o->name, o->arg ? o->arg : "yes");
		put_row(t, o, left);
		putchar('\n');
	}
	fputs("\nExit status:", stdout);
	for (size_t k = 0; (x = ct_table_exit(k)); k++)
		printf("%s%d %s%s", k == 5 ? "\n" : " ", x->code, x->words,
			ct_table_exit(k + 1) ? "," : ".\n");
	puts("Cite: man ct-references");
	return 0;
}

/* mdoc wants a line a sentence. */
static void sentences(const char *text)
{
	for (; *text; text++)
		if (text[0] == '.' && text[1] == ' ') {
			puts(".");
			text++;
		} else
			putchar(*text);
}

/* The same as a sentence. */
static void put_sentence(const char *text)
{
	for (const char *c = text; *c; c++)
		if (*c == '-')
			fputs("\\-", stdout);
		else
			putchar(c == text ? toupper((unsigned char)*c) : *c);
	if (*text)
		puts(".");
}

/* The keys of --expert, as a list in the list of options. */
static void mdoc_experts(const struct ct_tool *t)
{
	const struct ct_opt *o;

	puts(".Bl -tag -width Ds -compact");
	for (size_t k = 0; (o = ct_table_expert(t, k)); k++) {
		printf(".It Cm %s Ns = Ns Ar %s\n", o->name, o->arg ? o->arg : "yes");
		sentences(o->help);
		put_default(t, o);
		puts(".");
	}
	puts(".El");
}

int ct_table_show_mdoc(const struct ct_tool *t, struct ct_err *e)
{
	const struct ct_opt *o;
	char text[400];

	(void)e;
	puts(".Bl -tag -width Ds");
	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (!o->name)
			continue;
		fputs(".It ", stdout);
		if (o->c)
			printf("Fl %c , ", o->c);
		printf("Fl \\-%s%s%s\n", o->name,
			o->alone ? " Ns Op = Ns Ar "
			: o->arg ? " Ns = Ns Ar "
				 : "",
			o->arg ? o->arg : "");
		sentences(o->help);
		put_default(t, o);
		puts(".");
		ends_text(text, sizeof text, t, o);
		put_sentence(text);
		ct_modes_text(text, sizeof text, t, o);
		put_sentence(text);
		if (o->common && strcmp(o->name, "expert") == 0)
			mdoc_experts(t);
	}
	puts(".El");
	return 0;
}
