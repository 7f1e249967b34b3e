/* profile-rows.c: what the networks of profile.h see. */
#include "config.h"
#include "core/mem.h"
#include "resolution/degrade.h"
#include "resolution/profile.h"

#include <stdlib.h>

/* At most `most` rows more, along an axis of x, for set k. */
static int add(struct ct_profile_rows *r, int k, size_t most, const float *x, bool *clipped,
	const unsigned char *padding, const size_t n[3], int axis, struct ct_err *e)
{
	size_t count;

	if (ct_edge_lines_draw(r->set[k] + r->n[k], most, &count, clipped, x, padding, n, axis, e))
		return -1;
	r->n[k] += count;
	return 0;
}

/* x, whose axis b is reduced by P1 or by means, gives rows along b, and along `axis`. */
static int beside(struct ct_profile_rows *r, const float *x, const struct ct_padding *padding,
	const size_t n[3], int axis, int b, double factor, bool limited, size_t most,
	struct ct_par *par, struct ct_err *e)
{
	struct ct_degrade by = {.factor = {1, 1, 1}, .decimate = CT_DECIMATE_MEAN};
	const size_t cells = ct_degrade_size(n[b], factor);
	size_t m[3] = {n[0], n[1], n[2]};
	struct ct_separable down = {0};
	struct ct_padding coarse = {0};
	float *y = NULL;
	int rc = -1;

	m[b] = cells;
	by.factor[b] = factor;
	if (limited)
		ct_degrade_protocol(&by, 1);
	if (ct_degrade_plan(&down, &by, n, par, e) ||
		ct_alloc(&y, m[0] * m[1] * m[2], sizeof *y, e) ||
		ct_padding_reduce(&coarse, padding, n, b, factor, e))
		goto out;
	ct_separable_apply(&down, y, x, par);
	if (add(r, limited ? 3 : 2, most, y, NULL, coarse.is, m, b, e) ||
		(!limited && add(r, 1, most, y, NULL, coarse.is, m, axis, e)))
		goto out;
	rc = 0;
out:
	ct_padding_free(&coarse);
	ct_separable_free(&down);
	free(y);
	return rc;
}

int ct_profile_rows_draw(struct ct_profile_rows *r, const float *x,
	const struct ct_padding *padding, const size_t n[static 3], int axis, double factor,
	bool alone, unsigned no, struct ct_par *par, struct ct_err *e)
{
	bool use[3];
	size_t others = 0;

	for (int k = 0; k < CT_PROFILE_SETS; k++)
		r->n[k] = 0;
	if (add(r, 0, CT_EDGE_PLACES, x, &r->clipped, padding->is, n, axis, e))
		return -1;
	for (int b = 0; b < 3; b++) {
		use[b] = alone && b != axis && !(no >> b & 1) &&
			 ct_degrade_size(n[b], factor) > CT_EDGE_LONG;
		others += use[b];
	}
	for (int b = 0; b < 3; b++)
		for (int limited = 0; use[b] && r->n[0] > 0 && limited < 2; limited++)
			if (beside(r, x, padding, n, axis, b, factor, limited,
				    CT_EDGE_PLACES / others, par, e))
				return -1;
	return 0;
}
