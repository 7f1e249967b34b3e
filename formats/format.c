/* format.c: files of formats that the caller names; see any.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/io.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

const struct ct_format *ct_format_find(
	const struct ct_format *const *list, const unsigned char *data, size_t n)
{
	const struct ct_signature *s = NULL;

	while ((s = ct_signature_next(s, data, n)))
		for (size_t i = 0; list[i]; i++)
			if (strcmp(list[i]->name, s->format) == 0)
				return list[i];
	return NULL;
}

/* What people give in the place of a file of this kind, by its first bytes, or NULL. */
static const char *known_as(const unsigned char *data, size_t n, enum ct_kind wanted)
{
	const struct ct_signature *s = ct_signature_next(NULL, data, n);

	return n == 0 ? "empty" : s && s->kind != wanted ? s->what : NULL;
}

/* The format; if there is none the error is "not a NIfTI, NRRD or EXR file", in
 * words of the list. */
static const struct ct_format *recognise(const struct ct_format *const *list,
	const unsigned char *data, size_t n, const char *path, struct ct_err *e)
{
	const struct ct_format *is = ct_format_find(list, data, n);
	const char *join = "", *what = known_as(data, n, list[1] ? CT_KIND_UNKNOWN : list[0]->kind);
	char names[200] = "";
	size_t at = 0, left = 0;

	if (is)
		return is;
	for (size_t i = 0; list[i]; i++)
		left++;
	for (size_t i = 0; list[i] && at < sizeof names; i++) {
		at += (size_t)snprintf(names + at, sizeof names - at, "%s%s", join, list[i]->name);
		join = --left == 1 ? " or " : ", ";
	}
	ct_fail(e, CT_EINPUT, "%s: not a%s %s file%s%s", path, *names == 'E' ? "n" : "", names,
		what ? ", but " : "", what ? what : "");
	return NULL;
}

void ct_any_free(struct ct_any *a)
{
	ct_vol_free(&a->vol);
	ct_stack_free(&a->stack);
	ct_gauss_free(&a->gauss);
	ct_tensors_free(&a->tensors);
	a->kind = CT_KIND_UNKNOWN;
}

const struct ct_meta *ct_any_meta(const struct ct_any *a)
{
	return a->kind == CT_KIND_STACK     ? &a->stack.meta
	       : a->kind == CT_KIND_GAUSS   ? &a->gauss.meta
	       : a->kind == CT_KIND_TENSORS ? &a->tensors.meta
					    : &a->vol.meta;
}

static int end_read(int rc, const char *name, struct ct_any *a, struct ct_err *e)
{
	if (rc == 0)
		return 0;
	ct_any_free(a);
	return ct_blame(e, name);
}

int ct_format_read_stream(
	const struct ct_format *is, FILE *f, const char *name, struct ct_any *a, struct ct_err *e)
{
	a->kind = is->kind;
	return end_read(is->read(f, name, a, e), name, a, e);
}

int ct_format_read_bytes(const struct ct_format *is, const unsigned char *data, size_t n,
	const char *name, struct ct_any *a, struct ct_err *e)
{
	FILE *f;
	int rc;

	if (is->read) {
		f = fmemopen((void *)(uintptr_t)data, n, "rb"); /* only read */
		if (!f)
			return ct_fail(e, CT_ENOMEM, "%s: no memory", name);
		rc = ct_format_read_stream(is, f, name, a, e);
		fclose(f);
		return rc;
	}
	a->kind = is->kind;
	return end_read(is->read_bytes(data, n, name, a, e), name, a, e);
}

/* A whole file or stream, in memory first. */
static int slurp(
	const struct ct_format *const *list, const char *path, struct ct_any *a, struct ct_err *e)
{
	const struct ct_format *is;
	unsigned char *data;
	size_t n;
	int rc;

	if (ct_slurp(path, &data, &n, e))
		return -1;
	is = recognise(list, data, n < CT_SNIFF ? n : CT_SNIFF, path, e);
	rc = is ? ct_format_read_bytes(is, data, n, path, a, e) : -1;
	free(data);
	return rc;
}

static int read_any(
	const struct ct_format *const *list, const char *path, struct ct_any *a, struct ct_err *e)
{
	unsigned char head[CT_SNIFF];
	const struct ct_format *is;
	struct stat st;
	FILE *f;
	int rc = -1;

	/* a fifo is opened once and read once */
	if (strcmp(path, "-") == 0 || (stat(path, &st) == 0 && !S_ISREG(st.st_mode)))
		return slurp(list, path, a, e);
	if (ct_io_open(path, &f, e))
		return -1;
	is = recognise(list, head, fread(head, 1, sizeof head, f), path, e);
	if (is && is->read) {
		rewind(f);
		rc = ct_format_read_stream(is, f, path, a, e);
	}
	ct_io_close(f);
	return is && !is->read ? slurp(list, path, a, e) : rc;
}

static int read_first(
	const struct ct_format *const *list, const char *path, struct ct_any *a, struct ct_err *e)
{
	unsigned char head[CT_SNIFF];
	const char *what = NULL;
	struct stat st;
	FILE *f;
	int first, rc;

	if (stat(path, &st) == 0 && S_ISDIR(st.st_mode))
		return ct_fail(e, CT_EINPUT,
			"%s: is a folder, not a volume (of a DICOM series ct-convert makes one)",
			path);
	if (ct_io_open(path, &f, e))
		return -1;
	if (strcmp(path, "-") != 0 && fstat(fileno(f), &st) == 0 && S_ISREG(st.st_mode)) {
		what = known_as(head, fread(head, 1, sizeof head, f), list[0]->kind);
		rewind(f);
	}
	first = getc(f);
	if (first != EOF)
		ungetc(first, f);
	rc = what ? ct_fail(e, CT_EINPUT, "%s: not a volume (NIfTI, MetaImage or NRRD), but %s",
			    path, what)
		  : ct_format_read_stream(list[isalpha(first) != 0], f, path, a, e);
	if (rc && !what && strstr(e->msg, "not a NIfTI file") && ct_ends_match(path, "img|img.gz"))
		ct_fail(e, CT_EINPUT,
			"%s: the voxels of a .hdr/.img pair; only single-file NIfTI (.nii) is read",
			path);
	ct_io_close(f);
	return rc;
}

/* Libraries take what they get no memory for as what the file lacks, or as its fault: only errno
 * tells. A file is then read once more, since malloc may have found memory elsewhere. */
static int retry(__typeof__(read_any) *read, const struct ct_format *const *list, const char *path,
	struct ct_any *a, struct ct_err *e)
{
	struct stat st;
	int rc = -1;

	for (int tries = 0; tries < 2; tries++) {
		errno = 0;
		rc = read(list, path, a, e);
		if (errno != ENOMEM)
			break;
		ct_any_free(a);
		rc = ct_fail(e, CT_ENOMEM, "%s: not enough memory to read it", path);
		if (stat(path, &st) != 0 || !S_ISREG(st.st_mode))
			break;
	}
	return rc;
}

int ct_format_read(
	const struct ct_format *const *list, const char *path, struct ct_any *a, struct ct_err *e)
{
	return retry(read_any, list, path, a, e);
}

int ct_format_read_first(const struct ct_format *const list[static 2], const char *path,
	struct ct_any *a, struct ct_err *e)
{
	return retry(read_first, list, path, a, e);
}

int ct_format_write(const struct ct_format *const *list, const char *path, const struct ct_any *a,
	const struct ct_format_how *how, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_format *as = *list;

	for (size_t i = 0; list[i]; i++)
		if (ct_ends_match(path, list[i]->ends))
			as = list[i];
	return as->write(path, a, how, env, e);
}
