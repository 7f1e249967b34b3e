/* --help, the OPTIONS of a man page, which modes take an option, what a run costs and
 * how far it is: to the letter.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost-report.h"
#include "cli/modes.h"
#include "cli/progress.h"
#include "cli/table.h"
#include "capture.h"

#define COLOURS(X) X(RED, "red") X(GREEN, "green") X(BLUE, "blue")
enum colour { COLOURS(CT_WORD_VALUE) };

struct params {
	bool flag, other;
	int n, word;
	double x, none;
	const char *text, *path, *in, *out;
	struct ct_list more;
};
static const struct params defaults = {
	.flag = true, .n = -3, .word = 1, .x = 1234567.8, .none = (double)NAN, .text = "abc"};
static struct capture shown;
#define P struct params
#define CT_PARAMS P
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", "what is read"),
	CT_ARG(more, CT_READS, "MORE", "what else"),
	CT_ARG_CHOICE(word, "COLOUR", CT_WORDS(COLOURS), "its colour"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_IF(CT_IF(flag), CT_ENDS_VOLUME "|a", "d"),
		"what is written", .optional = true),
	CT_FLAG(flag, 'a', "flag", "a flag. It stands for nothing. E.g. this"),
	CT_OPT(n, 'n', "number", "N", -9, 9,
		"words that fill a line of the help to its last column and so does the second of them, too: it is as long as that. Yes",
		CT_WHEN(CT_IF(flag))),
	CT_OPT(x, 0, "real", "X", 0, 0, "one",
		CT_WHEN(CT_IF_WORD(word, CT_BIT(0) | CT_BIT(2)), CT_IF_FILE(out), CT_UNLESS(text),
			CT_IF(path))),
	CT_OPT(none, 0, "none", "X", 0, 0, "none",
		CT_WHEN(CT_UNLESS(flag), CT_UNLESS_WORD(word, CT_BIT(1)))),
	CT_CHOICE(word, 'w', "word", CT_WORDS(COLOURS), "a word"),
	CT_TEXT(text, 0, "text", "S", "text", CT_WHEN(CT_IF(more), CT_IF(none))),
	CT_TEXT(path, 0, "a-long-name-of-a-path", "FILE",
		"a word-that-is-longer-than-any-line-has-room-for-and-so-has-one-of-its-own end",
		CT_WHEN(CT_UNLESS(n))),
	CT_FLAG(other, 0, "other", ""),
	CT_OPT_END,
};

/* A row for each kind of condition, called by the letters from a on. */
#define ROW(name, ...) CT_OPT(other, 0, name, NULL, 0, 0, "", CT_WHEN(__VA_ARGS__))
static const struct ct_opt mode_opts[] = {
	CT_ARG(out, CT_READS, "OUT", ""),
	CT_ARG(more, CT_READS, "MORE", ""),
	CT_FLAG(flag, 0, "flag", ""),
	CT_OPT(n, 0, "number", "N", 0, 0, ""),
	CT_OPT(x, 0, "real", "X", 0, 0, ""),
	CT_OPT(none, 0, "none", "X", 0, 0, ""),
	CT_TEXT(text, 0, "text", "S", ""),
	CT_TEXT(path, 0, "path", "S", ""),
	CT_CHOICE(word, 0, "word", CT_WORDS(COLOURS), ""),
	ROW("a", CT_IF(flag)),
	ROW("b", CT_IF(n)),
	ROW("c", CT_IF(x)),
	ROW("d", CT_IF(none)),
	ROW("e", CT_IF(text)),
	ROW("f", CT_IF(path)),
	ROW("g", CT_IF(more)),
	ROW("h", CT_IF_WORD(word, CT_BIT(0) | CT_BIT(2))),
	ROW("i", CT_IF_FILE(out)),
	ROW("j", CT_UNLESS(n)),
	ROW("k", CT_UNLESS_WORD(word, CT_BIT(1))),
	ROW("l", CT_IF(flag), CT_IF(n)),
	ROW("m", CT_UNLESS(flag), CT_UNLESS(n)),
	ROW("n", CT_ALWAYS, CT_UNLESS(flag), CT_IF(x), CT_IF(n)),
	ROW("o", CT_ALWAYS),
	CT_OPT_END,
};
static const struct ct_tool mode_tool = {.name = "ct-m",
	.brief = "",
	.opts = mode_opts,
	.defaults = &defaults,
	.size = sizeof defaults};

/* The letters of the rows that are taken. */
static const char *taken(struct params p)
{
	static char letters[40];
	size_t n = 0;

	for (size_t k = 0; k + 1 < sizeof mode_opts / sizeof *mode_opts; k++) {
		bool row[sizeof mode_opts / sizeof *mode_opts] = {0};
		struct ct_given given = {&mode_tool, row};
		struct ct_err e = {0};

		row[k] = true;
		if (ct_modes_check(&given, &p, &e) == 0 && mode_opts[k].name &&
			!mode_opts[k].name[1])
			letters[n++] = mode_opts[k].name[0];
	}
	letters[n] = '\0';
	return letters;
}
#define TAKES(want, change)                                                                        \
	do {                                                                                       \
		struct params p = defaults;                                                        \
		p.out = "-";                                                                       \
		change;                                                                            \
		OK(is_text(taken(p), want), "modes: %s", #change);                                 \
	} while (0)

static void test_modes(void)
{
	const char abc[] = "abc", *const abd[] = {"abd"};
	bool row[sizeof mode_opts / sizeof *mode_opts];
	const struct ct_given given = {&mode_tool, row};
	struct ct_err e = {0};

	memset(row, true, sizeof row);
	OK(ct_modes_check(&given, &defaults, &e) == -1 && e.code == CT_EUSAGE &&
			is_text(e.msg, "--a: needs --flag"),
		"the first that is not taken is told");
	TAKES("jmo", (void)0);
	TAKES("ajlo", p.flag = false);
	TAKES("blno", p.n = 4);
	TAKES("ablo", p.flag = false; p.n = 4);
	TAKES("cjmno", p.x = 3);
	TAKES("djmo", p.none = 3);
	TAKES("jmo", p.text = abc); /* its content counts */
	TAKES("ejmo", p.text = *abd);
	TAKES("ejmo", p.text = NULL);
	TAKES("fjmo", p.path = "");
	TAKES("gjmo", p.more = ((struct ct_list){1, abd}));
	TAKES("hjkmo", p.word = 0);
	TAKES("hjkmo", p.word = 2);
	TAKES("ijmo", p.out = "o");
}

static bool costs(struct ct_cost c, bool json, const char *want)
{
	const struct ct_command command = {.json = json};
	const struct ct_env env = {.command = &command};
	struct ct_err e = {0};
	int rc;

	capture_begin(&shown);
	rc = ct_cost_print(&c, &env, &e);
	capture_end(&shown);
	return rc == 0 && is_text(shown.out, want);
}

static void test_cost(void)
{
	const double mib = 0x1p20;

	OK(costs((struct ct_cost){"3 steps", 0.2, 1.5 * mib, mib, 0}, false,
		   "work      3 steps\ntime      1 s on 1 threads\nmemory    2 MiB\ndisk      1 MiB\n"),
		"a cost is no less than it is");
	OK(costs((struct ct_cost){"", 7199.5, 3 * mib + 1, 0, 5 * mib}, false,
		   "time      7200 s on 1 threads\nmemory    4 MiB\n"
		   "disk      0 MiB, and 5 MiB of state beside it\n"),
		"seconds up to two hours, and a state");
	OK(costs((struct ct_cost){"w", 7200, 0, 0, 0}, false,
		   "work      w\ntime      2.0 h on 1 threads\nmemory    0 MiB\ndisk      0 MiB\n"),
		"then hours");
	OK(costs((struct ct_cost){"w", 90001.26, 1e13, 12, 7}, true,
		   "{\n  \"work\": \"w\",\n  \"seconds\": 90001.3,\n  \"threads\": 1,\n"
		   "  \"memory-bytes\": 10000000000000,\n  \"disk-bytes\": 12,\n"
		   "  \"state-bytes\": 7\n}\n"),
		"as JSON");
}

/* The value of the field, as the command line would say it. */
static const char *text_is(size_t at, enum ct_type type, const char *words, struct params p)
{
	static char text[40];
	const struct ct_opt o = {.type = type, .at = at, .arg = words, .choice = words != NULL};

	ct_table_text(text, sizeof text, &o, &p, 3);
	return text;
}
#define TEXT(f, type, words, ...)                                                                  \
	text_is(offsetof(P, f), type, words, (struct params){.f = __VA_ARGS__})

static void test_text(void)
{
	OK(is_text(TEXT(flag, CT_T_FLAG, NULL, true), "yes") &&
			is_text(TEXT(flag, CT_T_FLAG, NULL, false), "no") &&
			is_text(TEXT(n, CT_T_INT, NULL, -12), "-12") &&
			is_text(TEXT(x, CT_T_REAL, NULL, 0.12345), "0.123") &&
			is_text(TEXT(text, CT_T_STR, NULL, "a b"), "a b") &&
			is_text(TEXT(text, CT_T_STR, NULL, NULL), "") &&
			is_text(TEXT(more, CT_T_LIST, NULL, {0}), ""),
		"values in words");
	OK(is_text(TEXT(word, CT_T_INT, CT_WORDS(COLOURS), 0), "red") &&
			is_text(TEXT(word, CT_T_INT, CT_WORDS(COLOURS), 1), "green") &&
			is_text(TEXT(word, CT_T_INT, CT_WORDS(COLOURS), 2), "blue") &&
			is_text(TEXT(word, CT_T_INT, CT_WORDS(COLOURS), 3), "") &&
			is_text(TEXT(word, CT_T_INT, CT_WORDS(COLOURS), 9), "") &&
			is_text(TEXT(word, CT_T_INT, CT_WORDS(COLOURS), -1), ""),
		"a choice, or none of them");
}

static const char *draws_until(
	struct ct_progress *p, const char *what, size_t done, size_t total, size_t likely)
{
	const struct ct_command command = {0};
	const struct ct_env env = {.tool = "ct-t", .command = &command, .ctx = p};

	capture_begin(&shown);
	ct_progress_draw(&env, what, done, total, likely);
	capture_end(&shown);
	return shown.err;
}

static const char *draws(struct ct_progress *p, const char *what, size_t done, size_t total)
{
	return draws_until(p, what, done, total, 0);
}

/* As if that many seconds had gone by. */
static void wait(struct ct_progress *p, double seconds)
{
	p->last -= seconds;
	p->start -= seconds;
}

/* Is that what stands there before the time, and is the time right, give or take what a busy
 * machine takes? */
static bool is_left(const char *line, const char *before, int seconds, int more)
{
	const size_t n = strlen(before);
	char *end;
	long minutes, left;

	if (strncmp(line, before, n) != 0)
		return false;
	minutes = strtol(line + n, &end, 10);
	left = 60 * minutes + (*end == ':' ? strtol(end + 1, &end, 10) : 0);
	return strcmp(end, " left") == 0 && left >= seconds && left <= seconds + more;
}

static void test_progress(void)
{
	struct ct_progress p = {.how = CT_PROGRESS_TERMINAL}, off = {.how = CT_PROGRESS_NONE};
	const struct ct_env none = {.tool = "ct-t"};
	const char *line;

	OK(is_text(draws(&p, "fit", 2, 8), "\r\033[Kct-t: 25 %") && p.drawn, "the first line");
	OK(is_text(draws(&p, "fit", 3, 8), ""), "the next is drawn later");
	wait(&p, 7200);
	line = draws(&p, "fit", 4, 8); /* 2 of 6 in two hours */
	OK(is_left(line, "\r\033[Kct-t: 50 %, about ", 14400, 30), "with the time left: %s",
		line + 4);
	wait(&p, 300);
	line = draws(&p, "fit", 6, 8); /* 4 of 6 in 7500 seconds */
	OK(is_left(line, "\r\033[Kct-t: 75 %, about ", 3750, 30), "which falls: %s", line + 4);
	wait(&p, 3600);
	line = draws(&p, "fit", 6, 8); /* 5550 left, 3750 were said */
	OK(is_left(line, "\r\033[Kct-t: 75 %, about ", 3750, 30), "and does not rise: %s",
		line + 4);
	wait(&p, 12000);
	OK(is_text(draws(&p, "fit", 6, 8), "\r\033[Kct-t: 75 %"),
		"none if that was far too little");
	wait(&p, 1);
	line = draws(&p, "fit", 7, 8); /* 1/5 of 23101 */
	OK(is_left(line, "\r\033[Kct-t: 87 %, about ", 3750, 30), "one that may be true: %s",
		line + 4);
	wait(&p, 1);
	line = draws(&p, "fit", 3, 8);
	OK(strncmp(line, "\r\033[Kct-t: 87 %", 13) == 0, "a percentage does not fall: %s",
		line + 4);
	OK(is_text(draws(&p, "fit", 8, 8), "\r\033[K") && !p.drawn, "what is done is wiped");
	wait(&p, 1);
	OK(is_text(draws(&p, "fit", 1, 2), "\r\033[Kct-t: 50 %"), "the same work once more");
	OK(is_text(draws(&p, "none", 0, 0), "") && is_text(draws(&off, "fit", 1, 2), ""),
		"nothing of nothing, nor where it is off");
	capture_begin(&shown);
	ct_progress_draw(&none, "fit", 1, 2, 0);
	ct_progress_clear(&p);
	p.drawn = true;
	ct_progress_clear(&p);
	capture_end(&shown);
	OK(is_text(shown.err, "\r\033[K\r\033[K") && !p.drawn, "a line is wiped once");
}

static void test_progress_until(void)
{
	struct ct_progress p = {.how = CT_PROGRESS_TERMINAL};
	const char *line;

	OK(is_text(draws_until(&p, "steps", 0, 300, 300), "\r\033[Kct-t: 0 %"),
		"work that may end before");
	wait(&p, 100);
	line = draws_until(&p, "steps", 10, 300, 300);
	OK(is_left(line, "\r\033[Kct-t: 3 %, about ", 2900, 30), "by the last it may take: %s",
		line + 4);
	for (int more = 0; more < 2; more++) {
		wait(&p, more ? 1 : 100);
		line = draws_until(&p, "steps", 20, 300, more ? 90 : 60);
		OK(is_left(line, "\r\033[Kct-t: 33 %, about ", 400, 30), "%s: %s",
			more ? "it stands when more is likely" : "by what is likely", line + 4);
	}
	wait(&p, 1);
	line = draws_until(&p, "steps", 70, 300, 60);
	OK(is_left(line, "\r\033[Kct-t: 98 %, about ", 2, 5), "what is overdue is about to end: %s",
		line + 4);
}

static void test_progress_in_a_pipe(void)
{
	struct ct_progress p = {.how = CT_PROGRESS_PIPE};
	const char *line;

	OK(is_text(draws(&p, "fit", 1, 8), ""), "a pipe gets no line at once");
	wait(&p, 59);
	OK(is_text(draws(&p, "fit", 2, 8), ""), "a pipe gets no line in the first minute");
	wait(&p, 1);
	line = draws(&p, "fit", 3, 8); /* 2 of 7 in a minute */
	OK(strncmp(line, "ct-t: 37 %, about 2:3", 21) == 0 && strchr(line, '\n') && !p.drawn,
		"a pipe gets a line with the percentage and the time: %s", line);
	wait(&p, 10);
	OK(is_text(draws(&p, "fit", 5, 8), ""), "a pipe gets one line a minute");
}

/* The progress of parts of a run: what of the run is done, and its most. */
static void of_run(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	double *seen = env->ctx;

	(void)likely;
	seen[1] += strcmp(what, CT_PROGRESS_WHOLE) != 0 || (double)done / (double)total < seen[0];
	seen[0] = (double)done / (double)total;
}

static void test_progress_of_parts(void)
{
	double seen[2] = {0, 0};
	const struct ct_env env = {.progress = of_run, .ctx = seen};
	struct ct_env_part part = {.env = &env, .to = 0.5}, inner;
	struct ct_env own, within;

	ct_env_part(&own, &part);
	inner = (struct ct_env_part){.env = &own, .from = 0.5, .to = 1};
	ct_env_part(&within, &inner);
	ct_progress(&own, "views", 1, 2);
	OK(fabs(seen[0] - 0.25) < 1e-3, "half of the first half of a run is a quarter of it");
	ct_progress(&within, "fit", 1, 2);
	OK(fabs(seen[0] - 0.375) < 1e-3, "a part of a part counts by both shares");
	ct_progress(&own, "other", 0, 9);
	ct_progress(&within, "fit", 0, 2);
	OK(fabs(seen[0] - 0.375) < 1e-3, "work that begins anew in a part does not fall back");
	part = (struct ct_env_part){.env = &env, .from = 0.5, .to = 1};
	ct_progress_until(&own, "steps", 10, 300, 20);
	OK(fabs(seen[0] - 0.75) < 1e-3 && seen[1] == 0, "the next part goes on by what is likely");
}

static int nothing(const void *p, const struct ct_env *env, struct ct_err *e)
{
	(void)p;
	(void)env;
	(void)e;
	return 0;
}

static const struct ct_tool tool = {"ct-t", "Test.", opts, &defaults, sizeof defaults, nothing,
	CT_SEEDED | CT_REPORTS | CT_LONG};
static const struct ct_opt bare_opts[] = {CT_OPT_END};
static const struct ct_tool bare = {
	"ct-b", "Bare.", bare_opts, &defaults, sizeof defaults, nothing, 0};

static int call(const struct ct_tool *t, const char *word)
{
	char name[] = "ct-t", text[40], *argv[] = {name, text, NULL};
	int rc;

	snprintf(text, sizeof text, "%s", word);
	capture_begin(&shown);
	rc = ct_cli_main(t, 2, argv);
	capture_end(&shown);
	return rc;
}

#define COMMON_HELP                                                                                \
	"  -t, --threads=N         use N threads; 0 asks CT_THREADS, OMP_NUM_THREADS,\n"           \
	"                          SLURM_CPUS_PER_TASK, then the processors this process\n"        \
	"                          may use. The output is the same for any N (default 0)\n"        \
	"      --expand=N          refuse compressed files that become more than 1 GiB\n"          \
	"                          and N times as large; 0 refuses none (default 100)\n"           \
	"  -f, --force             overwrite existing output files (automatic inside\n"            \
	"                          make)\n"                                                        \
	"  -q, --quiet             print errors only\n"                                            \
	"  -v, --verbose           print what is being done\n"                                     \
	"  -h, --help              print this help\n"                                              \
	"      --version           print the version\n"                                            \
	"\n"                                                                                       \
	"Exit status: 0 done, 1 failed, 2 usage, 3 input invalid, 4 output not writable,\n"        \
	"5 geometry refused, 6 numerical failure, 7 no memory, 75 stopped on request.\n"           \
	"Cite: man ct-references\n"
static const char help[] =
	"Usage: ct-t [OPTION]... IN MORE... COLOUR [OUT]\n"
	"Test.\n"
	"\n"
	"  IN                      what is read\n"
	"  MORE                    what else\n"
	"  COLOUR                  its colour\n"
	"  OUT                     what is written\n"
	"                          [ends in .nii, .nii.gz or .a with --flag, else .d]\n"
	"  -a, --flag              a flag. It stands for nothing. E.g. this\n"
	"  -n, --number=N          words that fill a line of the help to its last column\n"
	"                          and so does the second of them, too: it is as long as\n"
	"                          that. Yes (default -3)\n"
	"                          [needs --flag]\n"
	"      --real=X            one (default 1.23457e+06)\n"
	"                          [needs COLOUR=red|blue, OUT to be a file or\n"
	"                          --a-long-name-of-a-path; not with --text]\n"
	"      --none=X            none\n"
	"                          [not with --flag or COLOUR=green]\n"
	"  -w, --word=red|green|blue a word (default green)\n"
	"      --text=S            text (default abc)\n"
	"                          [needs IN and MORE or --none]\n"
	"      --a-long-name-of-a-path=FILE a\n"
	"                          word-that-is-longer-than-any-line-has-room-for-and-so-has-one-of-its-own\n"
	"                          end\n"
	"                          [not with --number]\n"
	"      --other            \n"
	"  -s, --seed=N            seed of the random numbers (default 0)\n"
	"      --json              print the report as JSON\n"
	"      --dry-run           print the time, memory and disk expected, and do\n"
	"                          nothing\n" COMMON_HELP;
static const char page[] =
	".Bl -tag -width Ds\n"
	".It Fl a , Fl \\-flag\n"
	"a flag.\n"
	"It stands for nothing.\n"
	"E.g.\n"
	"this.\n"
	".It Fl n , Fl \\-number Ns = Ns Ar N\n"
	"words that fill a line of the help to its last column and so does the second of them, too: it is as long as that.\n"
	"Yes (default -3).\n"
	"Needs \\-\\-flag.\n"
	".It Fl \\-real Ns = Ns Ar X\n"
	"one (default 1.23457e+06).\n"
	"Needs COLOUR=red|blue, OUT to be a file or \\-\\-a\\-long\\-name\\-of\\-a\\-path; not with \\-\\-text.\n"
	".It Fl \\-none Ns = Ns Ar X\n"
	"none.\n"
	"Not with \\-\\-flag or COLOUR=green.\n"
	".It Fl w , Fl \\-word Ns = Ns Ar red|green|blue\n"
	"a word (default green).\n"
	".It Fl \\-text Ns = Ns Ar S\n"
	"text (default abc).\n"
	"Needs IN and MORE or \\-\\-none.\n"
	".It Fl \\-a-long-name-of-a-path Ns = Ns Ar FILE\n"
	"a word-that-is-longer-than-any-line-has-room-for-and-so-has-one-of-its-own end.\n"
	"Not with \\-\\-number.\n"
	".It Fl \\-other\n"
	".\n"
	".It Fl s , Fl \\-seed Ns = Ns Ar N\n"
	"seed of the random numbers (default 0).\n"
	".It Fl \\-json\n"
	"print the report as JSON.\n"
	".It Fl \\-dry-run\n"
	"print the time, memory and disk expected, and do nothing.\n"
	".It Fl t , Fl \\-threads Ns = Ns Ar N\n"
	"use N threads; 0 asks CT_THREADS, OMP_NUM_THREADS, SLURM_CPUS_PER_TASK, then the processors this process may use.\n"
	"The output is the same for any N (default 0).\n"
	".It Fl \\-expand Ns = Ns Ar N\n"
	"refuse compressed files that become more than 1 GiB and N times as large; 0 refuses none (default 100).\n"
	".It Fl f , Fl \\-force\n"
	"overwrite existing output files (automatic inside make).\n"
	".It Fl q , Fl \\-quiet\n"
	"print errors only.\n"
	".It Fl v , Fl \\-verbose\n"
	"print what is being done.\n"
	".It Fl h , Fl \\-help\n"
	"print this help.\n"
	".It Fl \\-version\n"
	"print the version.\n"
	".El\n";

static void test_help(void)
{
	OK(call(&tool, "--help") == 0 && is_text(shown.out, help), "--help");

	OK(call(&bare, "--help") == 0 &&
			is_text(shown.out, "Usage: ct-b [OPTION]...\nBare.\n\n" COMMON_HELP),
		"of what has no options");
	OK(call(&tool, "--mdoc-options") == 0 && is_text(shown.out, page), "the man page");
}

int main(void)
{
	test_help();
	test_modes();
	test_cost();
	test_progress();
	test_progress_until();
	test_progress_in_a_pipe();
	test_progress_of_parts();
	test_text();
	return tap_done();
}
