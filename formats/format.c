/* format.c: volumes and tensors by name. See format.h. */
#include "config.h"
#include "formats/bytes.h"
#include "formats/format.h"
#include "formats/handler.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

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
	FILE *f;
	int rc;

	if (ct_io_open(path, &f, e))
		return -1;
	rc = read_vol(f, path, v, e);
	ct_io_close(f);
	return rc;
}

int ct_vol_write(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return ct_nifti_write(path, v, CT_NIFTI_AUTO, false, env, e);
}

static int read_tensors(FILE *f, const char *name, struct ct_tensors *w, struct ct_err *e)
{
	unsigned char head[CT_SNIFF];
	const size_t n = fread(head, 1, sizeof head, f);
	const struct ct_format *is = ct_format_pytorch.sniff(head, n) != CT_SNIFF_NO
					     ? &ct_format_pytorch
					     : &ct_format_safetensors;
	struct ct_any a = {0};
	int rc;

	rewind(f);
	rc = is->read(f, name, &a, e);
	*w = a.tensors;
	return rc;
}

int ct_tensors_read(const char *path, struct ct_tensors *w, struct ct_err *e)
{
	unsigned char *data = NULL;
	struct stat st;
	FILE *f = NULL;
	size_t n;
	int rc = -1;

	*w = (struct ct_tensors){0};
	if (strcmp(path, "-") == 0 ||
		(stat(path, &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode))) {
		if (ct_slurp(path, &data, &n, e))
			return -1;
		f = fmemopen(data, n, "rb");
		if (!f)
			ct_fail(e, n ? CT_ENOMEM : CT_EINPUT, "%s: %s", path,
				n ? "no memory" : "is empty");
	} else if (ct_io_open(path, &f, e)) {
		return -1;
	}
	if (f) {
		rc = read_tensors(f, path, w, e);
		ct_io_close(f);
	}
	free(data);
	return rc;
}
