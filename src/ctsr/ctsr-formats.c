/* ctsr-formats.c: all formats of volumes. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr.h"
#include "formats/any.h"

const ctsr_format *const *ctsr_formats_all(void)
{
	return (const ctsr_format *const *)ct_format_volumes;
}
