/* module.c: the module itself; see module.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "dicom/module.h"
#include "core/inflate.h"
#include "core/simd.h"
#include "formats/temp.h"

static int begin(unsigned expand, const char *simd, struct ct_temp_kept *temp, struct ct_err *e)
{
	ct_inflate_allow(expand);
	ct_temp_share(temp);
	return ct_simd_use(simd, e);
}

extern const struct dicom_module ctsr_dicom_module;
__attribute__((visibility("default"))) const struct dicom_module ctsr_dicom_module = {
	begin, series_read, dicom_write, dicom_may_write, inspect_print, radiograph_read};
