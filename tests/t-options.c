/* The command line: how options are written, what values they take, what is told of it all.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/modes.h"
#include "cli/stop.h"
#include "core/inflate.h"
#include "capture.h"

#include <fcntl.h>
#include <sched.h>

#define COLOURS(X) X(RED, "red") X(GREEN, "green") X(BLUE, "blue")
enum colour { COLOURS(CT_WORD_VALUE) };

#define CT_PARAMS struct params
struct params {
	bool alpha, deep;
	int n, any, word;
	double x, real, gate;
	const char *text, *in, *rates;
	struct ct_list rest;
};
static const struct params defaults = {.n = 5, .word = 1, .x = 0.5};
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_NO_FILE, "IN", ""),
	CT_FLAG(alpha, 'a', "alpha", ""),
	CT_TEXT(text, 0, "alphabet", "S", ""),
	CT_OPT(n, 'n', "number", "N", 1, 9, ""),
	CT_OPT(any, 0, "any", "N", 0, 0, ""),
	CT_OPT(x, 'x', "xray", "X", -1.5, 2.5, ""),
	CT_OPT(real, 0, "real", "X", 0, 0, ""),
	CT_CHOICE(word, 'w', "word", CT_WORDS(COLOURS), ""),
	CT_EXPERT(gate, "gate", "HU", 0, 10, ""),
	CT_EXPERT(deep, "deep", NULL, 0, 0, "", CT_WHEN(CT_IF(alpha))),
	CT_EXPERT(rates, "rates", "A,B", 0, 0, ""),
	CT_ARG(rest, CT_NO_FILE, "REST", ""),
	CT_OPT_END,
};
static struct capture shown;
/* What the last run was given. */
static struct params got;
static struct ct_env env;
static struct ct_io_rule files;
static struct ct_command command;
static char history[400], rest[400], rates[40];
static bool given_n, given_none;
static size_t threads;
static int runs;

static int note(const void *params, const struct ct_env *e, struct ct_err *why)
{
	(void)why;
	got = *(const struct params *)params;
	env = *e;
	files = *e->files;
	command = *e->command;
	threads = ct_par_threads(e->par);
	given_n = ct_modes_given(&e->command->given, "number");
	given_none = ct_modes_given(&e->command->given, "none");
	snprintf(history, sizeof history, "%s", e->history);
	snprintf(rates, sizeof rates, "%s", got.rates ? got.rates : "");
	rest[0] = '\0';
	for (size_t i = 0; i < got.rest.n; i++)
		snprintf(rest + strlen(rest), sizeof rest - strlen(rest), "%s;", got.rest.v[i]);
	ct_log(e, CT_WARN, "beware");
	ct_log(e, CT_INFO, "step");
	runs++;
	return 0;
}

static int draw(const void *params, const struct ct_env *e, struct ct_err *why)
{
	(void)params;
	(void)why;
	ct_progress(e, "fit", 1, 3);
	ct_log(e, CT_WARN, "beware");
	ct_progress(e, "scan", 1, 3);
	return -1; /* without a word */
}

static const struct ct_tool tool = {.name = "ct-t",
	.brief = "Test.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = note,
	.flags = CT_SEEDED | CT_REPORTS | CT_LONG};

/* The command with these words, in which a semicolon is a blank; its status. */
static int call(const char *words)
{
	char text[400], *argv[40], *at, name[] = "ct-t";
	int argc = 1, rc;

	snprintf(text, sizeof text, "%s", words);
	argv[0] = name;
	for (char *w = strtok_r(text, " ", &at); w; w = strtok_r(NULL, " ", &at)) {
		for (char *s = w; *s; s++)
			*s = *s == ';' ? ' ' : *s;
		argv[argc++] = w;
	}
	argv[argc] = NULL;
	runs = 0;
	got = (struct params){0};
	capture_begin(&shown);
	rc = ct_cli_main(&tool, argc, argv);
	capture_end(&shown);
	return rc;
}

static bool refused(const char *words, const char *why)
{
	char want[400];

	snprintf(want, sizeof want, "ct-t: %s\nTry 'ct-t --help'.\n", why);
	return call(words) == CT_EUSAGE && runs == 0 && is_text(shown.err, want) && !*shown.out;
}
#define REFUSED(words, why) OK(refused(words, why), "refused: %s", words)
#define TAKEN(words, cond) OK(call(words) == 0 && runs == 1 && (cond), "taken: %s", words)

static void test_ways(void)
{
	TAKEN("in r", got.n == 5 && got.word == 1 && got.x > 0.4 && !got.alpha && !got.text);
	TAKEN("in r", strcmp(got.in, "in") == 0 && strcmp(rest, "r;") == 0 && !given_n);
	TAKEN("-n 3 in a b c", got.n == 3 && strcmp(rest, "a;b;c;") == 0 && given_n && !given_none);
	TAKEN("-n3 in r", got.n == 3);
	TAKEN("-an3 in r", got.n == 3 && got.alpha);
	TAKEN("in -an 3 r", got.n == 3 && got.alpha && strcmp(rest, "r;") == 0);
	TAKEN("-aq in r", got.alpha && env.verbose == -1);
	TAKEN("--number=4 in r", got.n == 4);
	TAKEN("--number 4 in r", got.n == 4);
	TAKEN("--nu 4 in r", got.n == 4);
	TAKEN("--alpha in r", got.alpha && !got.text);
	TAKEN("--alphab= in r", !got.alpha && got.text && !*got.text);
	TAKEN("--alphabet --alpha in r", !got.alpha && strcmp(got.text, "--alpha") == 0);
	TAKEN("-- --alpha -n --", strcmp(got.in, "--alpha") == 0 && strcmp(rest, "-n;--;") == 0);
	TAKEN("- -", strcmp(got.in, "-") == 0 && strcmp(rest, "-;") == 0);
	TAKEN("-w blue in r", got.word == 2);
	TAKEN("--word=red in r", got.word == 0);
	REFUSED("--alp in r", "unknown option '--alp'"); /* alpha or alphabet */
	REFUSED("--numbers=3 in r", "unknown option '--numbers=3'; did you mean --number?");
	REFUSED("--no in r", "unknown option '--no'");
	REFUSED("-z in r", "unknown option '-z'");
	REFUSED("-az in r", "unknown option '-z'");
	REFUSED("--alpha=1 in r", "option '--alpha=1' takes no value");
	REFUSED("in r -n", "option '-n' needs a value");
	REFUSED("in r -an", "option '-n' needs a value");
	REFUSED("in r --number", "option '--number' needs a value");
	REFUSED("", "missing IN");
	REFUSED("in", "missing REST");
}

static void test_values(void)
{
	TAKEN("-n 1 in r", got.n == 1);
	TAKEN("-n 9 in r", got.n == 9);
	TAKEN("--any=2147483647 in r", got.any == 2147483647);
	TAKEN("--any=-2147483648 in r", got.any == -2147483647 - 1);
	TAKEN("-x -1.5 in r", fabs(got.x + 1.5) < 1e-9);
	TAKEN("-x 25e-1 in r", fabs(got.x - 2.5) < 1e-9);
	TAKEN("--real=-1e300 in r", got.real < -9e299);
	REFUSED("-n 0 in r", "--number: 0 is outside [1, 9]");
	REFUSED("-n 10 in r", "--number: 10 is outside [1, 9]");
	REFUSED("-x 2.6 in r", "--xray: 2.6 is outside [-1.5, 2.5]");
	REFUSED("-x -1.6 in r", "--xray: -1.6 is outside [-1.5, 2.5]");
	REFUSED("--any= in r", "--any: '' is not an integer");
	REFUSED("--any=3x in r", "--any: '3x' is not an integer");
	REFUSED("--any=1.5 in r", "--any: '1.5' is not an integer");
	REFUSED("--any=2147483648 in r", "--any: '2147483648' is not an integer");
	REFUSED("--any=-2147483649 in r", "--any: '-2147483649' is not an integer");
	REFUSED("--real= in r", "--real: '' is not a number");
	REFUSED("--real=1,5 in r", "--real: '1,5' is not a number");
	REFUSED("--real=nan in r", "--real: 'nan' is not a number");
	REFUSED("--real=1e999 in r", "--real: '1e999' is not a number");
	REFUSED("-w yellow in r", "--word: 'yellow' is not one of red|green|blue");
	REFUSED("-w bl in r", "--word: 'bl' is not one of red|green|blue");
	REFUSED("-w gren in r", "--word: 'gren' is not one of red|green|blue; did you mean green?");
	REFUSED("-w BLEU in r", "--word: 'BLEU' is not one of red|green|blue; did you mean blue?");
	REFUSED("-w rde in r", "--word: 'rde' is not one of red|green|blue; did you mean red?");
	REFUSED("--wrod red in r", "unknown option '--wrod'; did you mean --word?");
	REFUSED("--wrod=red in r", "unknown option '--wrod=red'; did you mean --word?");
	REFUSED("--threds 1 in r", "unknown option '--threds'; did you mean --threads?");
	REFUSED("--thrxxxs 1 in r", "unknown option '--thrxxxs'");
}

static void test_expert(void)
{
	TAKEN("--expert gate=2.5 in r", got.gate > 2.4 && got.gate < 2.6);
	TAKEN("--expert=rates=1,2,gate=3 in r", strcmp(rates, "1,2") == 0 && got.gate > 2.9);
	TAKEN("-a --expert deep=yes in r", got.deep);
	TAKEN("-a --expert deep=no in r", !got.deep);
	REFUSED("--gate 2 in r", "unknown option '--gate'; did you mean --expert gate?");
	REFUSED("--expert gate=11 in r", "--expert gate: 11 is outside [0, 10]");
	REFUSED("-a --expert deep=1 in r", "--expert deep: '1' is not yes or no");
	REFUSED("--expert deep=yes in r", "--expert deep: needs --alpha");
	REFUSED("--expert gat=1 in r",
		"--expert: 'gat' is not one of its keys; --help lists them; did you mean gate?");
	REFUSED("--expert gate in r", "--expert: 'gate' has no value: gate=HU");
	TAKEN("--expert gate=1 --expert rates=3,gate=2 in r",
		got.gate > 1.9 && strcmp(rates, "3") == 0);
	OK(call("--help") == 0 && strstr(shown.out, "\nKeys of --expert:\n      gate=HU"),
		"--help lists the keys behind the options");
	OK(call("--mdoc-options") == 0 && strstr(shown.out, ".It Cm gate Ns = Ns Ar HU\n"),
		"so does the man page");
}

static void test_seed(void)
{
	TAKEN("in r", env.seed == 0);
	TAKEN("-s 7 in r", env.seed == 7);
	TAKEN("--seed=18446744073709551615 in r", env.seed == UINT64_MAX);
	REFUSED("--seed=18446744073709551616 in r",
		"--seed: '18446744073709551616' is not an integer");
	REFUSED("--seed= in r", "--seed: '' is not an integer");
	REFUSED("--seed=-1 in r", "--seed: '-1' is not an integer");
	REFUSED("--seed=3x in r", "--seed: '3x' is not an integer");
}

/* What all commands have. */
static void test_common(void)
{
	TAKEN("in r", env.verbose == 0 && !files.force && !command.json && !command.dry_run);
	OK(is_text(shown.err, "ct-t: warning: beware\n") && !*shown.out, "a warning is told");
	TAKEN("-v in r", env.verbose == 1);
	OK(is_text(shown.err, "ct-t: warning: beware\nct-t: step\n"), "and what is done, if asked");
	TAKEN("-qv in r", env.verbose == -1);
	OK(is_text(shown.err, ""), "nothing if that is asked");
	TAKEN("-f in r", files.force);
	TAKEN("--json in r", command.json);
	TAKEN("--dry-run in r", command.dry_run);
	setenv("MAKELEVEL", "1", 1);
	TAKEN("in r", files.force);
	unsetenv("MAKELEVEL");
	TAKEN("in r", ct_inflate_allowed() == CT_INFLATE_TIMES);
	TAKEN("--expand=7 in r", ct_inflate_allowed() == 7);
	TAKEN("--expand=100000 in r", ct_inflate_allowed() == 100000);
	REFUSED("--expand=100001 in r", "--expand: 100001 is outside [0, 100000]");
	REFUSED("--expand=-1 in r", "--expand: -1 is outside [0, 100000]");
	TAKEN("in r", env.stop && env.stop == ct_stop_flag() && *env.stop == 0);
	OK(strcmp(env.tool, "ct-t") == 0, "messages have the name");
	OK(call("--version") == 0 && runs == 0 &&
			is_text(shown.out, "ct-t (" PACKAGE_NAME ") " PACKAGE_VERSION "\n"),
		"--version wants no operands");
	OK(call("-h") == 0 && runs == 0 && strncmp(shown.out, "Usage: ct-t ", 12) == 0,
		"nor does --help");
}

static void test_threads(void)
{
	cpu_set_t all, one;

	CPU_ZERO(&one);
	TAKEN("-t 3 in r", threads == 3);
	setenv("SLURM_CPUS_PER_TASK", "2", 1);
	TAKEN("in r", threads == 2);
	setenv("OMP_NUM_THREADS", "5", 1);
	TAKEN("in r", threads == 5);
	setenv("CT_THREADS", "4", 1);
	TAKEN("in r", threads == 4);
	TAKEN("-t 0 in r", threads == 4);
	TAKEN("-t 1 in r", threads == 1);
	setenv("CT_THREADS", "1", 1);
	TAKEN("in r", threads == 1);
	setenv("CT_THREADS", "4097", 1);
	TAKEN("in r", threads == 5);
	setenv("CT_THREADS", "0", 1);
	TAKEN("in r", threads == 5);
	setenv("CT_THREADS", "none", 1);
	TAKEN("in r", threads == 5);
	unsetenv("CT_THREADS");
	unsetenv("OMP_NUM_THREADS");
	unsetenv("SLURM_CPUS_PER_TASK");
	if (sched_getaffinity(0, sizeof all, &all) == 0) {
		TAKEN("in r", threads == (size_t)CPU_COUNT(&all));
		for (int i = CPU_SETSIZE; i-- > 0;)
			if (CPU_ISSET(i, &all)) {
				CPU_ZERO(&one);
				CPU_SET(i, &one);
			}
		if (sched_setaffinity(0, sizeof one, &one) == 0)
			TAKEN("in r", threads == 1);
	}
	REFUSED("-t -1 in r", "--threads: -1 is outside [0, 4096]");
	REFUSED("-t 4097 in r", "--threads: 4097 is outside [0, 4096]");
	OK(call("-t 4096 --help") == 0, "4096 threads");
}

static bool remembers(const char *words, const char *want)
{
	char text[400];

	snprintf(text, sizeof text, "ct-t " PACKAGE_VERSION "%s", want);
	return call(words) == 0 && is_text(history, text);
}
#define REMEMBERS(words, want) OK(remembers(words, want), "the history of %s", words)

/* What decides the result, and nothing of where it was made. */
static void test_history(void)
{
	REMEMBERS("in r", " in r");
	REMEMBERS("/a/b/in d/r", " in r");
	REMEMBERS("a//in x/r// y/r/ /", " in r// r/ /");
	REMEMBERS("-n 3 --alphabet=/a/b/c in r", " -n 3 --alphabet=c in r");
	REMEMBERS("--alphabet a/b=c/d in r", " --alphabet d in r");
	REMEMBERS("in k=a/b", " in b");
	REMEMBERS("in -an3 r", " in -an3 r");
	REMEMBERS("-q -v -f -qvf --quiet --verb --force in r", " in r");
	REMEMBERS("-t 2 -t2 -ft 2 -ft2 --threads=2 --thr 2 in r", " in r");
	REMEMBERS("--expand 9 --expand=9 -s 4 in r", " -s 4 in r");
	REMEMBERS("-aq -qa in r", " -aq -qa in r");
	REMEMBERS("in -- -q -t -- --force", " in -- -q -t -- --force");
	REMEMBERS("- -", " - -");
	REMEMBERS("in a;b c'd $e f\"g h\\i", " in 'a b' 'c'\\''d' '$e' 'f\"g' 'h\\i'");
	REMEMBERS("--alphabet=x/a;b in r", " '--alphabet=a b' in r");
}

/* Operands that are a choice, and that may be missing. */
static const struct ct_opt few_opts[] = {
	CT_ARG_CHOICE(word, "COLOUR", CT_WORDS(COLOURS), ""),
	CT_ARG_MAYBE(in, CT_NO_FILE, "IN", ""),
	CT_OPT_END,
};
static struct ct_tool few_tool = {"ct-t", "Test.", few_opts, &defaults, sizeof defaults, note, 0};

static int call_few(int argc, ...)
{
	char name[] = "ct-t", words[3][40], *argv[5] = {name, words[0], words[1], words[2]};
	va_list ap;
	int rc;

	va_start(ap, argc);
	for (int i = 0; i < argc; i++)
		snprintf(words[i], sizeof words[i], "%s", va_arg(ap, const char *));
	va_end(ap);
	argv[argc + 1] = NULL;
	runs = 0;
	capture_begin(&shown);
	rc = ct_cli_main(&few_tool, argc + 1, argv);
	capture_end(&shown);
	return rc;
}

static void test_operands(void)
{
	OK(call_few(1, "blue") == 0 && got.word == 2 && !got.in, "an operand that may be missing");
	OK(call_few(2, "red", "in") == 0 && got.word == 0 && strcmp(got.in, "in") == 0, "or not");
	OK(call_few(0) == CT_EUSAGE && strncmp(shown.err, "ct-t: missing COLOUR\n", 21) == 0,
		"one that is a choice may not");
	OK(call_few(1, "pink") == CT_EUSAGE &&
			strncmp(shown.err, "ct-t: COLOUR: 'pink' is not one of red|green|blue\n",
				50) == 0,
		"and is one of its words");
	OK(call_few(3, "red", "in", "on") == CT_EUSAGE &&
			strncmp(shown.err, "ct-t: extra operand 'on'\n", 25) == 0,
		"no more than there are");
	for (unsigned k = 0; k < 8; k++) {
		few_tool.flags =
			(k & 1 ? CT_SEEDED : 0) | (k & 2 ? CT_REPORTS : 0) | (k & 4 ? CT_LONG : 0);
		OK((call_few(2, "--seed=1", "-h") == 0) == ((k & 1) != 0) &&
				(call_few(2, "--json", "-h") == 0) == ((k & 6) != 0) &&
				(call_few(2, "--dry-run", "-h") == 0) == ((k & 4) != 0),
			"a command has a seed, a report, a cost if it says so: %u", k);
	}
}

static void test_full(void)
{
	char name[] = "ct-t", word[] = "--help", *argv[] = {name, word, NULL};
	int rc, fd = open("/dev/full", O_WRONLY);

	if (fd < 0)
		return;
	capture_begin(&shown);
	dup2(fd, STDOUT_FILENO);
	rc = ct_cli_main(&tool, 2, argv);
	clearerr(stdout);
	capture_end(&shown);
	close(fd);
	OK(rc == CT_EOUTPUT &&
			is_text(shown.err, "ct-t: standard output: No space left on device\n"),
		"a full disk");
}

/* What a terminal is shown while a command runs. */
static void test_terminal(void)
{
	static const struct ct_tool drawing = {
		"ct-t", "Test.", few_opts, &defaults, sizeof defaults, draw, 0};
	const char *const want = "\r\033[Kct-t: 33 %\r\033[Kct-t: warning: beware\r\nct-t: \r\n";
	char name[] = "ct-t", word[] = "red", quiet[] = "-q", text[400] = "";
	char *argv[] = {name, word, NULL, NULL};
	int rc, err_was = dup(STDERR_FILENO), fd = posix_openpt(O_RDWR | O_NOCTTY), tty = -1;

	if (fd >= 0 && grantpt(fd) == 0 && unlockpt(fd) == 0)
		tty = open(ptsname(fd), O_RDWR | O_NOCTTY);
	if (tty < 0) {
		OK(true, "a terminal # skip there are none");
		return;
	}
	dup2(tty, STDERR_FILENO);
	rc = ct_cli_main(&drawing, 2, argv);
	argv[2] = quiet;
	rc |= ct_cli_main(&drawing, 3, argv) << 8;
	dup2(err_was, STDERR_FILENO);
	fcntl(fd, F_SETFL, O_NONBLOCK);
	for (size_t n = 0; n < sizeof text - 1;) {
		ssize_t more = read(fd, text + n, sizeof text - 1 - n);

		if (more <= 0)
			break;
		n += (size_t)more;
		text[n] = '\0';
	}
	OK(strncmp(text, want, strlen(want)) == 0, "a terminal is shown how far the work is");
	OK(strcmp(text + strlen(want), "ct-t: \r\n") == 0, "but not if that is not asked");
	OK(rc == (CT_EFAIL | CT_EFAIL << 8), "who fails without a word fails");
	close(tty);
	close(fd);
	close(err_was);
}

static void test_lists(void)
{
	struct ct_err e = {0};
	double v[3] = {0};
	size_t n[4];

	OK(ct_cli_numbers("o", "1,-2.5,3e1", ',', 3, false, v, &e) == 0 && fabs(v[0] - 1) < 1e-9 &&
			fabs(v[1] + 2.5) < 1e-9 && fabs(v[2] - 30) < 1e-9,
		"three numbers");
	OK(ct_cli_numbers("o", "4", ',', 3, true, v, &e) == 0 && fabs(v[0] - 4) < 1e-9 &&
			fabs(v[1] - 4) < 1e-9 && fabs(v[2] - 4) < 1e-9,
		"one for all");
	for (const char *const *s = (const char *const[]){"", "1", "1,2", "1,2,3,4", "1,2,3,",
		     "1,,3", "1,2;3", ",1,2,3", "1,2,nan", "1,2,3x", NULL};
		*s; s++)
		OK(ct_cli_numbers("o", *s, ',', 3, false, v, &e) && e.code == CT_EUSAGE &&
				strstr(e.msg, "is not 3 numbers") && !strstr(e.msg, "one for all"),
			"not three: %s", e.msg);
	for (const char *const *s = (const char *const[]){"", "1,2", "1,", "1,2,3,", "x", NULL}; *s;
		s++)
		OK(ct_cli_numbers("o", *s, ',', 3, true, v, &e) &&
				strstr(e.msg, "is not 3 numbers, or one for all"),
			"nor one for all: %s", e.msg);
	OK(ct_cli_numbers("o", "x", ',', 1, true, v, &e) &&
			is_text(e.msg, "--o: 'x' is not 1 number"),
		"one is one");
	OK(ct_cli_dims("o", "1x1000000x3x4", 4, n, &e) == 0 && n[0] == 1 && n[1] == 1000000 &&
			n[2] == 3 && n[3] == 4,
		"sizes");
	for (const char *const *s =
			(const char *const[]){"0.0x2", "-1x2", "2x1000001", "1.5x2", NULL};
		*s; s++)
		OK(ct_cli_dims("o", *s, 2, n, &e) && e.code == CT_EUSAGE &&
				strstr(e.msg, "is not a size"),
			"no size: %s", e.msg);
	OK(ct_cli_dims("o", "2", 2, n, &e) && strstr(e.msg, "is not 2 numbers"),
		"nor is one of two");
	OK(ct_cli_range("o", "-1:2", v, &e) == 0 && fabs(v[0] + 1) < 1e-9 && fabs(v[1] - 2) < 1e-9,
		"a range");
	OK(ct_cli_range("o", "2:2", v, &e) && is_text(e.msg, "--o: '2:2' is empty"),
		"an empty one");
	OK(ct_cli_range("o", "3:2", v, &e) && ct_cli_range("o", "1", v, &e), "and none");
}

int main(void)
{
	for (const char *const *s = (const char *const[]){"MAKELEVEL", "CT_THREADS",
		     "OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK", NULL};
		*s; s++)
		unsetenv(*s);
	test_ways();
	test_values();
	test_expert();
	test_seed();
	test_common();
	test_history();
	test_operands();
	test_lists();
	test_threads();
	test_full();
	test_terminal();
	return tap_done();
}
