/* installed.h: where files lie that are installed with the program or the library.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_INSTALLED_H
#define CT_CORE_INSTALLED_H
#include "core/err.h"

/* Path of a file, to be freed: the first of that name beside the running program, or beside the
 * shared library that this is a part of (a build folder), at `place` from there, "/../share/ctsr",
 * and in `folder`, where `how` (of access) is allowed. 1 if there is none, *path then the last of
 * these. CT_ENOMEM. */
int ct_installed_find(char **path, const char *name, const char *place, const char *folder, int how,
	struct ct_err *e);
/* Path of a network, to be freed: `given`, or if that is NULL what is installed by that name.
 * CT_EINPUT if there is none. */
int ct_installed_prior(char **path, const char *given, const char *name, struct ct_err *e);

#endif
