/* installed.c: see installed.h. */
#include "config.h"
#include "core/installed.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int ct_installed_find(char **path, const char *name, const char *place, const char *folder, int how,
	struct ct_err *e)
{
	char self[4000];
	const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
	char *slash;

	self[n > 0 ? n : 0] = '\0';
	slash = strrchr(self, '/');
	if (slash)
		*slash = '\0';
	for (int k = slash ? 0 : 2; k < 3; k++) {
		if (asprintf(path, "%s%s/%s", k < 2 ? self : "",
			    k == 0   ? ""
			    : k == 1 ? place
				     : folder,
			    name) < 0) {
			*path = NULL;
			return ct_fail(e, CT_ENOMEM, "no memory for a file name");
		}
		if (access(*path, how) == 0)
			return 0;
		if (k < 2)
			free(*path);
	}
	return 1;
}
