/* profile.c: see profile.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "operator/degrade.h"
#include "estimate/profile.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Weights, float32, little-endian; of each network those of rows, of a scan of which one axis is
 * refined, and of another: W1 b1 W2 b2 W3 b3. */
static const unsigned char network[] = {
#include "estimate/profile-network.inc"
};

enum {
	NETWORKS = 2,
	WIDE = 64,
	OUT = 32,
	FOCI = 2, /* means with weights */
	POOLED = (2 + FOCI) * OUT,
	SEEN_ALL = POOLED + 1,
	SEEN_ONE = CT_PROFILE_SETS * POOLED + 2,
	HIDDEN = 48,
	LAST = 24,
	ROW_WEIGHTS = WIDE * (CT_EDGE_ROW + 1) + WIDE * (WIDE + 1) + (OUT + FOCI) * (WIDE + 1),
	SCAN_WEIGHTS = LAST * (HIDDEN + 1) + 3 * (LAST + 1),
	ONE_WEIGHTS = HIDDEN * (SEEN_ONE + 1) + SCAN_WEIGHTS,
	ALL_WEIGHTS = HIDDEN * (SEEN_ALL + 1) + SCAN_WEIGHTS,
	WEIGHTS = ROW_WEIGHTS + ONE_WEIGHTS + ALL_WEIGHTS
};
_Static_assert(sizeof network == (size_t)4 * NETWORKS * WEIGHTS, "the network is of another shape");

static float weight(size_t i)
{
	uint32_t word = 0;
	float w;

	for (size_t k = 0; k < sizeof word; k++)
		word |= (uint32_t)network[4 * i + k] << 8 * k;
	memcpy(&w, &word, sizeof w);
	return w;
}

/* y = W x + b, W (rows,columns) at *at of the weights; below 0 it becomes 0 if it is to. */
static void layer(
	double *y, const double *x, size_t rows, size_t columns, const float **w, bool relu)
{
	const float *bias = *w + rows * columns;

	for (size_t i = 0; i < rows; i++) {
		double sum = (double)bias[i];

		for (size_t k = 0; k < columns; k++)
			sum += (double)(*w)[i * columns + k] * x[k];
		y[i] = relu && sum < 0 ? 0 : sum;
	}
	*w = bias + rows;
}

/* What n > 0 rows have in common. */
static void pool(double pooled[POOLED], const float (*rows)[CT_EDGE_ROW], size_t n, const float *w)
{
	double sum[OUT] = {0}, square[OUT] = {0}, focus[FOCI][OUT] = {{0}}, share[FOCI] = {0};

	for (size_t r = 0; r < n; r++) {
		double x[CT_EDGE_ROW], y[WIDE], z[WIDE];
		const float *at = w;

		for (size_t k = 0; k < CT_EDGE_ROW; k++)
			x[k] = (double)rows[r][k];
		layer(y, x, WIDE, CT_EDGE_ROW, &at, true);
		layer(z, y, WIDE, WIDE, &at, true);
		layer(y, z, OUT + FOCI, WIDE, &at, false);
		for (size_t k = 0; k < OUT; k++) {
			sum[k] += y[k];
			square[k] += y[k] * y[k];
		}
		for (size_t f = 0; f < FOCI; f++) {
			const double by = exp(fmin(y[OUT + f], 300));

			share[f] += by;
			for (size_t k = 0; k < OUT; k++)
				focus[f][k] += by * y[k];
		}
	}
	for (size_t k = 0; k < OUT; k++) {
		const double mean = sum[k] / (double)n;

		pooled[k] = mean;
		pooled[OUT + k] = log(fmax(square[k] / (double)n - mean * mean, 0) + 1e-3);
		for (size_t f = 0; f < FOCI; f++)
			pooled[(2 + f) * OUT + k] = focus[f][k] / share[f];
	}
}

/* Of measured/true, on scans that were left out of the training. */
#define MEDIAN 0.966

/* What a network says: before the last functions of the spread, its deviation and the class. */
static void judge(
	double out[3], const struct ct_profile_rows *r, double factor, bool alone, const float *w)
{
	double seen[SEEN_ONE] = {0}, hidden[HIDDEN], last[LAST];
	const float *at = w + ROW_WEIGHTS + (alone ? 0 : ONE_WEIGHTS);
	const bool beside = r->n[1] > 0 && r->n[2] > 0 && r->n[3] > 0;
	size_t n = POOLED;

	pool(seen, (const float(*)[CT_EDGE_ROW])r->set[0], r->n[0], w);
	for (int k = 1; alone && k < CT_PROFILE_SETS; k++, n += POOLED)
		if (beside)
			pool(seen + n, (const float(*)[CT_EDGE_ROW])r->set[k], r->n[k], w);
	if (alone)
		seen[n++] = beside;
	seen[n++] = log(factor);
	layer(hidden, seen, HIDDEN, n, &at, true);
	layer(last, hidden, LAST, HIDDEN, &at, true);
	layer(out, last, 3, LAST, &at, false);
}

static struct ct_profile measure(
	const struct ct_profile_rows *r, double factor, bool alone, const float *w)
{
	double spread = 0, deviation = 0, odds = 0;
	struct ct_profile p = {.edges = r->n[0]};

	for (size_t k = 0; k < NETWORKS; k++) {
		double out[3];

		judge(out, r, factor, alone, w + k * WEIGHTS);
		spread += log1p(exp(fmin(out[0], 30))) / NETWORKS;
		deviation += fmin(fmax(out[1], -4), 1) / NETWORKS;
		odds += out[2] / NETWORKS;
	}
	p.spread = spread / MEDIAN;
	p.deviation = r->clipped ? 1 : exp(deviation) * (spread + 0.1) / spread;
	p.aliases = fmin(fmax(1 / (1 + exp(-odds)), 0.001), 0.999);
	ct_edge_lines_median(p.edge, (const float(*)[CT_EDGE_ROW])r->set[0], r->n[0]);
	return p;
}

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

int ct_profile_measure(struct ct_profile out[static 3], const struct ct_vol *v,
	const double factor[static 3], struct ct_par *par, struct ct_err *e)
{
	const bool alone = (factor[0] > 1) + (factor[1] > 1) + (factor[2] > 1) == 1;
	struct ct_profile_rows *r = NULL;
	struct ct_padding padding = {0};
	float *w = NULL;
	int rc = -1;

	if (ct_alloc(&r, 1, sizeof *r, e) ||
		ct_alloc(&w, (size_t)NETWORKS * WEIGHTS, sizeof *w, e) ||
		ct_padding_find(&padding, v->data, v->n, e))
		goto out;
	for (size_t i = 0; i < (size_t)NETWORKS * WEIGHTS; i++)
		w[i] = weight(i);
	for (int a = 0; a < 3; a++) {
		out[a] = (struct ct_profile){.spread = (double)NAN};
		if (!(factor[a] > 1))
			continue;
		if (ct_profile_rows_draw(
			    r, v->data, &padding, v->n, a, factor[a], alone, 0, par, e))
			goto out;
		if (r->n[0] > 0)
			out[a] = measure(r, factor[a], alone, w);
	}
	rc = 0;
out:
	ct_padding_free(&padding);
	free(r);
	free(w);
	return rc;
}
