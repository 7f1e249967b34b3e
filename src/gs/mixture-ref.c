/* mixture-ref.c: see mixture-ref.h. */
#include "config.h"
#include "gs/mixture-ref.h"

#include <math.h>
#include <string.h>

void ct_mixture_ref_draw(
	double *out, const struct ct_block *k, const struct ct_voxel_gaussian *b, double cut)
{
	size_t count = k->n[0] * k->n[1] * k->n[2];

	for (size_t at = 0; at < count; at++) {
		double z = (double)(at / k->n[0] / k->n[1]) - b->m[2];
		double y = (double)(at / k->n[0] % k->n[1]) - b->m[1] - b->s12 * z;
		double x = (double)(at % k->n[0]) - b->m[0] - b->s02 * z - b->s01 * y;
		double q = (x * x / b->var[0] + y * y / b->var[1] + z * z / b->var[2]) / 2;

		if (q <= cut)
			out[at] += b->rho * exp(-q);
	}
}

void ct_mixture_ref_sums(double s[static 10], const double *g, const struct ct_block *k,
	const struct ct_voxel_gaussian *b, double cut)
{
	size_t count = k->n[0] * k->n[1] * k->n[2];

	memset(s, 0, 10 * sizeof *s);
	for (size_t at = 0; at < count; at++) {
		double z = (double)(at / k->n[0] / k->n[1]) - b->m[2];
		double y = (double)(at / k->n[0] % k->n[1]) - b->m[1] - b->s12 * z;
		double x = (double)(at % k->n[0]) - b->m[0] - b->s02 * z - b->s01 * y;
		double q = (x * x / b->var[0] + y * y / b->var[1] + z * z / b->var[2]) / 2;
		double v = q <= cut ? g[at] * exp(-q) : 0;
		const double d[10] = {1, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z};

		for (int i = 0; i < 10; i++)
			s[i] += v * d[i];
	}
}
