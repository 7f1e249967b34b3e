/* table.c: see table.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/table.h"
#include "core/inflate.h"
#include "formats/units.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const struct ct_common ct_common_defaults = {.expand = CT_INFLATE_TIMES, .seed = "0"};

enum { KEYED = 0x100, DRY_JSON = 0x200 }; /* has keys of --expert; --json of --dry-run alone */

#define CT_PARAMS struct ct_common
#define COMMON(f, c, name, arg, to, ...) CT_OPT(f, c, name, arg, 0, to, __VA_ARGS__, .common = true)
static const struct {
	unsigned flags; /* of the tools that have it; 0: all */
	struct ct_opt opt;
} common[] = {
	{KEYED, COMMON(expert, 0, "expert", "KEY=VALUE,...", 0,
			"set constants of the method; their defaults were measured")},
	{CT_SEEDED, COMMON(seed, 's', "seed", "N", 0, "seed of the random numbers")},
	{CT_REPORTS, COMMON(json, 0, "json", NULL, 0, "print the report as JSON")},
	{CT_TELLS, COMMON(json, 0, "json", NULL, 0, "print the result as JSON")},
	{DRY_JSON, COMMON(json, 0, "json", NULL, 0, "print the figures of --dry-run as JSON")},
	{CT_LONG, COMMON(dry_run, 0, "dry-run", NULL, 0,
			  "print the time, memory and disk expected, and do nothing")},
	{CT_IN_HU,
		CT_CHOICE(units, 0, "units", CT_WORDS(CT_UNITS_LIST),
			"unit of the values of a CT: auto is that of its file, and what cannot be HU "
			"is refused; hu is HU whatever the file says; other is no HU, refused where "
			"HU are needed",
			.common = true)},
	{0, COMMON(threads, 't', "threads", "N", 4096,
		    "use N threads; 0 asks CT_THREADS, OMP_NUM_THREADS, SLURM_CPUS_PER_TASK, then "
		    "the processors this process may use. The output is the same for any N")},
	{0, COMMON(expand, 0, "expand", "N", 100000,
		    "refuse compressed files that become more than 1 GiB and N times as large; 0 "
		    "refuses none")},
	{0, COMMON(force, 'f', "force", NULL, 0,
		    "overwrite existing output files (automatic inside make)")},
	{0, COMMON(quiet, 'q', "quiet", NULL, 0, "print errors only")},
	{0, COMMON(verbose, 'v', "verbose", NULL, 0, "print what is being done")},
	{0, COMMON(help, 'h', "help", NULL, 0, "print this help")},
	{0, COMMON(version, 0, "version", NULL, 0, "print the version")},
};

const struct ct_table_exits *ct_table_exit(size_t k)
{
	static const struct ct_table_exits all[] = {{CT_OK, "done"}, {CT_EFAIL, "failed"},
		{CT_EUSAGE, "usage"}, {CT_EINPUT, "input invalid"},
		{CT_EOUTPUT, "output not writable"}, {CT_EGEOM, "geometry refused"},
		{CT_ENUMERIC, "numerical failure"}, {CT_ENOMEM, "no memory"},
		{CT_ESTOP, "stopped on request"}};

	return k < sizeof all / sizeof *all ? &all[k] : NULL;
}

const struct ct_opt *ct_table_expert(const struct ct_tool *t, size_t k)
{
	for (const struct ct_opt *o = t->opts; o->type != CT_T_END; o++)
		if (o->expert && k-- == 0)
			return o;
	return NULL;
}

const struct ct_opt *ct_table_row(const struct ct_tool *t, size_t k)
{
	const unsigned flags =
		t->flags | (ct_table_expert(t, 0) ? KEYED : 0) |
		((t->flags & (CT_LONG | CT_REPORTS | CT_TELLS)) == CT_LONG ? DRY_JSON : 0);

	for (const struct ct_opt *o = t->opts; o->type != CT_T_END; o++)
		if (!o->expert && k-- == 0)
			return o;
	for (size_t i = 0; i < sizeof common / sizeof *common; i++)
		if ((!common[i].flags || common[i].flags & flags) && k-- == 0)
			return &common[i].opt;
	return NULL;
}

bool ct_table_is_file(const struct ct_opt *o)
{
	return o->role != CT_NO_FILE && !(o->arg && strchr(o->arg, '|'));
}

const struct ct_opt *ct_table_find(const struct ct_tool *t, const char *name, size_t n, char c)
{
	const struct ct_opt *o, *hit = NULL;
	int hits = 0;

	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (!o->name || (c ? o->c != c : strncmp(o->name, name, n) != 0))
			continue;
		if (c || strlen(o->name) == n)
			return o;
		hits++;
		hit = o;
	}
	return hits == 1 ? hit : NULL;
}

static int set_number(
	const struct ct_opt *o, void *p, const char *name, const char *s, struct ct_err *e)
{
	double x;

	if (o->type == CT_T_INT) {
		long long v;

		if (!ct_number_whole(&v, s, INT_MIN, INT_MAX))
			return ct_fail(e, CT_EUSAGE, "%s: '%s' is not an integer", name, s);
		*(int *)p = (int)v;
		x = (double)v;
	} else {
		if (!ct_number_read(&x, s))
			return ct_fail(e, CT_EUSAGE, "%s: '%s' is not a number", name, s);
		*(double *)p = x;
	}
	if (o->lo < o->hi && (x < o->lo || x > o->hi))
		return ct_fail(e, CT_EUSAGE, "%s: %g is outside [%g, %g]", name, x, o->lo, o->hi);
	return 0;
}

const char *ct_table_operand(const struct ct_opt *o)
{
	return o->label ? o->label : o->arg;
}

void ct_table_name(char out[CT_TABLE_NAME], const struct ct_opt *o)
{
	snprintf(out, CT_TABLE_NAME, "%s%s",
		o->expert ? "--expert "
		: o->name ? "--"
			  : "",
		o->name ? o->name : ct_table_operand(o));
}

int ct_table_set(const struct ct_opt *o, void *params, const char *s, struct ct_err *e)
{
	void *p = (char *)params + o->at;
	char name[CT_TABLE_NAME], hint[CT_WORDS_HINT];
	int i;

	ct_table_name(name, o);
	switch (o->type) {
	case CT_T_FLAG: /* an option is there or not; a key says yes or no */
		*(bool *)p = !o->expert || strcmp(s, "yes") == 0;
		return *(bool *)p || strcmp(s, "no") == 0
			       ? 0
			       : ct_fail(e, CT_EUSAGE, "%s: '%s' is not yes or no", name, s);
	case CT_T_STR: *(const char **)p = s; return 0;
	case CT_T_INT:
	case CT_T_REAL:
		if (!o->choice)
			return set_number(o, p, name, s, e);
		i = ct_words_find(o->arg, s);
		if (i < 0)
			return ct_fail(e, CT_EUSAGE, "%s: '%s' is not one of %s%s", name, s, o->arg,
				ct_words_hint_of(hint, o->arg, s));
		*(int *)p = i;
		return 0;
	case CT_T_LIST:
	case CT_T_END: break;
	}
	return 0;
}

const void *ct_table_defaults(const struct ct_tool *t, const struct ct_opt *o)
{
	return o->common ? (const void *)&ct_common_defaults : t->defaults;
}

bool ct_table_has_default(const struct ct_tool *t, const struct ct_opt *o)
{
	const void *p = (const char *)ct_table_defaults(t, o) + o->at;
	const double x = o->type == CT_T_INT    ? *(const int *)p
			 : o->type == CT_T_REAL ? *(const double *)p
						: 0;

	if (o->choice)
		return x >= 0;
	return !isnan(x) && (o->lo >= o->hi || (x >= o->lo && x <= o->hi));
}

void ct_table_text(char *out, size_t room, const struct ct_opt *o, const void *params, int digits)
{
	const void *p = (const char *)params + o->at;
	const char *text;
	size_t n = 0;

	*out = '\0';
	switch (o->type) {
	case CT_T_FLAG: snprintf(out, room, "%s", *(const bool *)p ? "yes" : "no"); break;
	case CT_T_INT:
		text = o->choice ? ct_words_at(o->arg, *(const int *)p, &n) : NULL;
		if (text)
			snprintf(out, room, "%.*s", (int)n, text);
		else if (!o->choice)
			snprintf(out, room, "%d", *(const int *)p);
		break;
	case CT_T_REAL: snprintf(out, room, "%.*g", digits, *(const double *)p); break;
	case CT_T_STR:
		text = *(const char *const *)p;
		snprintf(out, room, "%s", text ? text : "");
		break;
	case CT_T_LIST:
	case CT_T_END: break;
	}
}

int ct_cli_numbers(const char *option, const char *s, char sep, size_t n, bool spread, double *v,
	struct ct_err *e)
{
	if (!ct_words_numbers(s, sep, n, spread, v))
		return ct_fail(e, CT_EUSAGE, "--%s: '%s' is not %zu number%s%s", option, s, n,
			n == 1 ? "" : "s", spread && n > 1 ? ", or one for all" : "");
	return 0;
}

int ct_cli_within(const char *option, const char *s, size_t n, bool spread, double lo, double hi,
	double *v, struct ct_err *e)
{
	if (ct_cli_numbers(option, s, ',', n, spread, v, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		if (!(v[i] >= lo && v[i] <= hi))
			return ct_fail(
				e, CT_EUSAGE, "--%s: %g is outside [%g, %g]", option, v[i], lo, hi);
	return 0;
}

int ct_cli_list(const char *option, const char *s, size_t most, double lo, double hi, double *v,
	size_t *n, struct ct_err *e)
{
	*n = 1;
	for (const char *c = s; *c; c++)
		*n += *c == ',';
	if (*n > most)
		return ct_fail(
			e, CT_EUSAGE, "--%s: '%s' has more than %zu numbers", option, s, most);
	return ct_cli_within(option, s, *n, false, lo, hi, v, e);
}

int ct_cli_dims(const char *option, const char *s, size_t n, size_t *v, struct ct_err *e)
{
	double x[4];

	if (n > 4 || ct_cli_numbers(option, s, 'x', n, false, x, e))
		return -1;
	for (size_t i = 0; i < n; i++) {
		if (!(x[i] >= 1 && x[i] <= 1e6) || x[i] != floor(x[i]))
			return ct_fail(e, CT_EUSAGE, "--%s: '%s' is not a size", option, s);
		v[i] = (size_t)x[i];
	}
	return 0;
}

int ct_cli_range(const char *option, const char *s, double v[2], struct ct_err *e)
{
	if (ct_cli_numbers(option, s, ':', 2, false, v, e))
		return -1;
	if (!(v[0] < v[1]))
		return ct_fail(e, CT_EUSAGE, "--%s: '%s' is empty", option, s);
	return 0;
}

int ct_cli_memory(double *bytes, const char *text, struct ct_err *e)
{
	static const char units[] = "KMGT";
	const char *end, *unit;

	*bytes = 0;
	if (!text)
		return 0;
	*bytes = ct_number_begin(text, &end);
	unit = end != text && *end ? strchr(units, *end) : NULL;
	if (unit && !end[1])
		*bytes = ldexp(*bytes, 10 * (int)(unit - units + 1));
	if (!unit || end[1] || text[strspn(text, "0123456789.")] != *unit ||
		!(*bytes > 0 && *bytes < 0x1p50))
		return ct_fail(
			e, CT_EUSAGE, "--memory: '%.80s' is no size such as 600M or 2G", text);
	return 0;
}

void ct_table_put_word(FILE *f, const char *word, size_t n, const char *rest)
{
	static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
				    "0123456789_-+=.,:/@%";
	const bool is = n + strlen(rest) && strspn(word, plain) >= n && !rest[strspn(rest, plain)];

	fprintf(f, "%s%.*s", is ? "" : "'", (int)n, word);
	for (; *rest; rest++)
		*rest == '\'' ? fputs("'\\''", f) : fputc(*rest, f);
	fputs(is ? "" : "'", f);
}
