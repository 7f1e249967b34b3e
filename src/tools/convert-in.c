/* convert-in.c: what ct-convert reads. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/raw.h"
#include "tools/convert.h"
#include "tools/dicom-series.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

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

/* A folder, or a regular file with DICOM's mark behind its preamble. Never reads from a pipe. */
static bool is_dicom(const char *path, bool *folder)
{
	struct stat st;
	char head[132];
	size_t n;
	FILE *f;

	*folder = strcmp(path, "-") != 0 && stat(path, &st) == 0 && S_ISDIR(st.st_mode);
	if (*folder)
		return true;
	if (strcmp(path, "-") == 0 || stat(path, &st) != 0 || !S_ISREG(st.st_mode))
		return false;
	f = fopen(path, "rb");
	n = f ? fread(head, 1, sizeof head, f) : 0;
	if (f)
		fclose(f);
	return n == sizeof head && memcmp(head + 128, "DICM", 4) == 0;
}

#ifdef HAVE_VTK
/* One file stands for the series it belongs to, in its folder; several are taken as they are. */
static int read_dicom(const struct convert *p, bool folder, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = p->files.n - 1;
	const char *slash = strrchr(p->in, '/');
	struct series_rule rule = {.which = p->series,
		.tilt = (enum ct_tilt)p->tilt,
		.gaps = (enum ct_gaps)p->gaps,
		.units = (enum ct_units)p->units,
		.skip_damaged = p->skip_damaged};
	char *where =
		!slash ? strdup(".") : strndup(p->in, slash == p->in ? 1 : (size_t)(slash - p->in));
	char *member = NULL;
	int rc = -1;

	if (!where || asprintf(&member, "%s%s%s", where, slash == p->in ? "" : "/",
			      slash ? slash + 1 : p->in) < 0) {
		free(where);
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	if (n > 1 || folder)
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
static int read_dicom(const struct convert *p, bool folder, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	(void)folder;
	(void)v;
	(void)env;
	return ct_fail(e, CT_EINPUT, "%s: this build reads no DICOM (configure --with-vtk)", p->in);
}
#endif

int convert_read(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	bool folder;

	if (p->raw)
		return read_raw(p, v, e);
	if (is_dicom(p->in, &folder))
		return read_dicom(p, folder, v, env, e);
	if (p->files.n > 2)
		return ct_fail(
			e, CT_EUSAGE, "%s: several files are taken if they are DICOM", p->in);
	if (p->series)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", p->in);
	return ct_vol_read(p->in, v, e);
}
