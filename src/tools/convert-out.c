/* convert-out.c: what ct-convert writes. */
#include "config.h"
#include "formats/nifti.h"
#include "series/layout.h"
#include "tools/convert.h"

int convert_write(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return ct_nifti_write(
		p->out, v, (enum ct_nifti_type)p->type, p->tilt == CT_TILT_SHEAR, env, e);
}
