/* Hostile safetensors: the reader must refuse or give sound tensors, and leave nothing behind.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/format.h"
#include "fuzz-file.h"

#include <stdlib.h>
#include <string.h>

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	weights_look(data, size, &ct_format_safetensors);
	return 0;
}

/* Ours in both precisions, then other types. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char header[] =
		"{\"a\":{\"dtype\":\"F64\",\"shape\":[2],\"data_offsets\":[8,24]},"
		"\"b\":{\"dtype\":\"BF16\",\"shape\":[2,2],\"data_offsets\":[0,8]},"
		"\"c\":{\"dtype\":\"BOOL\",\"shape\":[],\"data_offsets\":[24,25]}}";
	const uint64_t length = sizeof header - 1;
	struct ct_tensors w = {0};
	struct ct_tensor *t;
	struct ct_err e = {0};
	size_t n;

	if (k > 2)
		return 0;
	if (k == 2) {
		*data = calloc(1, 8 + length + 25);
		if (!*data)
			exit(99);
		memcpy(*data, &length, 8);
		memcpy(*data + 8, header, length);
		return 8 + length + 25;
	}
	for (size_t i = 0; i < 3; i++) {
		if (ct_tensors_add(&w, i ? i > 1 ? "w" : "x" : "yy", i, (size_t[]){3, 2}, &t, &e))
			exit(99);
		for (size_t c = 0; c < ct_tensor_count(t); c++)
			t->data[c] = (float)c;
	}
	ct_meta_set(&w.meta, "arch", "unet", &e);
	n = seed_file(data, ct_tensors_write(seed_path(), &w, k == 1, &seed_env, &e));
	ct_tensors_free(&w);
	return n;
}
