/* reorient.c: see reorient.h. */
#include "config.h"
#include "resolution/reorient.h"

#include <math.h>
#include <string.h>

void ct_reorient_closest(int axis[3], int sign[3], const double a[3][4], const int world[static 3],
	const int towards[static 3])
{
	static const int all[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	double best = -1;

	for (int p = 0; p < 6; p++) {
		double sum = 0;

		for (int d = 0; d < 3; d++) {
			const int o = all[p][d];

			sum += fabs(a[world[d]][o]) / hypot(hypot(a[0][o], a[1][o]), a[2][o]);
		}
		if (sum > best + 1e-9) {
			best = sum;
			memcpy(axis, all[p], sizeof all[p]);
		}
	}
	for (int d = 0; d < 3; d++)
		sign[d] = a[world[d]][axis[d]] * towards[d] < 0 ? -1 : 1;
}

void ct_reorient(float *restrict out, const float *restrict in, const size_t n[static 3],
	const int axis[static 3], const int sign[static 3])
{
	const size_t old[3] = {1, n[0], n[0] * n[1]};
	const size_t m[3] = {n[axis[0]], n[axis[1]], n[axis[2]]};
	const size_t pitch[3] = {1, m[0], m[0] * m[1]};
	/* a page holds what lies along axis 0, here and there: neither of the two is outermost */
	const int outer = axis[2] == 0 ? 1 : 2, inner = 3 - outer;
	ptrdiff_t step[3], from = 0;

	for (int d = 0; d < 3; d++) {
		step[d] = sign[d] * (ptrdiff_t)old[axis[d]];
		if (sign[d] < 0)
			from += (ptrdiff_t)((m[d] - 1) * old[axis[d]]);
	}
	for (size_t a = 0; a < m[outer]; a++) {
		for (size_t b = 0; b < m[inner]; b++) {
			const float *row =
				in + from + (ptrdiff_t)a * step[outer] + (ptrdiff_t)b * step[inner];
			float *to = out + a * pitch[outer] + b * pitch[inner];

			for (size_t i = 0; i < m[0]; i++)
				to[i] = row[(ptrdiff_t)i * step[0]];
		}
	}
}

void ct_reorient_affine(double a[3][4], const size_t n[static 3], const int axis[static 3],
	const int sign[static 3])
{
	double old[3][4];

	memcpy(old, a, sizeof old);
	for (int r = 0; r < 3; r++)
		for (int d = 0; d < 3; d++) {
			a[r][d] = sign[d] * old[r][axis[d]];
			if (sign[d] < 0)
				a[r][3] += old[r][axis[d]] * (double)(n[axis[d]] - 1);
		}
}
