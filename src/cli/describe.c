/* describe.c: a command for programs: see table.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/json.h"
#include "cli/modes.h"
#include "cli/table.h"

#include <errno.h>
#include <stdio.h>

static const char *type_of(const struct ct_opt *o)
{
	if (ct_table_is_file(o))
		return "file";
	if (o->choice)
		return "choice";
	return o->type == CT_T_FLAG   ? "flag"
	       : o->type == CT_T_INT  ? "integer"
	       : o->type == CT_T_REAL ? "number"
				      : "text";
}

static const char *direction_of(const struct ct_opt *o)
{
	return !ct_table_is_file(o)         ? NULL
	       : o->role == CT_READS        ? "in"
	       : o->role == CT_READS_WRITES ? "both"
					    : "out";
}

static const char *name_of(const struct ct_opt *o)
{
	return o->name ? o->name : ct_table_operand(o);
}

/* "a|b|c": those whose bits are set. */
static json_t *list_of(const char *words, unsigned bits)
{
	json_t *all = json_array();
	const char *word;
	size_t n;

	for (int i = 0; (word = ct_words_at(words, i, &n)); i++)
		if (bits & CT_BIT(i))
			json_array_append_new(all, json_stringn(word, n));
	return all;
}

/* That an option is given, or is one of these words; that an operand is a file. */
static json_t *condition_of(const struct ct_tool *t, const struct ct_when *w)
{
	const struct ct_opt *o = ct_modes_row(t, w);

	return json_pack("{ss so* so*}", "name", name_of(o), "words",
		w->words ? list_of(o->arg, w->words) : NULL, "file",
		w->kind == CT_WHEN_FILE ? json_true() : NULL);
}

/* Those of a row of which any must hold, or of which none may. NULL: none. */
static json_t *conditions_of(const struct ct_tool *t, const struct ct_opt *o, bool exclude)
{
	json_t *all = NULL;

	for (const struct ct_when *w = o->when; w < o->when + CT_WHENS; w++)
		if (w->kind != CT_WHEN_ALWAYS && ct_modes_excludes(w) == exclude) {
			all = all ? all : json_array();
			json_array_append_new(all, condition_of(t, w));
		}
	return all;
}

static json_t *ends_of(const struct ct_tool *t, const struct ct_opt *o)
{
	json_t *all = json_array();

	for (const struct ct_ends *x = o->ends; x < o->ends + CT_ENDINGS && x->ends; x++)
		json_array_append_new(all,
			json_pack("{so so*}", "names", list_of(x->ends, ~0U), "with",
				x->when.kind == CT_WHEN_ALWAYS ? NULL : condition_of(t, &x->when)));
	return all;
}

/* NULL: there is none. */
static json_t *default_of(const struct ct_tool *t, const struct ct_opt *o)
{
	const void *p = (const char *)ct_table_defaults(t, o) + o->at;
	char text[200];

	if (!ct_table_has_default(t, o))
		return NULL;
	if (o->type == CT_T_FLAG)
		return json_boolean(*(const bool *)p);
	if (!o->choice && o->type == CT_T_INT)
		return json_integer(*(const int *)p);
	if (o->type == CT_T_REAL)
		return json_real(*(const double *)p);
	ct_table_text(text, sizeof text, o, ct_table_defaults(t, o), 17);
	return *text ? json_string(text) : NULL;
}

static json_t *row_of(const struct ct_tool *t, const struct ct_opt *o)
{
	const bool ranged = o->lo < o->hi, operand = !o->name;

	/* what there is not, NULL, is not told */
	return json_pack("{ss ss* ss* ss ss* ss so* so* so* so* so* so* so* so* so* so*}", "name",
		name_of(o), "value", o->name && !o->choice ? o->arg : NULL, "alone", o->alone,
		"type", type_of(o), "direction", direction_of(o), "help", o->help, "needs",
		conditions_of(t, o, false), "not_with", conditions_of(t, o, true), "letter",
		o->c ? json_stringn(&o->c, 1) : NULL, "words",
		o->choice ? list_of(o->arg, ~0U) : NULL, "least", ranged ? json_real(o->lo) : NULL,
		"most", ranged ? json_real(o->hi) : NULL, "ends",
		o->ends[0].ends ? ends_of(t, o) : NULL, "list",
		operand ? json_boolean(o->type == CT_T_LIST) : NULL, "optional",
		operand ? json_boolean(o->optional) : NULL, "default",
		operand ? NULL : default_of(t, o));
}

int ct_table_show_json(const struct ct_tool *t, struct ct_err *e)
{
	json_t *arguments = json_array(), *options = json_array(), *keys = json_array(),
	       *exits = json_object(), *all;
	const struct ct_table_exits *x;
	char code[12];
	const struct ct_opt *o;
	int rc;

	errno = 0;
	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		json_array_append_new(o->name ? options : arguments, row_of(t, o));
	for (size_t k = 0; (o = ct_table_expert(t, k)); k++)
		json_array_append_new(keys, row_of(t, o));
	for (size_t k = 0; (x = ct_table_exit(k)); k++) {
		snprintf(code, sizeof code, "%d", x->code);
		json_object_set_new(exits, code, json_string(x->words));
	}
	all = json_pack("{ss ss ss so so so so}", "name", t->name, "version", PACKAGE_VERSION,
		"brief", t->brief, "arguments", arguments, "options", options, "expert", keys,
		"exit", exits);
	/* a member that was not set is not told */
	rc = ct_json_print(errno == ENOMEM ? NULL : all, 17, e);
	json_decref(all);
	return rc;
}

static void put_text(const char *tag, const char *text)
{
	printf("<%s>", tag);
	for (; *text; text++)
		if (*text == '&' || *text == '<' || *text == '>')
			fputs(*text == '&' ? "&amp;" : *text == '<' ? "&lt;" : "&gt;", stdout);
		else
			putchar(*text);
	printf("</%s>", tag);
}

/* "slice-thickness" as an identifier; what Slicer shows. */
static void put_names(const struct ct_opt *o, const char *instead)
{
	const char *name = instead ? instead : name_of(o);

	fputs("<name>", stdout);
	for (const char *c = name; *c; c++)
		putchar(*c == '-' ? '_' : *c);
	fputs("</name>", stdout);
	put_text("label", name);
}

/* Slicer gives every number and choice, changed or not. Where there is no default, or only some
 * modes take it, it is a text that may stay empty. */
static bool may_be_given(const struct ct_tool *t, const struct ct_opt *o)
{
	return o->when[0].kind == CT_WHEN_ALWAYS && ct_table_has_default(t, o);
}

/* What the form offers. Slicer's schema has no flag for a file and one word only in a choice, so
 * both are texts there; the volumes that have a place on the line are chosen from the scene. */
static const char *tag_of(const struct ct_tool *t, const struct ct_opt *o)
{
	if (!o->name)
		return "image";
	if (o->type == CT_T_FLAG || o->alone) /* Slicer puts no = before a value */
		return "boolean";
	if (o->role != CT_NO_FILE || o->type == CT_T_STR || o->choice || !may_be_given(t, o))
		return "string";
	return o->type == CT_T_INT ? "integer" : "double";
}

static void put_default(const struct ct_tool *t, const struct ct_opt *o)
{
	char text[200];

	if (o->type == CT_T_FLAG || o->alone)
		snprintf(text, sizeof text, "false");
	else
		ct_table_text(text, sizeof text, o, t->defaults, 9);
	if (*text)
		put_text("default", text);
}

/* fileExtensions=".nii,.mha" of a volume. */
static void put_extensions(const struct ct_opt *o)
{
	const char *before = " fileExtensions=\".", *word;
	size_t n;

	for (const struct ct_ends *x = o->ends; x < o->ends + CT_ENDINGS && x->ends; x++)
		for (int i = 0; (word = ct_words_at(x->ends, i, &n)); i++, before = ",.")
			printf("%s%.*s", before, (int)n, word);
	if (o->ends[0].ends)
		putchar('"');
}

/* A volume at a place of the line. */
static void put_volume(const struct ct_opt *o, int place, bool output)
{
	fputs("<image", stdout);
	put_extensions(o);
	putchar('>');
	put_names(o, o->role == CT_READS_WRITES ? output ? "OUT" : "IN" : NULL);
	printf("<index>%d</index>", place);
	put_text("channel", output ? "output" : "input");
	put_text("description", o->help);
	puts("</image>");
}

static void put_option(const struct ct_tool *t, const struct ct_opt *o)
{
	const char *tag = tag_of(t, o);
	char text[1000];

	snprintf(text, sizeof text, o->choice ? "%s (%s)" : "%s", o->help, o->arg);
	printf("<%s>", tag);
	put_names(o, NULL);
	if (o->c)
		printf("<flag>-%c</flag>", o->c);
	printf("<longflag>--%s</longflag>", o->name);
	put_text("description", text);
	if (o->role == CT_NO_FILE && (o->type == CT_T_FLAG || o->alone || may_be_given(t, o)))
		put_default(t, o);
	printf("</%s>\n", tag);
}

int ct_table_show_xml(const struct ct_tool *t, struct ct_err *e)
{
	const struct ct_opt *o;
	int place = 0;

	(void)e;
	puts("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>");
	put_text("category", "CT super-resolution");
	put_text("title", t->name);
	put_text("description", t->brief);
	put_text("version", PACKAGE_VERSION);
	printf("<documentation-url>man:%s(1)</documentation-url>", t->name);
	put_text("license", "Apache-2.0");
	put_text("contributor", "the authors of ctsr");
	puts("\n<parameters>\n<label>Files</label><description>What is read and written</description>");
	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		if (!o->name) {
			if (o->role == CT_READS_WRITES)
				put_volume(o, place++, false);
			put_volume(o, place++, o->role != CT_READS);
		}
	puts("</parameters>\n<parameters>\n<label>Options</label><description>All but "
	     "the common ones</description>");
	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		if (o->name && !o->common)
			put_option(t, o);
	puts("</parameters>\n</executable>");
	return 0;
}
