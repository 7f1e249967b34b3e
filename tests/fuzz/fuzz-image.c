/* Hostile pictures: refused, or numbers, of which those beyond [0, 1] are told. OpenImageIO
 * decodes. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/png.h"
#include "fuzz-file.h"
#include "shim/image-read.h"
#include "shim/picture-file.h"

#include <stdbool.h>

const int fuzz_rounds = 0;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_err e = {0};
	float *gray = NULL;
	size_t w = 0, h = 0;
	double most = 0;

	if (picture_file_read(mem_file(data, size, 0), &w, &h, &most, &gray, &e) == 0) {
		bool inside = true;

		for (size_t i = 0; i < w * h; i++)
			inside &= gray[i] >= 0 && gray[i] <= 1;
		if (inside != (ct_image_read_check("x", w, h, gray, &e) == 0))
			abort();
	} else if (gray || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += gray != NULL;
	free(gray);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	unsigned char px[48];
	struct ct_err e = {0};
	size_t n;

	if (k > 1)
		return 0;
	for (size_t i = 0; i < sizeof px; i++)
		px[i] = (unsigned char)(i * 5);
	if (ct_png_encode(data, &n, 4, 4, k ? 3 : 1, px, &e))
		exit(99);
	return n;
}
