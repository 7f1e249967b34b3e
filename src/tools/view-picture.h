/* view-picture.h: a sheet with its labels, as a PNG. */
#ifndef CT_TOOLS_VIEW_PICTURE_H
#define CT_TOOLS_VIEW_PICTURE_H
#include "core/env.h"
#include "report/sheet.h"

struct view_picture {
	const struct ct_sheet *sheet;
	size_t gap;              /* between its tiles, pixels */
	size_t names;            /* files */
	const char *const *name; /* of them */
	const char *unit;        /* of the values, "" */
	bool shaded;   /* surfaces: their greys are no values, so they have no colour bar */
	bool labelled; /* labels.h */
};

int view_picture_write(
	const struct view_picture *p, const char *path, const struct ct_env *env, struct ct_err *e);

#endif
