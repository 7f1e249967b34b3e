/* ply.h: what reading and writing of PLY share; the public functions are in format.h and bytes.h.
 */
#ifndef CT_FORMATS_PLY_H
#define CT_FORMATS_PLY_H
#include "core/gauss.h"

#include <stdbool.h>

#define CT_PLY_COMMENT "comment ct:"
enum { CT_PLY_FIELDS = CT_GAUSS_COLUMNS };

/* The properties that are read, in the order of the columns of a set. */
extern const char *const ct_ply_names[CT_PLY_FIELDS];
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
