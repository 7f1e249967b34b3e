/* counts.c: see counts.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/counts.h"
#include "core/mem.h"
#include "core/order.h"
#include "core/par.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

enum { ABOUT = 2, MOST = (2 * ABOUT + 1) * (2 * ABOUT + 1), STILL = 8, FARTHEST = 16 };
#define LEAST 1e-4F  /* of the flat field: a value behind so much is noise */
#define DEAD 0.1F    /* of the median about a pixel */
#define LITTLE 1e-3F /* of the largest value: what varies less may be rounding */

CT_ORDER(by_value, float)

static float median(float *x, size_t n)
{
	qsort(x, n, sizeof *x, by_value);
	return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

/* Median of the pixels about one, without it. */
static float about(const float *x, size_t h, size_t w, size_t r, size_t c)
{
	float near[MOST];
	size_t n = 0;

	for (size_t i = r < ABOUT ? 0 : r - ABOUT; i <= r + ABOUT && i < h; i++)
		for (size_t j = c < ABOUT ? 0 : c - ABOUT; j <= c + ABOUT && j < w; j++)
			if (i != r || j != c)
				near[n++] = x[i * w + j];
	return n ? median(near, n) : x[r * w + c];
}

/* Range of what is finite of each pixel over the views; returns what is little of one. */
static float find_range(float *range, const struct ct_stack *s)
{
	const size_t n = s->h * s->w;
	float most = 0;

	for (size_t i = 0; i < n; i++) {
		float lo = INFINITY, hi = -INFINITY;

		for (size_t k = 0; k < s->views; k++) {
			const float x = s->data[k * n + i];

			lo = isfinite(x) ? fminf(lo, x) : lo;
			hi = isfinite(x) ? fmaxf(hi, x) : hi;
		}
		range[i] = hi > lo ? hi - lo : 0;
		most = hi >= lo ? fmaxf(most, fmaxf(fabsf(lo), fabsf(hi))) : most;
	}
	return LITTLE * most;
}

/* Does a pixel keep its value in all views, though in one of them pixels on either side of it in
 * its row, which do not keep theirs, have others? So a pixel that sees air in all views is good,
 * though a computed shadow passes it on the left in one view and on the right in the next. */
static bool is_still(const struct ct_stack *s, const float *range, float little, size_t i)
{
	const size_t c = i % s->w, n = s->h * s->w;
	bool within = false;

	for (size_t k = 0; range[i] == 0 && k < s->views && !within; k++) {
		const float *x = s->data + k * n + i;
		bool left = false, right = false;

		for (ptrdiff_t d = 1; d <= 2 * ABOUT; d++) {
			left = left || ((ptrdiff_t)c >= d && range[(ptrdiff_t)i - d] > little &&
					       !(fabsf(x[-d] - x[0]) <= little));
			right = right ||
				(c + (size_t)d < s->w && range[(ptrdiff_t)i + d] > little &&
					!(fabsf(x[d] - x[0]) <= little));
		}
		within = left && right;
	}
	return within;
}

/* bad[h][w], and how many; work[h][w]. */
static size_t find_bad(
	bool *bad, float *work, const struct ct_stack *s, const struct ct_counts_rule *r)
{
	const size_t n = s->h * s->w;
	size_t count = 0;
	float little;

	for (size_t i = 0; i < n && r->counts; i++)
		work[i] = r->flat[i] - (r->dark ? r->dark[i] : 0);
	for (size_t i = 0; i < n && r->counts; i++)
		bad[i] = !(work[i] > 0) ||
			 work[i] < DEAD * about(work, s->h, s->w, i / s->w, i % s->w);
	little = s->views < STILL ? 0 : find_range(work, s);
	for (size_t i = 0; i < n && s->views >= STILL; i++)
		bad[i] = bad[i] || is_still(s, work, little, i);
	for (size_t i = 0; i < n; i++)
		count += bad[i];
	return count;
}

/* Mean of the good pixels of a view nearest to (r, c), by the square of their distance. */
static float mended(const float *x, const bool *bad, size_t h, size_t w, size_t r, size_t c)
{
	for (size_t far = 1; far <= FARTHEST; far++) {
		double sum = 0, weights = 0;

		for (size_t i = r < far ? 0 : r - far; i <= r + far && i < h; i++)
			for (size_t j = c < far ? 0 : c - far; j <= c + far && j < w; j++) {
				const double dr = (double)i - (double)r, dc = (double)j - (double)c;

				if (bad[i * w + j] || !isfinite(x[i * w + j]))
					continue;
				sum += (double)x[i * w + j] / (dr * dr + dc * dc);
				weights += 1 / (dr * dr + dc * dc);
			}
		if (weights > 0)
			return (float)(sum / weights);
	}
	return NAN;
}

struct job {
	struct ct_stack *s;
	const struct ct_counts_rule *rule;
	const bool *bad;
	size_t (*found)[2]; /* of each view: lost, starved */
	float *mended;      /* [threads][h][w] */
};

static void correct_view(void *arg, size_t k, size_t worker)
{
	const struct job *j = arg;
	const struct ct_counts_rule *r = j->rule;
	const size_t h = j->s->h, w = j->s->w, n = h * w;
	float *x = ct_stack_view(j->s, k), *fresh = j->mended + worker * n;

	for (size_t i = 0; i < n && r->counts; i++) {
		const float dark = r->dark ? r->dark[i] : 0;
		const float t = (x[i] - dark) / (r->flat[i] - dark);

		j->found[k][1] += !j->bad[i] && t < LEAST;
		x[i] = isfinite(t) ? -logf(fmaxf(t, LEAST)) : t;
	}
	for (size_t i = 0; i < n; i++) {
		const bool lost = !isfinite(x[i]);

		j->found[k][0] += lost && !j->bad[i];
		fresh[i] = lost || j->bad[i] ? mended(x, j->bad, h, w, i / w, i % w) : x[i];
	}
	for (size_t i = 0; i < n; i++)
		x[i] = fresh[i];
}

/* One row of the detector. mean, smooth: [w]; near: [width]. */
static void unring(
	struct ct_stack *s, size_t row, size_t width, float *mean, float *smooth, float *near)
{
	const size_t w = s->w, half = width / 2;

	for (size_t c = 0; c < w; c++) {
		double sum = 0;

		for (size_t k = 0; k < s->views; k++)
			sum += (double)s->data[(k * s->h + row) * w + c];
		mean[c] = (float)(sum / (double)s->views);
	}
	for (size_t c = 0; c < w; c++) {
		const size_t part = c < half || w - 1 - c < half
					    ? (c < w - 1 - c ? c : w - 1 - c)
					    : half; /* as many on either side */

		for (size_t i = 0; i <= 2 * part; i++)
			near[i] = mean[c - part + i];
		smooth[c] = median(near, 2 * part + 1);
	}
	for (size_t k = 0; k < s->views; k++)
		for (size_t c = 0; c < w; c++)
			s->data[(k * s->h + row) * w + c] -= mean[c] - smooth[c];
}

static int remove_rings(struct ct_stack *s, size_t width, struct ct_err *e)
{
	float *work;

	if (ct_alloc(&work, 2 * s->w + width, sizeof *work, e))
		return -1;
	for (size_t r = 0; r < s->h; r++)
		unring(s, r, width, work, work + s->w, work + 2 * s->w);
	free(work);
	return 0;
}

int ct_counts_correct(struct ct_stack *s, const struct ct_counts_rule *rule,
	struct ct_counts_report *report, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = s->h * s->w;
	struct job j = {.s = s, .rule = rule};
	bool *bad = NULL;
	int rc = -1;

	*report = (struct ct_counts_report){0};
	if (ct_alloc0(&bad, n, sizeof *bad, e) ||
		ct_alloc0(&j.found, s->views, sizeof *j.found, e) ||
		ct_alloc(&j.mended, ct_par_threads(env->par) * n, sizeof *j.mended, e))
		goto out;
	report->bad = find_bad(bad, j.mended, s, rule);
	if (report->bad > n / 5) {
		ct_fail(e, CT_EINPUT,
			"%zu of %zu pixels of the detector are bad: are flat and dark field those of "
			"this scan, and its values counts?",
			report->bad, n);
		goto out;
	}
	j.bad = bad;
	ct_par_for(env->par, s->views, correct_view, &j);
	for (size_t k = 0; k < s->views; k++) {
		report->lost += j.found[k][0];
		report->starved += j.found[k][1];
	}
	rc = rule->rings ? remove_rings(s, rule->rings, e) : 0;
out:
	free(bad);
	free(j.found);
	free(j.mended);
	return rc;
}
