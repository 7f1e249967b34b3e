/* A chain of commands: what is called and how, what is done again, what becomes of a failure. The
 * commands are scripts. */
#include "config.h"
#include "cli/chain.h"
#include "cli/command.h"
#include "capture.h"
#include "core/clock.h"
#include "scratch.h"

#include <errno.h>
#include <signal.h>
#include <sys/time.h>
#include <sys/wait.h>

static struct ct_err e;
static struct capture shown;
static char said[4000]; /* through the log */
static volatile sig_atomic_t stop;
static pid_t self; /* this process */

static void note(const struct ct_env *env, enum ct_level level, const char *text)
{
	(void)env;
	snprintf(said + strlen(said), sizeof said - strlen(said), "%d %s\n", (int)level, text);
}

static struct ct_io_rule files;
static struct ct_command command;
static struct ct_env env = {.tool = "ct-t",
	.files = &files,
	.command = &command,
	.log = note,
	.verbose = 1,
	.stop = &stop};

static void put_script(const char *name, const char *body)
{
	char path[100], text[400];

	snprintf(path, sizeof path, "bin/%s", name);
	snprintf(text, sizeof text, "#!/bin/sh\necho %s \"$*\" >>log\n%s\n", name, body);
	put_text(path, text);
	if (chmod(path, 0755))
		exit(99);
}

/* A chain in `folder`, of the scripts here. */
static int begin(struct ct_chain *c, const char *folder)
{
	int rc;

	e = (struct ct_err){0};
	said[0] = '\0';
	remove("log");
	rc = ct_chain_open(c, folder, false, &e);
	if (rc) {
		ct_chain_close(c);
		return rc;
	}
	snprintf(c->tools, sizeof c->tools, "./bin/");
	return rc;
}

static int run(struct ct_chain *c)
{
	int rc;

	capture_begin(&shown);
	rc = ct_chain_run(c, &env, &e);
	capture_end(&shown);
	if (getpid() != self) { /* one that was to become a command */
		put_text("stray", "");
		_exit(CT_EFAIL);
	}
	ct_chain_close(c);
	return rc;
}

/* From `in` by k/mid to `out`, the first step with another word. */
static int two_steps(const char *in, const char *word)
{
	struct ct_chain c;

	if (begin(&c, "k"))
		return -1;
	c.source[0] = c.called = in;
	ct_chain_add(&c, false, "k/mid", "copy");
	ct_chain_words(&c, in, "k/mid", NULL);
	ct_chain_word(&c, "%s", word);
	ct_chain_add(&c, true, "out", "copy");
	ct_chain_words(&c, "k/mid", "out", NULL);
	return run(&c);
}

/* The only step of a chain: fails as the script does. */
static int one_step(const char *folder, const char *tool, const char *output)
{
	struct ct_chain c;

	if (begin(&c, folder))
		return -1;
	ct_chain_add(&c, false, output, tool);
	ct_chain_words(&c, "a", "b", NULL);
	return run(&c);
}

#define FIRST(in, w) "copy " in " k/mid " w " --force --threads=1 --verbose\n"
#define SECOND "copy k/mid out --force --threads=1 --verbose\n"
#define ONE_LEFT "2 of 2 steps were done\n"
static bool left(const char *what) /* so many steps were said to be done */
{
	char line[100];

	snprintf(line, sizeof line, "1 %s steps were done\n", what);
	return strstr(said, line) != NULL;
}

static void test_content(void)
{
	put_text("a", "alpha");
	OK(two_steps("a", "w") == 0 && strcmp(text_of("out"), "alpha") == 0, "a chain");
	OK(is_text(text_of("log"), FIRST("a", "w") SECOND), "its commands");
	OK(strncmp(said, "1 copy took ", 12) == 0 && strtod(said + 12, NULL) < 60 &&
			!strstr(said, "were done"),
		"the time of each is told");
	OK(is_text(text_of("k/commands.sh"),
		   "#!/bin/sh\nset -e\nCDPATH= cd -P -- \"$(dirname -- \"$0\")/..\"\n"
		   "copy a k/mid w --force\ncopy k/mid out --force\n"),
		"and how to do it by hand");
	OK(two_steps("a", "w") == 0 && is_text(text_of("log"), "") && left("2 of 2"),
		"what is done is not done again");
	env.seed = 5;
	OK(two_steps("a", "w") == 0 && left("2 of 2"), "a seed is one of the words, or none");
	env.seed = 0;
	put_text("a2", "alpha");
	OK(two_steps("a2", "w") == 0 && left("2 of 2"), "an input of another name is the same");
	OK(two_steps("a", "v") == 0 && is_text(text_of("log"), FIRST("a", "v")) && left("1 of 2"),
		"another word is another step");
	put_text("a", "beta");
	OK(two_steps("a", "v") == 0 && is_text(text_of("log"), FIRST("a", "v") SECOND) &&
			strcmp(text_of("out"), "beta") == 0 && !left("0 of 2"),
		"so is another input");
	remove("out");
	OK(two_steps("a", "v") == 0 && is_text(text_of("log"), SECOND) && left("1 of 2"),
		"a result that is gone");
	put_text("out", "other");
	OK(two_steps("a", "v") == 0 && is_text(text_of("log"), SECOND) && left("1 of 2"),
		"or another, is made again");
	put_text("k/mid", "other");
	OK(two_steps("a", "v") == 0 && is_text(text_of("log"), FIRST("a", "v")) && left("1 of 2"),
		"one between is, to the same");
	put_text("k/step-1.state", "junk");
	OK(two_steps("a", "v") == 0 && is_text(text_of("log"), FIRST("a", "v")) && left("1 of 2"),
		"a broken state is none");
}

/* What cannot be told before it is read is done again. */
static void test_untold(void)
{
	OK(two_steps("-", "w") == 0 && left("1 of 2") == false, "another input");
	OK(two_steps("-", "w") == 0 && is_text(text_of("log"), FIRST("-", "w")) && left("1 of 2"),
		"a stream may hold anything");
	OK(two_steps("none", "w") == -1 && e.code == CT_EINPUT && is_text(e.msg, "copy failed"),
		"what is not there is for the command to tell");
}

static void test_begun(void)
{
	put_text("stop", "75");
	OK(two_steps("a", "w") == -1 && e.code == CT_ESTOP &&
			is_text(e.msg, "stopped on request; the same command goes on"),
		"a command that was stopped");
	remove("stop");
	OK(two_steps("a", "w") == 0 && !strstr(text_of("log"), "--resume"),
		"begins anew if it knows of no state");
	put_text("a", "gamma");
	put_text("stop2", "3");
	OK(two_steps("a", "w") == -1 && e.code == CT_EINPUT &&
			is_text(e.msg, "copy failed; what it reads was made of a"),
		"one that failed, and of what source");
	remove("stop2");
	OK(two_steps("a", "w") == 0 && left("1 of 2") &&
			is_text(text_of("log"),
				"copy k/mid out --force --threads=1 --verbose --resume\n"),
		"goes on if it does");
	OK(two_steps("a", "w") == 0 && left("2 of 2"), "and is done");
	put_text("a", "delta");
	OK(two_steps("a", "w") == 0 && !strstr(text_of("log"), "--resume"),
		"but not from what was of another input");
}

static void test_failures(void)
{
	OK(one_step("f", "die", "x") == -1 && e.code == CT_EFAIL &&
			is_text(e.msg, "die was killed by signal 9"),
		"a command that is killed");
	files.force = true;
	OK(one_step("f", "nope", "x") == -1 && e.code == CT_EFAIL &&
			is_text(e.msg, "nope failed") &&
			is_text(shown.err, "ct-t: nope: No such file or directory\n"),
		"one that is not there");
	OK(!is_there("stray"), "nothing goes on in its place");
	setenv("PATH", "elsewhere:/bin:/usr/bin", 1);
	OK(one_step("f", "far", "x") == 0, "one that lies elsewhere");
	put_text("stop", "75");
	OK(one_step(NULL, "copy", "x") == -1 && e.code == CT_ESTOP &&
			is_text(e.msg, "stopped on request"),
		"of a temporary folder nothing can go on");
	OK(!is_there("x") &&
			strcmp(text_of("log"), "copy a b --force --threads=1 --verbose\n") == 0,
		"where the words are the same");
	remove("stop");
	stop = 1;
	OK(one_step(NULL, "copy", "b") == -1 && e.code == CT_ESTOP && !is_there("log"),
		"who is told to stop begins nothing");
	stop = 0;
}

/* The commands lie where this program does. */
static void test_place(void)
{
	struct ct_chain c;
	char own[5000];

	must(ct_chain_open(&c, NULL, true, &err));
	snprintf(own, sizeof own, "%s%s", c.tools, program_invocation_short_name);
	OK(c.tools[0] == '/' && access(own, X_OK) == 0, "commands lie beside each other");
	OK(!is_there(c.folder), "a dry chain has no folder");
	ct_chain_close(&c);
	must(begin(&c, NULL));
	ct_chain_add(&c, true, "b", "copy");
	ct_chain_words(&c, "a", "b", NULL);
	OK(run(&c) == 0 && is_text(text_of("log"), "copy a b --force --threads=1 --verbose\n"),
		"in a temporary folder nothing is gone on from");
}

static void test_reports(void)
{
	OK(one_step("f", "say", "x") == 0 && is_text(shown.out, "") &&
			is_text(shown.err, "report\nwords\n"),
		"a report goes to standard error");
	OK(one_step("f", "say", "-") == 0 && is_text(shown.out, "report\n") &&
			is_text(shown.err, "words\n"),
		"unless it is the data");
	env.verbose = -1;
	OK(one_step("f", "say", "x") == 0 && is_text(shown.out, "") &&
			is_text(shown.err, "words\n") &&
			is_text(text_of("log"), "say a b --force --threads=1 --quiet\n"),
		"or nowhere");
	env.verbose = 0;
	OK(one_step("f", "say", "x") == 0 &&
			is_text(text_of("log"), "say a b --force --threads=1\n"),
		"neither quiet nor verbose");
	env.verbose = 1;
}

static void on_alarm(int sig)
{
	(void)sig;
	stop = 1;
}

/* A request reaches what runs, though signals are blocked here. */
static void test_stop(void)
{
	const struct itimerval soon = {.it_value = {0, 300000}};
	sigset_t term;
	double start = ct_clock_wall();

	sigemptyset(&term);
	sigaddset(&term, SIGTERM);
	sigprocmask(SIG_BLOCK, &term, NULL);
	signal(SIGALRM, on_alarm);
	setitimer(ITIMER_REAL, &soon, NULL);
	OK(one_step("f", "wait", "x") == -1 && e.code == CT_ESTOP, "a command is told to stop");
	OK(ct_clock_wall() - start < 20, "and does");
	sigprocmask(SIG_UNBLOCK, &term, NULL);
	stop = 0;
}

/* What runs ends when the chain is killed. */
static void test_orphan(void)
{
	pid_t pid = fork();
	pid_t left_over;

	if (pid == 0) {
		one_step("o", "wait", "x");
		_exit(0);
	}
	for (int i = 0; i < 500 && !*text_of("pid"); i++)
		ct_clock_sleep(0.02);
	left_over = (pid_t)strtol(text_of("pid"), NULL, 10);
	kill(pid, SIGKILL);
	waitpid(pid, NULL, 0);
	for (int i = 0; i < 250 && is_there("pid") && kill(left_over, 0) == 0; i++)
		ct_clock_sleep(0.02);
	OK(left_over > 0 && kill(left_over, 0) != 0, "a command does not outlive its chain");
}

static void test_words(void)
{
	struct ct_chain c;

	must(begin(&c, "w"));
	c.source[0] = "src";
	c.source[1] = "more";
	ct_chain_add(&c, false, "one", "t");
	ct_chain_words(&c, "src", "--a=more", "-a=src", "a=src", "two", "srcs", "", NULL);
	ct_chain_add(&c, false, "two", "it's");
	ct_chain_words(&c, "one", "a b", "'", "--b=one", "two", "$x", "A_z.09,/@%:-+=", NULL);
	OK(ct_chain_input(&c, 0, 1) && ct_chain_input(&c, 0, 2) && ct_chain_input(&c, 1, 1) &&
			ct_chain_input(&c, 1, 4),
		"a word that is a source, or was made before, is an input");
	OK(is_text(ct_chain_input(&c, 0, 2), "more") && is_text(ct_chain_input(&c, 1, 4), "one"),
		"behind its option too");
	OK(!ct_chain_input(&c, 0, 3) && !ct_chain_input(&c, 0, 4) && !ct_chain_input(&c, 0, 5) &&
			!ct_chain_input(&c, 0, 6) && !ct_chain_input(&c, 0, 0) &&
			!ct_chain_input(&c, 1, 5) && !ct_chain_input(&c, 1, 2),
		"no other is");
	capture_begin(&shown);
	ct_chain_print(&c, "", stdout);
	capture_end(&shown);
	OK(is_text(shown.out, "t src --a=more -a=src a=src two srcs ''\n"
			      "'it'\\''s' one 'a b' ''\\''' --b=one two '$x' A_z.09,/@%:-+=\n"),
		"as a shell reads them");
	OK(!ct_chain_owns(&c, "two"), "the last has not begun");
	put_text("w/step-2.state", "another two\nct-t\n\n");
	OK(!ct_chain_owns(&c, "two"), "nor has it under this name");
	put_text("w/step-2.state", "two\nct-t\n\n");
	OK(ct_chain_owns(&c, "two") && !ct_chain_owns(&c, "one") && !ct_chain_owns(&c, "src"),
		"but now");
	ct_chain_close(&c);
	OK(c.lock == -1 && !c.n && !*c.tools, "closed");
	ct_chain_close(&c);
}

/* The line of the script that goes to where it was made. */
static bool goes(const char *folder, const char *where)
{
	char want[400];
	struct ct_chain c;
	int rc;

	if (begin(&c, folder))
		return false;
	snprintf(want, sizeof want, "#!/bin/sh\nset -e\n%s\n", where);
	rc = ct_chain_write(&c, &env, &e);
	remove("../script");
	if (rename(folder[1] ? "../ww/commands.sh" : "commands.sh", "../script") &&
		rename("d/e/commands.sh", "../script"))
		rc = -1;
	ct_chain_close(&c);
	return rc == 0 && is_text(text_of("../script"), want);
}

static void test_script(void)
{
	char here[200], cd[300];
	struct ct_chain c;

	if (mkdir("w w", 0777) || chdir("w w") || mkdir("d", 0777) || !getcwd(here, sizeof here))
		exit(99);
	snprintf(cd, sizeof cd, "cd -- '%s'", here);
	OK(goes("d/e", "CDPATH= cd -P -- \"$(dirname -- \"$0\")/../..\""),
		"a folder below: upwards");
	OK(goes(".", cd), "this folder: by its name");
	if (chdir("..") || rename("w w", "w1") || chdir("w1") || !getcwd(here, sizeof here))
		exit(99);
	snprintf(cd, sizeof cd, "cd -- %s", here);
	if (symlink("w12", "../ww") || mkdir("../w12", 0777))
		exit(99);
	OK(goes("../ww", cd), "a folder beside, of a name that begins like this: by its name");
	must(begin(&c, "../ww"));
	if (mkdir("../gone", 0777) || chdir("../gone") || rmdir("../gone"))
		exit(99);
	OK(ct_chain_write(&c, &env, &e) == -1 && e.code == CT_EOUTPUT &&
			is_text(e.msg, "../ww: No such file or directory"),
		"no folder to go to");
	ct_chain_close(&c);
}

int main(void)
{
	self = getpid();
	scratch_begin();
	if (mkdir("bin", 0777) || mkdir("elsewhere", 0777))
		return 99;
	put_script("copy", "[ -e stop ] && exit $(cat stop)\n"
			   "[ -e stop2 ] && [ \"$2\" = out ] && exit $(cat stop2)\n"
			   "[ \"$1\" = - ] && set -- /dev/null \"$2\"\n"
			   "[ -e \"$1\" ] || exit 3\ncp \"$1\" \"$2\"");
	put_script("die", "kill -9 $$");
	put_script("say", "echo report; sleep 0.1; echo words >&2");
	put_script("wait", "echo $$ >pid; exec sleep 30");
	put_script("far", "");
	if (rename("bin/far", "elsewhere/far"))
		return 99;
	test_content();
	test_untold();
	test_begun();
	test_failures();
	test_place();
	test_reports();
	test_stop();
	remove("pid");
	test_orphan();
	test_words();
	test_script();
	return tap_done();
}
