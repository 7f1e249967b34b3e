/* Hostile scanner files: refused, or a scan whose views can be made.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "core/mem.h"
#include "fuzz-file.h"
#include "tools/lib/geometry-json.h"

#include <stdbool.h>

const int fuzz_rounds = 1500;

/* A scan that a file may ask for, but no fuzzer should wait for. */
static bool is_small(const struct ct_geometry *s)
{
	return (double)s->views * (double)s->w * (double)s->h < 1e5;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const struct ct_vol grid = {
		.n = {8, 8, 8}, .affine = {{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 0}}};
	const char *path = mem_file(data, size, 0);

	for (int with = 0; with < 2; with++) {
		struct ct_stack out = {0};
		struct ct_vol named = {0};
		struct ct_err e = {0};
		struct ct_geometry s;

		ct_geometry_default(&s, CT_CONE, &grid);
		if (ct_geometry_json_read(&s, path, with ? &grid : NULL, &named, &e)) {
			if (e.code == CT_OK || e.msg[0] == '\0')
				abort();
			continue;
		}
		if (is_small(&s) && ct_geometry_fill(&out, &s, &e) == 0 && ct_stack_check(&out, &e))
			abort();
		fuzz_taken++;
		ct_stack_free(&out);
	}
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const text[] = {
		"{\"mode\":\"cone\",\"DSO\":7.0,\"DSD\":10,\"nDetector\":[16,8],\"sDetector\":[4,4.0],"
		"\"nVoxel\":[8,8,8],\"sVoxel\":[2,2,2],\"offOrigin\":[0.1,0,0],\"offDetector\":[0,1],"
		"\"totalAngle\":360,\"startAngle\":-5,\"numTrain\":6}",
		"{\"scanner\":{\"mode\":\"parallel\",\"DSO\":500,\"DSD\":1e3,\"nDetector\":9,"
		"\"dDetector\":1.5,\"dVoxel\":1,\"nVoxel\":8}}"};

	if (k > 1)
		return 0;
	*data = (unsigned char *)strdup(text[k]);
	if (!*data)
		exit(99);
	return strlen(text[k]);
}
