/* json.c: see json.h. */
#include "config.h"
#include "cli/json.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>

int ct_json_print(const json_t *o, unsigned digits, struct ct_err *e)
{
	const bool lost = !o || errno == ENOMEM; /* a member that was not set is not told */
	const int rc =
		lost ? -1 : json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(digits));

	if (rc && !ferror(stdout))
		return ct_fail(e, CT_ENOMEM, "no memory for JSON");
	putchar('\n');
	return 0;
}
