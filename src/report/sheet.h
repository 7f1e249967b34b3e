/* sheet.h: which slices or views of several files make up a picture, how they are toned, and what
 * is written on them. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_REPORT_SHEET_H
#define CT_REPORT_SHEET_H
#include "formats/any.h"
#include "picture/montage.h"

#include <stdbool.h>
#include <stdio.h>

/* What a sheet may show besides one plane. */
#define CT_SHEET_LIST(X) X(CT_SHEET_ALL_PLANES, "all")
enum { CT_SHEET_ALL_PLANES = CT_MONTAGE_PLANES };

/* Where a volume is cut. */
struct ct_sheet_cut {
	double at; /* of [0, 1] of the volume (ct_montage_position), or a world coordinate */
	bool mm;   /* which it is */
};
enum { CT_SHEET_CUTS = 1000 }; /* at most */

struct ct_sheet_rule {
	int plane;                      /* of enum ct_montage_plane, or CT_SHEET_ALL_PLANES */
	const struct ct_sheet_cut *cut; /* [cuts]: where the first volume is cut */
	size_t cuts;
	enum ct_mip slab;                    /* projection across the plane */
	double thickness;                    /* of the slab, mm; 0: the whole volume */
	size_t views;                        /* of projections, at most; > 0 */
	bool error;                          /* also maps of the difference from the first file */
	enum ct_colour_map map;              /* in which colours */
	double zoom;                         /* pixels for the finest spacing shown */
	const double *window, *error_window; /* [2], or NULL: chosen by what the files hold */
	bool window_hu;                      /* the window is one of HU */
};

/* What is written on a tile. */
struct ct_sheet_note {
	char caption[64];
	const char *side; /* of the patient: above, below, left, right; NULL for projections */
};

struct ct_sheet {
	struct ct_montage montage;  /* data of tiles belong to the files, or to own */
	struct ct_sheet_note *note; /* [rows][cols] */
	float **own;                /* likewise: computed data, NULL for the others */
};

/* A volume of HU? */
bool ct_sheet_in_hu(const struct ct_any *a);
/* Lays out n files, all volumes or all projections. Several files: a column a file, a row a slice
 * or view. One volume in all planes: a row a plane. Else the pictures fill rows near a square. *s
 * must be zero. CT_EGEOM names the place where the first file has no voxels, or the file that is
 * shown nowhere or whose area does not overlap with that of the first. */
int ct_sheet_make(struct ct_sheet *s, size_t n, const struct ct_any *file,
	const struct ct_sheet_rule *rule, struct ct_err *e);
void ct_sheet_free(struct ct_sheet *s);

/* What is written on and around a sheet (labels.c): above a text a column, or one for all; right a
 * colour bar with its range for the values and for the errors. On every tile its caption, on its
 * edges the sides of the patient, on the first one a scale bar of 1, 2 or 5 times a power of ten,
 * at most a third of its width. Letters grow with the first tile: by one for every 256 pixels. A
 * name that is wider than its column goes on in the next line. */
struct ct_labels {
	const struct ct_sheet *sheet;
	size_t names;            /* columns with a text, or 1: one for all; 0: nothing is written */
	const char *const *name; /* borrowed; NULL: none */
	const char *unit;        /* of the values; "" */
	FILE *svg;               /* words are written here, as elements of SVG; NULL: drawn */
	size_t scale, top;       /* of letters; of the margin, pixels; by ct_labels_draw */
};

/* *rgb <- the picture of h x w pixels (montage.h), to be freed: the sheet with its labels.
 * CT_EINPUT if it is too large, CT_ENOMEM. */
int ct_labels_draw(
	unsigned char **rgb, size_t *h, size_t *w, struct ct_labels *l, struct ct_err *e);
/* The picture as SVG: the n bytes of a PNG of h x w pixels, and the `text` of ct_labels_draw.
 * CT_ENOMEM. */
int ct_labels_svg(FILE *f, size_t h, size_t w, const unsigned char *png, size_t n, const char *text,
	struct ct_err *e);

#endif
