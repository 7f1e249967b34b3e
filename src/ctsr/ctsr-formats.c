/* ctsr-formats.c: all formats of volumes. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr.h"
#include "formats/any.h"

const ctsr_format *const *ctsr_formats_all(void)
{
	static const struct ct_format *const all[] = {
		&ct_format_nifti, &ct_format_nrrd, &ct_format_metaimage, NULL};

	return (const ctsr_format *const *)all;
}
