/* cuts.c: see cuts.h. */
#include "config.h"
#include "tools/cuts.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The first of a list; *rest is behind it and its comma, NULL at the end. */
static bool one(struct ct_sheet_cut *c, const char *text, const char **rest)
{
	char *end;

	c->at = strtod(text, &end);
	c->mm = strncmp(end, "mm", 2) == 0;
	if (end == text || !isfinite(c->at) || (!c->mm && !(c->at >= 0 && c->at <= 1)))
		return false;
	end += c->mm ? 2 : 0;
	if (*end && *end != ',')
		return false;
	*rest = *end ? end + 1 : NULL;
	return true;
}

int cuts_parse(struct ct_sheet_cut **cut, size_t *n, const char *option, const char *text,
	struct ct_err *e)
{
	const char *at = text;

	if (ct_alloc(cut, CT_SHEET_CUTS, sizeof **cut, e))
		return -1;
	for (*n = 0; at && *n < CT_SHEET_CUTS; ++*n)
		if (!one(&(*cut)[*n], at, &at))
			break;
	if (!at)
		return 0;
	free(*cut);
	*cut = NULL;
	return ct_fail(e, CT_EUSAGE,
		"--%s: '%s' is not a list of numbers in [0, 1] or of places like -12.5mm, at most "
		"%d",
		option, text, CT_SHEET_CUTS);
}

int cuts_even(struct ct_sheet_cut **cut, size_t n, struct ct_err *e)
{
	if (ct_alloc(cut, n, sizeof **cut, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		(*cut)[i] = (struct ct_sheet_cut){.at = ((double)i + 0.5) / (double)n};
	return 0;
}
