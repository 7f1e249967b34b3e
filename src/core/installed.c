/* installed.c: see installed.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"

#include <dlfcn.h>
#include <limits.h>
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Path of the running program, or of the shared library or module that this is a part of. */
static void find_self(char self[PATH_MAX])
{
	static const char here;
	struct link_map *map = NULL;
	Dl_info info;
	ssize_t n;

	self[0] = '\0';
	if (dladdr1(&here, &info, (void **)&map, RTLD_DL_LINKMAP) && map && map->l_name[0]) {
		if (!realpath(map->l_name, self))
			self[0] = '\0';
		return;
	}
	n = readlink("/proc/self/exe", self, PATH_MAX - 1);
	self[n > 0 ? n : 0] = '\0';
}

int ct_installed_find(char **path, const char *name, const char *place, const char *folder, int how,
	struct ct_err *e)
{
	char self[PATH_MAX], *slash;

	find_self(self);
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

int ct_installed_prior(char **path, const char *given, const char *name, struct ct_err *e)
{
	int rc;

	if (given) {
		*path = strdup(given);
		return *path ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	rc = ct_installed_find(path, name, "/../share/ctsr", CT_DATADIR, R_OK, e);
	if (rc <= 0)
		return rc;
	ct_fail(e, CT_EINPUT,
		"no prior is installed at %s: install the package ctsr-data, or name one: --prior, "
		"prior_file",
		*path);
	free(*path);
	*path = NULL;
	return -1;
}
