/* backproject-row.h: back-projection onto a row of voxels along axis 0, of any grid, from any
 * detector. Pure kernels (core/simd.h). */
#ifndef CT_RECON_BACKPROJECT_ROW_H
#define CT_RECON_BACKPROJECT_ROW_H
#include "core/simd.h"
#include "recon/backproject.h"

/* out[n0] += the views [first, first + count), stored from `views` on; row j of slice k. */
CT_SIMD_DECLARE(void, ct_backproject_row,
	(float *restrict out, const struct ct_backprojector *b, size_t j, size_t k, size_t first,
		size_t count, const float *restrict views));

#endif
