/* Hostile MetaImage and NRRD: the reader must refuse or give a sound volume, and leave nothing
 * behind. */
#include "config.h"
#include "driver.h"
#include "formats/headed.h"

#include "../headed-make.h"

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_vol v = {0};
	struct ct_err e = {0};
	float sum = 0;
	FILE *f;

	if (size == 0)
		return 0;
	f = fmemopen((void *)(uintptr_t)data, size, "rb");
	if (!f)
		return 0;
	if (ct_headed_read_stream(f, "/nonexistent/fuzz", &v, &e) == 0)
		for (size_t i = 0, n = ct_vol_count(&v); i < n; i++)
			sum += v.data[i];
	else if (v.data || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	fclose(f);
	ct_vol_free(&v);
	return 0;
}

/* Both formats, a few types, either order, packed or not. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	if (k >= 8)
		return 0;
	*data = malloc(2000);
	if (!*data)
		exit(99);
	return headed_file(*data, 2000, k & 1, 2 + k, k & 2, k & 4 ? 31 - 16 * (int)(k & 1) : 0);
}
