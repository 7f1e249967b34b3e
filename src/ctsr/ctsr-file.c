/* ctsr-file.c: files of volumes, in the formats that a program names.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "formats/any.h"
#include "formats/beside.h"
#include "formats/ends.h"

#include <string.h>

int ctsr_volume_read(
	ctsr_volume **v, const char *path, const ctsr_format *const *formats, ctsr_error *e)
{
	const ctsr_context one = {.size = sizeof one, .threads = 1};
	struct ct_any a = {0};
	struct ctsr_call k = CTSR_CALL(__func__);
	int rc = ctsr_make_volume(&k, v) || ctsr_call_begin(&k, path && formats, &one) ||
		 ct_format_read((const struct ct_format *const *)formats, path, &a, &k.err);

	if (rc == 0) {
		(*v)->v = a.vol;
		rc = ct_beside_read(&(*v)->v, path, &k.env, &k.err);
	}
	return ctsr_call_end(&k, rc, e);
}

int ctsr_volume_write(const ctsr_volume *v, const char *path, const ctsr_format *format,
	const ctsr_context *c, ctsr_error *e)
{
	const struct ct_format *f = (const struct ct_format *)format;
	struct ctsr_call k = CTSR_CALL(__func__);
	char ends[60];
	int rc = ctsr_call_begin(&k, v && path && format, c);

	if (rc == 0) {
		ct_ends_text(ends, sizeof ends, f->ends);
		if (strcmp(path, "-") != 0 && !ct_ends_match(path, f->ends))
			rc = ct_fail(&k.err, CT_EUSAGE, "%s: the name of a %s file ends in %s",
				path, f->name, ends);
		else if (ct_vol_check_finite(&v->v, &k.err))
			rc = ct_blame(&k.err, path);
		else
			rc = f->write(path, &(struct ct_any){.kind = CT_KIND_VOLUME, .vol = v->v},
				&(struct ct_format_how){0}, &k.env, &k.err);
	}
	return ctsr_call_end(&k, rc, e);
}
