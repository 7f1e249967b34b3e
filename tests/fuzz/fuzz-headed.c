/* Hostile MetaImage and NRRD: the reader must refuse or give a sound volume, and leave nothing
 * behind. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"

#include "../headed-make.h"

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	volume_look(data, size, "/nonexistent/fuzz", &ct_format_nrrd);
	return 0;
}

/* Two dimensions, and what is single beside three. */
static const char *const others[] = {
	"NDims = 2\nDimSize = 3 2\nElementSpacing = 1 2\nTransformMatrix = 1 0 0 1\n"
	"ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdef",
	"NDims = 4\nDimSize = 3 2 1 1\nElementSpacing = 1 1 1 1\nElementType = MET_UCHAR\n"
	"ElementDataFile = LOCAL\nabcdef",
	"NRRD0004\ndimension: 2\ntype: uchar\nsizes: 3 2\nencoding: raw\n"
	"space directions: (1,0) (0,2)\n\nabcdef",
	"NRRD0004\ndimension: 4\ntype: uchar\nsizes: 1 3 2 1\nencoding: raw\nspace: LPS\n"
	"kinds: list domain domain domain\nunits: \"s\" \"mm\" \"mm\" \"mm\"\n"
	"space directions: none (1,0,0) (0,2,0) (0,0,3)\n\nabcdef"};

/* Both formats, a few types, either order, packed or not; and other dimensions. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	if (k >= 8 && k - 8 < sizeof others / sizeof *others) {
		*data = (unsigned char *)strdup(others[k - 8]);
		if (!*data)
			exit(99);
		return strlen(others[k - 8]);
	}
	if (k >= 8)
		return 0;
	*data = malloc(2000);
	if (!*data)
		exit(99);
	return headed_file(*data, 2000, k & 1, 2 + k, k & 2, k & 4 ? 31 - 16 * (int)(k & 1) : 0);
}
