/* cli.c: see cli.h. The only file that prints, exits or reads the environment. */
#include "config.h"
#include "cli/cli.h"
#include "cli/progress.h"
#include "core/simd.h"
#include "core/mem.h"

#include <errno.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The options every tool has. */
struct common {
	bool help, version, mdoc, quiet, verbose, force, json, dry_run;
	int threads;
	const char *seed;
};

static const struct common common_defaults = {.threads = 0, .seed = "0"};

static const struct ct_opt common_opts[] = {
	CT_OPT(struct common, threads, 't', "threads", "N", 0, 4096,
		"use N threads; 0 asks CT_THREADS, OMP_NUM_THREADS, SLURM_CPUS_PER_TASK, then the "
		"processors this process may use. The output is the same for any N"),
	CT_OPT(struct common, force, 'f', "force", NULL, 0, 0, "overwrite existing output files"),
	CT_OPT(struct common, quiet, 'q', "quiet", NULL, 0, 0, "print errors only"),
	CT_OPT(struct common, verbose, 'v', "verbose", NULL, 0, 0, "print what is being done"),
	CT_OPT(struct common, help, 'h', "help", NULL, 0, 0, "print this help"),
	CT_OPT(struct common, version, 0, "version", NULL, 0, 0, "print the version"),
	CT_OPT_END,
};
static const struct ct_opt seed_opt =
	CT_OPT(struct common, seed, 's', "seed", "N", 0, 0, "seed of the random numbers");
static const struct ct_opt json_opt =
	CT_OPT(struct common, json, 0, "json", NULL, 0, 0, "print the report as JSON");
static const struct ct_opt dry_opt = CT_OPT(struct common, dry_run, 0, "dry-run", NULL, 0, 0,
	"print the time, memory and disk expected, and do nothing");

/* All options of a tool: its own, then the common ones; k-th or NULL. */
static const struct ct_opt *option(const struct ct_tool *t, size_t k, bool *common)
{
	const struct ct_opt *o = t->opts;

	*common = false;
	for (; o->type != CT_T_END; o++)
		if (k-- == 0)
			return o;
	*common = true;
	if ((t->flags & CT_SEEDED) && k-- == 0)
		return &seed_opt;
	if ((t->flags & CT_REPORTS) && k-- == 0)
		return &json_opt;
	if ((t->flags & CT_LONG) && k-- == 0)
		return &dry_opt;
	for (o = common_opts; o->type != CT_T_END; o++)
		if (k-- == 0)
			return o;
	return NULL;
}

static void word_at(char *out, size_t room, const char *words, int index)
{
	while (index-- > 0 && words) {
		words = strchr(words, '|');
		words = words ? words + 1 : NULL;
	}
	snprintf(out, room, "%.*s", words ? (int)strcspn(words, "|") : 0, words ? words : "");
}

static void put_default(const struct ct_opt *o, const void *defaults)
{
	const void *p = (const char *)defaults + o->at;
	char word[40];

	switch (o->type) {
	case CT_T_INT:
		if (o->choice) {
			word_at(word, sizeof word, o->arg, *(const int *)p);
			printf(" (default %s)", word);
		} else
			printf(" (default %d)", *(const int *)p);
		break;
	case CT_T_REAL:
		if (!isnan(*(const double *)p))
			printf(" (default %g)", *(const double *)p);
		break;
	case CT_T_STR:
		if (*(const char *const *)p)
			printf(" (default %s)", *(const char *const *)p);
		break;
	case CT_T_FLAG:
	case CT_T_LIST:
	case CT_T_END: break;
	}
}

static void synopsis(const struct ct_tool *t)
{
	printf("Usage: %s [OPTION]...", t->name);
	for (const struct ct_opt *o = t->opts; o->type != CT_T_END; o++)
		if (!o->name)
			printf(o->optional ? " [%s]%s" : " %s%s", o->arg,
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

static void help(const struct ct_tool *t)
{
	const struct ct_opt *o;
	bool common;

	synopsis(t);
	printf("\n%s\n\n", t->brief);
	for (size_t k = 0; (o = option(t, k, &common)); k++) {
		char left[80];
		int n;

		if (!o->name)
			snprintf(left, sizeof left, "  %s", o->arg);
		else
			snprintf(left, sizeof left, "  %c%c%c --%s%s%s", o->c ? '-' : ' ',
				o->c ? o->c : ' ', o->c ? ',' : ' ', o->name, o->arg ? "=" : "",
				o->arg ? o->arg : "");
		n = printf("%-25s", left);
		fold(25, (size_t)n, o->help);
		put_default(o, common ? (const void *)&common_defaults : t->defaults);
		putchar('\n');
	}
	fputs("\nExit status: 0 done, 1 failed, 2 usage, 3 input invalid, 4 output not writable,\n"
	      "5 geometry refused, 6 numerical failure, 7 no memory, 75 stopped on request.\n",
		stdout);
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

static void mdoc(const struct ct_tool *t)
{
	const struct ct_opt *o;
	bool common;

	puts(".Bl -tag -width Ds");
	for (size_t k = 0; (o = option(t, k, &common)); k++) {
		if (!o->name)
			continue;
		fputs(".It ", stdout);
		if (o->c)
			printf("Fl %c , ", o->c);
		printf("Fl \\-%s%s%s\n", o->name, o->arg ? " Ns = Ns Ar " : "",
			o->arg ? o->arg : "");
		sentences(o->help);
		put_default(o, common ? (const void *)&common_defaults : t->defaults);
		puts(".");
	}
	puts(".El");
}

static int set_number(
	const struct ct_opt *o, void *p, const char *name, const char *s, struct ct_err *e)
{
	char *end;
	double x;

	errno = 0;
	if (o->type == CT_T_INT) {
		long v = strtol(s, &end, 10);

		if (end == s || *end || errno || v < INT_MIN || v > INT_MAX)
			return ct_fail(e, CT_EUSAGE, "%s: '%s' is not an integer", name, s);
		*(int *)p = (int)v;
		x = (double)v;
	} else {
		x = strtod(s, &end);
		if (end == s || *end || !isfinite(x))
			return ct_fail(e, CT_EUSAGE, "%s: '%s' is not a number", name, s);
		*(double *)p = x;
	}
	if (o->lo < o->hi && (x < o->lo || x > o->hi))
		return ct_fail(e, CT_EUSAGE, "%s: %g is outside [%g, %g]", name, x, o->lo, o->hi);
	return 0;
}

static int set_choice(
	const struct ct_opt *o, int *p, const char *name, const char *s, struct ct_err *e)
{
	int i = ct_words_find(o->arg, s);

	if (i >= 0) {
		*p = i;
		return 0;
	}
	return ct_fail(e, CT_EUSAGE, "%s: '%s' is not one of %s", name, s, o->arg);
}

static int set(const struct ct_opt *o, void *params, const char *s, struct ct_err *e)
{
	void *p = (char *)params + o->at;
	char name[60];

	snprintf(name, sizeof name, "%s%s", o->name ? "--" : "", o->name ? o->name : o->arg);
	switch (o->type) {
	case CT_T_FLAG: *(bool *)p = true; return 0;
	case CT_T_STR: *(const char **)p = s; return 0;
	case CT_T_INT:
	case CT_T_REAL:
		return o->choice ? set_choice(o, p, name, s, e) : set_number(o, p, name, s, e);
	case CT_T_LIST:
	case CT_T_END: break;
	}
	return 0;
}

struct parser {
	const struct ct_tool *t;
	void *params;
	struct common *common;
	const struct ct_opt *operand; /* next one */
	const char **list;            /* room for repeated operands */
	size_t nlist;
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
	return set(s->operand++, s->params, a, e);
}

/* A long option may be cut short while that stays unique. */
static const struct ct_opt *find(
	const struct ct_tool *t, const char *a, size_t n, char c, bool *common)
{
	const struct ct_opt *o, *hit = NULL;
	bool is_common, hit_common = false;
	int hits = 0;

	for (size_t k = 0; (o = option(t, k, &is_common)); k++) {
		bool exact;

		if (!o->name || (c ? o->c != c : strncmp(o->name, a, n) != 0))
			continue;
		exact = c || strlen(o->name) == n;
		hits++;
		hit = o;
		hit_common = is_common;
		if (exact) {
			hits = 1;
			break;
		}
	}
	*common = hit_common;
	return hits == 1 ? hit : NULL;
}

static int parse_option(struct parser *s, char **argv, int *i, struct ct_err *e)
{
	const char *a = argv[*i], *val = NULL;
	const struct ct_opt *o;
	bool common, more;

	if (strcmp(a, "--mdoc-options") == 0) {
		s->common->mdoc = true;
		return 0;
	}
	if (a[1] == '-') {
		const char *eq = strchr(a, '=');

		o = find(s->t, a + 2, eq ? (size_t)(eq - a - 2) : strlen(a + 2), 0, &common);
		val = eq ? eq + 1 : NULL;
		if (!o)
			return ct_fail(e, CT_EUSAGE, "unknown option '%s'", a);
		if (o->type == CT_T_FLAG && val)
			return ct_fail(e, CT_EUSAGE, "option '%s' takes no value", a);
		if (o->type != CT_T_FLAG && !val && !(val = argv[++*i]))
			return ct_fail(e, CT_EUSAGE, "option '%s' needs a value", a);
		return set(o, common ? (void *)s->common : s->params, val, e);
	}
	do { /* -fq is -f -q; -x4 is -x 4 */
		o = find(s->t, NULL, 0, *++a, &common);
		if (!o)
			return ct_fail(e, CT_EUSAGE, "unknown option '-%c'", *a);
		more = o->type == CT_T_FLAG && a[1];
		if (o->type != CT_T_FLAG) {
			val = a[1] ? a + 1 : argv[++*i];
			if (!val)
				return ct_fail(e, CT_EUSAGE, "option '-%c' needs a value", *a);
		}
		if (set(o, common ? (void *)s->common : s->params, val, e))
			return -1;
	} while (more);
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
		} else if (parse_option(s, argv, &i, e))
			return -1;
	}
	if (s->common->help || s->common->version || s->common->mdoc)
		return 0;
	while (s->operand->type != CT_T_END && (s->operand->name || s->operand->optional ||
						       (s->operand->type == CT_T_LIST && s->nlist)))
		s->operand++;
	return s->operand->type != CT_T_END ? ct_fail(e, CT_EUSAGE, "missing %s", s->operand->arg)
					    : 0;
}

static size_t threads_wanted(int flag)
{
	static const char *const names[] = {"CT_THREADS", "OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK"};
	cpu_set_t set;

	if (flag > 0)
		return (size_t)flag;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		const char *s = getenv(names[i]);
		long v = s ? strtol(s, NULL, 10) : 0;

		if (v > 0 && v <= 4096)
			return (size_t)v;
	}
	if (sched_getaffinity(0, sizeof set, &set) == 0)
		return (size_t)CPU_COUNT(&set);
	return 1;
}

static volatile sig_atomic_t stop_asked;

static void on_signal(int sig)
{
	if (stop_asked) { /* asked twice: go now */
		signal(sig, SIG_DFL);
		raise(sig);
	}
	stop_asked = 1;
}

static void catch_signals(void)
{
	static const int sigs[] = {SIGINT, SIGTERM, SIGUSR1};
	struct sigaction sa = {.sa_handler = on_signal, .sa_flags = SA_RESTART};

	sigemptyset(&sa.sa_mask);
	for (size_t i = 0; i < sizeof sigs / sizeof *sigs; i++)
		sigaction(sigs[i], &sa, NULL);
}

static void say(const struct ct_env *env, enum ct_level level, const char *text)
{
	ct_progress_clear(env->ctx);
	fprintf(stderr, "%s: %s%s\n", env->tool, level == CT_WARN ? "warning: " : "", text);
}

/* The option that argument `a` is, if it cannot change the result and so stays out of the history.
 */
static const struct ct_opt *idle_option(const struct ct_tool *t, const char *a)
{
	static const char *const names[] = {"quiet", "verbose", "force", "threads", "resume"};
	const struct ct_opt *o = NULL;
	bool common;

	if (a[0] == '-' && a[1] == '-' && a[2])
		o = find(t, a + 2, strcspn(a + 2, "="), 0, &common);
	else if (a[0] == '-' && a[1] && !a[2])
		o = find(t, NULL, 0, a[1], &common);
	for (size_t k = 0; o && k < sizeof names / sizeof *names; k++)
		if (strcmp(o->name, names[k]) == 0)
			return o;
	return NULL;
}

static char *history_of(const struct ct_tool *t, int argc, char **argv)
{
	char *text = NULL;
	bool only_operands = false;
	size_t n;
	FILE *f = open_memstream(&text, &n);

	if (!f)
		return NULL;
	fprintf(f, "%s %s", t->name, PACKAGE_VERSION);
	for (int i = 1; i < argc; i++) {
		const struct ct_opt *o = only_operands ? NULL : idle_option(t, argv[i]);

		only_operands |= strcmp(argv[i], "--") == 0;
		if (o) {
			i += o->type != CT_T_FLAG && !strchr(argv[i], '=');
			continue;
		}
		fprintf(f, strpbrk(argv[i], " \t\n\"'\\$") ? " '%s'" : " %s", argv[i]);
	}
	if (fclose(f) != 0) {
		free(text);
		return NULL;
	}
	return text;
}

static int run(const struct ct_tool *t, const void *params, const struct common *c, int argc,
	char **argv, struct ct_err *e)
{
	struct ct_progress bar = {.on = !c->quiet && isatty(STDERR_FILENO)};
	struct ct_env env = {.verbose = c->quiet ? -1 : c->verbose,
		.force = c->force,
		.json = c->json,
		.dry_run = c->dry_run,
		.tool = t->name,
		.stop = &stop_asked,
		.log = say,
		.progress = ct_progress_draw,
		.ctx = &bar};
	char *end, *history;
	int rc;

	errno = 0;
	env.seed = strtoull(c->seed, &end, 10);
	if (end == c->seed || *end || errno || *c->seed == '-')
		return ct_fail(e, CT_EUSAGE, "--seed: '%s' is not an integer", c->seed);
	history = history_of(t, argc, argv);
	env.history = history;
	catch_signals();
	rc = ct_par_alloc(&env.par, threads_wanted(c->threads), e) || t->run(params, &env, e);
	ct_par_free(env.par);
	ct_progress_clear(&bar);
	free(history);
	return rc;
}

int ct_cli_main(const struct ct_tool *t, int argc, char **argv)
{
	struct ct_err e = {0};
	struct common common = common_defaults;
	struct parser s = {.t = t, .common = &common, .operand = t->opts};
	int rc;

	setlocale(LC_ALL, "C");
	s.params = malloc(t->size ? t->size : 1);
	s.list = malloc(((size_t)argc + 1) * sizeof *s.list);
	if (!s.params || !s.list)
		rc = ct_fail(&e, CT_ENOMEM, "no memory");
	else
		rc = parse(&s, argc, argv, &e) || ct_simd_use(getenv("CTSR_CPU"), &e) ? -1 : 0;
	if (rc == 0 && common.help)
		help(t);
	else if (rc == 0 && common.version)
		printf("%s (%s) %s\n", t->name, PACKAGE_NAME, PACKAGE_VERSION);
	else if (rc == 0 && common.mdoc)
		mdoc(t);
	else if (rc == 0)
		rc = run(t, s.params, &common, argc, argv, &e);
	free(s.params);
	free(s.list);
	if ((fflush(stdout) != 0 || ferror(stdout)) && rc == 0)
		rc = ct_fail(&e, CT_EOUTPUT, "standard output: %s", strerror(errno));
	if (rc == 0)
		return 0;
	fprintf(stderr, "%s: %s\n", t->name, e.msg);
	if (e.code == CT_EUSAGE)
		fprintf(stderr, "Try '%s --help'.\n", t->name);
	return e.code == CT_OK ? CT_EFAIL : (int)e.code;
}
