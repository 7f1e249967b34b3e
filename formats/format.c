/* format.c: volumes by name. See format.h. */
#include "config.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/nifti.h"

int ct_vol_read(const char *path, struct ct_vol *v, struct ct_err *e)
{
	FILE *f;
	int rc;

	if (ct_io_open(path, &f, e))
		return -1;
	rc = ct_nifti_read_stream(f, path, v, e);
	ct_io_close(f);
	return rc;
}

int ct_vol_write(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return ct_nifti_write(path, v, CT_NIFTI_AUTO, env, e);
}
