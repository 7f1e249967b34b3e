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
	size_t gap;               /* between its tiles, pixels */
	size_t names;             /* columns with a text, or 1: one for all; 0: none */
	const char *const *name;  /* borrowed; NULL: none */
	bool bars;                /* colour bars */
	const char *unit;         /* of the values; "" */
	size_t scale, top, right; /* of letters; of the margins, pixels; by ct_labels_size */
};

/* The size of the picture around one of h x w pixels. */
void ct_labels_size(struct ct_labels *l, size_t *h, size_t *w);
/* Around the sheet, mw pixels wide, in row `top` of a picture of that size. */
void ct_labels_draw(const struct ct_labels *l, const struct ct_canvas *all, size_t mw);
/* Longest of 1, 2, 5 times a power of ten that is not more than mm. */
double ct_labels_round(double mm);

#endif
