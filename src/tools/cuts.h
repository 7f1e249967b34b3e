/* cuts.h: where a volume is cut, as options say it. Pure. */
#ifndef CT_TOOLS_CUTS_H
#define CT_TOOLS_CUTS_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

struct cut {
	double at; /* of [0, 1] of the volume (ct_montage_position), or a world coordinate */
	bool mm;   /* which it is */
};

enum { CUTS_MOST = 1000 };

/* "0.25,0.5" or "-12.5mm,40mm", also mixed; *cut from malloc. CT_EUSAGE naming the option. */
int cuts_parse(struct cut **cut, size_t *n, const char *option, const char *text, struct ct_err *e);
/* n of them, in the middles of as many equal parts. */
int cuts_even(struct cut **cut, size_t n, struct ct_err *e);

#endif
