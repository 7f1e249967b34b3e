/* nabgs-data.h: what ct-nabgs fits, from its files. */
#ifndef CT_TOOLS_NABGS_DATA_H
#define CT_TOOLS_NABGS_DATA_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"
#include "resolution/degrade.h"

#include <stdbool.h>

/* Paths; NULL: not given. */
struct nabgs_files {
	const char *in, *base, *projections, *std, *lr, *window;
	bool full; /* without base projections */
};

struct nabgs_data {
	struct ct_stack in, base_proj; /* density mm */
	struct ct_stack weight;        /* of each pixel, in (0, 1]; none without --std */
	struct ct_vol base;            /* density, in [0, 1] */
	struct ct_vol
		lr; /* what D of the residual must be: density (LR - D base); none without --lr */
	struct ct_degrade by; /* D, of lr */
	double window[2];     /* HU */
};

/* Read and check all, and project the base if its projections are not given; *d must be zero. Codes
 * of the readers; CT_EINPUT, CT_EGEOM naming the file; CT_ESTOP. */
int nabgs_data_read(struct nabgs_data *d, const struct nabgs_files *f, const struct ct_env *env,
	struct ct_err *e);
void nabgs_data_free(struct nabgs_data *d);

#endif
