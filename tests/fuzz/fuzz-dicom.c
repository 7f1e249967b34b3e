/* Hostile DICOM, compressed too: refused, or a picture. vtk-dicom parses and decodes.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "fuzz-file.h"
#include "series/series.h"
#include "shim/dicom-file.h"

const int fuzz_rounds = 0;

enum { MOST = 1 << 18 }; /* pixels that are worth the time */

static void decode(const struct ct_slice *s)
{
	struct ct_err e = {0};
	float *out, sum = 0;
	size_t n;

	if (s->rows == 0 || s->columns == 0 || s->rows > MOST / s->columns)
		return;
	n = s->rows * s->columns;
	out = malloc(n * sizeof *out);
	if (!out)
		return;
	if (ct_dicom_pixels(s, out, &e) == 0)
		for (size_t i = 0; i < n; i++)
			sum += out[i];
	else if (e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f);
	free(out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const char *path = mem_file(data, size, 0);
	struct ct_census c = {0};
	struct ct_series *list = NULL;
	struct ct_err e = {0};
	size_t n = 0, pictures = 0;

	if (ct_dicom_scan(&path, 1, true, &c, &e))
		abort();
	for (size_t k = 0; k < c.files; k++)
		pictures += c.file[k].state == CT_FILE_PICTURE;
	if (c.files == 0 || (c.slices > 0) != (pictures > 0))
		abort();
	if (ct_series_list(c.slice, c.slices, NULL, &list, &n, &e) || (n > 0) != (c.slices > 0))
		abort();
	for (size_t k = 0; k < n; k++)
		decode(&c.slice[list[k].first]);
	free(list);
	ct_census_free(&c);
	return 0;
}

/* The corpus has them: tests/fuzz/make-dicom.py. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	(void)k;
	(void)data;
	return 0;
}
