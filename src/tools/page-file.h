/* page-file.h: the page of ct-report as a file, and the log that is shown on it. */
#ifndef CT_TOOLS_PAGE_FILE_H
#define CT_TOOLS_PAGE_FILE_H
#include "report/page.h"

/* Write what was measured (ct_page_measure) to `path`, laid out by the installed report.html. */
int page_file_write(
	const char *path, const struct ct_page *p, const struct ct_env *env, struct ct_err *e);
/* A text file, ended by a zero, owned by the caller. */
int page_file_text(char **to, const char *path, struct ct_err *e);
/* The warnings of this run. */
struct page_log {
	const struct ct_env *env;
	FILE *f;
	char *text;
	size_t n;
	const char *hide; /* a name that the log calls IN; or NULL */
};
/* *own <- env, whose warnings are noted as well. The log must stay where it is. */
int page_log_open(
	struct page_log *l, struct ct_env *own, const struct ct_env *env, struct ct_err *e);
/* Notes what the run took. */
void page_log_took(struct page_log *l, const struct ct_env *env, double seconds);
/* All of it, borrowed. */
const char *page_log_text(struct page_log *l);
void page_log_close(struct page_log *l);

#endif
