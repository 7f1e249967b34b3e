/* blob.c: see blob.h. */
#include "config.h"
#include "gs/blob.h"
#include "gs/act.h"

#include <math.h>

float *ct_gauss_field(const struct ct_gauss *g, size_t k)
{
	return k < CT_GS_SCALE ? g->pos[k]
	       : k < CT_GS_ROT ? g->scale[k - CT_GS_SCALE]
	       : k < CT_GS_RAW ? g->rot[k - CT_GS_ROT]
			       : g->raw;
}

/* 1/|q|; a quaternion of zeros counts as no rotation. */
static double unit(double out[4], const double q[4])
{
	double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);

	if (!(n > 1e-12)) {
		out[0] = 1;
		out[1] = out[2] = out[3] = 0;
		return 0;
	}
	for (int i = 0; i < 4; i++)
		out[i] = q[i] / n;
	return 1 / n;
}

void ct_blob_make(struct ct_blob *b, const double p[static 3], const double ln_s[static 3],
	const double q[static 4], double rho)
{
	double u[4], w, x, y, z;

	unit(u, q);
	w = u[0], x = u[1], y = u[2], z = u[3];
	b->a[0][0] = 1 - 2 * (y * y + z * z);
	b->a[0][1] = 2 * (x * y - w * z);
	b->a[0][2] = 2 * (x * z + w * y);
	b->a[1][0] = 2 * (x * y + w * z);
	b->a[1][1] = 1 - 2 * (x * x + z * z);
	b->a[1][2] = 2 * (y * z - w * x);
	b->a[2][0] = 2 * (x * z - w * y);
	b->a[2][1] = 2 * (y * z + w * x);
	b->a[2][2] = 1 - 2 * (x * x + y * y);
	for (int k = 0; k < 3; k++) {
		b->p[k] = p[k];
		b->s[k] = exp(ln_s[k]);
	}
	b->rho = rho;
}

struct job {
	struct ct_blob *b;
	const struct ct_gauss *g;
};

static void some(void *arg, size_t chunk, size_t worker)
{
	const struct job *j = arg;
	const struct ct_gauss *g = j->g;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;

	(void)worker;
	for (size_t i = first; i < end && i < g->n; i++) {
		const double p[3] = {
			(double)g->pos[0][i], (double)g->pos[1][i], (double)g->pos[2][i]};
		const double l[3] = {
			(double)g->scale[0][i], (double)g->scale[1][i], (double)g->scale[2][i]};
		const double q[4] = {(double)g->rot[0][i], (double)g->rot[1][i],
			(double)g->rot[2][i], (double)g->rot[3][i]};

		ct_blob_make(&j->b[i], p, l, q, ct_act(g->activation, g->gamma, (double)g->raw[i]));
	}
}

void ct_blobs(struct ct_blob *b, const struct ct_gauss *g, struct ct_par *par)
{
	struct job j = {b, g};

	ct_par_for(par, (g->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, some, &j);
}

void ct_blob_back(double dln_s[static 3], double dq[static 4], const double g[static 6],
	const struct ct_blob *b, const double q[static 4])
{
	const double full[3][3] = {{g[0], g[1], g[2]}, {g[1], g[3], g[4]}, {g[2], g[4], g[5]}};
	double d[3][3]; /* dL/dA = 2 G A diag(s^2) */
	double u[4], h[4], inv, w, x, y, z, dot = 0;

	for (int k = 0; k < 3; k++) {
		double s2 = b->s[k] * b->s[k], sum = 0;

		for (int r = 0; r < 3; r++) {
			double ga = full[r][0] * b->a[0][k] + full[r][1] * b->a[1][k] +
				    full[r][2] * b->a[2][k];

			d[r][k] = 2 * s2 * ga;
			sum += b->a[r][k] * ga;
		}
		dln_s[k] = 2 * s2 * sum;
	}
	inv = unit(u, q);
	w = u[0], x = u[1], y = u[2], z = u[3];
	h[0] = 2 * (z * (d[1][0] - d[0][1]) + y * (d[0][2] - d[2][0]) + x * (d[2][1] - d[1][2]));
	h[1] = 2 * (y * (d[0][1] + d[1][0]) + z * (d[0][2] + d[2][0]) + w * (d[2][1] - d[1][2]) -
			   2 * x * (d[1][1] + d[2][2]));
	h[2] = 2 * (x * (d[0][1] + d[1][0]) + w * (d[0][2] - d[2][0]) + z * (d[1][2] + d[2][1]) -
			   2 * y * (d[0][0] + d[2][2]));
	h[3] = 2 * (w * (d[1][0] - d[0][1]) + x * (d[0][2] + d[2][0]) + y * (d[1][2] + d[2][1]) -
			   2 * z * (d[0][0] + d[1][1]));
	for (int k = 0; k < 4; k++)
		dot += u[k] * h[k];
	for (int k = 0; k < 4; k++)
		dq[k] = (h[k] - u[k] * dot) * inv;
}

void ct_congruence(double out[static 6], const double m[static 3][3], const double h[static 6])
{
	const double full[3][3] = {{h[0], h[1], h[2]}, {h[1], h[3], h[4]}, {h[2], h[4], h[5]}};
	double hm[3][3];
	size_t at = 0;

	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++)
			hm[r][c] =
				full[r][0] * m[0][c] + full[r][1] * m[1][c] + full[r][2] * m[2][c];
	for (int r = 0; r < 3; r++)
		for (int c = r; c < 3; c++)
			out[at++] = m[0][r] * hm[0][c] + m[1][r] * hm[1][c] + m[2][r] * hm[2][c];
}
