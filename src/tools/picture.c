/* picture.c: ct-picture TIMES: the pictures that standard input names, decoded, to standard output,
 * for the commands, which start it (shim/reader.h). SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "shim/picture-file.h"

#include <stdio.h>
#include <stdlib.h>

static int answer(const char *path)
{
	struct ct_err e = {0};
	size_t size[2] = {0};
	double most = 0;
	float *gray = NULL;
	int rc = picture_file_read(path, &size[0], &size[1], &most, &gray, &e);

	fwrite(&e, sizeof e, 1, stdout);
	if (rc == 0) {
		fwrite(size, sizeof size, 1, stdout);
		fwrite(&most, sizeof most, 1, stdout);
		fwrite(gray, sizeof *gray, size[0] * size[1], stdout);
	}
	free(gray);
	return fflush(stdout) || ferror(stdout) ? CT_EOUTPUT : (int)e.code;
}

int main(int argc, char **argv)
{
	char *path = NULL;
	size_t room = 0;
	int rc = CT_OK;

	if (argc != 2) {
		fputs("ct-picture: reads pictures for other commands\n", stderr);
		return CT_EUSAGE;
	}
	ct_inflate_allow((unsigned)strtoul(argv[1], NULL, 10));
	while (rc == CT_OK && getdelim(&path, &room, '\0', stdin) > 0)
		rc = answer(path);
	free(path);
	return rc;
}
