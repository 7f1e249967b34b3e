/* Commands as words, and the folder that keeps what a run makes: what is done again, what is not
 * ours, a script that was edited. */
#include "config.h"
#include "cli/commands.h"
#include "cli/keep.h"
#include "cli/kept.h"
#include "capture.h"
#include "core/clock.h"
#include "formats/temp.h"
#include "scratch.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>

static struct ct_err e;
static struct capture shown;
static char said[4000]; /* through the log */

static void note(const struct ct_env *env, enum ct_level level, const char *text)
{
	(void)env;
	snprintf(said + strlen(said), sizeof said - strlen(said), "%d %s\n", (int)level, text);
}

static struct ct_io_rule files;
static struct ct_env env = {.tool = "ct-t", .files = &files, .log = note};

static void add_two(struct ct_commands *c)
{
	*c = (struct ct_commands){.source = {"src", "more"}};
	ct_commands_add(c, "one", "t");
	ct_commands_words(c, "src", "--a=more", "-a=src", "a=src", "two", "srcs", "", NULL);
	ct_commands_add(c, "two", "it's");
	ct_commands_words(c, "one", "a b", "'", "--b=one", "two", "$x", "A_z.09,/@%:-+=", NULL);
}

static void test_words(void)
{
	struct ct_commands c;

	add_two(&c);
	OK(ct_commands_input(&c, 0, 1) && ct_commands_input(&c, 1, 1),
		"a word that is a source, or was made before, is an input");
	OK(is_text(ct_commands_input(&c, 0, 2), "more") &&
			is_text(ct_commands_input(&c, 1, 4), "one"),
		"an input is found behind its option too");
	OK(!ct_commands_input(&c, 0, 3) && !ct_commands_input(&c, 0, 4) &&
			!ct_commands_input(&c, 0, 5) && !ct_commands_input(&c, 0, 6) &&
			!ct_commands_input(&c, 0, 0) && !ct_commands_input(&c, 1, 5) &&
			!ct_commands_input(&c, 1, 2),
		"no other word is an input");
	capture_begin(&shown);
	ct_commands_print(&c, "", stdout);
	capture_end(&shown);
	OK(is_text(shown.out, "t src --a=more -a=src a=src two srcs ''\n"
			      "'it'\\''s' one 'a b' ''\\''' --b=one two '$x' A_z.09,/@%:-+=\n"),
		"words are printed as a shell reads them");
	ct_commands_free(&c);
	OK(!c.n, "commands that are freed are none");
}

static const char *hide(const void *ctx, const char *name)
{
	return strcmp(name, ctx) == 0 ? "IN" : NULL;
}

static void test_history(void)
{
	struct ct_commands c = {.n = 0};
	char *text;

	ct_commands_add(&c, "o", "t");
	ct_commands_words(&c, "a/b", "--x=c/d", "--expand=7", "-n3", "a b/c d", "d/", NULL);
	OK(ct_commands_history(&text, &c, 0, NULL, NULL, &e) == 0 &&
			is_text(text, "t " PACKAGE_VERSION " b --x=d -n3 'c d' d/"),
		"a history has files by their last names, and nothing that only says how to work");
	free(text);
	OK(ct_commands_history(&text, &c, 0, hide, "c/d", &e) == 0 &&
			is_text(text, "t " PACKAGE_VERSION " b --x=IN -n3 'c d' d/"),
		"a history hides the file that it is told to hide");
	free(text);
	ct_commands_free(&c);
}

/* The line of the script that goes to where it was made. */
static bool goes(const char *folder, const char *where)
{
	char want[400];
	struct ct_commands c = {.n = 0};
	FILE *f = fopen("../script", "w");
	int rc;

	if (!f)
		exit(99);
	snprintf(want, sizeof want, "#!/bin/sh\nset -e\n%s\nt a --force\n", where);
	ct_commands_add(&c, "b", "t");
	ct_commands_words(&c, "a", NULL);
	rc = ct_commands_script(&c, folder, f, &e);
	fclose(f);
	ct_commands_free(&c);
	return rc == 0 && is_text(text_of("../script"), want);
}

static void test_script(void)
{
	char here[200], cd[300];

	if (mkdir("w w", 0777) || chdir("w w") || mkdir("d", 0777) || mkdir("d/e", 0777) ||
		!getcwd(here, sizeof here))
		exit(99);
	snprintf(cd, sizeof cd, "cd -- '%s'", here);
	OK(goes("d/e", "CDPATH= cd -P -- \"$(dirname -- \"$0\")/../..\""),
		"the script of a folder below goes upwards");
	OK(goes(".", cd), "the script of this folder goes to it by its name");
	if (chdir("..") || rename("w w", "w1") || chdir("w1") || !getcwd(here, sizeof here))
		exit(99);
	snprintf(cd, sizeof cd, "cd -- %s", here);
	if (symlink("w12", "../ww") || mkdir("../w12", 0777))
		exit(99);
	OK(goes("../ww", cd),
		"a folder beside, whose name begins like this one, is gone to by name");
	if (mkdir("../gone", 0777) || chdir("../gone") || rmdir("../gone"))
		exit(99);
	{
		struct ct_commands c = {.n = 0};

		OK(ct_commands_script(&c, "../ww", stderr, &e) == -1 && e.code == CT_EOUTPUT,
			"a script that has no folder to go to is an error");
	}
	if (chdir(scratch_path))
		exit(99);
}

static int begin(struct ct_kept *k, const char *folder)
{
	e = (struct ct_err){0};
	said[0] = '\0';
	return ct_kept_open(k, folder, &env, &e);
}

static void test_done(void)
{
	struct ct_kept k;

	must(begin(&k, "k"));
	OK(ct_kept_look(&k, 1, "a1", "c1") == CT_KEPT_NOTHING && !ct_kept_owns(&k, "out"),
		"in a new folder nothing was done");
	must(ct_kept_note(&k, 1, "out", "a1", "", &err));
	OK(ct_kept_look(&k, 1, "a1", "c1") == CT_KEPT_BEGUN && ct_kept_owns(&k, "out"),
		"a step that is noted before it is done has begun");
	OK(ct_kept_look(&k, 1, "a2", "c1") == CT_KEPT_NOTHING,
		"a step with another key has not begun");
	ct_kept_close(&k);
	must(begin(&k, "k"));
	OK(ct_kept_look(&k, 1, "a1", "c1") == CT_KEPT_BEGUN, "what has begun is known afterwards");
	must(ct_kept_note(&k, 1, "out", "a1", "c1", &err));
	ct_kept_close(&k);
	must(begin(&k, "k"));
	OK(ct_kept_look(&k, 1, "a1", "c1") == CT_KEPT_DONE &&
			ct_kept_look(&k, 1, "a1", "c2") == CT_KEPT_NOTHING &&
			ct_kept_look(&k, 1, "a1", "") == CT_KEPT_NOTHING,
		"a step is done while its output holds what it did");
	OK(ct_kept_look(&k, 1, "", "c1") == CT_KEPT_NOTHING, "a key that is not known is no proof");
	OK(ct_kept_owns(&k, "out") && !ct_kept_owns(&k, "out2") && !ct_kept_owns(&k, "ou"),
		"an output is owned under its own name alone");
	must(ct_kept_note(&k, 2, "m", "", "c1", &err));
	OK(ct_kept_look(&k, 2, "", "c1") == CT_KEPT_NOTHING && ct_kept_owns(&k, "m"),
		"what was made of a stream is owned, and not done");
	ct_kept_close(&k);
	OK(k.lock == -1 && !k.folder, "a folder that is closed is closed");
	ct_kept_close(&k);
}

/* run.state, each `from` in its first line being `to`. */
static void change(const char *from, const char *to)
{
	char text[4000], *at;

	snprintf(text, sizeof text, "%s", text_of("k/run.state"));
	at = strstr(text, from);
	if (!at)
		exit(99);
	memcpy(at, to, strlen(to));
	put_text("k/run.state", text);
}

static void test_versions(void)
{
	struct ct_kept k;

	change(PACKAGE_VERSION, "9.9.9");
	must(begin(&k, "k"));
	OK(ct_kept_look(&k, 1, "a1", "c1") == CT_KEPT_NOTHING && ct_kept_owns(&k, "out"),
		"what another version made is owned, and not done");
	must(ct_kept_note(&k, 2, "m", "a2", "c2", &err));
	OK(ct_kept_look(&k, 1, "a1", "c1") == CT_KEPT_NOTHING &&
			ct_kept_look(&k, 2, "a2", "c2") == CT_KEPT_DONE,
		"another version is not believed when the state is written anew");
	ct_kept_close(&k);
	change("ct-t", "ct-u");
	must(begin(&k, "k"));
	OK(k.foreign && ct_kept_check(&k, 0, NULL, &env, &e) == -1 && e.code == CT_EOUTPUT &&
			strncmp(e.msg, "k/run.state: exists, and no run in this folder made it",
				54) == 0,
		"a state of another command is refused");
	ct_kept_close(&k);
	put_text("k/run.state", "mine\n");
	must(begin(&k, "k"));
	OK(ct_kept_check(&k, 0, NULL, &env, &e) == -1,
		"a file of that name that is no state is refused");
	files.force = true;
	OK(ct_kept_check(&k, 0, NULL, &env, &e) == 0, "a state that is none is replaced by force");
	files.force = false;
	ct_kept_close(&k);
}

static void test_foreign(void)
{
	const char *const outputs[] = {"f/a", "f/b", "elsewhere"};
	struct ct_kept k;

	must(begin(&k, "f"));
	put_text("elsewhere", "");
	OK(ct_kept_check(&k, 3, outputs, &env, &e) == 0,
		"a file beside the folder is not asked about");
	put_text("f/b", "");
	OK(ct_kept_check(&k, 3, outputs, &env, &e) == -1 &&
			strncmp(e.msg, "f/b: exists, and no run", 23) == 0,
		"a file in the folder that no run made is refused by its name");
	must(ct_kept_note(&k, 0, "f/b", "a1", "", &err));
	OK(ct_kept_check(&k, 3, outputs, &env, &e) == 0, "one that a run began is not refused");
	ct_kept_close(&k);
}

static void test_commands_sh(void)
{
	struct ct_kept k;

	must(begin(&k, "s"));
	must(ct_kept_script(&k, "one\n", 4, &env, &err));
	OK(is_text(text_of("s/commands.sh"), "one\n"), "a script is written");
	must(ct_kept_script(&k, "two\n", 4, &env, &err));
	OK(is_text(text_of("s/commands.sh"), "two\n") && !*said,
		"a script of a run is replaced by the next");
	put_text("s/commands.sh", "mine\n");
	files.force = true;
	must(ct_kept_script(&k, "two\n", 4, &env, &err));
	OK(is_text(text_of("s/commands.sh"), "mine\n") &&
			strncmp(said, "0 s/commands.sh: was edited, and stays", 37) == 0,
		"a script that was edited stays, forced or not, and that is said");
	files.force = false;
	remove("s/commands.sh");
	must(ct_kept_script(&k, "two\n", 4, &env, &err));
	OK(is_text(text_of("s/commands.sh"), "two\n"), "a script that was removed is written anew");
	ct_kept_close(&k);
	must(begin(&k, "t"));
	put_text("t/commands.sh", "mine\n");
	OK(ct_kept_script(&k, "two\n", 4, &env, &e) == -1 && e.code == CT_EOUTPUT &&
			is_text(text_of("t/commands.sh"), "mine\n"),
		"a script that no run made is refused");
	OK(ct_kept_script(&k, "mine\n", 5, &env, &e) == 0,
		"unless it is the one that would be written");
	ct_kept_close(&k);
}

/* Holds the lock of `path` for a while from now on. */
static pid_t keep_locked(const char *path, double seconds)
{
	int ready[2];
	pid_t pid;
	char byte = 0;

	if (pipe(ready))
		exit(99);
	pid = fork();
	if (pid == 0) {
		if (!ct_temp_lock(open(path, O_RDWR)) || write(ready[1], &byte, 1) != 1)
			_exit(1);
		ct_clock_sleep(seconds);
		_exit(0);
	}
	close(ready[1]);
	if (read(ready[0], &byte, 1) != 1)
		exit(99);
	close(ready[0]);
	return pid;
}

/* Cannot be opened, for this reason. */
static bool fails(const char *folder, const char *why)
{
	struct ct_kept k;
	const bool is =
		begin(&k, folder) == -1 && e.code == CT_EOUTPUT && (!why || is_text(e.msg, why));

	ct_kept_close(&k);
	return is;
}

static void test_folder(void)
{
	struct ct_kept k;
	double start;
	pid_t pid;

	OK(begin(&k, "d") == 0 && rights_of("d") == 0755 && rights_of("d/lock") == 0600 &&
			is_text(k.folder, "d"),
		"a folder is made, and locked");
	ct_kept_close(&k);
	OK(is_there("d/lock"), "the lock stays when the folder is closed");
	pid = keep_locked("d/lock", 0.3);
	OK(begin(&k, "d") == 0 && k.lock >= 0, "a run that ends soon is waited for");
	ct_kept_close(&k);
	waitpid(pid, NULL, 0);
	pid = keep_locked("d/lock", 60);
	start = ct_clock_wall();
	OK(fails("d", "d: another run works in it"), "a run that does not end is another run");
	OK(ct_clock_wall() - start < 20, "which is told soon");
	kill(pid, SIGKILL);
	waitpid(pid, NULL, 0);
	put_text("a", "");
	OK(fails("a", "a/lock: Not a directory"), "a file is no folder to keep in");
	OK(fails("x/y", "x/y: No such file or directory"),
		"a folder is not made in one that is not there");
	if (mkdir("l", 0777) || symlink("../a", "l/lock"))
		exit(99);
	OK(fails("l", NULL), "a lock is no link");
	setenv("TMPDIR", "", 1);
	OK(is_text(ct_keep_folder(), "/tmp"), "temporary files go to /tmp if TMPDIR is empty");
}

int main(void)
{
	alarm(60);
	scratch_begin();
	test_words();
	test_history();
	test_script();
	test_done();
	test_versions();
	test_foreign();
	test_commands_sh();
	test_folder();
	return tap_done();
}
