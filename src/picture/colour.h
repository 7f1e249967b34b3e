/* colour.h: from values to colours. Pure.
 *
 * inferno rises evenly in lightness from black: eight places, evenly spaced, of the map of that
 * name by N. Smith and S. van der Walt (BIDS/colormap, CC0), straight lines between them. signed is
 * the diverging map of K. Moreland, "Diverging Color Maps for Scientific Visualization" (2009):
 * nine places of its table, from blue over light grey in the middle to red.
 */
#ifndef CT_PICTURE_COLOUR_H
#define CT_PICTURE_COLOUR_H
#include "core/words.h"

/* Maps of errors: black over red and yellow to white, and the two above. */
#define CT_COLOUR_ERROR_LIST(X)                                                                    \
	X(CT_COLOUR_HOT, "hot")                                                                    \
	X(CT_COLOUR_INFERNO, "inferno")                                                            \
	X(CT_COLOUR_SIGNED, "signed")
enum ct_colour_map { CT_COLOUR_ERROR_LIST(CT_WORD_VALUE) CT_COLOUR_GREY };

/* The colour of t, 0 to 1 and what lies beyond as its ends; NaN is blue. */
void ct_colour_of(unsigned char rgb[static 3], double t, enum ct_colour_map map);

#endif
