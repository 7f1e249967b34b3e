/* ply.h: what reading and writing of PLY share; the public functions are in format.h and bytes.h.
 */
#ifndef CT_FORMATS_PLY_H
#define CT_FORMATS_PLY_H
#include "core/gauss.h"

#include <stdbool.h>

#define CT_PLY_COMMENT "comment ct:"
enum { CT_PLY_FIELDS = 11 };

/* The properties that are read, in the order of ct_ply_fields. */
extern const char *const ct_ply_names[CT_PLY_FIELDS];
/* The arrays of a set. */
void ct_ply_fields(const struct ct_gauss *g, float *f[static CT_PLY_FIELDS]);
/* Keys of comments that are of the format, not metadata. */
#define CT_PLY_UNITS "units"
#define CT_PLY_ACTIVATION "activation"
#define CT_PLY_GAMMA "gamma"
#define CT_PLY_STEP "step"
#define CT_PLY_GRID "grid"
#define CT_PLY_AFFINE "affine"
/* Is the key of a comment one of the format, and not metadata? */
bool ct_ply_own(const char *key);

#endif
