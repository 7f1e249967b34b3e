/* json.c: see json.h. */
#include "config.h"
#include "cli/json.h"

#include <errno.h>
#include <stdio.h>

int ct_json_print(const json_t *o, unsigned digits, struct ct_err *e)
{
	int rc;

	errno = 0;
	rc = o ? json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(digits)) : -1;
	if ((rc && !ferror(stdout)) || errno == ENOMEM)
		return ct_fail(e, CT_ENOMEM, "no memory for JSON");
	putchar('\n');
	return 0;
}
