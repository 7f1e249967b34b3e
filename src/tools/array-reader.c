/* array-reader.c: ct-arrays TIMES: the arrays of the file of MATLAB or Data Exchange that standard
 * input names, to standard output, for the commands, which start it (shim/reader.h): of one file,
 * as its memory is limited by that. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "shim/arrays.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>

/* The libraries believe what a file says of its sizes: they get no more memory than a file of that
 * size may become. Opening a library takes some. */
static void limit(const char *path, const char *times)
{
	const rlim_t own = (rlim_t)512 << 20;
	const unsigned long n = strtoul(times, NULL, 10);
	struct rlimit most;
	struct stat st;

	if (n == 0 || stat(path, &st) != 0 || getrlimit(RLIMIT_AS, &most) != 0)
		return;
	most.rlim_cur = own + 2 * CT_INFLATE_FREE + 2 * (rlim_t)n * (rlim_t)st.st_size;
	if (most.rlim_max == RLIM_INFINITY || most.rlim_cur < most.rlim_max)
		setrlimit(RLIMIT_AS, &most);
}

int main(int argc, char **argv)
{
	static const struct ct_array end;
	struct ct_arrays a = {0};
	struct ct_err e = {0};
	char *path = NULL;
	size_t room = 0;
	int rc;

	if (argc != 2) {
		fputs("ct-arrays: reads a file of MATLAB or HDF5 for other commands\n", stderr);
		return CT_EUSAGE;
	}
	if (getdelim(&path, &room, '\0', stdin) <= 0)
		return CT_OK;
	limit(path, argv[1]);
	rc = arrays_file_read(&a, path, &e);
	free(path);
	fwrite(&e, sizeof e, 1, stdout);
	for (size_t i = 0; i < a.n && rc == 0; i++) {
		fwrite(&a.a[i], sizeof a.a[i], 1, stdout);
		if (a.a[i].count)
			fwrite(a.a[i].data, sizeof *a.a[i].data, a.a[i].count, stdout);
	}
	if (rc == 0)
		fwrite(&end, sizeof end, 1, stdout);
	ct_arrays_free(&a);
	return fflush(stdout) || ferror(stdout) ? CT_EOUTPUT : (int)e.code;
}
