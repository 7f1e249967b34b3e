/* rof-row.h: rows of rof.h. */
#ifndef CT_RECON_ROF_ROW_H
#define CT_RECON_ROF_ROW_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

/* A row of n voxels and its neighbours one row and one plane on. */
struct ct_rof_row {
	float *x;               /* the solution */
	const float *v;         /* what it is to be near */
	float *p[3];            /* the dual; p[0] is 0 at the last voxel */
	const float *before[3]; /* p[1] a row, p[2] a plane before; NULL: 0. [0] unused */
	const float *after[3];  /* x a row, a plane after; NULL: there is none */
};

/* x = v + mu div p; nonnegative: or 0 where that is below. */
CT_SIMD_DECLARE(void, ct_rof_row_primal,
	(size_t n, const struct ct_rof_row *r, float mu, bool nonnegative));
/* p <- p + step grad x, shortened to length 1 where it is longer. */
CT_SIMD_DECLARE(void, ct_rof_row_dual, (size_t n, const struct ct_rof_row *r, float step));

#endif
