/* ddim.c: the moves of the samplers whose step is a sum of what it knows: DDIM, DDPM,
 * DPM-Solver++(2M), GDP and the chain of BIRD (sampler.h).
 *
 * With a, sig of the timestep that a move goes to, a', sig' of that it leaves:
 *   DDIM   a x0 + sqrt(sig^2 - d^2) (x - a' x0) / sig' + d z,
 *          d = eta (sig / sig') sqrt(1 - a'^2 / a^2)
 *   GDP    the mean of DDIM with eta 1, and sqrt(1 - a'^2 / a^2) z, unless it is the last move
 *   DPM    (sig / sig') x + a (1 - exp(-h)) ((1 + 1/(2 r)) x0 - 1/(2 r) before),
 *          h the growth of log(a / sig) and r h that of the move before; x0 alone in the brackets
 *          where nothing is known from before, and in the last move, whose h is infinite
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "diffusion/draw.h"

#include <math.h>

/* Growth of log(a / sig) in move k. */
static double growth(const struct ct_sampler *s, size_t k)
{
	double from = ct_schedule_abar(s->schedule, s->t[k]),
	       to = ct_schedule_abar(s->schedule, s->t[k + 1]);

	return 0.5 * log(to / (1.0 - to) * (1.0 - from) / from);
}

static struct ct_ddim multistep(const struct ct_sampler *s, size_t k, bool known)
{
	double from = ct_schedule_abar(s->schedule, s->t[k]),
	       to = ct_schedule_abar(s->schedule, s->t[k + 1]), h, more, take;

	if (to == 1.0)
		return (struct ct_ddim){.x0 = 1};
	h = growth(s, k);
	take = -sqrt(to) * expm1(-h);
	more = known ? 0.5 * h / growth(s, k - 1) : 0.0;
	return (struct ct_ddim){.x = sqrt((1.0 - to) / (1.0 - from)),
		.x0 = take * (1.0 + more),
		.before = -take * more};
}

static struct ct_ddim single(const struct ct_sampler *s, size_t k, double eta)
{
	double from = ct_schedule_abar(s->schedule, s->t[k]),
	       to = ct_schedule_abar(s->schedule, s->t[k + 1]), left = 1.0 - to,
	       fresh = eta * eta * left / (1.0 - from) * (1.0 - from / to),
	       x = sqrt((left - fresh) / (1.0 - from));

	return (struct ct_ddim){.x = x, .x0 = sqrt(to) - sqrt(from) * x, .z = sqrt(fresh)};
}

struct ct_ddim ct_ddim_weights(const struct ct_sampler *s, size_t k, bool known)
{
	const enum ct_sampler_rule rule = s->how.rule;
	struct ct_ddim m;

	if (rule == CT_SAMPLER_DPM)
		return multistep(s, k, known);
	if (rule == CT_SAMPLER_DDIM)
		return single(s, k, s->how.eta);
	m = single(s, k, rule == CT_SAMPLER_BIRD ? 0 : 1);
	if (rule == CT_SAMPLER_GDP && m.z > 0)
		m.z = sqrt(1.0 - ct_schedule_abar(s->schedule, s->t[k]) /
					 ct_schedule_abar(s->schedule, s->t[k + 1]));
	return m;
}

void ct_draw_ddim(struct ct_draw *w, size_t k, float *x)
{
	const struct ct_sampler *s = w->s;
	const struct ct_ddim m = ct_ddim_weights(s, k, w->known);
	const bool bird = s->how.rule == CT_SAMPLER_BIRD, guided = s->how.rule == CT_SAMPLER_GDP;

	for (size_t i = 0; !bird && i < w->all; i++)
		w->x0[i] = fminf(fmaxf(w->x0[i], -1.0f), 1.0f);
	if (!guided && !bird)
		ct_draw_pull(w, 1.0, w->x0, w->x0);
	for (size_t i = 0; i < w->all; i++) {
		double before = m.before != 0.0 ? m.before * (double)w->before[i] : 0.0;

		x[i] = (float)(m.x * (double)x[i] + m.x0 * (double)w->x0[i] + before +
			       m.z * (double)w->z[i]);
	}
	if (guided)
		ct_draw_pull(w, s->how.guidance / (2.0 * (double)w->all), x, w->x0);
}
