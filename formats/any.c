/* any.c: the list of all formats; see any.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/any.h"

#include <stdio.h>
#include <sys/stat.h>

static const struct ct_format *const formats[] = {&ct_format_nifti, &ct_format_metaimage,
	&ct_format_nrrd, &ct_format_exr, &ct_format_ply, &ct_format_r2, &ct_format_safetensors,
	&ct_format_pytorch, NULL};

bool ct_any_is_stack(const char *path)
{
	unsigned char head[CT_SNIFF];
	struct stat st;
	size_t n;

	if (strcmp(path, "-") == 0)
		return true;
	n = ct_signature_read(head, path);
	if (n)
		return ct_signature_has("EXR", head, n);
	return stat(path, &st) != 0 || !S_ISREG(st.st_mode) || st.st_size > 0; /* no empty file */
}

int ct_any_check_picture(const char *path, struct ct_err *e)
{
	unsigned char head[CT_SNIFF];
	const struct ct_signature *s = ct_signature_next(NULL, head, ct_signature_read(head, path));

	return !s || s->kind == CT_KIND_PICTURE
		       ? 0
		       : ct_fail(e, CT_EINPUT,
				 "%s: neither projections (EXR) nor a picture, but %s", path,
				 s->what);
}

int ct_any_read(const char *path, struct ct_any *a, struct ct_err *e)
{
	return ct_format_read(formats, path, a, e);
}
