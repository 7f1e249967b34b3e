/* convert-in.c: what ct-convert reads. */
#include "config.h"
#include "cli/cli.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/raw.h"
#include "tools/convert.h"
#include "tools/dicom-inspect.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

static int read_raw(const struct convert *p, struct ct_vol *v, struct ct_err *e)
{
	struct ct_raw how = {.slope = p->slope, .inter = p->inter};
	const char *colon = strchr(p->raw, ':');
	char dims[80];

	if (!colon)
		return ct_fail(e, CT_EUSAGE, "--raw: '%s' is not WxHxD:TYPE", p->raw);
	if (!p->spacing)
		return ct_fail(e, CT_EUSAGE, "--raw needs --spacing");
	snprintf(dims, sizeof dims, "%.*s", (int)(colon - p->raw), p->raw);
	if (ct_cli_dims("raw", dims, 3, how.n, e) ||
		ct_raw_type(colon + 1, &how.type, &how.big, e) ||
		ct_cli_numbers("spacing", p->spacing, ',', 3, true, how.spacing, e) ||
		ct_raw_axes("orient", p->orient, how.world, how.sign, e))
		return -1;
	for (int d = 0; d < 3; d++)
		if (!(how.spacing[d] > 0))
			return ct_fail(e, CT_EUSAGE, "--spacing: %s is not positive", p->spacing);
	if (how.slope == 0)
		return ct_fail(e, CT_EUSAGE, "--slope 0 leaves nothing");
	return ct_raw_read(p->in, &how, v, e);
}

enum form { NOT_DICOM, FOLDER, FILE_OF_SERIES, ARCHIVE, PICTURE };

/* What a zip, tar or compressed file begins with, but for gzip. */
static bool is_archive(const unsigned char *p, size_t n)
{
	static const struct {
		const char *magic;
		size_t n;
	} known[] = {{"PK\3\4", 4}, {"BZh", 3}, {"\3757zXZ", 5}, {"\x28\xb5\x2f\xfd", 4}};

	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		if (n >= known[i].n && memcmp(p, known[i].magic, known[i].n) == 0)
			return true;
	return ct_any_is_tar(p, n);
}

/* Does the gzip file hold something else than NIfTI? */
static bool is_other_gzip(const char *path)
{
	unsigned char head[4];
	gzFile f = gzopen(path, "rb");
	const int n = f ? gzread(f, head, sizeof head) : 0;

	if (f)
		gzclose(f);
	return n == sizeof head && ct_any_sniff(head, sizeof head) != CT_KIND_VOLUME;
}

/* By content, of a folder or a regular file. Never reads from a pipe. */
static enum form form_of(const char *path)
{
	unsigned char head[CT_SNIFF];
	struct stat st;
	size_t n;
	FILE *f;

	if (strcmp(path, "-") == 0 || stat(path, &st) != 0)
		return NOT_DICOM;
	if (S_ISDIR(st.st_mode))
		return FOLDER;
	f = S_ISREG(st.st_mode) ? fopen(path, "rb") : NULL;
	n = f ? fread(head, 1, sizeof head, f) : 0;
	if (f)
		fclose(f);
	if (ct_any_sniff(head, n) == CT_KIND_DICOM ||
		(n >= 8 && (head[0] == 2 || head[0] == 8) && !head[1] && !head[3]))
		return FILE_OF_SERIES; /* with or without its preamble */
	if (ct_any_sniff(head, n) == CT_KIND_PICTURE)
		return PICTURE;
	if (is_archive(head, n) ||
		(n > 2 && head[0] == 0x1f && head[1] == 0x8b && is_other_gzip(path)))
		return ARCHIVE;
	return NOT_DICOM;
}

#ifdef HAVE_VTK
static struct series_rule rule_of(const struct convert *p)
{
	return (struct series_rule){.which = p->series,
		.tilt = (enum ct_tilt)p->tilt,
		.gaps = (enum ct_gaps)p->gaps,
		.units = (enum ct_units)p->units,
		.skip_damaged = p->skip_damaged,
		.about = p->about};
}

int convert_inspect(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	const struct series_rule rule = rule_of(p);

	return inspect_print(p->files.v, p->files.n, &rule, env, e);
}

/* One file stands for the series it belongs to, in its folder; several are taken as they are. */
static int read_dicom(const struct convert *p, enum form form, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = p->files.n - 1;
	const char *slash = strrchr(p->in, '/');
	struct series_rule rule = rule_of(p);
	char *where =
		!slash ? strdup(".") : strndup(p->in, slash == p->in ? 1 : (size_t)(slash - p->in));
	char *member = NULL;
	int rc = -1;

	if (!where || asprintf(&member, "%s%s%s", where, slash == p->in ? "" : "/",
			      slash ? slash + 1 : p->in) < 0) {
		free(where);
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	if (n > 1 || form != FILE_OF_SERIES)
		rc = series_read(p->files.v, n, &rule, v, env, e);
	else {
		if (!p->series)
			rule.member = member;
		rc = series_read((const char *const[]){where}, 1, &rule, v, env, e);
	}
	if (!rc)
		rc = ct_meta_input(&v->meta, p->in, 2,
			(const struct ct_piece[]){{v->affine, sizeof v->affine},
				{v->data, ct_vol_count(v) * sizeof *v->data}},
			e);
	free(member);
	free(where);
	return rc;
}
#else
int convert_inspect(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	(void)env;
	return ct_fail(e, CT_EINPUT, "%s: this build reads no DICOM (configure --with-vtk)",
		p->files.v[0]);
}

static int read_dicom(const struct convert *p, enum form form, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	(void)form;
	(void)v;
	(void)env;
	return ct_fail(e, CT_EINPUT, "%s: this build reads no DICOM (configure --with-vtk)", p->in);
}
#endif

int convert_read(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	enum form form;

	if (p->raw)
		return read_raw(p, v, e);
	form = form_of(p->in);
	if (form != NOT_DICOM && form != PICTURE)
		return read_dicom(p, form, v, env, e);
	if (p->files.n > 2)
		return ct_fail(
			e, CT_EUSAGE, "%s: several files are taken if they are DICOM", p->in);
	if (p->series)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", p->in);
	return form == PICTURE
		       ? ct_fail(e, CT_EINPUT,
				 "%s: a picture; ct-ddnm and ct-train read it as it is", p->in)
		       : ct_vol_read(p->in, v, e);
}
