/* block.c: see block.h. */
#include "config.h"
#include "gs/block.h"

#include <math.h>

int ct_block_init(struct ct_block *k, const double affine[static 3][4],
	const size_t first[static 3], const size_t n[static 3], struct ct_err *e)
{
	double cof[3][3], det = 0;

	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) {
			int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;

			cof[r][c] =
				affine[r1][c1] * affine[r2][c2] - affine[r1][c2] * affine[r2][c1];
		}
	for (int c = 0; c < 3; c++)
		det += affine[0][c] * cof[0][c];
	if (!(fabs(det) > 0) || !isfinite(det))
		return ct_fail(e, CT_EGEOM, "the affine of the grid has no inverse");
	for (int r = 0; r < 3; r++) {
		k->blur[r] = 0;
		k->n[r] = n[r];
		k->world[r] = affine[r][3];
		for (int c = 0; c < 3; c++) {
			k->inv[c][r] = cof[r][c] / det;
			k->world[r] += affine[r][c] * (double)first[c];
		}
	}
	return 0;
}
