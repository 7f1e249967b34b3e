/* std.h: the error to expect at each voxel of what a solver made, and how it is written. */
#ifndef CT_TOOLS_LIB_STD_H
#define CT_TOOLS_LIB_STD_H
#include "tools/lib/lowres.h"

/* Bytes of it and of the volume it is of, which has `fine` voxels. */
#define STD_BYTES(fine) (8 * (fine))

/* std (zeroed) <- what is expected of x, which the solver made of `lo`, a scan that is `is`
 * of a known operator (resolution/expected.h). CT_ENOMEM, CT_ESTOP. */
int std_of_solver(struct ct_vol *std, const struct ct_vol *x, const char *lo,
	const struct lowres_is *is, const struct ct_env *env, struct ct_err *e);
/* Write the result x to `out` (cli/keep.h), and if `path` is not NULL what is expected of it there,
 * with what it is and what `n` files it was made from: both, or neither. Codes of the writers. */
int std_write(const char *path, struct ct_vol *std, const char *out, const struct ct_vol *x,
	size_t n, const struct ct_meta *const from[], const struct ct_env *env, struct ct_err *e);

#endif
