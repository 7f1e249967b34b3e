/* Hostile DICOM, compressed too: refused, or a picture. vtk-dicom parses and decodes. */
#include "config.h"
#include "driver.h"
#include "mem-file.h"
#include "shim/dicom.h"

const int fuzz_rounds = 0;

enum { MOST = 1 << 18 }; /* pixels that are worth the time */

static void decode(const struct ct_slice *s)
{
	struct ct_err e = {0};
	float *out, sum = 0;
	size_t n = s->rows * s->columns;

	if (s->rows == 0 || s->columns == 0 || n > MOST)
		return;
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
	struct ct_slice *s = NULL;
	struct ct_err e = {0};
	size_t n = 0;

	if (ct_dicom_scan(&path, 1, &s, &n, &e) == 0)
		for (size_t k = 0; k < n; k++)
			decode(&s[k]);
	else if (s || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	ct_dicom_free(s, n);
	return 0;
}

/* The corpus has them: tests/fuzz/make-dicom.py. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	(void)k;
	(void)data;
	return 0;
}
