/* convert-out.c: what ct-convert writes. */
#include "config.h"
#include "cli/files.h"
#include "formats/nifti.h"
#include "series/layout.h"
#include "tools/convert.h"

#include <string.h>
#include <sys/stat.h>

/* A name that promises another format is a mistake. */
int convert_check_name(const char *path, struct ct_err *e)
{
	const size_t n = strlen(path);
	struct stat st;

	if (strcmp(path, "-") == 0 || ct_files_is_dicom(path) ||
		(n > 4 && strcmp(path + n - 4, ".nii") == 0) ||
		(n > 7 && strcmp(path + n - 7, ".nii.gz") == 0) ||
		(stat(path, &st) == 0 && !S_ISREG(st.st_mode)))
		return 0;
	return ct_fail(e, CT_EUSAGE, "%s: the name of OUT must end in .nii or .nii.gz", path);
}

int convert_write(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	if (ct_files_is_dicom(p->out))
		return convert_dicom(p, v, env, e);
	return ct_nifti_write(
		p->out, v, (enum ct_nifti_type)p->type, p->tilt == CT_TILT_SHEAR, env, e);
}
