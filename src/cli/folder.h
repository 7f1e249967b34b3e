/* folder.h: a folder that one run at a time works in.
 *
 * FOLDER/lock (in a temporary one FOLDER/temporary) is locked by it and by the programs that it
 * runs: the lock goes when all of them are gone, however they ended. A temporary folder is removed
 * when it is closed, or if that was killed, by the next one that is opened.
 */
#ifndef CT_CLI_FOLDER_H
#define CT_CLI_FOLDER_H
#include "core/err.h"

#include <stdbool.h>

struct ct_folder {
	char *path;
	bool temporary;
	int lock; /* its descriptor; -1: none */
};

/* `path`, made if missing, or if NULL a temporary folder. CT_EOUTPUT, also if another run works in
 * it. If dry it is named and neither made nor locked. */
int ct_folder_open(struct ct_folder *f, const char *path, bool dry, struct ct_err *e);
/* The folder for temporary files: TMPDIR, or /tmp. */
const char *ct_folder_temporaries(void);
/* The folder that `out` lies in, or the one for temporary files if that is a stream, owned by the
 * caller; NULL if no memory. */
char *ct_folder_of(const char *out);
/* FOLDER/name, owned by the caller; NULL if no memory. */
char *ct_folder_file(const struct ct_folder *f, const char *name);
/* Also legal on zeroes. */
void ct_folder_close(struct ct_folder *f);

#endif
