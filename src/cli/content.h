/* content.h: what a file or folder holds, byte for byte, whatever its name. */
#ifndef CT_CLI_CONTENT_H
#define CT_CLI_CONTENT_H
#include "core/env.h"

enum { CT_CONTENT_HEX = 33 };

/* The XXH3-128 of the bytes of a file, or of those of all files of a folder in the order of their
 * names. "" if there is nothing to be read twice: no such file, a stream, a pipe. CT_ENOMEM,
 * CT_ESTOP. */
int ct_content_read(
	char hex[CT_CONTENT_HEX], const char *path, const struct ct_env *env, struct ct_err *e);

#endif
