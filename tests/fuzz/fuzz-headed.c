/* Hostile MetaImage and NRRD: the reader must refuse or give a sound volume, and leave nothing
 * behind. */
#include "config.h"
#include "formats/headed.h"
#include "volume.h"

#include "../headed-make.h"

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	volume_look(data, size, "/nonexistent/fuzz", ct_headed_read_stream);
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
