/* Hostile sidecars: refused with a field, or what is expected of the scanner is sound.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/beside.h"
#include "estimate/scanner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const int fuzz_rounds = 3000;

static void use(const struct ct_meta *m)
{
	struct ct_profile p[3];
	struct ct_acquired a;
	struct ct_err e = {0};

	if (ct_acquired_get(&a, m, &e))
		abort();
	for (int k = 1; k <= 3; k++) {
		ct_scanner_expect(p, &a, (const double[3]){0.5 * k, 0.5 * k, k});
		for (int axis = 0; axis < 3; axis++)
			if (!isnan(p[axis].spread) &&
				!(isfinite(p[axis].spread) && p[axis].spread > 0 &&
					p[axis].deviation > 0 && p[axis].deviation < 1))
				abort();
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_meta m = {0};
	struct ct_err e = {0};
	const int rc = ct_beside_parse(&m, size % 3, (const char *)data, size, &e);

	if (rc < 0 ? e.code == CT_OK || e.msg[0] == '\0' : (m.n > 0) != (rc == 0))
		abort();
	if (rc == 0)
		use(&m);
	fuzz_taken += rc == 0;
	ct_meta_free(&m);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const text[] = {
		"{\"Modality\": \"CT\", \"Manufacturer\": \"Philips\", \"SliceThickness\": 2,\n"
		"\"SpacingBetweenSlices\": 2, \"ConvolutionKernel\": \"UB\"}",
		"{\"SliceThickness\": 1.5e0, \"SingleCollimationWidth\": 0.6, \"PixelSpacing\": [1, "
		"0.5], \"ConvolutionKernel\": [\"Br40f\", \"3\"], \"SourceSlices\": [{\"Planes\": "
		"[0]}]}"};

	if (k > 1)
		return 0;
	*data = (unsigned char *)strdup(text[k]);
	if (!*data)
		exit(99);
	return strlen(text[k]);
}
