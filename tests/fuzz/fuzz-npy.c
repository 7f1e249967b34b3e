/* Hostile numpy arrays: the reader must refuse or give all numbers, and leave nothing behind.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/raw.h"
#include "fuzz-file.h"

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_err e = {0};
	float *x = NULL, sum = 0;
	size_t n[3];

	if (ct_raw_npy(mem_file(data, size, 0), 2, -1, n, &x, &e) == 0)
		for (size_t i = 0; i < n[0] * n[1] * n[2]; i++)
			sum += x[i];
	else if (x || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	free(x);
	return 0;
}

/* Each version of the format, two and three dimensions, both byte orders. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const header[] = {
		"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }\n",
		"{'descr': '>i2', 'fortran_order': False, 'shape': (3, 5), }\n",
		"{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2, 4), }\n"};
	static const size_t bytes[] = {96, 30, 8};
	size_t n, lead = k ? 12 : 10;

	if (k > 2)
		return 0;
	n = strlen(header[k]);
	*data = calloc(1, lead + n + bytes[k]);
	if (!*data)
		exit(99);
	memcpy(*data, "\x93NUMPY", 6);
	(*data)[6] = (unsigned char)(1 + k);
	(*data)[8] = (unsigned char)n;
	memcpy(*data + lead, header[k], n);
	for (size_t i = 0; i < bytes[k]; i++)
		(*data)[lead + n + i] = (unsigned char)(i * 5);
	return lead + n + bytes[k];
}
