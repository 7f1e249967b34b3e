/* module.c: the module itself; see module.h. */
#include "config.h"
#include "dicom/module.h"
#include "core/inflate.h"
#include "core/simd.h"
#include "formats/temp.h"

static int begin(const struct dicom_begin *b, struct ct_err *e)
{
	ct_inflate_allow(b->expand);
	ct_temp_share(b->temp);
	return ct_simd_use(b->simd, e);
}

extern const struct dicom_module ctsr_dicom_module;
__attribute__((visibility("default"))) const struct dicom_module ctsr_dicom_module = {
	begin, series_read, dicom_write, inspect_print, radiograph_read};
