/* io.h: bytes in and out, the same way for every format.
 *
 * "-" is standard input or output. A named output is written to a temporary file beside it,
 * synced and renamed by ct_out_commit, so nothing half-written ever has the final name.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_IO_H
#define CT_FORMATS_IO_H
#include "core/env.h"
#include "formats/temp.h"

#include <stdbool.h>
#include <stdio.h>

/* Whole file (or standard input) into *data (free() it), at most CT_MAX_BYTES, and a zero behind
 * the n bytes. CT_EINPUT. */
int ct_slurp(const char *path, unsigned char **data, size_t *n, struct ct_err *e);
/* Open for reading; "-" gives stdin. CT_EINPUT (a directory too). Close with ct_io_close. */
int ct_io_open(const char *path, FILE **f, struct ct_err *e);
void ct_io_close(FILE *f);

/* Outputs that are there together or not at all: of an environment that names a set one that is
 * committed waits in it, whole, under its temporary name. */
enum { CT_OUT_SET = 2 };
struct ct_out_set {
	size_t n;
	bool names; /* the last names the others: an old one never stands beside new others */
	struct ct_out_waiting {
		char *path;
		struct ct_temp tmp;
	} file[CT_OUT_SET];
};

/* Rename those that wait, in order; if one cannot be, all is as it was before. CT_EOUTPUT. */
int ct_out_set_commit(struct ct_out_set *s, struct ct_err *e);
/* Drop those that wait; legal after commit and on a zeroed struct. */
void ct_out_set_drop(struct ct_out_set *s);

/* What is asked of the files that are read and written: env->files. */
struct ct_io_rule {
	bool force; /* overwrite existing outputs */
	bool deid;  /* warnings name no file beside those of the command line */
	int units;  /* enum ct_units: what the user says of the volumes that are read */
	struct ct_out_set *together; /* outputs that are there when all are whole; or NULL */
};
/* That of env, or nothing; env may be NULL. */
struct ct_io_rule ct_io_rule_of(const struct ct_env *env);

struct ct_out {
	FILE *f;
	char *path;         /* NULL for standard output */
	struct ct_temp tmp; /* of neither that nor a device */
	bool secret;        /* for its owner alone */
	size_t unsent;      /* bytes since the disk was told of them */
	struct ct_out_set *together;
};

/* CT_EOUTPUT if the file exists and the rule has no `force`, or if standard output is a terminal. A
 * symbolic link is followed; the file that is overwritten hands on its rights. */
int ct_out_open(struct ct_out *o, const char *path, const struct ct_env *env, struct ct_err *e);
/* The same for a file that its owner alone may read (mode 0600), in the place of what is there. */
int ct_out_open_private(struct ct_out *o, const char *path, struct ct_err *e);
/* Flush, sync, rename, the last later if it waits for others. CT_EOUTPUT, also for a file that came
 * meanwhile and that the rule does not overwrite; the temporary file, until then for its owner
 * alone, is gone either way. */
int ct_out_commit(struct ct_out *o, struct ct_err *e);
/* Drop the output; legal after commit and on a zeroed struct. */
void ct_out_abandon(struct ct_out *o);
/* fwrite with CT_EOUTPUT and errno's words. */
int ct_put(struct ct_out *o, const void *data, size_t n, struct ct_err *e);
/* Is an output of this name allowed now (exists, --force), and can a file be made there and hold
 * something? Asked before the work: cli/files.h. CT_EOUTPUT. */
int ct_out_check(const char *path, const struct ct_env *env, struct ct_err *e);
/* CT_EOUTPUT if the path, which stat() just could not follow, is a symbolic link, or would lie in a
 * folder that is not there. */
int ct_out_leads(const char *path, struct ct_err *e);
/* Is the output `out` the same file as `path`, by whatever names, be they there or not? "-" of an
 * input is the file that standard input is read from. */
bool ct_out_same(const char *out, const char *path, bool input);

#endif
