/* cli.c: see cli.h. Only src/cli and src/tools print, exit or read the environment.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/modes.h"
#include "cli/progress.h"
#include "cli/stop.h"
#include "cli/table.h"
#include "core/clock.h"
#include "core/simd.h"
#include "core/inflate.h"
#include "core/memory.h"
#include "core/stream.h"

#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

struct parser {
	const struct ct_tool *t;
	void *params;
	struct ct_common *common;
	const struct ct_opt *operand; /* next one */
	const char **list;            /* room for repeated operands */
	size_t nlist;
	struct ct_given given;
	bool *row;      /* of given */
	bool *idle;     /* of each word: it says how to work, not what to make */
	char **experts; /* the texts of --expert, cut into values */
	size_t nexperts;
	int (*show)(const struct ct_tool *t, struct ct_err *e); /* in place of the run; or NULL */
	FILE *behind;                                           /* what follows an error; or NULL */
};

static int set_operand(struct parser *s, const char *a, struct ct_err *e)
{
	while (s->operand->type != CT_T_END && s->operand->name)
		s->operand++;
	if (s->operand->type == CT_T_END)
		return ct_fail(e, CT_EUSAGE, "extra operand '%s'", a);
	if (s->operand->type == CT_T_LIST) {
		struct ct_list *l = (void *)((char *)s->params + s->operand->at);

		s->list[s->nlist++] = a;
		*l = (struct ct_list){s->nlist, s->list};
		return 0;
	}
	return ct_table_set(s->operand++, s->params, a, e);
}

static int take(struct parser *s, const struct ct_opt *o, const char *value, struct ct_err *e)
{
	if (!o->common)
		s->row[o - s->t->opts] = true;
	return ct_table_set(o, o->common ? (void *)s->common : s->params, value, e);
}

/* The n letters at `key`; of o, without a value. */
static int unknown_key(const struct ct_tool *t, const char *key, size_t n, const struct ct_opt *o,
	struct ct_err *e)
{
	struct ct_words_guess g = {.word = key, .n = n};
	char hint[CT_WORDS_HINT];

	if (o)
		return ct_fail(e, CT_EUSAGE, "--expert: '%s' has no value: %s=%s", o->name, o->name,
			o->arg);
	for (size_t k = 0; (o = ct_table_expert(t, k)); k++)
		ct_words_guess(&g, o->name, strlen(o->name));
	return ct_fail(e, CT_EUSAGE, "--expert: '%.*s' is not one of its keys; --help lists them%s",
		(int)n, key, ct_words_hint(hint, &g, ""));
}

/* "key=value,key=value": a part without "=" belongs to the value before it. */
static int take_experts(struct parser *s, const char *text, struct ct_err *e)
{
	char *at = strdup(text), *next;

	if (!at)
		return ct_fail(e, CT_ENOMEM, "no memory");
	s->experts[s->nexperts++] = at;
	for (; at; at = next) {
		const size_t n = strcspn(at, "=,");
		const struct ct_opt *o;
		size_t k = 0;

		while ((o = ct_table_expert(s->t, k++)) &&
			(strlen(o->name) != n || strncmp(o->name, at, n) != 0))
			;
		if (!o || at[n] != '=')
			return unknown_key(s->t, at, n, o, e);
		for (next = strchr(at, ','); next; next = strchr(next + 1, ','))
			if (next[1 + strcspn(next + 1, "=,")] == '=')
				break;
		if (next)
			*next++ = '\0';
		if (take(s, o, at + n + 1, e))
			return -1;
	}
	return 0;
}

/* What make asks of each command, for its man page, and what other programs do.
 * Not of an option behind that. */
static bool parse_hidden(struct parser *s, const char *a)
{
	static const struct {
		const char *word;
		int (*show)(const struct ct_tool *t, struct ct_err *e);
	} hidden[] = {{"--mdoc-options", ct_table_show_mdoc}, {"--describe", ct_table_show_json},
		{"--xml", ct_table_show_xml}};

	for (size_t k = 0; k < sizeof hidden / sizeof *hidden; k++)
		if (strcmp(a, hidden[k].word) == 0)
			s->show = hidden[k].show;
	return s->show != NULL;
}

bool ct_cli_is_idle(const char *name)
{
	static const char *const names[] = {
		"quiet", "verbose", "force", "threads", "resume", "expand", "memory"};

	for (size_t k = 0; k < sizeof names / sizeof *names; k++)
		if (strcmp(name, names[k]) == 0)
			return true;
	return false;
}

/* "--name" or "--name=value". */
static int unknown(const struct ct_tool *t, const char *a, struct ct_err *e)
{
	struct ct_words_guess g = {.word = a + 2, .n = strcspn(a + 2, "=")};
	const struct ct_opt *o;
	char hint[CT_WORDS_HINT];

	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		if (o->name)
			ct_words_guess(&g, o->name, strlen(o->name));
	if (g.near)
		ct_words_hint(hint, &g, "--");
	else { /* a key where an option was meant */
		for (size_t k = 0; (o = ct_table_expert(t, k)); k++)
			ct_words_guess(&g, o->name, strlen(o->name));
		ct_words_hint(hint, &g, "--expert ");
	}
	return ct_fail(e, CT_EUSAGE, "unknown option '%s'%s", a, hint);
}

static int parse_option(struct parser *s, char **argv, int *i, struct ct_err *e)
{
	const char *a = argv[*i], *val = NULL;
	const int first = *i;
	const struct ct_opt *o;
	bool idle = true, more;

	if (a[1] == '-') {
		const char *eq = strchr(a, '=');

		o = ct_table_find(s->t, a + 2, eq ? (size_t)(eq - a - 2) : strlen(a + 2), 0);
		val = eq ? eq + 1 : NULL;
		if (!o)
			return unknown(s->t, a, e);
		if (o->type == CT_T_FLAG && val)
			return ct_fail(e, CT_EUSAGE, "option '%s' takes no value", a);
		if (!val)
			val = o->alone;
		if (o->type != CT_T_FLAG && !val && !(val = argv[++*i]))
			return ct_fail(e, CT_EUSAGE, "option '%s' needs a value", a);
		if (o->common && strcmp(o->name, "expert") == 0)
			return take_experts(s, val, e);
		s->idle[first] = s->idle[*i] = ct_cli_is_idle(o->name);
		return take(s, o, val, e);
	}
	do { /* -fq is -f -q; -x4 is -x 4 */
		o = ct_table_find(s->t, NULL, 0, *++a);
		if (!o)
			return ct_fail(e, CT_EUSAGE, "unknown option '-%c'", *a);
		more = o->type == CT_T_FLAG && a[1];
		if (o->type != CT_T_FLAG) {
			val = a[1] ? a + 1 : argv[++*i];
			if (!val)
				return ct_fail(e, CT_EUSAGE, "option '-%c' needs a value", *a);
		}
		idle &= ct_cli_is_idle(o->name);
		if (take(s, o, val, e))
			return -1;
	} while (more);
	s->idle[first] = s->idle[*i] = idle;
	return 0;
}

static int version(const struct ct_tool *t, struct ct_err *e)
{
	(void)e;
	printf("%s (%s) %s\n", t->name, PACKAGE_NAME, PACKAGE_VERSION);
	return 0;
}

static int parse(struct parser *s, int argc, char **argv, struct ct_err *e)
{
	bool only_operands = false;

	memcpy(s->params, s->t->defaults, s->t->size);
	for (int i = 1; i < argc; i++) {
		const char *a = argv[i];

		if (!only_operands && strcmp(a, "--") == 0)
			only_operands = true;
		else if (only_operands || a[0] != '-' || a[1] == '\0') {
			if (set_operand(s, a, e))
				return -1;
		} else if (!parse_hidden(s, a) && parse_option(s, argv, &i, e))
			return -1;
	}
	if (s->common->version)
		s->show = version;
	if (s->common->help)
		s->show = ct_table_show_help;
	if (s->show)
		return 0;
	while (s->operand->type != CT_T_END && (s->operand->name || s->operand->optional ||
						       (s->operand->type == CT_T_LIST && s->nlist)))
		s->operand++;
	if (s->operand->type != CT_T_END)
		return ct_fail(e, CT_EUSAGE, "missing %s", ct_table_operand(s->operand));
	if (s->common->json && !s->common->dry_run && !(s->t->flags & (CT_REPORTS | CT_TELLS)))
		return ct_fail(e, CT_EUSAGE, "--json: needs --dry-run");
	return ct_err_any(
		ct_files_names(s->t, s->params, e) || ct_modes_check(&s->given, s->params, e));
}

static size_t threads_wanted(int flag)
{
	static const char *const names[] = {"CT_THREADS", "OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK"};
	cpu_set_t set;

	if (flag > 0)
		return (size_t)flag;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		const char *s = getenv(names[i]);
		const char *end = NULL;
		const double v = s ? ct_number_begin(s, &end) : 0;

		/* OMP_NUM_THREADS may be a list, one for each level of nesting */
		if (v >= 1 && v <= 4096 && v == floor(v) && (!*end || *end == ','))
			return (size_t)v;
	}
	if (sched_getaffinity(0, sizeof set, &set) == 0)
		return (size_t)CPU_COUNT(&set);
	return 1;
}

/* A line of the log, at once, so that those of commands that run at the same time stay whole. */
static void put_log(const struct ct_env *env, const char *what, const char *text)
{
	const char *path = getenv(CT_LOG_NAME);
	char line[900];
	size_t n;
	int fd;

	if (!path || !*path || env->command->dry_run ||
		snprintf(line, sizeof line - 1, "%s: %s%s", env->tool, what, text) < 0)
		return;
	for (char *c = line; *c; c++)
		if ((unsigned char)*c < ' ' || *c == 127)
			*c = '?';
	n = strlen(line);
	line[n++] = '\n';
	fd = open(path, O_WRONLY | O_APPEND | O_NOCTTY);
	if (fd < 0)
		return;
	if (write(fd, line, n) < 0)
		errno = 0;
	close(fd);
}

static void log_end(const struct ct_env *env, double start, int status)
{
	char text[200];

	snprintf(text, sizeof text, "%.1f s, %.1f s of CPU time, %.0f MiB", ct_clock_wall() - start,
		ct_clock_cpu(), ct_memory_held() / 0x1p20);
	put_log(env, status ? "failed after " : "took ", text);
}

static void say(const struct ct_env *env, enum ct_level level, const char *text)
{
	if (level == CT_BEHIND && env->command->behind) {
		fprintf(env->command->behind, "%s: %s\n", env->tool, text);
		return;
	}
	if (level == CT_WARN)
		put_log(env, "warning: ", text);
	if (level == CT_WARN && env->command->notes)
		fprintf(env->command->notes, "%s: warning: %s\n", env->tool, text);
	if (level == CT_TOLD)
		put_log(env, "", text);
	if (level == CT_TOLD && env->command->notes)
		fprintf(env->command->notes, "%s: %s\n", env->tool, text);
	if ((level == CT_TOLD ? 0 : (int)level) > env->verbose)
		return;
	ct_progress_clear(env->ctx);
	fprintf(stderr, "%s: %s%s\n", env->tool, level == CT_WARN ? "warning: " : "", text);
}

/* The name behind "--option=", or the word. */
static const char *named(const char *word)
{
	const char *equals = strchr(word, '=');

	return word[0] == '-' && word[1] == '-' && equals ? equals + 1 : word;
}

/* Files by their names alone: where they lay is nobody's business and would make the same data
 * differ. With --deid their names are not told either. */
void ct_cli_put_history(FILE *f, const char *word, ct_cli_hidden *hidden, const void *ctx)
{
	const char *name = named(word), *by = hidden ? hidden(ctx, name) : NULL;
	const size_t option = (size_t)(name - word);

	for (const char *c = name; *c; c++)
		if (*c == '/' && c[1] && c[1] != '/')
			name = c + 1;
	fputc(' ', f);
	ct_table_put_word(f, word, option, by ? by : name);
}

static const char *hidden(const void *parser, const char *name)
{
	const struct parser *s = parser;

	return ct_files_hidden(s->t->opts, s->params, name);
}

static int put_command(char **text, const struct parser *s, int argc, char **argv, struct ct_err *e)
{
	size_t n;
	FILE *f;

	if (ct_stream_open(&f, text, &n, e))
		return -1;
	fprintf(f, "%s %s", s->t->name, PACKAGE_VERSION);
	for (int i = 1; i < argc; i++)
		if (!s->idle[i])
			ct_cli_put_history(f, argv[i], hidden, s);
	return ct_stream_close(f, text, e);
}

static void progress(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	ct_stop_test();
	ct_progress_draw(env, what, done, total, likely);
}

/* Room for what is on the stack of this thread, which else ends with SIGSEGV: its limit is looked
 * at when it grows, so it can still be raised. */
static int have_stack(struct ct_err *e)
{
	enum { LEAST = 1 << 20 };
	struct rlimit limit;

	if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= LEAST)
		return 0;
	limit.rlim_cur = LEAST;
	if (limit.rlim_max < LEAST)
		limit.rlim_max = LEAST;
	return setrlimit(RLIMIT_STACK, &limit) == 0
		       ? 0
		       : ct_fail(e, CT_ENOMEM,
				 "the stack is limited to less than %d KiB: raise it with ulimit -s %d",
				 LEAST / 1024, LEAST / 1024);
}

static enum ct_progress_how progress_how(
	const struct ct_tool *t, const struct ct_common *c, const void *params)
{
	if (getenv("SLICER_HOME") && !(t->flags & CT_REPORTS) && !c->json && !c->dry_run &&
		!ct_files_write_stdout(t->opts, params))
		return CT_PROGRESS_SLICER;
	return c->quiet                ? CT_PROGRESS_NONE
	       : isatty(STDERR_FILENO) ? CT_PROGRESS_TERMINAL
				       : CT_PROGRESS_PIPE;
}

static int run(const struct parser *s, int argc, char **argv, struct ct_err *e)
{
	const struct ct_tool *t = s->t;
	const struct ct_common *c = s->common;
	const void *params = s->params;
	struct ct_progress bar = {.how = progress_how(t, c, params)};
	const struct ct_io_rule files = {
		.force = c->force || getenv("MAKELEVEL"), /* make asks for what is out of date */
		.units = c->units};
	const struct ct_command command = {
		.given = s->given, .json = c->json, .dry_run = c->dry_run, .behind = s->behind};
	struct ct_env env = {.files = &files,
		.command = &command,
		.verbose = c->quiet ? -1 : c->verbose,
		.tool = t->name,
		.stop = ct_stop_flag(),
		.log = say,
		.progress = progress,
		.ctx = &bar};
	const double start = ct_clock_wall();
	char *history;
	int rc;

	if (!ct_number_u64(&env.seed, c->seed))
		return ct_fail(e, CT_EUSAGE, "--seed: '%s' is not an integer", c->seed);
	if (put_command(&history, s, argc, argv, e))
		return -1;
	env.history = history;
	ct_inflate_allow((unsigned)c->expand);
	rc = have_stack(e) || ct_stop_catch(t->name, e) ||
	     ct_files_check(t->opts, params, &env, e) ||
	     ct_par_alloc(&env.par, threads_wanted(c->threads), e) || t->run(params, &env, e);
	ct_par_free(env.par);
	ct_progress_clear(&bar);
	log_end(&env, start, rc);
	free(history);
	return rc;
}

static size_t rows_of(const struct ct_tool *t)
{
	size_t n = 1;

	for (const struct ct_opt *o = t->opts; o->type != CT_T_END; o++)
		n++;
	return n;
}

int ct_cli_main(const struct ct_tool *t, int argc, char **argv)
{
	struct ct_err e = {0};
	struct ct_common common = ct_common_defaults;
	struct parser s = {.t = t, .common = &common, .operand = t->opts};
	const char *tmp = getenv("TMPDIR");
	char *behind = NULL;
	size_t length = 0;
	int rc;

	setlocale(LC_ALL, "C");
	if (tmp && !*tmp) /* as if it were not set, in libraries too */
		unsetenv("TMPDIR");
	if (argc > 2 && strcmp(argv[1], "--complete") == 0) {
		ct_table_complete(t, argc - 2, argv + 2);
		return fflush(stdout) == 0 ? 0 : CT_EOUTPUT;
	}
	s.params = malloc(t->size ? t->size : 1);
	s.list = malloc(((size_t)argc + 1) * sizeof *s.list);
	s.row = calloc(rows_of(t), sizeof *s.row);
	s.idle = calloc((size_t)argc + 1, sizeof *s.idle);
	s.experts = malloc(((size_t)argc + 1) * sizeof *s.experts);
	s.given = (struct ct_given){t, s.row};
	s.behind = open_memstream(&behind, &length);
	if (!s.params || !s.list || !s.row || !s.idle || !s.experts)
		rc = ct_fail(&e, CT_ENOMEM, "no memory");
	else
		rc = ct_err_any(parse(&s, argc, argv, &e) || ct_simd_use(getenv("CTSR_CPU"), &e));
	if (rc == 0)
		rc = s.show ? s.show(t, &e) : run(&s, argc, argv, &e);
	free(s.params);
	free(s.list);
	free(s.row);
	free(s.idle);
	while (s.nexperts)
		free(s.experts[--s.nexperts]);
	free(s.experts);
	if ((fflush(stdout) != 0 || ferror(stdout)) && rc == 0)
		rc = ct_fail(&e, CT_EOUTPUT, "standard output: %s", strerror(errno));
	if (s.behind)
		fclose(s.behind);
	if (rc == 0) {
		free(behind);
		return 0;
	}
	fprintf(stderr, "%s: %s\n", t->name, e.msg);
	if (behind && length > 0)
		fputs(behind, stderr);
	free(behind);
	if (e.code == CT_EUSAGE)
		fprintf(stderr, "Try '%s --help'.\n", t->name);
	if (e.code == CT_ENOMEM) /* libraries that had none do not all end well */
		_exit(CT_ENOMEM);
	return e.code == CT_OK ? CT_EFAIL : (int)e.code;
}
