/* module.h: what needs the DICOM library, as a module that is loaded when DICOM is met.
 *
 * The library takes 50 shared objects and 30 ms to start. A command calls dicom.h,
 * which loads ctsr-dicom.so: from the folder of the program (a build folder), or from where it is
 * installed.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DICOM_MODULE_H
#define CT_DICOM_MODULE_H
#include "dicom/dicom.h"

/* What the functions of dicom.h do, within the module; `in` is of dicom_from. */
int series_read(
	struct ct_vol *v, const struct ct_dicom_in *in, const struct ct_env *env, struct ct_err *e);
__typeof__(ct_dicom_write) dicom_write;
int dicom_may_write(
	const char *path, const struct ct_vol *v, const size_t n[static 3], struct ct_err *e);
__typeof__(ct_dicom_inspect) inspect_print;
__typeof__(ct_dicom_radiograph) radiograph_read;

/* What a program says once for all its copies of core: see core/inflate.h, core/simd.h,
 * formats/temp.h. */
struct ct_temp_kept;
struct dicom_module {
	/* simd: CTSR_CPU, or NULL */
	int (*begin)(
		unsigned expand, const char *simd, struct ct_temp_kept *temp, struct ct_err *e);
	__typeof__(series_read) *read;
	__typeof__(dicom_write) *write;
	__typeof__(dicom_may_write) *may_write;
	__typeof__(inspect_print) *inspect;
	__typeof__(radiograph_read) *radiograph;
};
#define DICOM_MODULE "ctsr-dicom.so"
#define DICOM_MODULE_SYMBOL "ctsr_dicom_module"

#endif
