/* labels.h: what is written on and around a sheet. Pure.
 *
 * Above: a text a column, or one for all; right: a colour bar with its range for the values and for
 * the errors. On every tile its caption, on its edges the sides of the patient, on the first one a
 * scale bar of 1, 2 or 5 times a power of ten, at most a third of its width. Letters grow with the
 * first tile: by one for every 256 pixels.
 */
#ifndef CT_REPORT_LABELS_H
#define CT_REPORT_LABELS_H
#include "report/sheet.h"
#include "picture/text.h"

struct ct_labels {
	const struct ct_sheet *sheet;
	size_t names;            /* columns with a text, or 1: one for all; 0: nothing is written */
	const char *const *name; /* borrowed; NULL: none */
	bool bars;               /* colour bars */
	const char *unit;        /* of the values; "" */
	size_t scale, top;       /* of letters; of the margin, pixels; by ct_labels_draw */
};

/* *rgb <- the picture of h x w pixels (montage.h), to be freed: the sheet with its labels.
 * CT_EINPUT if it is too large, CT_ENOMEM. */
int ct_labels_draw(
	unsigned char **rgb, size_t *h, size_t *w, struct ct_labels *l, struct ct_err *e);

#endif
