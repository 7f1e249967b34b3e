/* picture.c: ct-picture FILE TIMES: one picture, decoded, to standard output, for the
 * commands, which start it (shim/image-read.h). TIMES is as for ct_inflate_allow.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "shim/picture-file.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
	struct ct_err e = {0};
	size_t size[2] = {0};
	float *gray = NULL;
	int rc;

	if (argc != 3) {
		fputs("ct-picture: reads a picture for other commands\n", stderr);
		return CT_EUSAGE;
	}
	ct_inflate_allow((unsigned)strtoul(argv[2], NULL, 10));
	rc = picture_file_read(argv[1], &size[0], &size[1], &gray, &e);
	fwrite(&e, sizeof e, 1, stdout);
	if (rc == 0) {
		fwrite(size, sizeof size, 1, stdout);
		fwrite(gray, sizeof *gray, size[0] * size[1], stdout);
	}
	free(gray);
	return fflush(stdout) || ferror(stdout) ? CT_EOUTPUT : (int)e.code;
}
