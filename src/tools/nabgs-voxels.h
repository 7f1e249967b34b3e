/* nabgs-voxels.h: the residual as voxels, not Gaussians: kern/joint.h on what ct-nabgs reads. */
#ifndef CT_TOOLS_NABGS_VOXELS_H
#define CT_TOOLS_NABGS_VOXELS_H
#include "tools/nabgs-data.h"

struct nabgs_voxels {
	const char *out;
	const char *state; /* path; NULL: none is kept */
	bool resume;
	double lambda;     /* weight of the projections against the variation, 1/HU; 0: chosen */
	size_t iterations; /* 0: fifteen */
	size_t every;      /* iterations between states; 0: when stopped */
};

/* Solve, write OUT and report; or say what it would cost, if that is asked for. *d is used up.
 * CT_EUSAGE without LR; codes of the solver, reader and writer. */
int nabgs_voxels(struct nabgs_data *d, const struct nabgs_voxels *how, const struct ct_env *env,
	struct ct_err *e);

#endif
