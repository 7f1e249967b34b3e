/* pilot.c: see pilot.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/pilot.h"
#include "core/mem.h"
#include "operator/crop.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TISSUE -500.0F /* HU, and above */

static size_t tissue(const struct ct_vol *lo, const size_t n[3], const ptrdiff_t start[3])
{
	size_t count = 0;

	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++) {
			const float *row = lo->data + (size_t)start[0] +
					   lo->n[0] * ((size_t)start[1] + j +
							      lo->n[1] * ((size_t)start[2] + k));

			for (size_t i = 0; i < n[0]; i++)
				count += row[i] > TISSUE;
		}
	return count;
}

/* Where the pilot begins. */
static void choose(ptrdiff_t start[3], const struct ct_vol *lo, const size_t n[3])
{
	const ptrdiff_t first[3] = {0};
	const double all = (double)tissue(lo, lo->n, first) / (double)ct_vol_count(lo);
	const double voxels = (double)n[0] * (double)n[1] * (double)n[2];
	double least = (double)INFINITY;

	for (int p = 0; p < CT_CROP_PLACES; p++) {
		ptrdiff_t here[3];
		double off;

		ct_crop_place(here, lo->n, n, (p + CT_CROP_PLACES / 2) % CT_CROP_PLACES);
		off = fabs((double)tissue(lo, n, here) / voxels - all);
		if (off < least) {
			least = off;
			memcpy(start, here, sizeof here);
		}
	}
}

bool ct_pilot_size(size_t n[static 3], const struct ct_vol *lo, const struct ct_upsample_rule *rule)
{
	double fine = 1;

	for (int a = 0; a < 3; a++)
		fine *= (double)ct_degrade_cover(lo->n[a], rule->by.factor[a]);
	for (int a = 0; a < 3; a++) {
		const double x = rule->by.factor[a], share = (double)lo->n[a] * x / CT_PILOT_SHARE;
		const double most = fmin(fmax(share, CT_PILOT_FEWEST), CT_PILOT_MOST);

		n[a] = fine <= CT_PILOT_WHOLE ? lo->n[a] : (size_t)ceil(most / x);
		n[a] = n[a] < lo->n[a] ? n[a] : lo->n[a];
	}
	return rule->known && (rule->noise > 0 || rule->tolerance > 0) &&
	       (rule->method == CT_UPSAMPLE_AUTO || rule->method >= CT_UPSAMPLE_TV);
}

static int refine(struct ct_upsample_report *did, const struct ct_vol *lo, const size_t n[3],
	const struct ct_upsample_rule *rule, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol part = {0}, out = {0};
	ptrdiff_t start[3];
	int rc = -1;

	choose(start, lo, n);
	if (ct_crop(&part, lo, n, start, 0, e) == 0)
		rc = ct_upsample(&out, &part, rule, did, env, e);
	ct_vol_free(&part);
	ct_vol_free(&out);
	return rc;
}

int ct_pilot_run(struct ct_pilot *p, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	bool part, const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule own = *rule;
	struct ct_upsample_report did;
	struct ct_env quiet = *env;
	const size_t fewest = rule->iterations < CT_PILOT_LEAST ? rule->iterations : CT_PILOT_LEAST;
	size_t n[3];
	bool whole;

	if (!ct_pilot_size(n, lo, rule))
		return 0;
	whole = memcmp(n, lo->n, sizeof n) == 0;
	if (whole && !part)
		return 0;
	if (ct_alloc(&p->multipliers.mu, rule->iterations + 1, sizeof *p->multipliers.mu, e))
		return -1;
	p->multipliers.room = rule->iterations + 1;
	own.multipliers = &p->multipliers;
	own.spread = rule->spread > 0 ? rule->spread : ct_upsample_spread(lo);
	own.start = NULL;
	own.mirrors = false;
	quiet.log = NULL; /* it is not what was asked for */
	if (refine(&did, lo, n, &own, &quiet, e))
		return -1;
	if (!whole && did.iterations < fewest) {
		own.tolerance = 0;
		own.iterations = fewest;
		p->multipliers.n = 0;
		if (refine(&did, lo, n, &own, &quiet, e))
			return -1;
	}
	p->multipliers.room = 0;
	p->iterations = rule->tolerance == 0 ? 0 : did.iterations;
	return 0;
}

void ct_pilot_free(struct ct_pilot *p)
{
	free(p->multipliers.mu);
	*p = (struct ct_pilot){0};
}
