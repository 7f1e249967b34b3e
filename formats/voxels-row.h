/* voxels-row.h: the conversions of voxels.h. Kernels (core/simd.h). */
#ifndef CT_FORMATS_VOXELS_ROW_H
#define CT_FORMATS_VOXELS_ROW_H
#include "core/simd.h"
#include "formats/voxels.h"

CT_SIMD_DECLARE(void, ct_voxels_row_float,
	(size_t n, float *restrict out, enum ct_voxel type, const void *restrict in, double slope,
		double inter));
CT_SIMD_DECLARE(bool, ct_voxels_row_i16,
	(size_t n, int16_t *restrict out, const float *restrict in, bool exact));

#endif
