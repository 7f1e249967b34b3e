/* err.c: see err.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/err.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

int ct_fail(struct ct_err *e, enum ct_code code, const char *fmt, ...)
{
	va_list ap;

	e->code = code;
	va_start(ap, fmt);
	vsnprintf(e->msg, sizeof e->msg, fmt, ap);
	va_end(ap);
	for (char *p = e->msg; *p; p++) /* names come from files: nothing that steers a terminal */
		if ((unsigned char)*p < ' ' || *p == 127)
			*p = '?';
	return -1;
}

int ct_fail_errno(struct ct_err *e, enum ct_code code, const char *what)
{
	const int why = errno;

	return ct_fail(e, why == ENOMEM ? CT_ENOMEM : code, "%s: %s", what, strerror(why));
}

int ct_err_first(struct ct_err *e, size_t n, const struct ct_err *of, size_t step)
{
	for (; n > 0 && of->code == CT_OK; n--)
		of = (const void *)((const char *)of + step);
	return n > 0 ? (*e = *of, -1) : 0;
}

int ct_blame(struct ct_err *e, const char *what)
{
	enum { ROOM = 200 };
	const size_t n = strlen(what);
	const char *end = n > ROOM ? what + n - ROOM + 3 : what; /* a file's name is there */
	char old[sizeof e->msg];

	memcpy(old, e->msg, sizeof old);
	old[sizeof old - 1] = '\0';
	snprintf(e->msg, sizeof e->msg, "%s%s: %.290s", n > ROOM ? "..." : "", end, old);
	return -1;
}
