/* confidence.c: the confidence weights of the predicted detail; see restore.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/upsample.h"
#include "restore/restore.h"

#include <math.h>

/* HU, of thick slices, of what is refined twice along several axes, and of others: doc/trials.md,
 * "Where the network looks". */
#define LEAST_THICK 3
#define LEAST_TWICE 14
#define LEAST 10

struct trust {
	double doubt, gate, second_gate;
};

/* Of a scan with noise; `most`: the largest factor, `coarse` axes are refined. */
static struct trust trust_noisy(bool points, double most, int coarse)
{
	return (struct trust){points || coarse == 1 || most < 4 ? 0 : 0.5, 0, 10};
}

/* Of one without. */
static struct trust trust_plain(enum ct_decimate by, bool aliases, int coarse)
{
	if (coarse == 1)
		return (struct trust){0.6, aliases ? 0 : 4, 10};
	if (by == CT_DECIMATE_POINT)
		return (struct trust){aliases ? 0 : 1.2, 4, 4};
	return aliases ? (struct trust){0.6, 0, 10} : (struct trust){1.2, 15, 10};
}

/* The operator on the grid of the networks: the same blur, in LR voxels. */
static struct ct_degrade as_seen(const struct ct_degrade *d, double cell)
{
	struct ct_degrade seen = *d;

	for (int a = 0; a < 3; a++)
		if (d->factor[a] > 1) {
			seen.factor[a] = cell;
			seen.sigma[a] *= cell / d->factor[a];
		}
	return seen;
}

/* The numbers are measured: doc/trials.md, "How far a correction is trusted". */
int ct_restore_confidence(struct ct_restore_rule *rule, bool *little, size_t cell,
	const size_t n[static 3], struct ct_err *e)
{
	const struct ct_degrade seen = as_seen(&rule->by, (double)cell), *d = &seen;
	struct trust trust;
	double aliasing, most = 1;
	bool aliases, points;
	size_t fine[3];
	int coarse = 0;

	for (int a = 0; a < 3; a++) {
		fine[a] = ct_degrade_cover(n[a], d->factor[a]);
		most = fmax(most, d->factor[a]);
		coarse += d->factor[a] > 1;
	}
	if (ct_upsample_aliasing(&aliasing, d, fine, e))
		return -1;
	aliases = aliasing > CT_UPSAMPLE_ALIAS;
	points = aliases && d->decimate == CT_DECIMATE_POINT;
	rule->weight = 1;
	trust = rule->noise > 0 ? trust_noisy(points, most, coarse)
				: trust_plain(d->decimate, aliases, coarse);
	rule->doubt = trust.doubt;
	rule->gate = trust.gate;
	rule->second_gate = trust.second_gate;
	rule->steps = aliases ? 0 : 0.05;
	/* the network for 4x errs more often where it expects much */
	rule->cap = aliases ? 0 : (cell == 4 && coarse > 1 && !(rule->noise > 0) ? 90 : 125) * most;
	rule->second_cap = aliases ? 0 : 20 * most; /* more spoils plastic, where nothing aliases */
	rule->least = coarse == 1 ? LEAST_THICK : cell == 2 ? LEAST_TWICE : LEAST;
	rule->flat = points && !(rule->noise > 0);
	rule->passes = 2;
	/* thick slices that are well sampled */
	*little = coarse == 1 && !aliases && d->decimate == CT_DECIMATE_SINC;
	return 0;
}
