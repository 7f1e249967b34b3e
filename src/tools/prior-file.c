/* prior-file.c: see prior-file.h. */
#include "config.h"
#include "formats/format.h"
#include "tools/lib/installed.h"
#include "tools/prior-file.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int prior_file_find(char **path, const char *given, const char *name, struct ct_err *e)
{
	int rc;

	if (given) {
		*path = strdup(given);
		return *path ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	rc = ct_installed_find(path, name, "/../share/ctsr", CT_DATADIR, R_OK, e);
	if (rc <= 0)
		return rc;
	ct_fail(e, CT_EINPUT, "no prior is installed at %s; --prior names one", *path);
	free(*path);
	*path = NULL;
	return -1;
}

int prior_file_read(
	struct ct_slice_prior *prior, struct ct_meta *meta, const char *given, struct ct_err *e)
{
	struct ct_tensors w = {0};
	char *path;
	int rc = -1;

	if (prior_file_find(&path, given, PRIOR_SLICES, e))
		return -1;
	if (ct_tensors_read(path, &w, e) == 0) {
		rc = ct_slice_prior_alloc(prior, &w, e) ? ct_blame(e, path) : 0;
		*meta = w.meta;
		w.meta = (struct ct_meta){0};
	}
	ct_tensors_free(&w);
	free(path);
	return rc;
}
