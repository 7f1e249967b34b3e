/* reader.h: programs of ours that decode a file for a command, through a pipe.
 *
 * Such a program, beside the running one or installed, is started with the number that
 * ct_inflate_allow takes. Its standard input names one file after the other, each name ended by a
 * zero; for each it writes to standard output a struct ct_err and, if its code is 0, what the file
 * holds. So only who has such files waits for the libraries that read them, and once for all files;
 * a damaged file cannot end the command. SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SHIM_READER_H
#define CT_SHIM_READER_H
#include "core/err.h"

#include <stdio.h>

struct ct_reader {
	const char *program;
	const char *file, *files;     /* what it reads, for messages: "picture", "pictures" */
	const char *package, *option; /* that install it */
};

/* A program at work, of one thread; zero: none yet. */
struct ct_reading {
	FILE *from; /* owned: what it says; its names go the same way */
	int pid;
};

/* Name a file to the program, which is started if it is not at work, and give what follows its
 * error to take(), which returns 0, -1 after ct_fail, or 1 if the program ends too early. CT_EFAIL
 * if it is not installed, CT_EINPUT naming the file, also if that kills the program; CT_ENOMEM;
 * after an error it is no longer at work. */
int ct_reading_next(struct ct_reading *s, const struct ct_reader *r, const char *path,
	int (*take)(FILE *f, void *ctx, struct ct_err *e), void *ctx, struct ct_err *e);
void ct_reading_end(struct ct_reading *s);

#endif
