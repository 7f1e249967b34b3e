/* open.c: the module is loaded; see module.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "core/installed.h"
#include "core/mem.h"
#include "dicom/form.h"
#include "dicom/module.h"
#include "formats/temp.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct dicom_module *module(struct ct_err *e)
{
	const struct dicom_module *m = NULL;
	void *handle = NULL;
	char *path;
	int rc;

	/* some of the libraries do not look whether there is memory */
	if (ct_mem_room((size_t)64 << 20, e)) {
		ct_blame(e, "DICOM libraries");
		return NULL;
	}
	rc = ct_installed_find(&path, DICOM_MODULE, "/../libexec/ctsr", CT_LIBEXECDIR, R_OK, e);
	if (rc < 0)
		return NULL;
	if (rc == 0)
		handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (handle)
		m = dlsym(handle, DICOM_MODULE_SYMBOL);
	if (!m && rc > 0)
		ct_fail(e, CT_EFAIL,
			"DICOM needs %s, which is not installed: install the package ctsr-dicom, "
			"or configure --with-vtk",
			path);
	else if (!m) {
		const char *why = dlerror();

		why = why ? why : "is no module of ours";
		ct_fail(e,
			strstr(why, "failed to map") || strstr(why, "annot allocate") ? CT_ENOMEM
										      : CT_EINPUT,
			"%s: %s; it reads and writes DICOM", path, why);
	}
	free(path);
	if (m && m->begin(ct_inflate_allowed(), getenv("CTSR_CPU"), ct_temp_table(), e))
		return NULL;
	return m; /* the handle stays, as long as the program */
}

int ct_dicom_read(
	struct ct_vol *v, const struct ct_dicom_in *in, const struct ct_env *env, struct ct_err *e)
{
	const struct dicom_module *m = module(e);
	struct dicom_from from;
	int rc;

	if (!m)
		return ct_blame(e, in->paths[0]);
	if (dicom_from(&from, in, e))
		return -1;
	rc = m->read(v, &from.in, env, e);
	dicom_from_free(&from);
	return rc;
}

int ct_dicom_write(const char *path, const struct ct_vol *v, const struct ct_dicom_out *out,
	const struct ct_env *env, struct ct_err *e)
{
	const struct dicom_module *m = module(e);

	return m ? m->write(path, v, out, env, e) : ct_blame(e, path);
}

int ct_dicom_may_write(
	const char *path, const struct ct_vol *v, const size_t n[static 3], struct ct_err *e)
{
	const struct dicom_module *m = module(e);

	if (!m)
		return ct_blame(e, path);
	return ct_err_any(
		ct_vol_check_grid(v, e) ? ct_blame(e, path) : m->may_write(path, v, n, e));
}

int ct_dicom_inspect(
	const struct ct_dicom_in *in, json_t *into, const struct ct_env *env, struct ct_err *e)
{
	const struct dicom_module *m = module(e);
	struct dicom_from from;
	int rc;

	if (!m)
		return ct_blame(e, in->paths[0]);
	if (dicom_from(&from, in, e))
		return -1;
	rc = m->inspect(&from.in, into, env, e);
	if (rc && from.folder)
		ct_blame(e, in->paths[0]);
	dicom_from_free(&from);
	return rc;
}

int ct_dicom_radiograph(struct ct_vol *v, double mm[2], const char *path, struct ct_err *e)
{
	const struct dicom_module *m = module(e);

	return m ? m->radiograph(v, mm, path, e) : ct_blame(e, path);
}
