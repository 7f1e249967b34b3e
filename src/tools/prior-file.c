/* prior-file.c: see prior-file.h. */
#include "config.h"
#include "tools/prior-file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int prior_file_find(char **path, const char *given, const char *name, struct ct_err *e)
{
	static const char *const places[] = {"", "/../share/ctsr"};
	char self[4000];
	ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
	char *slash;

	*path = NULL;
	if (given) {
		*path = strdup(given);
		return *path ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	self[n > 0 ? n : 0] = '\0';
	slash = strrchr(self, '/');
	if (slash)
		*slash = '\0';
	for (size_t k = 0; slash && k < sizeof places / sizeof *places; k++) {
		if (asprintf(path, "%s%s/%s", self, places[k], name) < 0) {
			*path = NULL;
			return ct_fail(e, CT_ENOMEM, "no memory for a file name");
		}
		if (access(*path, R_OK) == 0)
			return 0;
		free(*path);
		*path = NULL;
	}
	if (asprintf(path, "%s/%s", CT_DATADIR, name) < 0) {
		*path = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	if (access(*path, R_OK) == 0)
		return 0;
	ct_fail(e, CT_EINPUT, "no prior is installed at %s; --prior names one", *path);
	free(*path);
	*path = NULL;
	return -1;
}
