/* Algebra of the block-mean operator: properties, not stored numbers.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "pinv.h"

#include <string.h>

enum { H = 3, W = 5, S = 4, NY = H * W, NX = NY * S * S };

int main(void)
{
	const struct ct_measurement op = {
		.kind = CT_MEASUREMENT_MEAN, .h = H, .w = W, .s = S, .high = S * H, .wide = S * W};
	float x[NX], x0[NX], up[NX], y[NY], ax[NY + 1];
	double c[NY], d[NY], cc = 0, cd = 0;

	ct_rng_normals(NX, x, 1, 1, 0);
	ct_rng_normals(NY, y, 1, 2, 0);
	memcpy(x0, x, sizeof x);

	block_mean_pinv(H, W, S, up, y);
	ct_measurement_forward(&op, ax, up, NULL);
	NEAR(maxdiff(NY, ax, y), 0, 1e-7, "A A+ = I");

	ax[NY] = 7;
	ct_measurement_forward(&op, ax, x, NULL);
	OK(ax[NY] == 7, "no more than (h,w) is written"); /* NOLINT: as it was */
	NEAR(dot(NY, ax, y), dot(NX, x, up) / (S * S), 1e-5, "<Ax, y> = <x, A+ y> / s^2");

	ct_measurement_data(&op, d, y, NULL);
	ct_measurement_pull(&op, 0, x, x, d, c, NULL);
	OK(memcmp(x, x0, sizeof x) == 0, "a pull of 0 leaves x as it was");

	ct_measurement_pull(&op, 1, x, x, d, c, NULL);
	ct_measurement_forward(&op, ax, x, NULL);
	NEAR(maxdiff(NY, ax, y), 0, 1e-6, "a pull of 1 makes A x = y");
	NEAR((double)(x[1] - x[0]), (double)(x0[1] - x0[0]), 1e-6, "the null space is not touched");

	ct_measurement_analyse(&op, c, x, NULL);
	memset(up, 0, sizeof up);
	ct_measurement_synth_add(&op, up, c, NULL);
	ct_measurement_analyse(&op, d, up, NULL);
	for (int i = 0; i < NY; i++) {
		cc += c[i] * c[i];
		cd = fmax(cd, fabs(c[i] - d[i]));
	}
	NEAR(cd, 0, 1e-6, "analysis undoes synthesis");
	NEAR(dot(NX, up, up) / cc, 1, 1e-6, "the block vectors are orthonormal");
	ct_measurement_forward(&op, ax, x, NULL);
	NEAR((double)ax[7] * S, c[7], 1e-6, "coefficients are s times the means");
	return tap_done();
}
