/* page-file.c: see page-file.h. */
#include "config.h"
#include "tools/page-file.h"
#include "formats/io.h"
#include "tools/lib/installed.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FORM "report.html"

int page_file_text(char **to, const char *path, struct ct_err *e)
{
	unsigned char *data;
	size_t n;

	if (ct_slurp(path, &data, &n, e))
		return -1;
	*to = strndup((const char *)data, n);
	free(data);
	return *to ? 0 : ct_fail(e, CT_ENOMEM, "no memory");
}

static int read_form(char **to, struct ct_err *e)
{
	char *path;
	const int rc = ct_installed_find(&path, FORM, "/../share/ctsr", CT_DATADIR, R_OK, e);
	int done = -1;

	if (rc < 0)
		return -1;
	done = rc > 0 ? ct_fail(e, CT_EINPUT, "%s: is not there: the page is laid out by it", path)
		      : page_file_text(to, path, e);
	free(path);
	return done;
}

int page_file_write(
	const char *path, const struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out o = {0};
	char *form;
	int rc = -1;

	if (read_form(&form, e))
		return -1;
	if (ct_out_open(&o, path, env, e) == 0 && ct_page_write(o.f, form, p, env, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(form);
	return rc;
}
