/* Bytes in and out: whole files, names and rights of outputs, temporary files, hashes, expansion.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/meta.h"
#include "formats/hash.h"
#include "core/inflate.h"
#include "formats/io.h"
#include "formats/out-folder.h"
#include "formats/temp.h"
#include "formats/text.h"
#include "tap.h"

#include <fcntl.h>
#include <glob.h>
#include <limits.h>
#include <poll.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}};

static void save(const char *path, const void *p, size_t n)
{
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(p, 1, n, f) != n || fclose(f) != 0)
		exit(99);
}

static bool there(const char *path)
{
	return access(path, F_OK) == 0;
}

static unsigned mode_of(const char *path)
{
	struct stat st;

	return stat(path, &st) == 0 ? (unsigned)st.st_mode & 07777 : 0;
}

/* How many names match. */
static size_t count(const char *pattern)
{
	glob_t g;
	size_t n = glob(pattern, 0, NULL, &g) == 0 ? g.gl_pathc : 0;

	globfree(&g);
	return n;
}

/* Fails with the code and the words. */
static bool says(int rc, enum ct_code code, const char *words)
{
	const bool good = rc == -1 && err.code == code && strstr(err.msg, words);

	if (!good)
		printf("# %d, code %d: %s\n", rc, (int)err.code, err.msg);
	err = (struct ct_err){0};
	return good;
}

static void test_slurp(void)
{
	static const size_t sizes[] = {0, 1, 65535, 65536, 65537, 200000, 1000000};
	unsigned char *p = malloc(1000000), *data;
	size_t n;

	if (!p)
		exit(99);
	for (size_t i = 0; i < 1000000; i++)
		p[i] = (unsigned char)(i * 7919 >> 5);
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		save("whole", p, sizes[i]);
		OK(ct_slurp("whole", &data, &n, &err) == 0 && n == sizes[i] &&
				memcmp(data, p, n) == 0,
			"%zu bytes are read", sizes[i]);
		free(data);
	}
	free(p);
	OK(says(ct_slurp("none", &data, &n, &err), CT_EINPUT, "none: No such") && !data,
		"not what is not there");
	OK(says(ct_slurp(".", &data, &n, &err), CT_EINPUT, ".: is a folder") && !data && n == 0,
		"nor a folder");
	if (there("/proc/self/mem")) /* nothing is mapped at 0 */
		OK(says(ct_slurp("/proc/self/mem", &data, &n, &err), CT_EINPUT, "mem: ") && !data,
			"nor what cannot be read");
	unlink("whole");
}

static int write_to(const char *path, const char *text, const struct ct_env *env)
{
	struct ct_out o;

	if (ct_out_open(&o, path, env, &err))
		return -1;
	return ct_put(&o, text, strlen(text), &err) || ct_out_commit(&o, &err) ? -1 : 0;
}

/* A file is closed, standard input is not. */
static void test_close(void)
{
	const int next = dup(0);
	unsigned char *data;
	size_t n;
	FILE *f;

	close(next);
	save("three", "abc", 3);
	must(ct_slurp("three", &data, &n, &err));
	free(data);
	if (!freopen("three", "rb", stdin) || ct_io_open("-", &f, &err))
		exit(99);
	OK(f == stdin && fgetc(f) == 'a', "standard input is open");
	ct_io_close(f);
	OK(fgetc(stdin) == 'b', "and stays so");
	OK(says(ct_io_open(".", &f, &err), CT_EINPUT, "folder"), "a folder is none");
	ct_io_close(NULL);
	must(ct_io_open("three", &f, &err));
	OK(fileno(f) == next, "all else was closed");
	ct_io_close(f);
	unlink("three");
}

static void test_names(void)
{
	struct stat a, b;
	struct ct_out o;

	OK(write_to("a", "one", NULL) == 0 && count(".ctsr-*") == 0, "a file is made");
	OK(says(write_to("a", "two", NULL), CT_EOUTPUT, "a: exists; overwrite = 1"),
		"kept without force");
	OK(write_to("a", "three", &force) == 0 && stat("a", &a) == 0 && a.st_size == 5, "or not");
	OK(says(write_to(".", "x", &force), CT_EOUTPUT, ".: is a folder"), "a folder is kept");
	OK(says(write_to("none/a", "x", &force), CT_EOUTPUT, "none/a: "), "no folder, no file");
	if (symlink("a", "link"))
		exit(99);
	OK(write_to("link", "seven77", &force) == 0 && stat("a", &a) == 0 && a.st_size == 7 &&
			lstat("link", &b) == 0 && S_ISLNK(b.st_mode),
		"a link is followed");
	OK(ct_out_open_private(&o, "link", &err) == 0 && ct_put(&o, "s", 1, &err) == 0 &&
			ct_out_commit(&o, &err) == 0 && lstat("link", &b) == 0 &&
			S_ISREG(b.st_mode) && b.st_size == 1 && mode_of("link") == 0600 &&
			stat("a", &a) == 0 && a.st_size == 7,
		"but not by what its owner alone may read");
	OK(write_to("/dev/null", "x", NULL) == 0 && count("/dev/null.ct-*") == 0, "a device");
	if (there("/dev/full"))
		OK(says(write_to("/dev/full", "x", NULL), CT_EOUTPUT, "/dev/full: No space"),
			"a full one");
	unlink("a");
	unlink("link");
}

static void test_rights(void)
{
	struct stat st;

	umask(027);
	OK(write_to("a", "x", NULL) == 0 && write_to("b", "x", NULL) == 0 && mode_of("a") == 0640 &&
			mode_of("b") == 0640,
		"a file is for whom the mask says, the second like the first");
	umask(022);
	if (chmod("a", 0751))
		exit(99);
	OK(write_to("a", "y", &force) == 0 && mode_of("a") == 0751,
		"one that was there keeps rights");
	if (geteuid() == 0) {
		if (chown("a", 12, 34) || chmod("a", 0664) || chmod(".", 0777))
			exit(99);
		OK(write_to("a", "z", &force) == 0 && stat("a", &st) == 0 && st.st_uid == 12 &&
				st.st_gid == 34 && mode_of("a") == 0664,
			"and its owner");
		if (chown("a", 12, getegid()) || chmod("a", 0664) || seteuid(65534))
			exit(99);
		OK(write_to("a", "z", &force) == 0 && stat("a", &st) == 0 && st.st_uid == 65534 &&
				st.st_gid == getegid() && mode_of("a") == 0664,
			"or its group");
		if (seteuid(0) || chown("a", 12, 34) || seteuid(65534))
			exit(99);
		OK(write_to("a", "z", &force) == 0 && stat("a", &st) == 0 && st.st_uid == 65534 &&
				mode_of("a") == 0604,
			"or gives none to a group that is another");
		if (seteuid(0))
			exit(99);
	}
	unlink("a");
	unlink("b");
}

/* What another program puts there between the begin and the end of an output. */
static void test_meanwhile(void)
{
	static const struct ct_env *const rules[] = {NULL, &force};
	struct ct_out_set all = {0};
	struct ct_out_folder d;
	char path[PATH_MAX];
	struct ct_out o;
	struct stat st;

	for (size_t k = 0; k < 2; k++) {
		if (ct_out_open(&o, "a", rules[k], &err) || ct_put(&o, "ours", 4, &err))
			exit(99);
		save("a", "their file", 10);
		OK(k ? ct_out_commit(&o, &err) == 0
		     : says(ct_out_commit(&o, &err), CT_EOUTPUT,
			       "a: was put there by another program"),
			"a file that came meanwhile is %s", k ? "replaced with force" : "told");
		OK(stat("a", &st) == 0 && st.st_size == (k ? 4 : 10) && count(".ctsr-*") == 0,
			"a file that came meanwhile %s", k ? "is ours then" : "stays as it is");
		unlink("a");
	}
	for (size_t k = 0; k < 2; k++) {
		if (ct_out_open(&o, k ? "a" : "b", NULL, &err))
			exit(99);
		o.together = &all;
		if (ct_out_commit(&o, &err))
			exit(99);
	}
	save("a", "their file", 10);
	OK(says(ct_out_set_commit(&all, &err), CT_EOUTPUT, "a: was put") && !there("b") &&
			stat("a", &st) == 0 && st.st_size == 10,
		"of two outputs neither is made where one came meanwhile");
	unlink("a");
	if (ct_out_folder_open(&d, "d", "*.dcm", NULL, &err))
		exit(99);
	snprintf(path, sizeof path, "%s/1.dcm", d.tmp.path);
	save(path, "ours", 4);
	if (mkdir("d", 0777))
		exit(99);
	save("d/2.dcm", "theirs", 6);
	OK(says(ct_out_folder_commit(&d, &err), CT_EOUTPUT, "d: holds files") && there("d/2.dcm") &&
			!there("d/1.dcm") && count(".ctsr-*") == 0,
		"a folder of files that came meanwhile stays as it is");
	unlink("d/2.dcm");
	rmdir("d");
}

static void test_ends(void)
{
	struct ct_out o;
	char name[100];

	OK(ct_out_open(&o, "a", NULL, &err) == 0 && ct_put(&o, "x", 1, &err) == 0 &&
			there(o.tmp.path) && !there("a"),
		"until the end there is a temporary file");
	ct_out_abandon(&o);
	OK(!o.f && !o.path && !o.tmp.path && count("a*") == 0, "and none if it is abandoned");
	ct_out_abandon(&o);
	if (ct_out_open(&o, "a", NULL, &err) || mkdir("a", 0777))
		exit(99);
	OK(says(ct_out_commit(&o, &err), CT_EOUTPUT, "a: ") && count(".ctsr-*") == 0,
		"a folder that comes between is an error");
	rmdir("a");
	test_meanwhile();
	if (ct_out_open(&o, "a", NULL, &err))
		exit(99);
	snprintf(name, sizeof name, "%s", o.tmp.path);
	OK(ct_out_commit(&o, &err) == 0 && !o.f && !o.tmp.path && there("a") && !there(name),
		"an end");
	*strrchr(name, '/') = '\0';
	if (mkdir(name, 0700))
		exit(99);
	ct_temp_remove_all();
	OK(there(name), "its name is forgotten");
	rmdir(name);
	unlink("a");
	if (ct_out_open(&o, "a", NULL, &err))
		exit(99);
	ct_temp_remove_all();
	OK(!there(o.tmp.path), "what is not at its end goes when the program does");
	ct_out_abandon(&o);
	OK(ct_out_open(&o, "-", NULL, &err) == 0 && o.f == stdout && ct_out_commit(&o, &err) == 0 &&
			fileno(stdout) == STDOUT_FILENO,
		"standard output stays open");
}

static void test_check(void)
{
	OK(ct_out_check("a", NULL, &err) == 0 && count("a*") == 0, "a file could be made");
	save("a", "x", 1);
	OK(says(ct_out_check("a", NULL, &err), CT_EOUTPUT, "exists"), "but not where one is");
	OK(ct_out_check("a", &force, &err) == 0 && count("a*") == 1 && there("a"), "without force");
	OK(ct_out_check("-", NULL, &err) == 0 && ct_out_check("/dev/null", NULL, &err) == 0,
		"standard output and a device");
	OK(says(ct_out_check("none/a", NULL, &err), CT_EOUTPUT, "none/a: "),
		"nor without a folder");
	if (geteuid() == 0 && mkfifo("fifo", 0400) == 0) {
		const pid_t child = fork();
		int status = 0;

		if (child == 0) /* access() asks for the real user */
			_exit(setuid(65534) || ct_out_check("fifo", NULL, &err) != -1 ||
				err.code != CT_EOUTPUT);
		waitpid(child, &status, 0);
		OK(status == 0, "nor into what may not be written");
		unlink("fifo");
	}
	unlink("a");
}

static void test_same(void)
{
	const int out = dup(STDOUT_FILENO);
	bool whole, piped;
	int fd;

	if (mkdir("d", 0777) || symlink("d", "e"))
		exit(99);
	save("a", "x", 1);
	save("d/a", "x", 1);
	if (link("a", "hard") || symlink("a", "soft") || out < 0)
		exit(99);
	OK(ct_out_same("a", "./a", true) && ct_out_same("hard", "a", true) &&
			ct_out_same("a", "soft", false),
		"one file of many names");
	OK(!ct_out_same("a", "d/a", true) && !ct_out_same("a", "b", false) &&
			!ct_out_same("b", "a", false),
		"two files");
	OK(ct_out_same("b", "./b", false) && ct_out_same("d/b", "e/b", false), "one to come");
	OK(!ct_out_same("b", "c", false) && !ct_out_same("b", "d/b", false) &&
			!ct_out_same("none/b", "none/b", false) && !ct_out_same("d/b", "c", false),
		"two to come, or none");
	OK(!ct_out_same("/dev/null", "/dev/null", true), "a device is no file");
	if (!freopen("a", "rb", stdin))
		exit(99);
	OK(ct_out_same("a", "-", true) && !ct_out_same("d/a", "-", true), "standard input");
	if (!freopen("/dev/null", "rb", stdin))
		exit(99);
	OK(!ct_out_same("/dev/null", "-", true), "that is no file");
	fd = open("d/a", O_WRONLY);
	fflush(stdout);
	if (fd < 0 || dup2(fd, STDOUT_FILENO) < 0)
		exit(99);
	whole = ct_out_same("-", "d/a", true) && ct_out_same("d/a", "-", false);
	piped = ct_out_same("-", "a", true) || !freopen("/dev/null", "wb", stdout) ||
		ct_out_same("-", "-", true);
	if (dup2(out, STDOUT_FILENO) < 0)
		exit(99);
	OK(whole && !piped, "standard output");
	close(out);
	close(fd);
	if (system("rm -r a d e hard soft"))
		exit(99);
}

/* Nothing binary on a terminal. */
static void test_terminal(void)
{
	const int out = dup(STDOUT_FILENO), pty = posix_openpt(O_RDWR | O_NOCTTY);
	int fd, rc = 0;

	if (pty < 0 || grantpt(pty) || unlockpt(pty) ||
		(fd = open(ptsname(pty), O_RDWR | O_NOCTTY)) < 0) {
		OK(1, "binary data to a terminal # skip no terminals");
		close(out);
		if (pty >= 0)
			close(pty);
		return;
	}
	fflush(stdout);
	if (dup2(fd, STDOUT_FILENO) < 0)
		exit(99);
	rc = ct_out_check("-", NULL, &err);
	if (dup2(out, STDOUT_FILENO) < 0)
		exit(99);
	OK(says(rc, CT_EOUTPUT, "to a terminal"), "no binary data to a terminal");
	close(out);
	close(fd);
	close(pty);
}

/* A working folder as a killed run leaves it, all but what `wrong` says. */
static void leave(const char *name, const char *base, const char *wrong)
{
	char host[256] = "", boot[256] = "", text[2000], path[200];
	FILE *f = fopen("/proc/sys/kernel/random/boot_id", "r");
	struct stat st;

	if (!f || fscanf(f, "%255s", boot) != 1 || gethostname(host, sizeof host) ||
		mkdir(name, 0700) || stat(name, &st))
		exit(99);
	fclose(f);
	if (strcmp(wrong, "host") == 0)
		boot[0] = host[0] = '-';
	snprintf(text, sizeof text, "ctsr temporary 1\ninode %ju\nof %s\nhost %s\nboot %s\n",
		(uintmax_t)st.st_ino + (strcmp(wrong, "inode") == 0), base, host, boot);
	if (strcmp(wrong, "version") == 0)
		text[strlen("ctsr temporary ")] = '0';
	if (strcmp(wrong, "end") == 0)
		snprintf(text + strlen(text), 10, "more\n");
	snprintf(path, sizeof path, "%s/mark", name);
	if (strcmp(wrong, "mark") != 0)
		save(path, text, strcmp(wrong, "short") == 0 ? strlen(text) / 2 : strlen(text));
	if (strcmp(wrong, "link") == 0) {
		snprintf(text, sizeof text, "%s.mark", name);
		if (rename(path, text) || symlink(strrchr(text, '/') + 1, path))
			exit(99);
	}
	if (strcmp(wrong, "owner") == 0 && (geteuid() != 0 || chown(path, 65534, 65534)))
		unlink(path);
	if (strcmp(wrong, "folder's owner") == 0 && (geteuid() != 0 || chown(name, 65534, 65534)))
		unlink(path);
	if (strcmp(wrong, "rights") == 0 && chmod(name, 0755))
		exit(99);
	snprintf(path, sizeof path, "%s/%s", name, strcmp(wrong, "more") == 0 ? "more" : "data");
	if (strcmp(wrong, "folder") == 0 && mkdir(path, 0700))
		exit(99);
	else if (strcmp(wrong, "folder") != 0)
		save(path, "x", 1);
}

static void test_temp(void)
{
	enum { MANY = 40 };
	const char *const wrong[] = {"host", "inode", "version", "end", "mark", "short", "link",
		"owner", "folder's owner", "rights", "more", "folder"};
	struct ct_temp t, first;
	char name[100];
	int fd, held[3];

	if (mkdir("d", 0777))
		exit(99);
	leave("d/.ctsr-tmp-abcXYZ", "p", "");
	leave("d/.ctsr-tmp-000000", "p", "");
	leave("d/.ctsr-tmp-other0", "q", "");
	leave("d/.ctsr-tmp-other1", "p.state", "");
	leave("d/.ctsr-tmp-other2", "p\nhost x", "");
	leave("d/.ctsr-tmp-abcde", "p", "");
	leave("d/.ctsr-tmp-abcd.f", "p", "");
	leave("d/ctsr-tmp-abcdef", "p", "");
	leave("d/.ctsr-tmp-locked", "p", "");
	leave("./.ctsr-tmp-abcdef", "p", "");
	for (int i = 0; i < (int)(sizeof wrong / sizeof *wrong); i++) {
		snprintf(name, sizeof name, "d/.ctsr-tmp-wrong%c", 'A' + i);
		leave(name, "p", wrong[i]);
	}
	if (symlink("ctsr-tmp-abcdef", "d/.ctsr-tmp-linked") ||
		(fd = open("d/.ctsr-tmp-locked/mark", O_RDWR)) < 0)
		exit(99);
	if (!ct_temp_lock(fd)) {
		OK(1, "temporary files # skip no locks here");
		return;
	}
	for (int i = 0; i < MANY; i++) { /* as many as there are, one after the other */
		int f = ct_temp_open("d/p", &t, &err);

		if (f < 0 || mode_of(t.path) != 0600 || strncmp(t.path, "d/.ctsr-tmp-", 12) != 0 ||
			strlen(t.path) != 23 || strcmp(t.path + 12, "XXXXXX/data") == 0)
			OK(0, "a temporary file: %s", err.msg);
		close(f);
		ct_temp_remove(&t);
	}
	OK(!there("d/.ctsr-tmp-abcXYZ") && !there("d/.ctsr-tmp-000000"),
		"what killed runs left of this file is swept");
	OK(there("d/.ctsr-tmp-other0/data") && there("d/.ctsr-tmp-other1/data") &&
			there("d/.ctsr-tmp-other2/data"),
		"but not what they left of another");
	OK(there("d/.ctsr-tmp-abcde/data") && there("d/.ctsr-tmp-abcd.f/data") &&
			there("d/ctsr-tmp-abcdef/data") && there("d/.ctsr-tmp-linked") &&
			there(".ctsr-tmp-abcdef/data"),
		"nor what has another name or is elsewhere");
	for (int i = 0; i < (int)(sizeof wrong / sizeof *wrong); i++) {
		snprintf(name, sizeof name, "d/.ctsr-tmp-wrong%c/%s", 'A' + i,
			strcmp(wrong[i], "more") == 0 ? wrong[i] : "data");
		OK(there(name), "nor what is not proven: its %s is wrong", wrong[i]);
	}
	OK(there("d/.ctsr-tmp-locked/data"), "nor what is in use");
	held[0] = ct_temp_open("d/p", &first, &err);
	held[1] = ct_temp_open("d/p", &t, &err);
	OK(there(first.path), "nor what this process works in");
	ct_temp_remove(&t);
	held[2] = ct_temp_open("p", &t, &err);
	OK(there(first.path) && there(t.path) && !there(".ctsr-tmp-abcdef"), "in this folder, too");
	ct_temp_remove_all();
	OK(!there(first.path) && !there(t.path), "all of this process go at once");
	ct_temp_remove(&first);
	ct_temp_remove(&t);
	close(fd);
	for (int i = 0; i < 3; i++)
		must(close(held[i]));
	OK(system("rm -r d") == 0 && count("p*") == 0 && count(".ctsr-*") == 0,
		"and nothing is left");
}

/* Seconds of the processor so far. */
static double busy(void)
{
	struct rusage u;

	getrusage(RUSAGE_SELF, &u);
	return (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
	       (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec) * 1e-6;
}

/* As many as a run has at once go with it. */
static void test_many(void)
{
	enum { AT_ONCE = 16 };
	struct ct_temp tmp[AT_ONCE];

	for (int i = 0; i < AT_ONCE; i++)
		close(ct_temp_open("m", tmp + i, &err));
	ct_temp_remove_all();
	OK(count(".ctsr-*") == 0, "%d temporary files go at once", AT_ONCE);
	for (int i = 0; i < AT_ONCE; i++)
		ct_temp_remove(tmp + i);
}

/* A file that others may not have, until we end. */
static void test_claim(void)
{
	struct ct_temp t, again;
	int fd = ct_temp_claim("c", &t, &err), status = 0;
	pid_t child;
	const double before = busy();

	OK(fd >= 0 && strcmp(t.path, "c.ct-locked") == 0 && mode_of(t.path) == 0600,
		"one run has it");
	OK(says(ct_temp_claim("c", &again, &err), CT_EOUTPUT, "c: another run is making it") &&
			!again.path,
		"and no other");
	OK(busy() - before < 0.7, "who waits rests");
	for (int clean = 0; clean < 2; clean++) {
		child = fork(); /* shares the lock */
		if (child == 0)
			_exit(poll(NULL, 0, 300) != 0 || (clean && unlink(t.path) != 0));
		close(fd);
		fd = ct_temp_claim("c", &again, &err);
		OK(fd >= 0 && waitpid(child, &status, 0) == child && status == 0,
			"who ends soon is waited for");
		OK(there(t.path), "%s",
			clean ? "and the file is made again" : "and the file stays");
		free(t.path);
		t = again;
	}
	ct_temp_remove(&t);
	OK(!there("c.ct-locked"), "nothing is left");
	fd = ct_temp_claim("c", &t, &err);
	ct_temp_remove_all();
	OK(fd >= 0 && !there(t.path), "nor by who is told to end at once");
	ct_temp_remove(&t);
	for (int full = 0; full < 2; full++) { /* a file of the user's, or of an older version */
		save("c.ct-locked", "mine", full ? 4 : 0);
		fd = ct_temp_claim("c", &t, &err);
		OK(fd >= 0 && says(ct_temp_claim("c", &again, &err), CT_EOUTPUT, "another run"),
			"a file of that name is locked all the same");
		ct_temp_remove_all();
		ct_temp_remove(&t);
		OK(there("c.ct-locked"), "but what this program did not make stays");
	}
	unlink("c.ct-locked");
	if (mkdir("c.ct-locked", 0777))
		exit(99);
	OK(says(ct_temp_claim("c", &t, &err), CT_EOUTPUT, "c: ") && there("c.ct-locked"),
		"a folder of that name is an error: %s", err.msg);
	rmdir("c.ct-locked");
	OK(says(ct_temp_claim("none/c", &t, &err), CT_EOUTPUT, "none/c: No such"), "no folder");
	if (symlink("x", "l.ct-locked"))
		exit(99);
	OK(says(ct_temp_claim("l", &t, &err), CT_EOUTPUT, "l: ") && !there("x"),
		"a link is not followed");
	unlink("l.ct-locked");
}

static bool input_is(const struct ct_meta *m, const char *name, const void *p, size_t n)
{
	const XXH128_hash_t h = XXH3_128bits(p, n);
	char want[100];

	snprintf(want, sizeof want, "%s xxh3:%016llx%016llx", name, (unsigned long long)h.high64,
		(unsigned long long)h.low64);
	return strcmp(ct_meta_get(m, CT_META_INPUT), want) == 0;
}

static void test_hash(void)
{
	static const struct {
		const char *path, *name;
	} c[] = {{"a", "a"}, {"a/", "a"}, {"/", ""}, {"/a", "a"}, {"b/a//", "a"}};
	unsigned char p[3000];
	struct ct_meta m = {0};
	const struct ct_piece piece[] = {{p, 1}, {p + 1, 1000}, {p + 1001, 1999}};

	for (size_t i = 0; i < sizeof p; i++)
		p[i] = (unsigned char)(i * 7919 >> 4);
	for (size_t i = 0; i < sizeof c / sizeof *c; i++)
		OK(ct_meta_input(&m, c[i].path, 3, piece, &err) == 0 &&
				input_is(&m, c[i].name, p, sizeof p),
			"name and hash of %s", c[i].path);
	ct_meta_free(&m);
}

static void test_inflate(void)
{
	const uint64_t much = CT_INFLATE_FREE;

	OK(ct_inflate_allowed() == 100, "a hundred times is usual");
	OK(ct_inflate_check(0, much, &err) == 0, "so much comes of any file");
	OK(says(ct_inflate_check(1, much + 1, &err), CT_EINPUT, "over 100 times"), "not more");
	OK(ct_inflate_check(much, 100 * much + 99, &err) == 0 &&
			ct_inflate_check(much, 100 * much + 100, &err) == -1,
		"unless it is a hundredth");
	ct_inflate_allow(7);
	OK(ct_inflate_allowed() == 7 && ct_inflate_check(much, 7 * much + 6, &err) == 0 &&
			ct_inflate_check(much, 7 * much + 7, &err) == -1,
		"or what is said");
	ct_inflate_allow(0);
	OK(ct_inflate_check(1, UINT64_MAX, &err) == 0, "or nothing is");
	ct_inflate_allow(CT_INFLATE_TIMES);
}

static void test_text(void)
{
	static const struct {
		const char *in, *out;
	} c[] = {{"plain \x7f", "plain \x7f"}, {"\xc3\xa4", "\xc3\xa4"}, {"a\x80\xff z", "a?? z"},
		{"", ""}, {"\x7f\xc3", "\x7f?"}};

	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		json_t *v = ct_text_json(c[i].in);

		OK(v && strcmp(json_string_value(v), c[i].out) == 0, "text %zu", i);
		json_decref(v);
	}
}

/* How many are open. */
static int open_files(void)
{
	int n = 0;

	for (int fd = 0; fd < 256; fd++)
		n += fcntl(fd, F_GETFD) >= 0;
	return n;
}

int main(void)
{
	char dir[] = "/tmp/t-io.XXXXXX", clean[64];
	const int files = open_files();

	if (!mkdtemp(dir) || chdir(dir))
		return 99;
	test_slurp();
	test_close();
	test_names();
	test_rights();
	test_ends();
	test_check();
	test_same();
	test_terminal();
	test_temp();
	test_many();
	test_claim();
	OK(open_files() == files, "all files are closed");
	test_hash();
	test_inflate();
	test_text();
	snprintf(clean, sizeof clean, "rmdir %s", dir);
	return system(clean) ? 99 : tap_done();
}
