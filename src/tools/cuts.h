/* cuts.h: where a volume is cut, as options say it. Pure. */
#ifndef CT_TOOLS_CUTS_H
#define CT_TOOLS_CUTS_H
#include "report/sheet.h"

/* "0.25,0.5" or "-12.5mm,40mm", also mixed; *cut from malloc. CT_EUSAGE naming the option. */
int cuts_parse(struct ct_sheet_cut **cut, size_t *n, const char *option, const char *text,
	struct ct_err *e);
/* n of them, in the middles of as many equal parts. */
int cuts_even(struct ct_sheet_cut **cut, size_t n, struct ct_err *e);

#endif
