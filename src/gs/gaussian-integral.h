/* gaussian-integral.h: the line integral of one Gaussian, and its gradient. The integral of a 3-D
 * Gaussian along the rays of a view is a 2-D Gaussian, its footprint (splat.h). For any kind of
 * number, after gaussian-formulas.h, whose macros it uses, and
 *
 *   GAUSSIAN, GRADIENT   structs with the fields of ct_gaussian and ct_gaussian_gradient
 *   FOOTPRINT            a struct as vec_footprint of gaussian-kernels.c
 * SPDX-License-Identifier: Apache-2.0
 */
/* Ray and Jacobian at the centre; what stands for "in front of the source". */
IMPL MASK FN(look)(FOOTPRINT *f, const struct ct_camera *c, const GAUSSIAN *b)
{
	NUM d[3];

	for (int a = 0; a < 3; a++)
		d[a] = b->p[a] - c->origin[a];
	f->z = f->dist = d[0] * 0 + 1;
	if (c->cone) {
		f->z = FN(along)(c->n, d);
		f->dist = SQRT(FN(dot)(d, d));
	}
	for (int r = 0; r < 2; r++) {
		const NUM q = FN(along)(c->map[r], d) / f->z;

		f->m[r] = c->c[r] + q;
		for (int a = 0; a < 3; a++)
			f->j[r][a] = c->cone ? (c->map[r][a] - q * c->n[a]) / f->z
					     : q * 0 + c->map[r][a];
	}
	for (int a = 0; a < 3; a++)
		f->delta[a] = c->cone ? d[a] / f->dist : d[a] * 0 + c->n[a];
	return f->z > (c->cone ? c->near : 0);
}

/* Minors of the rows of J A diag(s): their cross product. */
IMPL void FN(minors)(NUM area[static 3], const FOOTPRINT *f)
{
	for (int k = 0; k < 3; k++) {
		const int i = (k + 1) % 3, l = (k + 2) % 3;

		area[k] = f->row[0][i] * f->row[1][l] - f->row[0][l] * f->row[1][i];
	}
}

IMPL MASK FN(footprint_of)(FOOTPRINT *f, const struct ct_camera *c, const GAUSSIAN *b)
{
	MASK ok = FN(look)(f, c, b);
	NUM along, area[3], det, most;

	along = f->z * 0;
	for (int k = 0; k < 3; k++) { /* J A diag(s), and diag(1/s) A^T delta */
		const NUM axis[3] = {b->a[0][k], b->a[1][k], b->a[2][k]};

		f->t[k] = FN(dot)(axis, f->delta) / b->s[k];
		f->row[0][k] = FN(dot)(f->j[0], axis) * b->s[k];
		f->row[1][k] = FN(dot)(f->j[1], axis) * b->s[k];
		along += f->t[k] * f->t[k];
	}
	f->mu = SQRT(2 * M_PI / along);
	f->cov[0] = FN(dot)(f->row[0], f->row[0]);
	f->cov[1] = FN(dot)(f->row[0], f->row[1]);
	f->cov[2] = FN(dot)(f->row[1], f->row[1]);
	FN(minors)(area, f);
	det = FN(dot)(area, area); /* without cancellation */
	f->cond = det / f->cov[2];
	f->slope = f->cov[1] / f->cov[2];
	most = det + f->mu + f->cov[0];
	return ok & (det > 0) & (f->cond > 0) & (most - most >= 0); /* NaN - NaN is not */
}

/* Position of a Gaussian in cone beam through J and through the ray. g[r] = dL/dJ_r. */
IMPL void FN(cone_backward)(NUM p[static 3], const FOOTPRINT *f, const struct ct_camera *c,
	const GAUSSIAN *b, NUM g[static 2][3], const NUM dl_dmu)
{
	const NUM pull = -dl_dmu * f->mu * f->mu * f->mu / (2 * M_PI);
	NUM gd[3], straight, ts[3];

	for (int r = 0; r < 2; r++) {
		const NUM gn = FN(along)(c->n, g[r]) / f->z, gj = FN(dot)(g[r], f->j[r]) / f->z;

		for (int a = 0; a < 3; a++)
			p[a] -= gn * f->j[r][a] + gj * c->n[a];
	}
	for (int k = 0; k < 3; k++)
		ts[k] = f->t[k] / b->s[k];
	for (int a = 0; a < 3; a++) /* Sigma^-1 delta = A diag(1/s) t */
		gd[a] = pull * FN(dot)(b->a[a], ts);
	straight = FN(dot)(gd, f->delta);
	for (int a = 0; a < 3; a++)
		p[a] += (gd[a] - f->delta[a] * straight) / f->dist;
}

/* The inverse covariance is K = L D L^T in the coordinates (x, y) of rasterise.h, D the inverse
 * variances (cond, row-row), L^T = [1 -slope; 0 1], Q the moments of g e. With R = L^T J A diag(s),
 * its first row by minors, row1 x (row0 x row1) / |row1|^2, so that no large terms cancel however
 * long and thin the Gaussian is:
 *   dL/dm = rho mu L D (sx, sy),   T = 1/2 rho mu D Q D,   dL/dJ = 2 L T R diag(s) A^T,
 *   N = R^T T R + dL/dmu mu^3/(4 pi) t t^T. */
IMPL void FN(footprint_backward)(GRADIENT *g, const FOOTPRINT *f, const struct ct_camera *c,
	const GAUSSIAN *b, const NUM sums[static 6])
{
	const NUM dx = 1 / f->cond, dy = 1 / f->cov[2];
	const NUM amp = b->rho * f->mu, dl_dmu = b->rho * sums[0];
	const NUM t00 = amp / 2 * dx * dx * sums[3], t01 = amp / 2 * dx * dy * sums[4];
	const NUM t11 = amp / 2 * dy * dy * sums[5];
	const NUM w = dl_dmu * f->mu * f->mu * f->mu / (4 * M_PI);
	NUM tr[2][3], rs[3], gj[2][3], area[3];
	int at = 0;

	FN(minors)(area, f);
	g->rho = f->mu * sums[0];
	g->m[0] = amp * dx * sums[1];
	g->m[1] = amp * (dy * sums[2] - f->slope * dx * sums[1]);
	for (int k = 0; k < 3; k++) {
		const int i = (k + 1) % 3, l = (k + 2) % 3;

		rs[k] = (f->row[1][i] * area[l] - f->row[1][l] * area[i]) * dy;
		tr[0][k] = t00 * rs[k] + t01 * f->row[1][k];
		tr[1][k] = t01 * rs[k] + t11 * f->row[1][k];
		g->p[k] = f->j[0][k] * g->m[0] + f->j[1][k] * g->m[1];
	}
	for (int k = 0; k < 3; k++)
		for (int l = k; l < 3; l++)
			g->shape[at++] =
				rs[k] * tr[0][l] + f->row[1][k] * tr[1][l] + w * f->t[k] * f->t[l];
	if (!c->cone)
		return;
	for (int k = 0; k < 3; k++) {
		tr[1][k] = 2 * b->s[k] * (tr[1][k] - f->slope * tr[0][k]);
		tr[0][k] = 2 * b->s[k] * tr[0][k];
	}
	for (int a = 0; a < 3; a++) {
		gj[0][a] = FN(dot)(b->a[a], tr[0]);
		gj[1][a] = FN(dot)(b->a[a], tr[1]);
	}
	FN(cone_backward)(g->p, f, c, b, gj, dl_dmu);
}
