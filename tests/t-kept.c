/* What is kept: a result that cannot be written where it should be; the folder of what a run makes:
 * what is done again, what is not ours, a script that was edited.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/keep.h"
#include "cli/kept.h"
#include "cli/resume.h"
#include "capture.h"
#include "core/clock.h"
#include "core/env.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/temp.h"
#include "scratch.h"

#include <fcntl.h>
#include <glob.h>
#include <math.h>
#include <signal.h>
#include <sys/wait.h>

static glob_t found;

/* Is there one file of this name, of the owner alone, which the message names? */
static bool kept(const char *pattern)
{
	struct stat st;

	globfree(&found);
	return glob(pattern, 0, NULL, &found) == 0 && found.gl_pathc == 1 &&
	       strstr(err.msg, found.gl_pathv[0]) && stat(found.gl_pathv[0], &st) == 0 &&
	       (st.st_mode & 0777) == 0600;
}

static void volume(const struct ct_env *env)
{
	const size_t n[3] = {3, 4, 5};
	struct ct_vol v = {0}, back = {0};
	unsigned char head[CT_SNIFF];
	struct ct_any any = {0};

	if (ct_vol_alloc(&v, n, &err))
		exit(99);
	for (size_t i = 0; i < 60; i++)
		v.data[i] = 0.5f * (float)i;
	OK(ct_keep_vol("there.nii", &v, env, &err) == 0 && access("there.nii", R_OK) == 0 &&
			glob("tmp/*", 0, NULL, &found) == GLOB_NOMATCH,
		"what can be written is, and nothing else");
	OK(ct_keep_vol("there.nii", &v, env, &err) == -1 && err.code == CT_EOUTPUT &&
			kept("tmp/kept.*.there.nii"),
		"what is there is not written over: %s", err.msg);
	unlink(found.gl_pathv[0]);
	OK(ct_keep_vol("gone/o.nii.gz", &v, env, &err) == -1 && err.code == CT_EOUTPUT &&
			strstr(err.msg, "gone/o.nii.gz: ") == err.msg &&
			kept("tmp/kept.*.o.nii.gz"),
		"a folder that is gone: %s", err.msg);
	OK(ct_vol_read(found.gl_pathv[0], &back, &err) == 0 &&
			memcmp(back.data, v.data, 60 * sizeof *v.data) == 0,
		"it is all there");
	unlink(found.gl_pathv[0]);
	OK(ct_keep_vol("gone/o.mha", &v, env, &err) == -1 && kept("tmp/kept.*.o.mha") &&
			ct_any_read(found.gl_pathv[0], &any, &err) == 0 &&
			memcmp(any.vol.data, v.data, 60 * sizeof *v.data) == 0 &&
			ct_signature_read(head, found.gl_pathv[0]) &&
			memcmp(head, "ObjectType", 10) == 0,
		"a MetaImage that cannot be written is kept as MetaImage: %s", err.msg);
	ct_any_free(&any);
	unlink(found.gl_pathv[0]);
	setenv("TMPDIR", "nowhere", 1);
	OK(ct_keep_vol("gone/o.nii", &v, env, &err) == -1 && err.code == CT_EOUTPUT &&
			!strstr(err.msg, "kept"),
		"nor can it be kept: %s", err.msg);
	setenv("TMPDIR", "tmp", 1);
	v.data[59] = INFINITY;
	OK(ct_keep_vol("there.nii", &v,
		   &(struct ct_env){.files = &(const struct ct_io_rule){.force = true}},
		   &err) == -1 &&
			err.code == CT_ENUMERIC && strstr(err.msg, "voxel (2,3,4) is infinite"),
		"what is not finite is no result: %s", err.msg);
	unlink("there.nii");
	ct_vol_free(&v);
	ct_vol_free(&back);
}

static void stack(const struct ct_env *env)
{
	struct ct_stack s = {0}, back = {0};

	if (ct_stack_alloc(&s, 2, 3, 4, &err))
		exit(99);
	for (size_t k = 0; k < 2; k++) {
		s.view[k].source[2] = -500;
		s.view[k].centre[2] = 400;
		s.view[k].u[0] = s.view[k].v[1] = 1;
	}
	for (size_t i = 0; i < 24; i++)
		s.data[i] = (float)i;
	OK(ct_keep_stack("gone/o.exr", &s, env, &err) == -1 && kept("tmp/kept.*.o.exr") &&
			ct_stack_read(found.gl_pathv[0], &back, &err) == 0 &&
			memcmp(back.data, s.data, 24 * sizeof *s.data) == 0,
		"and so a stack: %s", err.msg);
	unlink(found.gl_pathv[0]);
	s.data[23] = NAN;
	OK(ct_keep_stack("o.exr", &s, env, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "view 1, row 2, column 3 is NaN"),
		"nor of a stack: %s", err.msg);
	ct_stack_free(&s);
	ct_stack_free(&back);
}

/* A result whose folder has gone: kept where temporary files go, and the state from there on. */

#define CT_PARAMS struct params
struct params {
	const char *in;
	int n;
};
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", ""), CT_OPT(n, 'n', "n", "N", 0, 9, ""), CT_OPT_END};
static const struct params params = {"in", 3};

static int pack(struct ct_tensors *t, const void *work, struct ct_err *e)
{
	struct ct_tensor *x;
	const size_t one = 1;

	if (ct_tensors_add(t, "x", 1, &one, &x, e))
		return -1;
	x->data[0] = *(const float *)work;
	return 0;
}

static int unpack(void *work, const struct ct_tensors *t, struct ct_err *e)
{
	*(float *)work = t->n == 1 ? t->t[0].data[0] : 0;
	(void)e;
	return 0;
}

static bool put_there(const char *path)
{
	FILE *f = fopen(path, "w");

	return f && fclose(f) == 0;
}

/* A file is for its owner alone until it has its name. */
static void test_rights(void)
{
	struct ct_err e = {0};
	struct ct_out o;
	struct stat st;

	umask(022);
	OK(ct_out_open(&o, "x", NULL, &e) == 0 && stat(o.tmp.path, &st) == 0 &&
			(st.st_mode & 0777) == 0600,
		"a temporary file is for its owner");
	OK(ct_put(&o, "x", 1, &e) == 0 && ct_out_commit(&o, &e) == 0 && stat("x", &st) == 0 &&
			(st.st_mode & 0777) == 0644,
		"and then for whom the mask says");
	unlink("x");
}

static void t_rescue(void)
{
	const struct ct_command command = {0};
	const struct ct_env env = {.tool = "ct-test", .command = &command};
	const float work = 42;
	char root[] = "/tmp/t-rescue.XXXXXX", pattern[200];
	struct ct_resume r = {0};
	struct ct_err e = {0};
	float got = 0;
	struct stat st;
	glob_t there;

	if (!mkdtemp(root) || chdir(root) || mkdir("d", 0777) || mkdir("tmp", 0777))
		exit(99);
	setenv("TMPDIR", "tmp", 1);
	test_rights();
	OK(ct_resume_open(&r, "d/o", false, opts, &params, &env, &e) == 0, "a run begins");
	OK(ct_resume_load(&r, unpack, NULL, &e) == 1, "with no state");
	if (unlink("d/o.state.ct-locked") || rmdir("d"))
		exit(99);
	ct_fail(&e, CT_EOUTPUT, "d/o: No such file or directory");
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && e.code == CT_EOUTPUT,
		"its folder goes; the failure stays one");
	snprintf(pattern, sizeof pattern, "tmp/kept.*.o.state");
	OK(glob(pattern, 0, NULL, &there) == 0 && there.gl_pathc == 1, "the result is kept");
	OK(strstr(e.msg, "d/o: No such") == e.msg && strstr(e.msg, there.gl_pathv[0]),
		"and where is said: %s", e.msg);
	OK(stat(there.gl_pathv[0], &st) == 0 && (st.st_mode & 0777) == 0600, "for its owner");
	if (mkdir("d", 0777) || rename(there.gl_pathv[0], "d/o.state"))
		exit(99);
	ct_resume_close(&r);
	OK(ct_resume_open(&r, "d/o", true, opts, &params, &env, &e) == 0 &&
			ct_resume_load(&r, unpack, &got, &e) == 0 && got == 42,
		"moved to where it belongs it is gone on from");
	ct_resume_done(&r);
	OK(stat("d/o.state", &st) != 0, "and removed at the end");
	ct_resume_close(&r);
	OK(ct_resume_open(&r, "d/o", false, opts, &params, &env, &e) == 0 &&
			put_there("d/o.state") && ct_resume_save(&r, pack, &work, &e) == -1 &&
			e.code == CT_EOUTPUT,
		"what another run puts there meanwhile is not written over: %s", e.msg);
	ct_resume_done(&r);
	OK(stat("d/o.state", &st) == 0, "nor removed");
	ct_resume_close(&r);
	globfree(&there);
	OK(glob(pattern, 0, NULL, &there) == 0 && there.gl_pathc == 1 &&
			unlink(there.gl_pathv[0]) == 0,
		"its own is kept beside");
	globfree(&there);
	unlink("d/o.state");
	if (rmdir("d") || rmdir("tmp") || rmdir(root))
		exit(99);
}

/* A result that cannot be written where it should be is kept elsewhere, and that is said. */
static void test_elsewhere(void)
{
	const struct ct_env env = {.tool = "ct-test"};
	char root[] = "/tmp/t-keep.XXXXXX";

	if (!mkdtemp(root) || chdir(root) || mkdir("tmp", 0777))
		exit(99);
	setenv("TMPDIR", "tmp", 1);
	volume(&env);
	stack(&env);
	globfree(&found);
	rmdir("tmp");
	t_rescue();
	unsetenv("TMPDIR");
	if (rmdir(root))
		exit(99);
}

/* The folder that keeps what a run makes. */
static struct ct_err e;
static char said[4000]; /* through the log */

static void note(const struct ct_env *env, enum ct_level level, const char *text)
{
	(void)env;
	snprintf(said + strlen(said), sizeof said - strlen(said), "%d %s\n", (int)level, text);
}

static struct ct_io_rule files;
static struct ct_env env = {.tool = "ct-t", .files = &files, .log = note};

static const char *const outputs[] = {"k/a", "k/b", "elsewhere"};

static int begin(struct ct_kept *k, const char *folder)
{
	e = (struct ct_err){0};
	said[0] = '\0';
	return ct_kept_open(k, folder, 3, outputs, &env, &e);
}

/* What output `place` is, with a key; -1 for an error. */
static int look(struct ct_kept *k, size_t place, const char *key, bool of_own)
{
	char hex[CT_HASH_HEX];
	enum ct_kept_is is;

	said[0] = '\0';
	e = (struct ct_err){0};
	return ct_kept_look(&is, hex, k, place, outputs[place], key, of_own, &env, &e) ? -1
										       : (int)is;
}

/* A run makes it. */
static void make(struct ct_kept *k, size_t place, const char *key, const char *text)
{
	char hex[CT_HASH_HEX];

	must(ct_kept_note(k, place, outputs[place], key, "-", &err));
	if (!text)
		return;
	put_text(outputs[place], text);
	ct_hash_hex(hex, strlen(text), text);
	must(ct_kept_note(k, place, outputs[place], key, hex, &err));
}

static void test_done(void)
{
	struct ct_kept k;

	must(begin(&k, "k"));
	OK(look(&k, 1, "a1", false) == CT_KEPT_MISSING && !ct_kept_owns(&k, 1, "k/b"),
		"in a new folder nothing was done");
	make(&k, 1, "a1", NULL);
	ct_kept_close(&k);
	OK(is_there("k/lock"), "a new folder in which something was made keeps its lock");
	must(begin(&k, "k"));
	OK(look(&k, 1, "a1", false) == CT_KEPT_BEGUN && ct_kept_owns(&k, 1, "k/b"),
		"an output that is noted before it is done has begun");
	OK(look(&k, 1, "a2", false) == CT_KEPT_MISSING, "an output with another key has not begun");
	make(&k, 1, "a1", "one");
	make(&k, 2, "a1", "two");
	ct_kept_close(&k);
	OK(k.lock == -1 && !k.folder, "a folder that is closed is closed");
	ct_kept_close(&k);
	must(begin(&k, "k"));
	OK(look(&k, 1, "a1", false) == CT_KEPT_DONE && look(&k, 2, "a1", false) == CT_KEPT_DONE,
		"an output that holds what was noted is done");
	OK(!ct_kept_owns(&k, 1, "b") && !ct_kept_owns(&k, 2, "elsewher"),
		"an output is owned under its own name alone");
	OK(look(&k, 2, "a2", false) == CT_KEPT_MISSING && is_there("elsewhere"),
		"an output elsewhere with another key is to be made, and stays until then");
	put_text("elsewhere", "mine");
	OK(look(&k, 2, "a1", false) == -1 && e.code == CT_EOUTPUT &&
			strncmp(e.msg, "elsewhere: was changed since", 28) == 0,
		"an output elsewhere that was changed is refused");
	files.force = true;
	OK(look(&k, 2, "a1", false) == CT_KEPT_MISSING &&
			is_text(said, "0 elsewhere: was changed, and is made again\n"),
		"with force it is to be made, and that is said");
	files.force = false;
	OK(look(&k, 1, "a2", false) == CT_KEPT_MISSING && !is_there("k/b"),
		"an output in the folder with another key is removed");
	ct_kept_close(&k);
}

static void test_own(void)
{
	struct ct_kept k;

	must(begin(&k, "k"));
	make(&k, 1, "a1", "one");
	put_text("k/b", "mine");
	OK(look(&k, 1, "a1", false) == CT_KEPT_OWN && strncmp(said, "0 k/b: is not what", 18) == 0,
		"a file that a person changed is theirs, and that is said");
	OK(look(&k, 1, "a2", false) == -1 && e.code == CT_EOUTPUT &&
			strncmp(e.msg, "k/b: is not what a run made of this input", 41) == 0,
		"a person's own file with another key is refused");
	OK(look(&k, 1, "a2", true) == CT_KEPT_OWN,
		"a person's own file that is made of another one is used");
	OK(look(&k, 1, "a1", false) == CT_KEPT_OWN && is_text(text_of("k/b"), "mine"),
		"a person's own file stays as it is");
	put_text("k/a", "mine");
	OK(look(&k, 0, "a1", false) == CT_KEPT_OWN,
		"a file that a person put where the run has not come is used");
	OK(look(&k, 0, "a2", false) == -1 && is_text(text_of("k/a"), "mine"),
		"a file that a person put there is refused with another key");
	remove("k/a");
	make(&k, 1, "a1", NULL);
	OK(look(&k, 1, "a1", false) == CT_KEPT_OWN,
		"a file that was written when its run was killed is not made again");
	make(&k, 1, "a1", "one");
	ct_kept_close(&k);
}

/* run.state, `from` in its first line being `to`. */
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

/* Is the folder refused for this file? */
static bool refuses(const char *file)
{
	char want[200];
	struct ct_kept k;
	const int rc = begin(&k, "k");

	ct_kept_close(&k);
	snprintf(want, sizeof want, "%s: exists, and no run in this folder made it", file);
	return rc == -1 && e.code == CT_EOUTPUT && strncmp(e.msg, want, strlen(want)) == 0;
}

static void test_versions(void)
{
	struct ct_kept k;

	change(PACKAGE_VERSION, "9.9.9");
	must(begin(&k, "k"));
	make(&k, 2, "a2", "two");
	ct_kept_close(&k);
	must(begin(&k, "k"));
	OK(look(&k, 2, "a2", false) == CT_KEPT_DONE,
		"what this version made beside another is done");
	put_text("k/b", "mine");
	OK(look(&k, 1, "a1", false) == CT_KEPT_OWN,
		"a person's own file is used after another version");
	put_text("k/b", "one");
	OK(look(&k, 1, "a1", false) == CT_KEPT_MISSING && !is_there("k/b"),
		"what another version made is owned, and not done");
	ct_kept_close(&k);
	change("ct-t", "ct-u");
	OK(refuses("k/run.state"), "a state of another command is refused");
	put_text("k/run.state", "mine\n");
	OK(refuses("k/run.state"), "a file that is no state is refused");
	remove("k/run.state");
	put_text("k/b", "mine");
	OK(refuses("k/b"), "an output that no run made is refused by its name");
	files.force = true;
	put_text("k/run.state", "mine\n");
	must(begin(&k, "k"));
	OK(look(&k, 1, "a1", false) == CT_KEPT_MISSING && !is_there("k/run.state"),
		"what no run made is replaced by force");
	files.force = false;
	ct_kept_close(&k);
}

static void test_commands_sh(void)
{
	struct ct_kept k;

	must(begin(&k, "k"));
	must(ct_kept_script(&k, "one\n", 4, &env, &err));
	OK(is_text(text_of("k/commands.sh"), "one\n"), "a script is written");
	must(ct_kept_script(&k, "two\n", 4, &env, &err));
	OK(is_text(text_of("k/commands.sh"), "two\n") && !*said,
		"a script of a run is replaced by the next");
	put_text("k/commands.sh", "mine\n");
	files.force = true;
	must(ct_kept_script(&k, "two\n", 4, &env, &err));
	OK(is_text(text_of("k/commands.sh"), "mine\n") &&
			strncmp(said, "0 k/commands.sh: was edited, and stays", 37) == 0,
		"a script that was edited stays, forced or not, and that is said");
	files.force = false;
	remove("k/commands.sh");
	must(ct_kept_script(&k, "two\n", 4, &env, &err));
	OK(is_text(text_of("k/commands.sh"), "two\n"), "a script that was removed is written anew");
	ct_kept_close(&k);
	remove("k/run.state");
	OK(refuses("k/commands.sh"), "a script that no run made is refused");
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

/* Has that process a file of this name open? */
static bool has_open(pid_t pid, const char *end)
{
	char pattern[40], to[200];
	bool has = false;

	snprintf(pattern, sizeof pattern, "/proc/%d/fd/*", (int)pid);
	globfree(&found);
	glob(pattern, 0, NULL, &found);
	for (size_t i = 0; i < found.gl_pathc && !has; i++) {
		const ssize_t n = readlink(found.gl_pathv[i], to, sizeof to);
		const size_t k = strlen(end);

		has = n >= (ssize_t)k && memcmp(to + n - k, end, k) == 0;
	}
	return has;
}

/* A process that has the file locked, and removes it when we wait for it. */
static void remove_locked(const char *path)
{
	const pid_t we = getpid();
	int fd, ready[2];
	char byte = 0;

	if (pipe(ready))
		exit(99);
	if (fork() == 0) {
		fd = open(path, O_RDWR);
		if (!ct_temp_lock(fd) || write(ready[1], &byte, 1) != 1)
			_exit(1);
		while (getppid() == we && !has_open(we, path))
			ct_clock_sleep(0.001);
		_exit(unlink(path));
	}
	if (read(ready[0], &byte, 1) != 1)
		exit(99);
	close(ready[0]);
	close(ready[1]);
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
	OK(!is_there("d"), "a new folder in which nothing was made goes when it is closed");
	must(mkdir("d", 0777));
	OK(begin(&k, "d") == 0, "a folder that is there is taken");
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
	remove_locked("d/lock");
	OK(fails("d", "d: another run just removed it"),
		"a lock that is removed while it is waited for locks nothing");
	wait(NULL);
	put_text("a", "");
	OK(fails("a", "a/lock: Not a directory"), "a file is no folder to keep in");
	OK(fails("x/y", "x/y: No such file or directory"),
		"a folder is not made in one that is not there");
	if (mkdir("l", 0777) || symlink("../a", "l/lock"))
		exit(99);
	OK(fails("l", NULL), "a lock is no link");
	unsetenv("TMPDIR");
	OK(is_text(ct_keep_folder(), "/tmp"), "temporary files go to /tmp without TMPDIR");
}

int main(void)
{
	alarm(60);
	test_elsewhere();
	scratch_begin();
	test_done();
	test_own();
	test_versions();
	test_commands_sh();
	test_folder();
	return tap_done();
}
