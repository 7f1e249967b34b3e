/* Hostile NIfTI: the reader must refuse or give a sound volume, and leave nothing behind.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"

#include "../nifti-make.h"

#include <zlib.h>

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	volume_look(data, size, "fuzz", &ct_format_nifti);
	return 0;
}

/* Both versions and orders, with extensions; then one of them compressed. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const int n[3] = {4, 3, 2}, type[4] = {4, 16, 64, 768};
	static const size_t bytes[4] = {2, 4, 8, 4};
	const size_t t = k % 4;
	struct made m;
	z_stream z = {0};

	if (k > 4)
		return 0;
	make(&m, 1 + (int)(k & 1), k & 2, type[t], bytes[t], n, 64);
	put_ext(&m, m.version == 1 ? 352 : 544, 32, 6, "{\"ct:window\":\"-1:2\"}");
	put_ext(&m, m.version == 1 ? 384 : 576, 32, 4, "<a/>");
	put_slope(&m, 2, -1024);
	put_codes(&m, 1, (int)(k & 1));
	put_srow(&m, (const double[12]){-1, 0, 0, 4, 0, 2, 0, 5, 0, 0, -3, 6});
	*data = m.p;
	if (k < 4)
		return m.n;
	*data = malloc(4096);
	if (!*data || deflateInit2(&z, 6, Z_DEFLATED, 31, 8, 0) != Z_OK)
		exit(99);
	z.next_in = m.p;
	z.avail_in = (uInt)m.n;
	z.next_out = *data;
	z.avail_out = 4096;
	deflate(&z, Z_FINISH);
	deflateEnd(&z);
	free(m.p);
	return z.total_out;
}
