/* units-read.c: volumes that are to be HU, of any format: see units.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"

void ct_vol_doubt(const struct ct_vol *v, const char *path, const struct ct_env *env)
{
	const char *doubt = ct_meta_get(&v->meta, CT_META_NIFTI_DOUBT);

	if (doubt)
		ct_log(env, CT_WARN, "%s: %s", path, doubt);
}

int ct_vol_read_hu(const char *path, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const enum ct_units units = (enum ct_units)ct_io_rule_of(env).units;

	if (ct_vol_read(path, v, e))
		return -1;
	ct_vol_doubt(v, path, env);
	if ((units == CT_UNITS_AUTO ? ct_units_check(v, "--units", e)
				    : ct_units_note(v, units, e)) == 0 &&
		ct_vol_check_finite(v, e) == 0)
		return 0;
	ct_vol_free(v);
	return ct_blame(e, path);
}
