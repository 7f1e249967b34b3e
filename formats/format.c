/* format.c: volumes and tensors by name. See format.h. */
#include "config.h"
#include "formats/format.h"
#include "formats/handler.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"

#include <ctype.h>
#include <errno.h>

/* By the first byte. Never seeks, but for voxels at the end of a file. */
static int read_vol(FILE *f, const char *name, struct ct_vol *v, struct ct_err *e)
{
	const int first = getc(f);

	if (first != EOF)
		ungetc(first, f);
	return (isalpha(first) ? ct_headed_read_stream : ct_nifti_read_stream)(f, name, v, e);
}

int ct_vol_read(const char *path, struct ct_vol *v, struct ct_err *e)
{
	int tries = 2;
	bool again;
	FILE *f;
	int rc;

	do {
		if (ct_io_open(path, &f, e))
			return -1;
		errno = 0;
		rc = read_vol(f, path, v, e);
		if (ct_io_starved(&again, path, e)) {
			ct_vol_free(v);
			rc = -1;
		}
		ct_io_close(f);
	} while (again && --tries);
	return rc;
}

int ct_vol_write(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return ct_nifti_write(path, v, CT_NIFTI_AUTO, false, env, e);
}

int ct_tensors_read(const char *path, struct ct_tensors *w, struct ct_err *e)
{
	static const struct ct_format *const list[] = {
		&ct_format_safetensors, &ct_format_pytorch, NULL};
	struct ct_any a = {0};
	int rc = ct_format_read(list, path, &a, e);

	*w = a.tensors;
	return rc;
}
