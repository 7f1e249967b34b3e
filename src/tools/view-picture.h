/* view-picture.h: a sheet with what is drawn on and around it, as a PNG. */
#ifndef CT_TOOLS_VIEW_PICTURE_H
#define CT_TOOLS_VIEW_PICTURE_H
#include "core/env.h"
#include "tools/profile.h"
#include "tools/sheet.h"

struct view_picture {
	const struct sheet *sheet;
	size_t gap;                    /* between its tiles, pixels */
	size_t names;                  /* files */
	const char *const *name;       /* of them */
	const char *unit;              /* of the values, "" */
	const struct profile *profile; /* plotted below and drawn on the slices; NULL: none */
	size_t gaussians;              /* drawn on the slices */
	const struct ct_gaussian *gaussian;
	bool shaded;   /* surfaces, of which no colours are values */
	bool labelled; /* labels.h */
};

int view_picture_write(
	const struct view_picture *p, const char *path, const struct ct_env *env, struct ct_err *e);

#endif
