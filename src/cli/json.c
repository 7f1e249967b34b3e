/* json.c: see json.h. SPDX-License-Identifier: Apache-2.0 */
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

int ct_json_report(json_t *o, bool json, struct ct_err *e)
{
	const int rc = json || !o ? ct_json_print(o, 12, e) : 0;
	const char *name;
	json_t *v;

	if (!json)
		json_object_foreach (o, name, v) {
			if (json_is_integer(v))
				printf("%s %lld\n", name, (long long)json_integer_value(v));
			else if (json_is_real(v))
				printf("%s %.6g\n", name, json_real_value(v));
			else
				printf("%s %s\n", name, json_string_value(v));
		}
	json_decref(o);
	return rc;
}
