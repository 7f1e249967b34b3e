/* field.h: what ct-field fits: a CT, or projections, and the grids of both. */
#ifndef CT_TOOLS_FIELD_H
#define CT_TOOLS_FIELD_H
#include "field/fit.h"
#include "refine/operator.h"

struct field_files {
	const char *in, *grid, *factor, *window;
};

struct field_input {
	struct ct_vol lr;      /* density */
	struct ct_stack rays;  /* or, if views > 0, these */
	struct ct_operator is; /* of lr */
	struct ct_vol fine;    /* grid without data: of lr refined, or of the scan */
	struct ct_vol out;     /* grid without data, in the end with them */
	struct ct_vol like;    /* of --grid, for its metadata */
	double window[2];
};

/* Is IN a stack? By its content; a stream is what `rays` says. CT_EINPUT. */
int field_is_stack(bool *stack, const char *in, bool rays, struct ct_err *e);
/* All of it; *i must be zero. CT_EUSAGE, CT_EINPUT, CT_EGEOM, CT_ENUMERIC. */
int field_read(struct field_input *i, const struct field_files *f, bool stack,
	const struct ct_env *env, struct ct_err *e);
void field_free(struct field_input *i);
/* The densities of OUT become HU, with metadata. */
int field_finish(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e);

#endif
