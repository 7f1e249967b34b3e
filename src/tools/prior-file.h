/* prior-file.h: where the shipped prior lies. */
#ifndef CT_TOOLS_PRIOR_FILE_H
#define CT_TOOLS_PRIOR_FILE_H
#include "core/err.h"
#include "restore/restore.h"

/* Of pictures and of what projections lack, for ct-ddnm, and of slices. */
#define PRIOR_PICTURES "prior.safetensors"
#define PRIOR_RESIDUAL "residual.safetensors"
#define PRIOR_SLICES "slices.safetensors"

/* Path of the prior in use, to be freed: `given`, or if NULL the first file of that name beside
 * the running program (a build folder), ../share/ctsr/ from there, and the folder of the
 * installation. CT_EINPUT if there is none. */
int prior_file_find(char **path, const char *given, const char *name, struct ct_err *e);
/* The slice prior of `given`, or the installed one, and its metadata. Codes of the readers. */
int prior_file_read(
	struct ct_slice_prior *prior, struct ct_meta *meta, const char *given, struct ct_err *e);

#endif
