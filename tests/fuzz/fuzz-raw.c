/* Raw voxels: a line "WIDTHxHEIGHTxDEPTH:TYPE AXES" as the command line has it, then the file.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/raw.h"
#include "fuzz-file.h"

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const uint8_t *line = memchr(data, '\n', size);
	struct ct_raw how = {.spacing = {1, 2, 3}, .slope = 2, .inter = -1};
	struct ct_vol v = {0};
	struct ct_err e = {0};
	char type[16], axes[16], text[80] = "";
	float sum = 0;

	if (!line || line - data >= (ptrdiff_t)sizeof text)
		return 0;
	memcpy(text, data, (size_t)(line - data));
	if (sscanf(text, "%5zux%5zux%5zu:%15s %15s", &how.n[0], &how.n[1], &how.n[2], type, axes) !=
			5 ||
		ct_raw_type(type, &how.type, &how.big, &e) ||
		ct_raw_axes("--orient", axes, how.world, how.sign, &e))
		return 0;
	size -= (size_t)(line - data) + 1;
	if (ct_raw_read(mem_file(line + 1, size, 0), &how, &v, &e) == 0)
		for (size_t i = 0, n = ct_vol_count(&v); i < n; i++)
			sum += v.data[i];
	else if (v.data || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	ct_vol_free(&v);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const line[] = {
		"2x3x4:i16:be LPS\n", "4x3x2:f64 RAS\n", "3x3x1:u8 ASR\n"};
	static const size_t bytes[] = {48, 192, 9};
	size_t n;

	if (k > 2)
		return 0;
	n = strlen(line[k]);
	*data = calloc(1, n + bytes[k]);
	if (!*data)
		exit(99);
	memcpy(*data, line[k], n);
	return n + bytes[k];
}
