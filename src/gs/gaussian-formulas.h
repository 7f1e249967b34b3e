/* gaussian-formulas.h: rotation and gradient of a Gaussian (gaussian.h) for any kind of number:
 * included once for double, which is tested against finite differences (gaussian.c), and once for
 * a vector of doubles, which is used (gaussian-kernels.c).
 *
 * The includer defines
 *   NUM     the number                      MASK        what comparing two gives
 *   PICK(m, a, b)   m ? a : b               SQRT(x)
 *   FN(name)        the functions' names
 * SPDX-License-Identifier: Apache-2.0
 */
#define IMPL static inline __attribute__((always_inline, unused))

IMPL NUM FN(dot)(const NUM a[static 3], const NUM b[static 3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

IMPL NUM FN(along)(const double a[static 3], const NUM b[static 3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out = q/|q| and 1/|q|; a quaternion of zeros counts as no rotation that cannot be turned. */
IMPL NUM FN(unit)(NUM out[static 4], const NUM q[static 4])
{
	const NUM n = SQRT(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
	const MASK ok = n > 1e-12;
	const NUM inv = PICK(ok, 1 / n, n * 0);

	for (int i = 0; i < 4; i++)
		out[i] = PICK(ok, q[i] * inv, n * 0 + (i == 0));
	return inv;
}

IMPL void FN(rotation)(NUM a[static 3][3], const NUM q[static 4])
{
	NUM u[4], w, x, y, z;

	FN(unit)(u, q);
	w = u[0], x = u[1], y = u[2], z = u[3];
	a[0][0] = 1 - 2 * (y * y + z * z);
	a[0][1] = 2 * (x * y - w * z);
	a[0][2] = 2 * (x * z + w * y);
	a[1][0] = 2 * (x * y + w * z);
	a[1][1] = 1 - 2 * (x * x + z * z);
	a[1][2] = 2 * (y * z - w * x);
	a[2][0] = 2 * (x * z - w * y);
	a[2][1] = 2 * (y * z + w * x);
	a[2][2] = 1 - 2 * (x * x + y * y);
}

/* With N = diag(s) A^T dL/dSigma A diag(s): d ln s_k = 2 N_kk, and turning axis k towards axis l
 * gives 2 N_kl (s_k/s_l - s_l/s_k), which is an angle g about the third; an angle about the axes
 * of the Gaussian moves q by q (0, angle)/2, so dL/dq = 2 q (0, g), at right angles to q. */
IMPL void FN(gaussian_backward)(NUM dln_s[static 3], NUM dq[static 4], const NUM n[static 6],
	const NUM s[static 3], const NUM q[static 4])
{
	NUM u[4], g[3], inv = FN(unit)(u, q) * 2;

	dln_s[0] = 2 * n[0];
	dln_s[1] = 2 * n[3];
	dln_s[2] = 2 * n[5];
	g[0] = 2 * n[4] * (s[1] / s[2] - s[2] / s[1]);
	g[1] = 2 * n[2] * (s[2] / s[0] - s[0] / s[2]);
	g[2] = 2 * n[1] * (s[0] / s[1] - s[1] / s[0]);
	for (int k = 0; k < 3; k++)
		g[k] *= inv;
	dq[0] = -(u[1] * g[0] + u[2] * g[1] + u[3] * g[2]);
	dq[1] = u[0] * g[0] + u[2] * g[2] - u[3] * g[1];
	dq[2] = u[0] * g[1] + u[3] * g[0] - u[1] * g[2];
	dq[3] = u[0] * g[2] + u[1] * g[1] - u[2] * g[0];
}
