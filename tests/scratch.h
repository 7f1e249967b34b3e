/* scratch.h: a folder for the files of a test, where it works, and which goes when it ends.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_SCRATCH_H
#define CT_TESTS_SCRATCH_H
#include "tap.h"

#include <ftw.h>
#include <stdbool.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char scratch_path[] = "/tmp/ctsr-test.XXXXXX";
static pid_t scratch_owner; /* not what it forks */

__attribute__((unused)) static int scratch_remove(
	const char *path, const struct stat *st, int type, struct FTW *at)
{
	(void)st;
	(void)type;
	(void)at;
	return remove(path);
}

static void scratch_end(void)
{
	if (getpid() == scratch_owner && chdir("/") == 0)
		nftw(scratch_path, scratch_remove, 20, FTW_DEPTH | FTW_PHYS);
}

static void scratch_begin(void)
{
	if (!mkdtemp(scratch_path) || chdir(scratch_path))
		exit(99);
	scratch_owner = getpid();
	umask(022);
	atexit(scratch_end);
}

__attribute__((unused)) static void put_bytes(const char *path, const void *data, size_t n)
{
	FILE *f = fopen(path, "w");

	if (!f || fwrite(data, 1, n, f) != n || fclose(f))
		exit(99);
}

__attribute__((unused)) static void put_text(const char *path, const char *text)
{
	put_bytes(path, text, strlen(text));
}

/* What a file holds, until the next call; empty if there is none. */
__attribute__((unused)) static const char *text_of(const char *path)
{
	static char text[16000];
	FILE *f = fopen(path, "r");

	text[f ? fread(text, 1, sizeof text - 1, f) : 0] = '\0';
	if (f)
		fclose(f);
	return text;
}

__attribute__((unused)) static bool is_there(const char *path)
{
	struct stat st;

	return lstat(path, &st) == 0;
}

__attribute__((unused)) static unsigned rights_of(const char *path)
{
	struct stat st;

	return lstat(path, &st) == 0 ? st.st_mode & 07777 : 0;
}
#endif
