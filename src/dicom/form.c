/* form.c: see form.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/files.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "dicom/form.h"

#include <stdlib.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

/* Does the gzip file hold something else than NIfTI? */
static bool is_other_gzip(const char *path)
{
	unsigned char head[4];
	gzFile f = gzopen(path, "rb");
	const int n = f ? gzread(f, head, sizeof head) : 0;

	if (f)
		gzclose(f);
	return n == sizeof head && ct_signature_kind(head, sizeof head) != CT_KIND_VOLUME;
}

enum dicom_form dicom_form_of(const char *path)
{
	const struct ct_signature *s;
	unsigned char head[CT_SNIFF];
	struct stat st;
	size_t n;

	if (strcmp(path, "-") == 0 || stat(path, &st) != 0)
		return NOT_DICOM;
	if (S_ISDIR(st.st_mode))
		return FOLDER;
	n = ct_signature_read(head, path);
	if (ct_signature_kind(head, n) == CT_KIND_DICOM)
		return FILE_OF_SERIES;
	s = ct_signature_next(NULL, head, n);
	if (s && (s->archive || (head[0] == 0x1f && head[1] == 0x8b &&
					!ct_ends_match(path, "img.gz") && is_other_gzip(path))))
		return ARCHIVE;
	return NOT_DICOM;
}

int dicom_check_name(const char *out, const char *in, struct ct_err *e)
{
	if (strcmp(out, "-") == 0 || ct_ends_any(out) || ct_files_is_dicom(out) ||
		access(out, F_OK) == 0 || dicom_form_of(in) != FOLDER)
		return 0;
	return ct_fail(e, CT_EUSAGE, "%s: %s/ is a series of DICOM, %s.nii.gz a volume: which?",
		out, out, out);
}

int dicom_from(struct dicom_from *f, const struct ct_dicom_in *in, struct ct_err *e)
{
	const char *path = in->paths[0], *slash = strrchr(path, '/');
	const enum dicom_form form = dicom_form_of(path);
	size_t n;

	*f = (struct dicom_from){.in = *in};
	f->in.name = path;
	if (form == NOT_DICOM && access(path, F_OK))
		return ct_fail_errno(e, CT_EINPUT, path);
	if (form == NOT_DICOM)
		return ct_fail(e, CT_EINPUT, "%s: is not DICOM", path);
	if (form != FILE_OF_SERIES || in->n > 1)
		return 0;
	/* as the scan of the folder puts names together, however many slashes part the two */
	n = slash ? (size_t)(slash - path) : 0;
	while (n > 0 && path[n - 1] == '/')
		n--;
	f->folder = slash ? strndup(path, n ? n : 1) : strdup(".");
	if (!f->folder || asprintf(&f->member, "%s%s%s", f->folder, slash && n == 0 ? "" : "/",
				  slash ? slash + 1 : path) < 0) {
		f->member = NULL;
		dicom_from_free(f);
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	f->in.paths = (const char *const *)&f->folder;
	f->in.member = f->member;
	return 0;
}

void dicom_from_free(struct dicom_from *f)
{
	free(f->folder);
	free(f->member);
	f->folder = f->member = NULL;
}
