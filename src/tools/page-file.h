/* page-file.h: the page of ct-report as a file. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_PAGE_FILE_H
#define CT_TOOLS_PAGE_FILE_H
#include "report/page.h"

/* Write what was measured (ct_page_measure) to `path`, laid out by the installed report.html. */
int page_file_write(
	const char *path, const struct ct_page *p, const struct ct_env *env, struct ct_err *e);

#endif
