/* caution.c: how much of what the prior expects is taken; see restore.h. */
#include "config.h"
#include "resolution/upsample.h"
#include "restore/restore.h"

#include <math.h>

/* How much of flat.h is taken after the prior. Of twelve scans the error deep in soft tissue falls
 * by .5 to 16 % at a third and up to twice as much at 1, where up to .06 dB and some small
 * structures are lost. */
#define FLAT (1 / 3.0)

int ct_restore_careful(
	struct ct_restore_rule *rule, bool *little, const size_t n[static 3], struct ct_err *e)
{
	const struct ct_degrade *d = &rule->by;
	double aliasing = 0, most = 1;
	bool aliases, points;
	int coarse = 0;

	for (int a = 0; a < 3; a++) {
		double share = 0;

		if (d->factor[a] > 1 &&
			ct_upsample_aliasing(&share, d, ct_degrade_cover(n[a], d->factor[a]), a, e))
			return -1;
		aliasing = fmax(aliasing, share);
		most = fmax(most, d->factor[a]);
		coarse += d->factor[a] > 1;
	}
	aliases = aliasing > CT_UPSAMPLE_ALIAS;
	points = aliases && d->decimate == CT_DECIMATE_POINT;
	rule->weight = 1;
	rule->doubt = points || rule->noise > 0 ? 0 : 1.2;
	rule->gate = aliases || rule->noise > 0 ? 0 : 15;
	rule->steps = aliases ? 0 : 0.05;
	rule->cap = aliases ? 0 : 62.5 * most;
	rule->flat = points && !(rule->noise > 0) ? FLAT : 0;
	rule->passes = rule->noise > 0 && !points ? 1 : 2; /* the most that gain */
	*little = coarse == 1 && !aliases;                 /* thick slices that are well sampled */
	return 0;
}
