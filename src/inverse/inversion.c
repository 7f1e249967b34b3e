/* inversion.c: see inversion.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/inversion.h"

#include <math.h>

/* Of the time of both, about. */
#define FIRST 0.6

struct ct_upsample_rule ct_inversion_second(const struct ct_inversion *v)
{
	struct ct_upsample_rule rule = v->first;

	rule.method = CT_UPSAMPLE_HTV;
	rule.mirrors = false;
	return rule;
}

int ct_inversion_bytes(double *bytes, enum ct_upsample method, const struct ct_inversion *v,
	const size_t n[static 3], struct ct_err *e)
{
	const struct ct_upsample_rule second = ct_inversion_second(v);
	double more;

	if (ct_upsample_bytes(bytes, method, &v->first, n, e))
		return -1;
	if (!(v->second > 0))
		return 0;
	if (ct_upsample_bytes(&more, second.method, &second, n, e))
		return -1;
	*bytes = fmax(*bytes, more + sizeof(float) * (double)n[0] * (double)n[1] * (double)n[2]);
	return 0;
}

int ct_inversion_pilot(struct ct_inversion_pilots *p, const struct ct_vol *lo,
	const struct ct_inversion *v, bool part, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule second = ct_inversion_second(v);

	if (ct_pilot_run(&p->first, lo, &v->first, part, env, e))
		return -1;
	return v->second > 0 ? ct_pilot_run(&p->second, lo, &second, part, env, e) : 0;
}

void ct_inversion_pilot_free(struct ct_inversion_pilots *p)
{
	ct_pilot_free(&p->first);
	ct_pilot_free(&p->second);
}

static int invert(struct ct_vol *hi, const struct ct_vol *lo, struct ct_upsample_rule rule,
	struct ct_pilot *pilot, struct ct_upsample_report *report, const struct ct_env *env,
	struct ct_err *e)
{
	if (pilot)
		rule.multipliers = &pilot->multipliers;
	if (pilot && pilot->iterations) {
		rule.iterations = pilot->iterations;
		rule.tolerance = 0;
	}
	return ct_upsample(hi, lo, &rule, report, env, e);
}

int ct_inversion_run(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_inversion *v,
	struct ct_inversion_pilots *pilots, struct ct_upsample_report *report,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env_part part = {.env = env, .to = v->second > 0 ? FIRST : 1};
	struct ct_upsample_report did;
	struct ct_vol other = {0};
	struct ct_env own;
	int rc = -1;

	ct_env_part(&own, &part);
	if (invert(hi, lo, v->first, pilots ? &pilots->first : NULL, report, &own, e))
		return -1;
	if (!(v->second > 0))
		return 0;
	part = (struct ct_env_part){.env = env, .from = FIRST, .to = 1};
	if (invert(&other, lo, ct_inversion_second(v), pilots ? &pilots->second : NULL, &did, &own,
		    e))
		goto out;
	for (size_t i = 0; i < ct_vol_count(hi); i++)
		hi->data[i] += (float)v->second * (other.data[i] - hi->data[i]);
	report->iterations += did.iterations;
	rc = ct_upsample_settle(hi, lo, &v->first.by, (double)INFINITY, &report->residual, env, e);
out:
	ct_vol_free(&other);
	return rc;
}
