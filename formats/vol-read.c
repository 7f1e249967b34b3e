/* vol-read.c: volumes by name, of all formats that hold one; see format.h. */
#include "config.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"

#include <ctype.h>
#include <errno.h>

/* By the first byte; the reader of MetaImage also reads NRRD. */
static const struct ct_format *format_of(FILE *f)
{
	const int first = getc(f);

	if (first != EOF)
		ungetc(first, f);
	return isalpha(first) ? &ct_format_metaimage : &ct_format_nifti;
}

/* Never seeks, but for voxels at the end of a file. */
int ct_vol_read(const char *path, struct ct_vol *v, struct ct_err *e)
{
	struct ct_any a = {0};
	int tries = 2;
	bool again;
	FILE *f;
	int rc;

	do {
		if (ct_io_open(path, &f, e))
			return -1;
		errno = 0;
		rc = ct_format_read_stream(format_of(f), f, path, &a, e);
		if (ct_io_starved(&again, path, e)) {
			ct_any_free(&a);
			rc = -1;
		}
		ct_io_close(f);
	} while (again && --tries);
	*v = a.vol;
	return rc;
}
