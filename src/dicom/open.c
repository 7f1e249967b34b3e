/* open.c: the module is loaded; see module.h. */
#include "config.h"
#include "core/inflate.h"
#include "dicom/module.h"
#include "formats/temp.h"
#include "tools/lib/installed.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#ifdef HAVE_VTK
/* Some of the libraries do not look whether there is memory: there has to be. */
static int check_memory(struct ct_err *e)
{
	const size_t need = (size_t)64 << 20;
	void *const p =
		mmap(NULL, need, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);

	if (p == MAP_FAILED)
		return ct_fail(e, CT_ENOMEM, "the DICOM libraries need 64 MiB to begin with");
	munmap(p, need);
	return 0;
}

const struct dicom_module *dicom_module(struct ct_err *e)
{
	const struct dicom_begin how = {ct_inflate_allowed(), getenv("CTSR_CPU"), ct_temp_table()};
	const struct dicom_module *m = NULL;
	void *handle = NULL;
	char *path;
	int rc;

	if (check_memory(e))
		return NULL;
	rc = ct_installed_find(&path, DICOM_MODULE, "/../libexec/ctsr", CT_LIBEXECDIR, R_OK, e);
	if (rc < 0)
		return NULL;
	if (rc == 0)
		handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (handle)
		m = dlsym(handle, DICOM_MODULE_SYMBOL);
	if (!m)
		ct_fail(e, CT_EINPUT, "%s: %s; it reads and writes DICOM", path,
			rc > 0 ? "is not installed" : dlerror());
	free(path);
	return m && m->begin(&how, e) == 0 ? m
					   : NULL; /* the handle stays, as long as the program */
}
#else
const struct dicom_module *dicom_module(struct ct_err *e)
{
	ct_fail(e, CT_EINPUT, "this build has no DICOM (configure --with-vtk)");
	return NULL;
}
#endif
