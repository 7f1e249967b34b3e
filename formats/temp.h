/* temp.h: the files, and folders of files, that are not yet what they are to become.
 *
 * FOLDER/.ctsr-tmp-XXXXXX, for its owner alone, is a working folder beside what is made in it. It
 * holds "mark", locked by the process that works there, and "data", the file or folder that is to
 * be renamed. The mark says to what it belongs (proof.h). A killed process has no lock: the
 * next that makes the same file removes what the mark proves, and nothing else.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_TEMP_H
#define CT_FORMATS_TEMP_H
#include "core/err.h"

#include <stdbool.h>
#include <sys/types.h>

#ifdef __cplusplus
extern "C" {
#endif

struct ct_temp {
	char *path;          /* the file or folder, or the lock; owned; NULL: none */
	int lock;            /* descriptor; it holds the lock */
	const char *own;     /* a folder's files: patterns, separated by '|'; borrowed */
	bool claimed;        /* a lock, not a working folder */
	bool replaced, made; /* as ct_temp_undo is to know: there was a file, or none */
	bool stays;          /* what is there is not to be removed */
	bool over;           /* what is at its place may be replaced */
};

/* A file for PATH, empty, open for reading and writing, for its owner alone: its descriptor. In
 * the end rename t->path or do not, and call ct_temp_remove. CT_EOUTPUT naming PATH, CT_ENOMEM. */
int ct_temp_open(const char *path, struct ct_temp *t, struct ct_err *e);
/* The same as a folder, of files that are called as `own`: 0 or -1. */
int ct_temp_folder(const char *path, const char *own, struct ct_temp *t, struct ct_err *e);
/* What is at t->path now, if we may have made it, and the working folder. Legal on zeroes. */
void ct_temp_remove(struct ct_temp *t);
/* Rename to `path` what is at t->path: -1 with EEXIST, where the file system can, if something is
 * there and may not be replaced. With `undo` what was there before is remembered, where the
 * file system can, for ct_temp_undo: it is there again, and what took its place is at t->path. */
int ct_temp_rename(struct ct_temp *t, const char *path, bool undo);
/* What is at `path` goes before something else does that is of no use without it; ct_temp_undo
 * puts it back. -1 with errno if it cannot. */
int ct_temp_aside(struct ct_temp *t, const char *path);
void ct_temp_undo(struct ct_temp *t, const char *path);
/* The folder of `path` to the disk, where the system does that for folders. -1 with errno. */
int ct_temp_settle(const char *path);
/* All of this process, from any thread, when it ends. */
void ct_temp_remove_all(void);

/* For the one run that makes PATH: the lock of PATH.ct-locked. A file of that name without our mark
 * is locked, and stays as it is. CT_EOUTPUT naming PATH, also if another run has it (and does not
 * end within two seconds), CT_ENOMEM. */
int ct_temp_claim(const char *path, struct ct_temp *t, struct ct_err *e);

/* The process's umask, read and not set, since other threads may make files; 077 if the system does
 * not report it. */
mode_t ct_temp_umask(void);
/* Take the lock of an open file for this process and those it forks: it goes when they are gone.
 * False if another has it, or there is none on such a file system. */
bool ct_temp_lock(int fd);
/* The same, but waits for who has it, two seconds at most: errno is EWOULDBLOCK if that goes on. */
bool ct_temp_wait(int fd);
/* Where those are noted, and use the table of another copy of this file, in a program that loads a
 * module: it ends them all. */
struct ct_temp_kept;
struct ct_temp_kept *ct_temp_table(void);
void ct_temp_share(struct ct_temp_kept *table);

#ifdef __cplusplus
}
#endif
#endif
