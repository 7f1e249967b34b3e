/* write.h: a volume as DICOM, within the module; see dicom.h. */
#ifndef CT_DICOM_WRITE_H
#define CT_DICOM_WRITE_H
#include "dicom/dicom.h"

int dicom_write(const char *path, const struct ct_vol *v, const struct ct_dicom_out *out,
	const struct ct_env *env, struct ct_err *e);

#endif
