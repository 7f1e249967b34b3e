/* vec3.h: vectors of space. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_VEC3_H
#define CT_CORE_VEC3_H
#include <math.h>
#include <stddef.h>
#include <string.h>

static inline double ct_vec3_dot(const double a[static 3], const double b[static 3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out is neither a nor b. */
static inline void ct_vec3_cross(
	double out[static 3], const double a[static 3], const double b[static 3])
{
	out[0] = a[1] * b[2] - a[2] * b[1];
	out[1] = a[2] * b[0] - a[0] * b[2];
	out[2] = a[0] * b[1] - a[1] * b[0];
}

/* out = a - b; it may be one of them. */
static inline void ct_vec3_minus(
	double out[static 3], const double a[static 3], const double b[static 3])
{
	for (int i = 0; i < 3; i++)
		out[i] = a[i] - b[i];
}

static inline double ct_vec3_length(const double a[static 3])
{
	return sqrt(ct_vec3_dot(a, a));
}

/* out = a / |a|; it may be a. */
static inline void ct_vec3_unit(double out[static 3], const double a[static 3])
{
	const double length = ct_vec3_length(a);

	for (int i = 0; i < 3; i++)
		out[i] = a[i] / length;
}

/* Rows b x c, c x a, a x b: over the determinant, which it returns, the inverse of the matrix with
 * columns a, b, c. */
static inline double ct_vec3_dual(double out[static 3][3], const double a[static 3],
	const double b[static 3], const double c[static 3])
{
	ct_vec3_cross(out[0], b, c);
	ct_vec3_cross(out[1], c, a);
	ct_vec3_cross(out[2], a, b);
	return ct_vec3_dot(a, out[0]);
}

/* The order of the columns of `a` in which column axis[d] runs most along the world's axis
 * world[d]: the largest sum of cosines, and of equal ones, or of NaN, the first. */
static inline void ct_vec3_axes(
	int axis[static 3], const double a[static 3][4], const int world[static 3])
{
	static const int all[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	double best = -1;

	memcpy(axis, all[0], sizeof all[0]);
	for (int p = 0; p < 6; p++) {
		double sum = 0;

		for (int d = 0; d < 3; d++) {
			const int o = all[p][d];

			sum += fabs(a[world[d]][o]) / hypot(hypot(a[0][o], a[1][o]), a[2][o]);
		}
		if (sum > best + 1e-9) {
			best = sum;
			for (int d = 0; d < 3; d++)
				axis[d] = all[p][d];
		}
	}
}

/* Three elements of `size` bytes, 512 at most: x[d] becomes what x[axis[d]] was. */
static inline void ct_vec3_order(void *x, size_t size, const int axis[static 3])
{
	char was[3 * 512];

	memcpy(was, x, 3 * size);
	for (int d = 0; d < 3; d++)
		memcpy((char *)x + (size_t)d * size, was + (size_t)axis[d] * size, size);
}

/* Where in axis[] a is. */
static inline int ct_vec3_place(int a, const int axis[static 3])
{
	return a == axis[0] ? 0 : a == axis[1] ? 1 : 2;
}

/* out = the map m after the affine map a, both 3x4. */
static inline void ct_vec3_after(
	double out[static 3][4], const double m[static 3][4], const double a[static 3][4])
{
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 4; c++) {
			out[r][c] = c == 3 ? m[r][3] : 0;
			for (int k = 0; k < 3; k++)
				out[r][c] += m[r][k] * a[k][c];
		}
}

#endif
