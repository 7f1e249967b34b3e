/* headed-write.c: MetaImage and NRRD, LPS. See headed.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/stream.h"
#include "formats/ends.h"
#include "formats/headed-impl.h"
#include "formats/headed.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* What a header says. */
struct what {
	const struct ct_vol *v;
	bool nrrd, i16, packed;
	const char *data; /* the file of the voxels; NULL: behind the header */
	uint64_t bytes;   /* of the voxels in their file, where they are packed */
	double step[3][3], origin[3], mm[3]; /* LPS: from voxel to voxel along axis d */
};

/* The shortest that reads back the same. */
static void put_number(FILE *f, const char *before, double x)
{
	char text[40];
	double back;

	for (int digits = 6; digits <= 17; digits++) {
		snprintf(text, sizeof text, "%.*g", digits, x + 0.0);
		if (ct_number_read(&back, text) && back == x)
			break;
	}
	fprintf(f, "%s%s", before, text);
}

static void put_numbers(FILE *f, const char *between, const double *x, size_t n)
{
	for (size_t i = 0; i < n; i++)
		put_number(f, i ? between : "", x[i]);
}

/* One that the header keeps as it is: no control character but new lines. A key, which may come
 * from any file, is one word in which nothing parts key and value. */
static void put_pair(FILE *f, const char *before, const struct ct_pair *p, const char *between)
{
	fputs(before, f);
	for (const char *s = p->key; *s; s++)
		fprintf(f, isgraph((unsigned char)*s) && !strchr("=:\\", *s) ? "%c" : "\\x%02x",
			(unsigned char)*s);
	fputs(between, f);
	for (const char *s = p->value; *s; s++)
		if (*s == '\n' || *s == '\\')
			fputs(*s == '\n' ? "\\n" : "\\\\", f);
		else
			fputc((unsigned char)*s < ' ' ? ' ' : *s, f);
	fputc('\n', f);
}

static void put_meta(FILE *f, const struct ct_meta *m, const char *before, const char *between)
{
	for (size_t i = 0; i < m->n; i++)
		if (strncmp(m->pair[i].key, "nifti.", 6) != 0 &&
			strcmp(m->pair[i].key, CT_META_INPUT) != 0)
			put_pair(f, before, &m->pair[i], between);
}

static void put_mha(FILE *f, const struct what *w)
{
	fputs("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n",
		f);
	if (w->packed) /* as wide as it can become */
		fprintf(f, "CompressedData = True\nCompressedDataSize = %-20llu\n",
			(unsigned long long)w->bytes);
	else
		fputs("CompressedData = False\n", f);
	fputs("TransformMatrix =", f);
	for (int d = 0; d < 3; d++)
		for (int r = 0; r < 3; r++)
			put_number(f, " ", w->step[d][r] / w->mm[d]);
	fputs("\nOffset = ", f);
	put_numbers(f, " ", w->origin, 3);
	fputs("\nCenterOfRotation = 0 0 0\nElementSpacing = ", f);
	put_numbers(f, " ", w->mm, 3);
	fprintf(f, "\nDimSize = %zu %zu %zu\n", w->v->n[0], w->v->n[1], w->v->n[2]);
	put_meta(f, &w->v->meta, "ct-", " = ");
	fprintf(f, "ElementType = %s\nElementDataFile = %s\n", w->i16 ? "MET_SHORT" : "MET_FLOAT",
		w->data ? w->data : "LOCAL");
}

static void put_nrrd(FILE *f, const struct what *w)
{
	fprintf(f, "NRRD0004\ntype: %s\ndimension: 3\nspace: left-posterior-superior\n",
		w->i16 ? "int16" : "float");
	fprintf(f, "sizes: %zu %zu %zu\nspace directions:", w->v->n[0], w->v->n[1], w->v->n[2]);
	for (int d = 0; d < 3; d++) {
		fputs(" (", f);
		put_numbers(f, ",", w->step[d], 3);
		fputs(")", f);
	}
	fprintf(f, "\nkinds: domain domain domain\nendian: little\nencoding: %s\nspace origin: (",
		w->packed ? "gzip" : "raw");
	put_numbers(f, ",", w->origin, 3);
	fputs(")\nspace units: \"mm\" \"mm\" \"mm\"\n", f);
	if (w->data)
		fprintf(f, "data file: %s\n", w->data);
	put_meta(f, &w->v->meta, "ct:", ":=");
	fputc('\n', f);
}

/* Is the file of voxels found again when the header names it? */
static bool nameable(const char *file)
{
	struct ct_headed h = {0};
	struct ct_err any;

	for (const char *s = file; *s; s++)
		if ((unsigned char)*s < ' ')
			return false;
	return *file != ' ' && ct_headed_file(&h, "", file, &any) == 0;
}

int ct_headed_beside(char **data, const char *path, bool packed, struct ct_err *e)
{
	const bool mhd = ct_ends_match(path, "mhd");

	*data = NULL;
	if (!mhd && !ct_ends_match(path, "nhdr"))
		return 0;
	if (asprintf(data, "%.*s%s", (int)(strrchr(path, '.') - path), path,
		    !packed ? ".raw"
		    : mhd   ? ".zraw"
			    : ".raw.gz") < 0) {
		*data = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	if (nameable(basename(*data)))
		return 0;
	free(*data);
	*data = NULL;
	return ct_fail(e, CT_EOUTPUT,
		"%s: a header cannot name its file of voxels: the name begins with a blank or LIST, "
		"or holds %% or a control character: choose another, or %s",
		path, mhd ? ".mha" : ".nrrd");
}

/* Does the header `path` say that its voxels are in `data`? */
static bool says(const char *path, const char *data)
{
	struct ct_err any;
	char *its = NULL;
	const bool so =
		ct_headed_source(&its, path, &any) == 0 && its && ct_out_same(data, its, false);

	free(its);
	return so;
}

int ct_headed_own(const char *path, const char *data, struct ct_err *e)
{
	const size_t stem = (size_t)(strrchr(path, '.') - path);
	char *other = NULL, *twin[2] = {NULL, NULL};
	struct stat st;
	bool own;
	int rc = 0;

	if (stat(data, &st) != 0 || !S_ISREG(st.st_mode))
		return 0;
	if (asprintf(&other, "%.*s%s", (int)stem, path,
		    ct_ends_match(path, "mhd") ? ".nhdr" : ".mhd") < 0) {
		other = NULL;
		rc = ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	for (int packed = 0; packed < 2 && rc == 0; packed++)
		rc = ct_headed_beside(&twin[packed], path, packed, e);
	own = rc == 0 && (says(path, twin[0]) || says(path, twin[1])) && !says(other, data);
	if (rc == 0 && !own)
		rc = ct_fail(e, CT_EOUTPUT,
			"%s: exists, and is not of %s alone: choose another name, or remove it",
			data, path);
	free(twin[0]);
	free(twin[1]);
	free(other);
	return rc;
}

static int put_header(struct ct_sink *s, const struct what *w, struct ct_err *e)
{
	char *text;
	size_t n;
	FILE *f;
	int rc;

	if (ct_stream_open(&f, &text, &n, e))
		return -1;
	(w->nrrd ? put_nrrd : put_mha)(f, w);
	rc = ct_err_any(ct_stream_close(f, &text, e) || ct_sink_give(s, text, n, e));
	free(text);
	return rc;
}

static int put_voxels(struct ct_sink *s, struct what *w, const struct ct_env *env, struct ct_err *e)
{
	const uint64_t start = s->at;

	if ((w->packed && ct_sink_pack(s, w->nrrd, e)) || ct_sink_voxels(s, w->v, w->i16, env, e) ||
		ct_sink_end(s, e))
		return -1;
	w->bytes = s->at - start;
	return 0;
}

/* All in one file. What the header says of packed voxels is known behind them. */
static int write_one(const char *path, struct what *w, const struct ct_env *env, struct ct_err *e)
{
	struct ct_sink s;
	int rc;

	if (ct_sink_open(&s, path, env, e))
		return -1;
	rc = ct_err_any(put_header(&s, w, e) || put_voxels(&s, w, env, e) ||
			(w->packed && !w->nrrd && (ct_sink_rewind(&s, e) || put_header(&s, w, e))));
	return ct_sink_close(&s, rc, e);
}

/* Neither is there before both are whole. */
static int write_two(const char *path, const char *data, struct what *w, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_out_set both = {.names = true};
	struct ct_io_rule rule = ct_io_rule_of(env);
	struct ct_env own = env ? *env : (struct ct_env){0};
	struct ct_sink voxels, header;
	int rc;

	rule.together = &both;
	own.files = &rule;
	if (ct_headed_own(path, data, e) || ct_sink_open(&voxels, data, &own, e))
		return -1;
	if (put_voxels(&voxels, w, env, e) || ct_sink_open(&header, path, &own, e))
		return ct_sink_close(&voxels, -1, e);
	rc = put_header(&header, w, e);
	if (rc == 0 && fflush(header.out.f) != 0)
		rc = ct_fail_errno(e, CT_EOUTPUT, path);
	rc = ct_sink_close(&voxels, rc, e);
	rc = ct_sink_close(&header, rc, e);
	if (rc == 0)
		rc = ct_out_set_commit(&both, e);
	ct_out_set_drop(&both);
	return rc;
}

int ct_headed_write(const char *path, const struct ct_vol *v, enum ct_nifti_type type, bool packed,
	const struct ct_env *env, struct ct_err *e)
{
	static const double lps[3] = {-1, -1, 1};
	struct what w = {.v = v,
		.packed = packed,
		.nrrd = ct_ends_match(path, "nrrd") || ct_ends_match(path, "nhdr")};
	char *data;
	int rc;

	ct_vol_spacing(v, w.mm);
	for (int r = 0; r < 3; r++) {
		for (int d = 0; d < 3; d++)
			w.step[d][r] = lps[r] * v->affine[r][d];
		w.origin[r] = lps[r] * v->affine[r][3];
	}
	if (ct_headed_beside(&data, path, packed, e))
		return -1;
	w.data = data ? basename(data) : NULL;
	if (ct_vol_check_grid(v, e) || ct_nifti_is_i16(v, type, &w.i16, e))
		rc = ct_blame(e, path);
	else
		rc = data ? write_two(path, data, &w, env, e) : write_one(path, &w, env, e);
	free(data);
	return rc;
}
