/* splat_back.c: gradients of the projections of Gaussians; see splat.h. */
#include "config.h"
#include "core/mem.h"
#include "gs/splat.h"

#include <math.h>
#include <stdlib.h>

static double dot(const double a[static 3], const double b[static 3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

int ct_gs_grad_reserve(struct ct_gs_grad *g, size_t n, struct ct_err *e)
{
	size_t cap = g->cap;

	for (size_t k = 0; k < CT_GS_FIELDS; k++) {
		cap = g->cap;
		if (ct_grow(&g->d[k], &cap, n, sizeof(float), e))
			return -1;
	}
	cap = g->cap;
	if (ct_grow(&g->screen, &cap, n, sizeof(float), e))
		return -1;
	g->cap = cap;
	return 0;
}

void ct_gs_grad_free(struct ct_gs_grad *g)
{
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		free(g->d[k]);
	free(g->screen);
	*g = (struct ct_gs_grad){0};
}

void ct_foot_sums(double s[static 6], const double *g, const struct ct_camera *c,
	const struct ct_foot *f, double cut)
{
	double slope = f->cov[1] / f->cov[2];

	for (int i = 0; i < 6; i++)
		s[i] = 0;
	for (size_t r = 0; r < c->h; r++)
		for (size_t k = 0; k < c->w; k++) {
			double y = (double)r - f->m[1], x = (double)k - f->m[0] - slope * y;
			double q = x * x / f->cond / 2 + y * y / f->cov[2] / 2;
			double v = q <= cut ? g[r * c->w + k] * exp(-q) : 0;

			s[0] += v;
			s[1] += v * x;
			s[2] += v * y;
			s[3] += v * x * x;
			s[4] += v * x * y;
			s[5] += v * y * y;
		}
}

/* Position of a Gaussian in cone beam through J and through the ray: dl_dmu, and
 * h = dL/dS2 (columns-columns, columns-rows, rows-rows). */
static void cone_back(double p[static 3], const struct ct_foot *f, const struct ct_camera *c,
	const struct ct_blob *b, const double h[3], double dl_dmu)
{
	double js[2][3], gd[3], along, mu3 = f->mu * f->mu * f->mu;

	for (int r = 0; r < 2; r++) { /* J Sigma */
		double t[3];

		for (int k = 0; k < 3; k++)
			t[k] = b->s[k] * b->s[k] *
			       (f->j[r][0] * b->a[0][k] + f->j[r][1] * b->a[1][k] +
				       f->j[r][2] * b->a[2][k]);
		for (int a = 0; a < 3; a++)
			js[r][a] = dot(b->a[a], t);
	}
	for (int r = 0; r < 2; r++) {
		double gj[3], gn, gjj;

		for (int a = 0; a < 3; a++)
			gj[a] = 2 * (r ? h[1] * js[0][a] + h[2] * js[1][a]
				       : h[0] * js[0][a] + h[1] * js[1][a]);
		gn = dot(gj, c->n) / f->z;
		gjj = dot(gj, f->j[r]) / f->z;
		for (int a = 0; a < 3; a++)
			p[a] -= gn * f->j[r][a] + gjj * c->n[a];
	}
	for (int a = 0; a < 3; a++)
		gd[a] = -dl_dmu * mu3 / (2 * M_PI) * f->v[a];
	along = dot(gd, f->delta);
	for (int a = 0; a < 3; a++)
		p[a] += (gd[a] - f->delta[a] * along) / f->dist;
}

/* With K^-1 the covariance, L D L^T = K its form in the coordinates (x, y) of dab.h, D the inverse
 * variances (cond, row-row), L^T = [1 -slope; 0 1], moments Q of g e:
 *   dL/dm = rho mu L D (sx, sy),   dL/dS2 = 1/2 rho mu L D Q D L^T,
 *   dL/dSigma = J^T dL/dS2 J + dL/dmu mu^3 / (4 pi) v v^T,   v = Sigma^-1 delta. */
void ct_foot_back(struct ct_foot_grad *g, const struct ct_foot *f, const struct ct_camera *c,
	const struct ct_blob *b, const double sums[static 6])
{
	double slope = f->cov[1] / f->cov[2], dx = 1 / f->cond, dy = 1 / f->cov[2];
	double amp = b->rho * f->mu, dl_dmu = b->rho * sums[0];
	double t00 = amp / 2 * dx * dx * sums[3], t01 = amp / 2 * dx * dy * sums[4];
	double t11 = amp / 2 * dy * dy * sums[5];
	const double h[3] = {t00, t01 - slope * t00, t11 - 2 * slope * t01 + slope * slope * t00};
	double w = dl_dmu * f->mu * f->mu * f->mu / (4 * M_PI);
	size_t at = 0;

	g->rho = f->mu * sums[0];
	g->m[0] = amp * dx * sums[1];
	g->m[1] = amp * (dy * sums[2] - slope * dx * sums[1]);
	for (int r = 0; r < 3; r++) {
		g->p[r] = f->j[0][r] * g->m[0] + f->j[1][r] * g->m[1];
		for (int k = r; k < 3; k++)
			g->sigma[at++] = f->j[0][r] * (h[0] * f->j[0][k] + h[1] * f->j[1][k]) +
					 f->j[1][r] * (h[1] * f->j[0][k] + h[2] * f->j[1][k]) +
					 w * f->v[r] * f->v[k];
	}
	if (c->cone)
		cone_back(g->p, f, c, b, h, dl_dmu);
}

struct job {
	struct ct_gs_grad *grad;
	const struct ct_splat *s;
	const struct ct_blob *b;
	const struct ct_gauss *set;
	const float *dimg;
};

static void one(const struct job *j, size_t i)
{
	const struct ct_splat *s = j->s;
	const struct ct_camera *c = &s->cam;
	double q[4], sums[6], dl[3] = {0}, dq[4] = {0};
	struct ct_foot_grad g = {0};
	struct ct_foot f;
	bool seen = s->row[0][i] < s->row[1][i] && ct_foot_of(&f, c, &j->b[i]);

	if (seen) {
		for (int k = 0; k < 4; k++)
			q[k] = (double)j->set->rot[k][i];
		ct_dab_sums(sums, j->dimg, ct_dab_pitch(c->w), c->w, (size_t)s->row[0][i],
			(size_t)s->row[1][i], &s->dab[i]);
		ct_foot_back(&g, &f, c, &j->b[i], sums);
		ct_blob_back(dl, dq, g.sigma, &j->b[i], q);
	}
	for (int k = 0; k < 3; k++) {
		j->grad->d[CT_GS_POS + k][i] = (float)g.p[k];
		j->grad->d[CT_GS_SCALE + k][i] = (float)dl[k];
	}
	for (int k = 0; k < 4; k++)
		j->grad->d[CT_GS_ROT + k][i] = (float)dq[k];
	j->grad->d[CT_GS_RAW][i] = (float)g.rho;
	j->grad->screen[i] =
		seen ? (float)hypot(g.m[0] * (double)c->w / 2, g.m[1] * (double)c->h / 2) : -1.0f;
}

static void some(void *arg, size_t chunk, size_t worker)
{
	const struct job *j = arg;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;

	(void)worker;
	for (size_t i = first; i < end && i < j->s->n; i++)
		one(j, i);
}

void ct_splat_back(struct ct_gs_grad *grad, const struct ct_splat *s, const struct ct_blob *b,
	const struct ct_gauss *set, const float *dimg, struct ct_par *par)
{
	struct job j = {grad, s, b, set, dimg};

	ct_par_for(par, (s->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, some, &j);
}
