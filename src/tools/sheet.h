/* sheet.h: which slices or views of several files make up a picture, and how they are toned. */
#ifndef CT_TOOLS_SHEET_H
#define CT_TOOLS_SHEET_H
#include "formats/any.h"
#include "tools/montage.h"

#include <stdbool.h>

/* What a sheet may show besides one plane. */
#define SHEET_LIST(X) X(SHEET_ALL_PLANES, "all")
enum { SHEET_ALL_PLANES = MONTAGE_PLANES };

struct sheet_rule {
	int plane;                           /* of enum montage_plane, or SHEET_ALL_PLANES */
	double slice;                        /* of [0, 1], in the first volume */
	size_t views;                        /* of a stack, at most, > 0 */
	bool error;                          /* maps of the difference to the first file too */
	double zoom;                         /* pixels for the finest spacing shown */
	const double *window, *error_window; /* [2], or NULL: chosen by what the files hold */
};

struct sheet {
	size_t rows, cols;
	struct montage_tile *tile; /* [rows][cols]; borrows the data of the files */
	double mm;                 /* a pixel */
};

/* Sheet of n files, all volumes or all stacks: a column a file, a row a plane or view; a single
 * stack fills rows near a square. *s must be zero. CT_EGEOM naming the file by its place if
 * error maps are asked for and the areas do not overlap. */
int sheet_make(struct sheet *s, size_t n, const struct ct_any *file, const struct sheet_rule *rule,
	struct ct_err *e);
void sheet_free(struct sheet *s);

#endif
