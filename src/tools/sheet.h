/* sheet.h: which slices or views of several files make up a picture, and how they are toned. */
#ifndef CT_TOOLS_SHEET_H
#define CT_TOOLS_SHEET_H
#include "formats/any.h"
#include "tools/cuts.h"
#include "tools/montage.h"
#include "tools/slab.h"
#include "tools/surface.h"

#include <stdbool.h>

/* What a sheet may show besides one plane. */
#define SHEET_LIST(X) X(SHEET_ALL_PLANES, "all")
enum { SHEET_ALL_PLANES = MONTAGE_PLANES };

struct sheet_rule {
	int plane;             /* of enum montage_plane, or SHEET_ALL_PLANES */
	const struct cut *cut; /* [cuts]: where the first volume is cut */
	size_t cuts;
	enum slab slab;                      /* many slices in one */
	double thickness;                    /* mm of them; 0: all */
	bool surface;                        /* that of a level, in the place of slices */
	double level;                        /* of values as they are */
	struct ct_par *par;                  /* for it */
	size_t views;                        /* of a stack, at most, > 0 */
	bool error;                          /* maps of the difference to the first file too */
	enum colour_map map;                 /* in which colours */
	double zoom;                         /* pixels for the finest spacing shown */
	const double *window, *error_window; /* [2], or NULL: chosen by what the files hold */
	bool window_hu;                      /* the window is one of HU */
};

/* What labels and lines need to know of a tile. */
struct sheet_note {
	char caption[64];
	const char *side; /* the sides of the patient: above, below, left, right; NULL of views */
	/* of one slice of a volume: where it is; vol NULL else. Borrowed. */
	const struct ct_vol *vol;
	enum montage_plane plane;
	double mm;
};

struct sheet {
	size_t rows, cols;
	struct montage_tile *tile; /* [rows][cols]; borrows the data of the files */
	struct sheet_note *note;   /* likewise */
	float **own; /* likewise: the data of those that are computed, NULL of the rest */
	double mm;   /* a pixel */
};

/* Bytes that the sheet takes, and its picture, at most. */
double sheet_bytes(size_t n, const struct ct_any *file, const struct sheet_rule *rule);
/* A volume of HU? */
bool sheet_in_hu(const struct ct_any *a);
/* Sheet of n files, all volumes or all stacks: a column a file, a row a slice or view; a single
 * stack, or one plane of a single volume, fills rows near a square; of a single volume in all
 * planes these are the rows. *s must be zero. CT_EGEOM naming the place or the file if the first
 * file is not where it is to be cut, or if error maps are asked for and the areas do not overlap.
 */
int sheet_make(struct sheet *s, size_t n, const struct ct_any *file, const struct sheet_rule *rule,
	struct ct_err *e);
void sheet_free(struct sheet *s);

#endif
