/* prior-file.c: see prior-file.h. */
#include "config.h"
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
