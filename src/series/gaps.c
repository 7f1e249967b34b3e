/* gaps.c: slices that are missing; see layout.h. */
#include "config.h"
#include "series/layout.h"

#include <math.h>

/* How many times wider slice k is meant to lie from the next than slice `usual` is: by the field
 * that changed more. */
static double widened(const struct ct_slice *s, size_t usual, size_t k)
{
	const double by[2] = {s[k].thickness / s[usual].thickness, s[k].between / s[usual].between};
	double most = 1;

	for (int i = 0; i < 2; i++)
		if (isfinite(by[i]))
			most = fmax(most, by[i]);
	return most;
}

void ct_layout_count_missing(struct ct_layout *l, const struct ct_slice *s)
{
	struct ct_spread *r = &l->spread;
	size_t usual = 1;

	if (!(r->least > 0.95 * r->mid) || !ct_layout_uneven(l))
		return;
	while (usual + 1 < l->slices && l->at[usual] - l->at[usual - 1] > 1.05 * r->mid)
		usual++;
	for (size_t k = 1; k < l->slices; k++) {
		const double wide = fmax(widened(s, usual, k - 1), widened(s, usual, k));
		const double times = (l->at[k] - l->at[k - 1]) / (r->mid * wide);

		if (times > 1.5 && fabs(times - round(times)) < 0.1 && times < 1e6)
			r->missing += l->lost[k] = (size_t)round(times) - 1;
	}
}
