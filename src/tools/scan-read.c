/* scan-read.c: see scan-read.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "dicom/form.h"
#include "formats/beside.h"
#include "formats/io.h"
#include "formats/units.h"
#include "dicom/sidecar.h"
#include "tools/scan-read.h"

int scan_read(struct ct_vol *v, const char *path, const char *series, const char *out,
	json_t *about, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_dicom_in in = {.paths = &path,
		.n = 1,
		.series = series,
		.units = (enum ct_units)ct_io_rule_of(env).units,
		.out = out,
		.about = about};

	if (dicom_form_of(path) != NOT_DICOM
			? ct_dicom_read(v, &in, env, e)
			: ct_vol_read_hu(path, v, env, e) || ct_beside_read(v, path, env, e))
		return -1;
	return about ? sidecar_volume(about, v, path, e) : 0;
}
