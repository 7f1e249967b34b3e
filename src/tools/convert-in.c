/* convert-in.c: what ct-convert reads. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/raw.h"
#include "tools/convert.h"
#include "dicom/form.h"
#include "dicom/dicom.h"

#include <stdio.h>
#include <string.h>

static int raw_error(const char *text, struct ct_err *e)
{
	return ct_fail(e, CT_EUSAGE,
		"--raw: '%s' is not WxHxD:TYPE:X,Y,Z, such as 512x512x90:i16:0.7,0.7,1.5", text);
}

/* "WxHxD:TYPE[:be]:X,Y,Z" */
static int raw_layout(struct ct_raw *how, const char *text, struct ct_err *e)
{
	const char *type = strchr(text, ':'), *mm = strrchr(text, ':');
	char dims[80], word[80];

	if (!type || type == mm)
		return raw_error(text, e);
	snprintf(dims, sizeof dims, "%.*s", (int)(type - text), text);
	snprintf(word, sizeof word, "%.*s", (int)(mm - type - 1), type + 1);
	if (ct_cli_dims("raw", dims, 3, how->n, e) || ct_raw_type(word, &how->type, &how->big, e) ||
		ct_cli_numbers("raw", mm + 1, ',', 3, true, how->spacing, e))
		return -1;
	for (int d = 0; d < 3; d++)
		if (!(how->spacing[d] > 0))
			return ct_fail(
				e, CT_EUSAGE, "--raw: the voxel size %s is not positive", mm + 1);
	return 0;
}

static int read_raw(const struct convert *p, struct ct_vol *v, struct ct_err *e)
{
	struct ct_raw how = {.slope = p->slope, .inter = p->inter};

	return raw_layout(&how, p->raw, e) ||
			       ct_raw_axes("orient", p->orient, how.world, how.sign, e)
		       ? -1
		       : ct_raw_read(p->in, &how, v, e);
}

struct ct_dicom_in convert_dicom_in(const struct convert *p, size_t n)
{
	return (struct ct_dicom_in){.paths = p->files.v,
		.n = n,
		.series = p->series,
		.tilt = (enum ct_tilt)p->tilt,
		.gaps = (enum ct_gaps)p->gaps,
		.units = (enum ct_units)p->units,
		.skip_damaged = p->skip_damaged,
		.about = p->about};
}

bool convert_is_picture(const char *path)
{
	unsigned char head[CT_SNIFF];

	return strcmp(path, "-") != 0 &&
	       ct_any_sniff(head, ct_any_head(head, path)) == CT_KIND_PICTURE;
}

static int read_other(const struct convert *p, struct ct_vol *v, struct ct_err *e)
{
	if (p->raw)
		return read_raw(p, v, e);
	if (p->files.n > 2)
		return ct_fail(
			e, CT_EUSAGE, "%s: several files are taken if they are DICOM", p->in);
	if (p->series && !p->template)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", p->in);
	return convert_is_picture(p->in)
		       ? ct_fail(e, CT_EINPUT,
				 "%s: a picture, not a volume; --radiograph makes a stack of it",
				 p->in)
		       : ct_vol_read(p->in, v, e);
}

int convert_read(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	if (!p->raw && dicom_form_of(p->in) != NOT_DICOM)
		return convert_series(p, v, env, e);
	if (read_other(p, v, e))
		return -1;
	return ct_vol_check_finite(v, e) ? ct_blame(e, p->in) : 0;
}
