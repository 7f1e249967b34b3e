/* units.c: see units.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
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

/* The voxels that are numbers. */
struct look {
	float lo, hi;
	size_t n, lowest;           /* as low as lo */
	size_t air, soft, opposite; /* below -900; in [900, 1150]; in [900, 1100] */
	size_t dense;               /* above 4095 */
};

static struct look look_at(const struct ct_vol *v)
{
	struct look l = {.lo = INFINITY, .hi = -INFINITY};

	for (size_t i = 0, n = ct_vol_count(v); i < n; i++) {
		const float x = v->data[i];

		if (!isfinite(x))
			continue;
		if (x < l.lo)
			l.lowest = 0;
		l.lo = fminf(l.lo, x);
		l.hi = fmaxf(l.hi, x);
		l.n++;
		l.lowest += x == l.lo;
		l.air += x < -900;
		l.soft += x >= 900 && x <= 1150;
		l.opposite += x >= 900 && x <= 1100;
		l.dense += x > 4095;
	}
	return l;
}

/* Why they cannot be HU; NULL if they can. */
static const char *why_not(const struct look *l)
{
	if (!(l->lo < l->hi))
		return NULL;
	if (l->lo >= -2 && l->hi <= 10)
		return "";
	if (l->lo < -32768 || l->hi > 65535)
		return ": no CT reaches that far";
	if (l->lo >= 0 && l->hi > 1000 && l->soft * 10 >= l->n)
		return ": they are as if 1000 or 1024 was added";
	if (l->lo < 0 && l->hi <= 1300 && l->opposite * 10 >= l->n && l->air * 100 < l->n)
		return ": air is near 1000, as if their sign was changed";
	if (l->lo == 0 && (l->hi == 255 || l->hi == 65535))
		return ": they fill 8 or 16 bits, as grey values do";
	if (l->lo == 0 && l->hi <= 1000 && l->lowest * 20 >= l->n)
		return ": they begin at a background of 0, as grey values do";
	if (l->dense * 2 > l->n)
		return ": most are above 4095, as only metal is, or as if 8192 was added";
	return NULL;
}

int ct_units_check(const struct ct_vol *v, const char *option, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY), *why;
	struct look l;

	if (quantity && strcmp(quantity, CT_QUANTITY_OTHER) == 0)
		return ct_fail(e, CT_EINPUT,
			"its values are not HU, says its metadata (but see %s)", option);
	if (quantity)
		return 0;
	l = look_at(v);
	why = why_not(&l);
	return why ? ct_fail(e, CT_EINPUT, "values from %g to %g are not HU%s (but see %s)",
			     (double)l.lo, (double)l.hi, why, option)
		   : 0;
}
