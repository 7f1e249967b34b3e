/* gauss-scene.c: see gauss-scene.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/gauss-scene.h"

#include <math.h>
#include <string.h>

bool ct_gauss_is_scene(const struct ct_gauss *g)
{
	return g->grid[0] == 0 && g->affine[0][0] == 1;
}

struct ct_gauss_scene ct_gauss_scene_of(const size_t n[static 3], double affine[3][4])
{
	struct ct_gauss_scene s = {.plain = true};

	for (int a = 0; a < 3; a++) {
		double mm = 0;

		for (int r = 0; r < 3; r++)
			mm += affine[r][a] * affine[r][a];
		mm = sqrt(mm);
		s.half = fmax(s.half, mm * (double)n[a] / 2);
		for (int r = 0; r < 3; r++)
			s.axis[r][a] = affine[r][a] / mm;
	}
	for (int r = 0; r < 3; r++) {
		s.centre[r] = affine[r][3];
		for (int a = 0; a < 3; a++) {
			s.centre[r] += affine[r][a] * ((double)n[a] - 1) / 2;
			s.plain &= fabs(s.axis[r][a] - (r == a)) < 1e-12;
		}
	}
	return s;
}

/* q <- the rotation of m q, or of its mirror image, which has the same covariance. */
static void turn(double q[4], double m[3][3])
{
	double w = q[0], x = q[1], y = q[2], z = q[3], n = w * w + x * x + y * y + z * z;
	double r[3][3], p[3][3], det, big;
	int k = 0;

	if (!(n > 0))
		return;
	n = 2 / n;
	memcpy(r,
		(double[3][3]){{1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)},
			{n * (x * y + w * z), 1 - n * (x * x + z * z), n * (y * z - w * x)},
			{n * (x * z - w * y), n * (y * z + w * x), 1 - n * (x * x + y * y)}},
		sizeof r);
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			p[i][j] = m[i][0] * r[0][j] + m[i][1] * r[1][j] + m[i][2] * r[2][j];
	det = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
	      p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
	      p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
	for (int i = 0; i < 3 && det < 0; i++)
		for (int j = 0; j < 3; j++)
			p[i][j] = -p[i][j];
	/* of the four ways to take a quaternion of a matrix that with the largest divisor */
	const double four[4] = {1 + p[0][0] + p[1][1] + p[2][2], 1 + p[0][0] - p[1][1] - p[2][2],
		1 - p[0][0] + p[1][1] - p[2][2], 1 - p[0][0] - p[1][1] + p[2][2]};

	for (int i = 1; i < 4; i++)
		k = four[i] > four[k] ? i : k;
	big = sqrt(fmax(four[k], 1e-300));
	const double a = p[2][1] - p[1][2], b = p[0][2] - p[2][0], c = p[1][0] - p[0][1];
	const double d = p[1][0] + p[0][1], f = p[0][2] + p[2][0], g = p[2][1] + p[1][2];
	const double all[4][4] = {{big * big, a, b, c}, {a, big * big, d, f}, {b, d, big * big, g},
		{c, f, g, big * big}};

	for (int i = 0; i < 4; i++)
		q[i] = all[k][i] / (2 * big);
}

void ct_gauss_move(struct ct_gauss *g, size_t i, const struct ct_gauss_scene *s, bool back)
{
	double x[3], y[3], q[4], m[3][3];

	for (int r = 0; r < 3; r++) {
		x[r] = (double)g->pos[r][i] - (back ? s->centre[r] : 0);
		for (int a = 0; a < 3; a++)
			m[r][a] = back ? s->axis[a][r] : s->axis[r][a];
		g->scale[r][i] += (float)((back ? -1 : 1) * log(s->half));
	}
	for (int r = 0; r < 3; r++) {
		y[r] = m[r][0] * x[0] + m[r][1] * x[1] + m[r][2] * x[2];
		g->pos[r][i] = (float)(back ? y[r] / s->half : s->centre[r] + y[r] * s->half);
	}
	if (s->plain)
		return;
	for (int k = 0; k < 4; k++)
		q[k] = (double)g->rot[k][i];
	turn(q, m);
	for (int k = 0; k < 4; k++)
		g->rot[k][i] = (float)q[k];
}

void ct_gauss_place(struct ct_gauss *g, const size_t n[static 3], double affine[3][4])
{
	struct ct_gauss_scene s = ct_gauss_scene_of(n, affine);

	for (size_t i = 0; i < g->n; i++)
		ct_gauss_move(g, i, &s, false);
	memcpy(g->grid, n, sizeof g->grid);
	memcpy(g->affine, affine, sizeof g->affine);
}

int ct_gauss_placed(struct ct_gauss *to, const struct ct_gauss *g, double gamma,
	const size_t n[static 3], double affine[3][4], struct ct_err *e)
{
	if (ct_gauss_reserve(to, g->n, e) || ct_meta_copy(&to->meta, &g->meta, e))
		return -1;
	to->n = g->n;
	for (int k = 0; k < CT_GAUSS_COLUMNS; k++)
		memcpy(to->column[k], g->column[k], g->n * sizeof *g->column[k]);
	to->activation = gamma > 0 ? CT_PRELU : g->activation;
	to->gamma = gamma > 0 ? gamma : g->gamma;
	ct_gauss_place(to, n, affine);
	return 0;
}
