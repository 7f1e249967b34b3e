/* ctsr-metaimage.c: a file of its own, so that a static link holds this format only if it is named.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "ctsr/ctsr.h"
#include "formats/any.h"

const ctsr_format *ctsr_metaimage(void)
{
	return (const ctsr_format *)&ct_format_metaimage;
}
