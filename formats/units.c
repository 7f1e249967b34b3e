/* units.c: see units.h. */
#include "config.h"
#include "formats/format.h"
#include "formats/units.h"

#include <math.h>
#include <string.h>
int ct_units_note(struct ct_vol *v, enum ct_units units, struct ct_err *e)
{
	if (units == CT_UNITS_AUTO)
		return 0;
	return ct_meta_set(&v->meta, CT_META_QUANTITY,
		units == CT_UNITS_HU ? CT_QUANTITY_HU : CT_QUANTITY_OTHER, e);
}

int ct_units_check(const struct ct_vol *v, const char *option, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	float lo = INFINITY, hi = -INFINITY;
	size_t soft = 0;
	bool shifted;

	if (quantity && strcmp(quantity, CT_QUANTITY_OTHER) == 0)
		return ct_fail(e, CT_EINPUT,
			"its values are not HU, says its metadata (but see %s)", option);
	if (quantity)
		return 0;
	for (size_t i = 0, n = ct_vol_count(v); i < n; i++) {
		if (isfinite(v->data[i])) {
			lo = fminf(lo, v->data[i]);
			hi = fmaxf(hi, v->data[i]);
			soft += v->data[i] >= 900 && v->data[i] <= 1150;
		}
	}
	shifted = lo >= 0 && hi > 1000 && soft >= ct_vol_count(v) / 10;
	if (!(lo < hi) || !((lo >= -2 && hi <= 10) || shifted))
		return 0;
	return ct_fail(e, CT_EINPUT, "values from %g to %g are not HU%s (but see %s)", (double)lo,
		(double)hi, shifted ? ": they are as if 1000 or 1024 was added" : "", option);
}

int ct_vol_read_hu(const char *path, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const enum ct_units units = (enum ct_units)env->units;

	if (ct_vol_read(path, v, e))
		return -1;
	if ((units == CT_UNITS_AUTO ? ct_units_check(v, "--units", e)
				    : ct_units_note(v, units, e)) == 0 &&
		ct_vol_check_finite(v, e) == 0)
		return 0;
	ct_vol_free(v);
	return ct_blame(e, path);
}
