/* trial.c: see trial.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/trial.h"
#include "operator/crop.h"
#include "operator/padding.h"

#include <math.h>
#include <string.h>

enum { ITERATIONS = 300 };
#define TOLERANCE 0.1 /* HU RMS: as a refinement ends */

/* Mean square of the differences along the refined axes, of n voxels from start on. */
static double roughness(
	const struct ct_vol *lo, const size_t n[3], const ptrdiff_t start[3], const bool refined[3])
{
	const size_t step[3] = {1, lo->n[0], lo->n[0] * lo->n[1]};
	double sum = 0;

	for (size_t k = 0; k + 1 < n[2]; k++)
		for (size_t j = 0; j + 1 < n[1]; j++)
			for (size_t i = 0; i + 1 < n[0]; i++) {
				const float *v = lo->data + (i + (size_t)start[0]) +
						 (j + (size_t)start[1]) * step[1] +
						 (k + (size_t)start[2]) * step[2];

				for (int a = 0; a < 3; a++) {
					const double d = (double)(v[step[a]] - v[0]);

					sum += refined[a] ? d * d : 0;
				}
			}
	return sum;
}

/* Where the part begins: the roughest of 27 places. */
static void choose(
	ptrdiff_t start[3], const struct ct_vol *lo, const size_t n[3], const bool refined[3])
{
	double most = -1;

	for (int p = 0; p < CT_CROP_PLACES; p++) {
		ptrdiff_t here[3];
		double rough;

		ct_crop_place(here, lo->n, n, p);
		rough = roughness(lo, n, here, refined);
		if (rough > most) {
			most = rough;
			memcpy(start, here, sizeof here);
		}
	}
}

/* The part, refined again by a method. */
static int again(struct ct_vol *made, enum ct_upsample method, const struct ct_vol *coarse,
	const struct ct_degrade *by, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule rule = {.method = method,
		.known = true,
		.by = *by,
		.iterations = ITERATIONS,
		.tolerance = TOLERANCE};
	struct ct_upsample_report did;

	return ct_upsample(made, coarse, &rule, &did, env, e);
}

static void compare(struct ct_trial *t, const struct ct_vol *part, const struct ct_vol *dc,
	const struct ct_vol *tv, const struct ct_vol *htv)
{
	double least = 0, first = 0, moved = 0, right = 0;

	for (size_t i = 0; i < ct_vol_count(part); i++) {
		const double misses = (double)(part->data[i] - tv->data[i]);
		const double to = (double)(htv->data[i] - tv->data[i]);
		const double plain = (double)(part->data[i] - dc->data[i]);

		least += plain * plain;
		first += misses * misses;
		moved += to * to;
		right += to * misses;
	}
	if (least > 0 && first > 0)
		t->gain = 10 * log10(least / first);
	if (moved > 0)
		t->share = fmax(right / moved, 0);
}

/* *filled (zeroed struct) <- lo, its padding filled as that of a scan is (refine/run.c), and *use
 * is it; or lo, where nothing is padding. */
static int fill(
	struct ct_vol *filled, const struct ct_vol **use, const struct ct_vol *lo, struct ct_err *e)
{
	struct ct_padding p = {0};
	int rc = 0;

	*use = lo;
	if (ct_padding_find(&p, lo->data, lo->n, e))
		return -1;
	if (p.is) {
		rc = ct_crop(filled, lo, lo->n, (const ptrdiff_t[3]){0}, 0, e) ||
		     ct_padding_fill(filled->data, &p, lo->n, e);
		*use = filled;
	}
	ct_padding_free(&p);
	return rc ? -1 : 0;
}

int ct_trial_run(struct ct_trial *t, const struct ct_vol *lo, const struct ct_degrade *by,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env quiet = *env;
	struct ct_vol filled = {0}, part = {0}, coarse = {0}, dc = {0}, tv = {0}, htv = {0};
	const struct ct_vol *use;
	struct ct_degrade own = *by; /* of the part: twice as coarse where that is to be refined */
	bool refined[3];
	ptrdiff_t start[3];
	size_t n[3];
	int rc = -1;

	*t = (struct ct_trial){.gain = (double)INFINITY};
	for (int a = 0; a < 3; a++) {
		refined[a] = by->factor[a] > 1;
		own.factor[a] = refined[a] ? 2 : 1;
		own.sigma[a] = by->sigma[a] * own.factor[a] / by->factor[a];
		n[a] = lo->n[a] < CT_TRIAL_MOST ? lo->n[a] : CT_TRIAL_MOST;
		n[a] -= refined[a] ? n[a] % 2 : 0;
		if (n[a] < (refined[a] ? CT_TRIAL_LEAST : 2))
			return 0;
	}
	quiet.log = NULL; /* it is not what was asked for */
	quiet.progress = NULL;
	if (fill(&filled, &use, lo, e))
		goto out;
	choose(start, use, n, refined);
	if (ct_crop(&part, use, n, start, 0, e) ||
		ct_degrade_volume(&coarse, &part, &own, 0, 0, env->par, e) ||
		again(&dc, CT_UPSAMPLE_DC, &coarse, &own, &quiet, e) ||
		again(&tv, CT_UPSAMPLE_TV, &coarse, &own, &quiet, e) ||
		again(&htv, CT_UPSAMPLE_HTV, &coarse, &own, &quiet, e))
		goto out;
	compare(t, &part, &dc, &tv, &htv);
	rc = 0;
out:
	ct_vol_free(&filled);
	ct_vol_free(&part);
	ct_vol_free(&coarse);
	ct_vol_free(&dc);
	ct_vol_free(&tv);
	ct_vol_free(&htv);
	return rc;
}
