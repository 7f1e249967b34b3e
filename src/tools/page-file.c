/* page-file.c: see page-file.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"
#include "formats/io.h"
#include "tools/page-file.h"

#include <stdlib.h>
#include <unistd.h>

#define FORM "report.html"

int page_file_write(
	const char *path, const struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out o = {0};
	unsigned char *form = NULL;
	char *at;
	size_t n;
	int rc = ct_installed_find(&at, FORM, "/../share/ctsr", CT_DATADIR, R_OK, e);

	if (rc < 0)
		return -1;
	rc = rc > 0 ? ct_fail(e, CT_EINPUT, "%s: is not there: the page is laid out by it", at)
		    : ct_slurp(at, &form, &n, e);
	free(at);
	if (rc == 0)
		rc = ct_err_any(ct_out_open(&o, path, env, e) ||
				ct_page_write(o.f, (const char *)form, p, env, e) ||
				ct_out_commit(&o, e));
	ct_out_abandon(&o);
	free(form);
	return rc;
}
