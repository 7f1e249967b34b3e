/* gaps.c: slices that are missing; see layout.h. SPDX-License-Identifier: Apache-2.0 */
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

/* How many of `step` the gap before slice k is, less those that it is meant to be; 0 if that is no
 * whole number, or one. */
static size_t count(
	const struct ct_layout *l, const struct ct_slice *s, size_t usual, double step, size_t k)
{
	const double wide = fmax(widened(s, usual, k - 1), widened(s, usual, k));
	const double times = (l->at[k] - l->at[k - 1]) / (step * wide);

	return times > 1.5 && fabs(times - round(times)) < 0.1 && times < 1e6
		       ? (size_t)round(times) - 1
		       : 0;
}

/* Does InstanceNumber leave out, in each gap that is several of `step`, as many as the gap does,
 * and none elsewhere? */
static bool numbers_agree(
	const struct ct_layout *l, const struct ct_slice *s, size_t usual, double step)
{
	const int way = s[l->slices - 1].instance > s[0].instance ? 1 : -1;

	for (size_t k = 1; k < l->slices; k++) {
		const long long by = way * ((long long)s[k].instance - s[k - 1].instance);

		if (s[k].frames > 1 || by != (long long)count(l, s, usual, step, k) + 1)
			return false;
	}
	return true;
}

/* A slice behind a gap of about `step` at most. */
static size_t usual_of(const struct ct_layout *l, double step)
{
	size_t usual = 1;

	while (usual + 1 < l->slices && l->at[usual] - l->at[usual - 1] > 1.05 * step)
		usual++;
	return usual;
}

/* The distance of the slices that a stack had: the median of the gaps, where none is smaller. Where
 * most slices are missing the smallest gap is, if the numbers of the slices say so. 0: not known.
 */
static double step_of(const struct ct_layout *l, const struct ct_slice *s)
{
	const struct ct_spread *r = &l->spread;

	if (r->least > 0.95 * r->mid)
		return r->mid;
	return r->least > 0 && numbers_agree(l, s, usual_of(l, r->least), r->least) ? r->least : 0;
}

void ct_layout_count_missing(struct ct_layout *l, const struct ct_slice *s)
{
	struct ct_spread *r = &l->spread;
	size_t usual;

	if (!ct_layout_uneven(l) || !(step_of(l, s) > 0))
		return;
	r->mid = step_of(l, s);
	usual = usual_of(l, r->mid);
	for (size_t k = 1; k < l->slices; k++)
		r->missing += l->lost[k] = count(l, s, usual, r->mid, k);
}

void ct_layout_middle(const struct ct_slice *s, double mm[3])
{
	const double i = ((double)s->columns - 1) / 2 * s->pitch[0],
		     j = ((double)s->rows - 1) / 2 * s->pitch[1];

	for (int r = 0; r < 3; r++)
		mm[r] = (r < 2 ? -1 : 1) * (s->position[r] + i * s->across[r] + j * s->down[r]);
}

size_t ct_layout_gap(const struct ct_layout *l, const struct ct_slice *s, size_t k,
	double before[3], double after[3])
{
	if (l->lost[k]) {
		ct_layout_middle(&s[k - 1], before);
		ct_layout_middle(&s[k], after);
	}
	return l->lost[k];
}
