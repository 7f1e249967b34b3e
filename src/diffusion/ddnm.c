/* ddnm.c: see ddnm.h. */
#include "config.h"
#include "diffusion/ddnm.h"
#include "core/mem.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* One channel is n = s h s w values, m = h w coefficients. */
struct work {
	size_t n, m, all; /* all = channels * n */
	float *x0, *eps, *z;
	double *data;         /* coefficients of A+ y, every channel */
	double *c0, *cz, *ce; /* coefficients of x0, z, eps, one channel */
	double *t;            /* scratch of the operator */
};

/* Where a move goes, and what does not depend on the component. */
struct move {
	double a, sig;      /* sqrt(abar_j), sqrt(1 - abar_j) */
	double fresh, kept; /* factors of z and eps outside the measured components */
	double eta, q, sy;
	enum ct_ddnm_rule rule; /* PLUS only if sy > 0 */
	double lam;             /* of the rules that have one for all components */
};

static void work_free(const struct work *w)
{
	free(w->x0);
	free(w->data);
}

static int work_alloc(struct work *w, const struct ct_ddnm *d, struct ct_err *e)
{
	const struct ct_measurement *op = d->op;
	size_t doubles;

	if (ct_size_mul(&w->m, op->h, op->w, "picture", e) ||
		ct_size_mul(&w->n, w->m, op->s * op->s, "picture", e) ||
		ct_size_mul(&w->all, w->n, d->channels, "picture", e) ||
		ct_alloc(&w->x0, w->all, 3 * sizeof *w->x0, e))
		return -1;
	w->eps = w->x0 + w->all;
	w->z = w->eps + w->all;
	doubles = (d->channels + 3) * w->m + ct_measurement_scratch(op);
	if (ct_alloc(&w->data, doubles, sizeof *w->data, e))
		return -1;
	w->c0 = w->data + d->channels * w->m;
	w->cz = w->c0 + w->m;
	w->ce = w->cz + w->m;
	w->t = w->ce + w->m;
	return 0;
}

static struct move move_to(const struct ct_ddnm *d, int j)
{
	double abar = ct_schedule_abar(d->schedule, j), q = sqrt(1.0 - d->eta * d->eta);
	struct move m = {.a = sqrt(abar),
		.sig = sqrt(1.0 - abar),
		.eta = d->eta,
		.q = q,
		.sy = 2.0 * d->sigma_y,
		.rule = d->rule,
		.lam = 1.0};
	double gam = 1.0;

	if (m.rule == CT_DDNM_PLUS && !(m.sy > 0))
		m.rule = CT_DDNM;
	if (m.rule == CT_DDNM_SIMPLE) {
		double sig = sqrt(1.0 - abar * abar), ay = abar * m.sy;

		m.lam = sig >= ay ? 1.0 : sig / ay;
		gam = sig >= ay ? sqrt(sig * sig - ay * ay) : 0.0;
	}
	m.fresh = gam * m.sig * d->eta;
	m.kept = gam * m.sig * q;
	return m;
}

/* What the measured component of singular value s > 0 adds to the unmeasured rule a x0 + fresh z
 * + kept eps: c0, cz, ce are the components of x0, z, eps, and cy that of A+ y. */
static double measured(const struct move *m, double s, double c0, double cy, double cz, double ce)
{
	double lam = m->lam, noise = m->a * m->sy / s, d;

	if (m->rule != CT_DDNM_PLUS)
		return -m->a * lam * (c0 - cy);
	if (m->sig < noise)
		lam = m->sig * m->q / noise;
	d = m->sig > noise ? sqrt(m->sig * m->sig - noise * noise) : m->sig * m->eta;
	return -m->a * lam * (c0 - cy) + (d - m->fresh) * cz - m->kept * ce;
}

/* One channel: x becomes the state at the end of the move. */
static void advance(
	const struct ct_measurement *op, const struct move *m, struct work *w, size_t c, float *x)
{
	const float *x0 = w->x0 + c * w->n, *eps = w->eps + c * w->n, *z = w->z + c * w->n;
	const double *cy = w->data + c * w->m;

	for (size_t i = 0; i < w->n; i++)
		x[i] = (float)(m->a * (double)x0[i] + m->fresh * (double)z[i] +
			       m->kept * (double)eps[i]);
	ct_measurement_analyse(op, w->c0, x0, w->t);
	if (m->rule == CT_DDNM_PLUS) {
		ct_measurement_analyse(op, w->cz, z, w->t);
		ct_measurement_analyse(op, w->ce, eps, w->t);
	}
	for (size_t i = 0; i < op->h; i++)
		for (size_t j = 0; j < op->w; j++) {
			size_t k = i * op->w + j;
			double s = ct_measurement_singular(op, i, j);
			bool plus = m->rule == CT_DDNM_PLUS;

			w->c0[k] = s > 0 ? measured(m, s, w->c0[k], cy[k], plus ? w->cz[k] : 0,
						   plus ? w->ce[k] : 0)
					 : 0;
		}
	ct_measurement_synth_add(op, x, w->c0, w->t);
}

/* x0 from the network's eps. */
static int estimate(
	const struct ct_ddnm *d, struct work *w, int t, const float *x, struct ct_err *e)
{
	double abar = ct_schedule_abar(d->schedule, t), a = 1.0 / sqrt(abar), b = sqrt(1.0 - abar);

	if (d->eps(d->eps_ctx, (double)t, x, w->eps, e))
		return -1;
	for (size_t i = 0; i < w->all; i++) {
		w->x0[i] = (float)(((double)x[i] - b * (double)w->eps[i]) * a);
		if (!isfinite(w->x0[i]))
			return ct_fail(e, CT_ENUMERIC,
				"timestep %d: the network's output is not finite", t);
	}
	return 0;
}

/* x = sqrt(abar) clean + sqrt(1 - abar) z; clean may be NULL. */
static void noised(
	const struct ct_ddnm *d, const struct work *w, int t, float *x, const float *clean)
{
	double a = sqrt(ct_schedule_abar(d->schedule, t)),
	       b = sqrt(1.0 - ct_schedule_abar(d->schedule, t));

	for (size_t i = 0; i < w->all; i++)
		x[i] = clean ? (float)(a * (double)clean[i] + b * (double)w->z[i]) : w->z[i];
}

int ct_ddnm(const struct ct_ddnm *d, float *x, const float *y, const float *init, struct ct_err *e)
{
	struct work w = {0};
	int rc = -1;

	if (work_alloc(&w, d, e))
		goto out;
	for (size_t c = 0; c < d->channels; c++)
		ct_measurement_data(d->op, w.data + c * w.m, y + c * w.m, w.t);
	d->normals(d->normals_ctx, 0, w.all, w.z);
	noised(d, &w, d->t[0], x, init);
	for (size_t k = 0; k + 1 < d->nt; k++) {
		if (d->t[k + 1] > d->t[k]) { /* back in time: the last estimate, noised again */
			d->normals(d->normals_ctx, k + 1, w.all, w.z);
			noised(d, &w, d->t[k + 1], x, w.x0);
			continue;
		}
		struct move m = move_to(d, d->t[k + 1]);

		if (estimate(d, &w, d->t[k], x, e))
			goto out;
		d->normals(d->normals_ctx, k + 1, w.all, w.z);
		for (size_t c = 0; c < d->channels; c++)
			advance(d->op, &m, &w, c, x + c * w.n);
	}
	rc = 0;
out:
	work_free(&w);
	return rc;
}
