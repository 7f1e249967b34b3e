/* window-rule.c: see window-rule.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/window-rule.h"
#include "xray/window.h"

#include <string.h>

int ct_window_rule_choose(double window[static 2], const struct ct_window_rule *r,
	const struct ct_meta *m, struct ct_err *e)
{
	const char *had = m ? ct_meta_get(m, CT_META_WINDOW) : NULL;

	if (ct_window_get(window, m, e))
		return -1;
	if (!r || !*r->words)
		return 0;
	if (!ct_window_is(r->range))
		return ct_fail(e, CT_EUSAGE, "%s: float32 does not hold it", r->words);
	if (had && (r->range[0] != window[0] || r->range[1] != window[1])) {
		const char *file = ct_meta_get(m, CT_META_INPUT); /* "NAME HASH" */
		const char *end = file ? strrchr(file, ' ') : NULL;

		return ct_fail(e, CT_EUSAGE, "%s contradicts %.*s, whose window is %s", r->words,
			end ? (int)(end - file) : 9, end ? file : "the input", had);
	}
	window[0] = r->range[0];
	window[1] = r->range[1];
	return 0;
}

void ct_window_rule_warn(const struct ct_vol *v, const char *name, const double window[static 2],
	const struct ct_env *env)
{
	float largest;
	const size_t above = ct_window_above(ct_vol_count(v), v->data, window, &largest);

	if (above > 0)
		ct_log(env, CT_WARN,
			"%s: %zu voxels are above %g HU, up to %g, and count as %g (a wider "
			"--window keeps them)",
			name, above, window[1], (double)largest, window[1]);
}

int ct_window_rule_reconstructed(struct ct_vol *out, const struct ct_stack *in,
	const struct ct_window_rule *r, bool density, struct ct_err *e)
{
	static const char *const gone[] = {CT_META_SCAN_DSO, CT_META_SCAN_DSD, CT_META_SCAN_ARC,
		CT_META_SCAN_START, CT_META_SCAN_ISO, CT_META_VOLUME_SIZE, CT_META_VOLUME_AFFINE,
		CT_META_COARSEN, CT_META_PIXEL, CT_META_OVERSHOOT, CT_META_QUANTITY};
	const char *had = ct_meta_get(&in->meta, CT_META_QUANTITY);
	const bool residual = had && strcmp(had, CT_QUANTITY_RESIDUAL) == 0;
	double window[2];

	if (ct_window_rule_choose(window, r, &in->meta, e) ||
		ct_meta_copy(&out->meta, &in->meta, e))
		return -1;
	for (size_t i = 0; i < sizeof gone / sizeof *gone; i++)
		ct_meta_drop(&out->meta, gone[i]);
	if (ct_window_put(&out->meta, window, e))
		return -1;
	if (density)
		return ct_meta_set(&out->meta, CT_META_QUANTITY, CT_QUANTITY_DENSITY, e);
	return ct_window_volume(out, residual, window, e);
}
