/* multipliers.c: see multipliers.h. */
#include "config.h"
#include "resolution/multipliers.h"
#include "core/mem.h"
#include "resolution/crop.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 3 };
#define TISSUE -500.0F /* HU, and above */

/* A box of n coarse voxels: where it begins, at places 0 .. 2 of the axes. */
static void place(ptrdiff_t start[3], const size_t n[3], const size_t of[3], const int at[3])
{
	for (int a = 0; a < 3; a++)
		start[a] = (ptrdiff_t)((of[a] - n[a]) * (size_t)at[a] / (PLACES - 1));
}

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

/* Where the sample begins. */
static void choose(ptrdiff_t start[3], const struct ct_vol *lo, const size_t n[3])
{
	const int middle[3] = {1, 1, 1};
	size_t most;

	place(start, n, lo->n, middle);
	most = tissue(lo, n, start);
	for (int p = 0; p < PLACES * PLACES * PLACES; p++) {
		const int at[3] = {p % PLACES, p / PLACES % PLACES, p / (PLACES * PLACES)};
		ptrdiff_t here[3];
		size_t count;

		place(here, n, lo->n, at);
		count = tissue(lo, n, here);
		if (count > most) {
			most = count;
			memcpy(start, here, sizeof here);
		}
	}
}

bool ct_multipliers_sample(
	size_t n[static 3], const struct ct_vol *lo, const struct ct_upsample_rule *rule)
{
	for (int a = 0; a < 3; a++) {
		n[a] = (size_t)ceil(CT_MULTIPLIERS_FINE / rule->by.factor[a]);
		n[a] = n[a] < lo->n[a] ? n[a] : lo->n[a];
	}
	return rule->known && rule->noise > 0 &&
	       (rule->method == CT_UPSAMPLE_AUTO || rule->method >= CT_UPSAMPLE_TV);
}

int ct_multipliers_find(struct ct_multipliers *m, const struct ct_vol *lo,
	const struct ct_upsample_rule *rule, bool part, const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule own = *rule;
	struct ct_upsample_report did;
	struct ct_env quiet = *env;
	struct ct_vol sample = {0}, out = {0};
	ptrdiff_t start[3];
	size_t n[3];
	int rc = -1;

	if (!ct_multipliers_sample(n, lo, rule) || (!part && memcmp(n, lo->n, sizeof n) == 0))
		return 0;
	quiet.progress = NULL;
	own.start = NULL;
	own.multipliers = m;
	own.spread = rule->spread > 0 ? rule->spread : ct_upsample_spread(lo);
	choose(start, lo, n);
	if (ct_alloc(&m->mu, rule->iterations + 1, sizeof *m->mu, e) || ct_vol_alloc(&sample, n, e))
		goto out;
	m->room = rule->iterations + 1;
	memcpy(sample.affine, lo->affine, sizeof sample.affine);
	ct_crop(sample.data, n, lo->data, lo->n, start, 0);
	rc = ct_upsample(&out, &sample, &own, &did, &quiet, e);
	m->room = 0;
out:
	ct_vol_free(&sample);
	ct_vol_free(&out);
	return rc;
}

void ct_multipliers_free(struct ct_multipliers *m)
{
	free(m->mu);
	*m = (struct ct_multipliers){0};
}
