/* headed.c: a header of text, and its voxels. See headed.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "formats/headed.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/headed-impl.h"
#include "formats/io.h"
#include "formats/text.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum {
	LONGEST_LINE = 1 << 18,
	MOST_BYTES = 1 << 20,
	FIELDS = 4096
}; /* bytes of a line, of all; fields */

int ct_headed_line(FILE *f, char **line, struct ct_err *e)
{
	size_t n = 0, cap = 0;
	int c;

	*line = NULL;
	while ((c = getc(f)) != EOF && c != '\n') {
		if (c == '\0' || n + 1 >= LONGEST_LINE)
			return ct_fail(e, CT_EINPUT, "its header is no text");
		if (ct_grow(line, &cap, n + 2, 1, e))
			return -1;
		(*line)[n++] = (char)c;
	}
	if (c == EOF && n == 0)
		return ferror(f) ? ct_fail(e, CT_EINPUT, "%s", strerror(errno)) : 0;
	if (n > 0 && (*line)[n - 1] == '\r')
		n--;
	if (ct_grow(line, &cap, n + 1, 1, e))
		return -1;
	(*line)[n] = '\0';
	return 1;
}

static char *trim(char *s)
{
	char *end = s + strlen(s);

	while (end > s && isspace((unsigned char)end[-1]))
		*--end = '\0';
	return s + strspn(s, " \t");
}

int ct_headed_set(struct ct_headed *h, const char *ours, char *key, char *value, struct ct_err *e)
{
	struct ct_meta *m = &h->v->meta;
	const size_t n = strlen(ours);

	key = trim(key);
	value = trim(value);
	h->bytes += strlen(key) + strlen(value);
	if (h->field.n + m->n >= FIELDS || h->bytes > MOST_BYTES)
		return ct_fail(e, CT_EINPUT, "a header of more than %d fields or %d bytes", FIELDS,
			MOST_BYTES);
	if (strncmp(key, ours, n) != 0) {
		const char *before = ct_headed_get(h, key);

		if (before && strcmp(before, value) != 0)
			return ct_fail(e, CT_EINPUT, "%.40s is said twice: '%.60s' and '%.60s'",
				key, before, value);
		return ct_meta_set(&h->field, key, value, e);
	}
	ct_text_unescape(key);
	ct_text_unescape(value);
	return ct_meta_set(m, key + n, value, e);
}

const char *ct_headed_get(const struct ct_headed *h, const char *key)
{
	return ct_meta_get(&h->field, key);
}

int ct_headed_numbers(
	const struct ct_headed *h, const char *key, size_t n, double *x, struct ct_err *e)
{
	const char *s = ct_headed_get(h, key), *at = s, *end;

	if (!s)
		return 1;
	for (size_t i = 0; i < n; i++, at = end) {
		at += strspn(at, " \t,()");
		x[i] = ct_number_begin(at, &end);
		if (end == at || (*end && !strchr(" \t,()", *end)))
			return ct_fail(e, CT_EINPUT, "%s: '%.60s' is not %zu numbers", key, s, n);
	}
	at += strspn(at, " \t,()");
	return *at ? ct_fail(e, CT_EINPUT, "%s: '%.60s' is more than %zu numbers", key, s, n) : 0;
}

int ct_headed_sizes(struct ct_headed *h, const char *key, size_t dims, struct ct_err *e)
{
	double x[4];
	int rc = ct_headed_numbers(h, key, dims, x, e);

	if (rc)
		return rc < 0 ? -1 : ct_fail(e, CT_EINPUT, "has no %s", key);
	h->v->n[2] = 1;
	for (size_t d = 0; d < dims; d++) {
		if (!(x[d] >= 1 && x[d] <= INT32_MAX && x[d] == floor(x[d])))
			return ct_fail(e, CT_EINPUT, "%s: %g is no number of voxels", key, x[d]);
		if (d < h->axes)
			h->v->n[d] = (size_t)x[d];
		else if (x[d] != 1)
			return ct_fail(e, CT_EINPUT,
				"%s: axis %zu is none of space and not single: only one volume a file is read",
				key, d + 1);
	}
	return 0;
}

int ct_headed_number_type(
	struct ct_headed *h, const char *key, const struct ct_voxel_name *types, struct ct_err *e)
{
	const char *name = ct_headed_get(h, key);

	if (!name)
		return ct_fail(e, CT_EINPUT, "has no %s", key);
	for (; types->name; types++)
		if (strcasecmp(types->name, name) == 0) {
			h->stored.type = types->type;
			return 0;
		}
	return ct_fail(e, CT_EINPUT, "%s: %.40s is no number that is read here", key, name);
}

void ct_headed_place(
	struct ct_headed *h, const double step[3][3], const double origin[3], const double sign[3])
{
	const double *a = step[0], *b = step[1];
	double across[3], area;

	ct_vec3_cross(across, a, b);
	area = ct_vec3_length(across);
	for (int r = 0; r < 3; r++) { /* + 0: no -0, for the hash */
		const double last = h->axes == 3 ? step[2][r] : area > 0 ? across[r] / area : 0;

		h->v->affine[r][0] = sign[r] * a[r] + 0.0;
		h->v->affine[r][1] = sign[r] * b[r] + 0.0;
		h->v->affine[r][2] = sign[r] * last + 0.0;
		h->v->affine[r][3] = sign[r] * origin[r] + 0.0;
	}
}

int ct_headed_file(struct ct_headed *h, const char *key, const char *file, struct ct_err *e)
{
	if (strncmp(file, "LIST", 4) == 0)
		return ct_fail(e, CT_EINPUT, "%s: LIST: voxels in several files are not read", key);
	if (strchr(file, '%'))
		return ct_fail(e, CT_EINPUT,
			"%s: %.60s: a pattern; voxels in several files are not read", key, file);
	while (strncmp(file, "./", 2) == 0) /* beside it, too */
		file += 2 + strspn(file + 2, "/");
	if (!*file || strchr(file, '/') || strcmp(file, ".") == 0 || strcmp(file, "..") == 0)
		return ct_fail(e, CT_EINPUT, "%s: '%.60s' is no file beside the header", key, file);
	h->file = file;
	return 0;
}

/* In the folder of the header `name`. */
static int path_beside(char **path, const char *name, const char *file, struct ct_err *e)
{
	const char *slash = strrchr(name, '/');

	if (asprintf(path, "%.*s%s", slash ? (int)(slash - name) + 1 : 0, name, file) >= 0)
		return 0;
	*path = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory for a file name");
}

/* The file beside the header `name`. */
static int open_beside(FILE **f, const char *name, const char *file, struct ct_err *e)
{
	struct stat st;
	char *path;
	int rc;

	if (strcmp(name, "-") == 0)
		return ct_fail(e, CT_EINPUT,
			"the voxels are in %s, and nothing is beside standard input", file);
	if (path_beside(&path, name, file, e))
		return -1;
	if (stat(path, &st) == 0 && !S_ISREG(st.st_mode))
		rc = ct_fail(e, CT_EINPUT, "%s: is no file of voxels", path);
	else
		rc = ct_io_open(path, f, e);
	free(path);
	return rc;
}

/* Before the voxels of f, or of what is packed before all of it. */
static int find_voxels(FILE *f, const struct ct_headed *h, struct ct_err *e)
{
	const off_t here = ftello(f);
	size_t bytes;
	int c = 0;

	for (size_t k = 0; k < h->lines && c != EOF; k++)
		while ((c = getc(f)) != EOF && c != '\n')
			;
	if (!h->at_end)
		return 0;
	if (ct_stored_bytes(&h->stored, h->v->n, &bytes, e))
		return -1;
	if (fseeko(f, -(off_t)bytes, SEEK_END) != 0 || ftello(f) < here)
		return ct_fail(e, CT_EINPUT, "truncated file: its voxels need %zu bytes", bytes);
	return 0;
}

static int read_voxels(FILE *f, const struct ct_headed *h, const char *name, struct ct_err *e)
{
	struct ct_source s = {0};
	int rc = -1;

	if (find_voxels(f, h, e) == 0 &&
		ct_source_open(&s, f, h->packed ? CT_PACKING_ZLIB : CT_PACKING_NONE, e) == 0 &&
		ct_source_skip(&s, h->skip, e) == 0 &&
		ct_source_volume(&s, &h->stored, name, h->v, e) == 0)
		rc = (h->packed ? ct_source_behind(&s) == 0 : getc(f) == EOF)
			     ? 0
			     : ct_fail(e, CT_EINPUT, "longer than its header says");
	ct_source_close(&s);
	return rc;
}

static int read_header(FILE *f, struct ct_headed *h, struct ct_err *e)
{
	char *line;
	int rc = ct_headed_line(f, &line, e);

	if (rc == 0)
		rc = ct_fail(e, CT_EINPUT, "is empty");
	else if (rc > 0 && ct_signature_has("NRRD", (const unsigned char *)line, strlen(line)))
		rc = ct_headed_nrrd(f, h, e);
	else if (rc > 0 && ct_signature_has("MetaImage", (const unsigned char *)line, strlen(line)))
		rc = ct_headed_mha(f, line, h, e);
	else if (rc > 0 || (e->code == CT_EINPUT && !ferror(f)))
		rc = ct_fail(e, CT_EINPUT, "not a NIfTI file, nor MetaImage or NRRD");
	free(line);
	return rc;
}

int ct_headed_source(char **data, const char *path, struct ct_err *e)
{
	struct ct_vol v = {0};
	struct ct_headed h = {.v = &v, .stored = {.slope = 1}};
	struct ct_err any = {0};
	struct stat st;
	FILE *f;
	int rc = 0;

	*data = NULL;
	f = stat(path, &st) == 0 && S_ISREG(st.st_mode) ? fopen(path, "rb") : NULL;
	if (f && read_header(f, &h, &any) == 0 && h.file)
		rc = path_beside(data, path, h.file, e);
	if (f)
		fclose(f);
	ct_vol_free(&v);
	ct_meta_free(&h.field);
	return rc;
}

static int read_volume(FILE *f, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_meta *m = &a->vol.meta;
	struct ct_headed h = {.v = &a->vol, .stored = {.slope = 1}};
	FILE *beside = NULL;
	int rc = -1;

	if (read_header(f, &h, e) || (h.file && open_beside(&beside, name, h.file, e)))
		goto out;
	ct_meta_drop(m, CT_META_NIFTI_CODE);
	if (!h.placed && ct_meta_set(m, CT_META_NIFTI_CODE, "0", e))
		goto out;
	rc = read_voxels(beside ? beside : f, &h, name, e);
	if (rc && h.file)
		ct_blame(e, h.file);
out:
	ct_io_close(beside);
	ct_meta_free(&h.field);
	return rc;
}

/* Which of the two, the name says. */
static int write_volume(const char *path, const struct ct_any *a, const struct ct_format_how *how,
	const struct ct_env *env, struct ct_err *e)
{
	return ct_headed_write(path, &a->vol, how->type, how->packed, env, e);
}

const struct ct_format ct_format_metaimage = {.name = "MetaImage",
	.kind = CT_KIND_VOLUME,
	.read = read_volume,
	.write = write_volume,
	.ends = CT_ENDS_METAIMAGE};
const struct ct_format ct_format_nrrd = {.name = "NRRD",
	.kind = CT_KIND_VOLUME,
	.read = read_volume,
	.write = write_volume,
	.ends = CT_ENDS_NRRD};
const struct ct_format *const ct_format_volumes[] = {
	&ct_format_nifti, &ct_format_nrrd, &ct_format_metaimage, NULL};

int ct_vol_write(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return ct_format_write(ct_format_volumes, path,
		&(struct ct_any){.kind = CT_KIND_VOLUME, .vol = *v}, &(struct ct_format_how){0},
		env, e);
}

int ct_vol_read(const char *path, struct ct_vol *v, struct ct_err *e)
{
	struct ct_any a = {0};
	/* the reader of NRRD also reads MetaImage */
	int rc = ct_format_read_first(ct_format_volumes, path, &a, e);

	*v = a.vol;
	return rc;
}
