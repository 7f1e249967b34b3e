/* ddnm.c: the moves of DDNM and DDNM+ (sampler.h).
 *
 * From timestep t to j < t, with a, sig, x0, z, eps of sampler.h:
 *   x0h = x0 - V^T Lambda_t V (x0 - A+ y),   Lambda_t = diag(lambda_t)
 *   x   = a x0h + noise
 * The DDNM paper calls it Lambda_t, the CT super-resolution paper Sigma_t. With Lambda_t = I it is
 * the range-null step. q = sqrt(1 - eta^2); eta = 0 is the deterministic DDIM. It is not the eta of
 * DDIM.
 *
 * DDNM    Lambda_t = I, noise = sig (eta z + q eps). The last x agrees with y exactly.
 * PLUS    DDNM+: y has noise of standard deviation sy = 2 sigma_y. For a component of singular
 *         value s:
 *           lambda_t = 1 if sig >= a sy / s, else sig q s / (a sy)
 *           noise = phi_t z, phi_t = sqrt(sig^2 - (a sy / s)^2) if sig > a sy / s, else sig eta
 *         Where nothing is measured, noise = sig (eta z + q eps). So the last step, sig = 0,
 *         leaves the network's own estimate. sy = 0 is DDNM.
 * SIMPLE  with sig' = sqrt(1 - abar_j^2), the same for all components:
 *           lambda_t = min(1, sig' / (abar_j sy))
 *           noise = gamma_t sig (eta z + q eps), gamma_t = sqrt(max(0, sig'^2 - (abar_j sy)^2))
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "diffusion/draw.h"

#include <math.h>
#include <stdbool.h>

/* Where a move goes, and what does not depend on the component. */
struct move {
	double a, sig;      /* sqrt(abar_j), sqrt(1 - abar_j) */
	double fresh, kept; /* factors of z and eps outside the measured components */
	double eta, q, sy;
	enum ct_sampler_rule rule; /* PLUS only if sy > 0 */
	double lambda_t;           /* Lambda_t of the rules that have one for all components */
};

static struct move move_to(const struct ct_sampler *s, int j)
{
	double abar = ct_schedule_abar(s->schedule, j), q = sqrt(1.0 - s->how.eta * s->how.eta);
	struct move m = {.a = sqrt(abar),
		.sig = sqrt(1.0 - abar),
		.eta = s->how.eta,
		.q = q,
		.sy = 2.0 * s->how.sigma_y,
		.rule = s->how.rule,
		.lambda_t = 1.0};
	double gamma_t = 1.0;

	if (m.rule == CT_SAMPLER_PLUS && !(m.sy > 0))
		m.rule = CT_SAMPLER_DDNM;
	if (m.rule == CT_SAMPLER_SIMPLE) {
		double sig = sqrt(1.0 - abar * abar), ay = abar * m.sy;

		m.lambda_t = sig >= ay ? 1.0 : sig / ay;
		gamma_t = sig >= ay ? sqrt(sig * sig - ay * ay) : 0.0;
	}
	m.fresh = gamma_t * m.sig * s->how.eta;
	m.kept = gamma_t * m.sig * q;
	return m;
}

/* What the measured component of singular value s > 0 adds to the unmeasured rule a x0 + fresh z
 * + kept eps: c0, cz, ce are the components of x0, z, eps, and cy that of A+ y. */
static double measured(const struct move *m, double s, double c0, double cy, double cz, double ce)
{
	double lambda_t = m->lambda_t; /* on the diagonal of Lambda_t, the paper's Sigma_t */
	double noise = m->a * m->sy / s, phi_t; /* phi_t: of fresh noise, Phi_t = diag(phi_t^2) */

	if (m->rule != CT_SAMPLER_PLUS)
		return -m->a * lambda_t * (c0 - cy);
	if (m->sig < noise)
		lambda_t = m->sig * m->q / noise;
	phi_t = m->sig > noise ? sqrt(m->sig * m->sig - noise * noise) : m->sig * m->eta;
	return -m->a * lambda_t * (c0 - cy) + (phi_t - m->fresh) * cz - m->kept * ce;
}

/* One channel: x becomes the state at the end of the move. */
static void advance(const struct ct_draw *w, const struct move *m, size_t c, float *x)
{
	const struct ct_measurement *op = w->s->op;
	const float *x0 = w->x0 + c * w->n, *eps = w->eps + c * w->n, *z = w->z + c * w->n;
	const double *cy = w->data + c * w->m;
	const bool plus = m->rule == CT_SAMPLER_PLUS;

	for (size_t i = 0; i < w->n; i++)
		x[i] = (float)(m->a * (double)x0[i] + m->fresh * (double)z[i] +
			       m->kept * (double)eps[i]);
	ct_measurement_analyse(op, w->c0, x0, w->t);
	if (plus) {
		ct_measurement_analyse(op, w->cz, z, w->t);
		ct_measurement_analyse(op, w->ce, eps, w->t);
	}
	for (size_t k = 0; k < w->m; k++) {
		double s = ct_measurement_singular(op, k);

		w->c0[k] = s > 0 ? measured(m, s, w->c0[k], cy[k], plus ? w->cz[k] : 0,
					   plus ? w->ce[k] : 0)
				 : 0;
	}
	ct_measurement_synth_add(op, x, w->c0, w->t);
}

void ct_draw_ddnm(const struct ct_draw *w, size_t k, float *x)
{
	const struct move m = move_to(w->s, w->s->t[k + 1]);

	for (size_t c = 0; c < w->s->channels; c++)
		advance(w, &m, c, x + c * w->n);
}
