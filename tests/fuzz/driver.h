/* driver.h: a fuzz target is these two functions and a number; and what a target of a reader of
 * volumes or weights does with a file.
 *
 * In make check driver.c feeds it its own seeds, mutations of them, and the inputs of
 * tests/fuzz/corpus/x.tar. scripts/fuzz.sh builds the same target for libFuzzer, which looks for
 * more.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TESTS_FUZZ_DRIVER_H
#define CT_TESTS_FUZZ_DRIVER_H
#include "formats/any.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
/* Valid file number k in *data (from malloc); its size, or 0 when there are no more. */
size_t fuzz_seed(size_t k, unsigned char **data);
/* Mutations of each seed in make check; 0 where a library that is not ours decodes. */
extern const int fuzz_rounds;
/* Inputs that were not refused: the target counts them, and driver.c wants every seed taken. */
extern size_t fuzz_taken;

/* Read the bytes as a file of that name: all voxels, or an error and nothing. */
__attribute__((unused)) static void volume_look(
	const uint8_t *data, size_t size, const char *name, const struct ct_format *is)
{
	struct ct_any a = {0};
	struct ct_err e = {0};
	float sum = 0;

	if (size == 0)
		return;
	if (ct_format_read_bytes(is, data, size, name, &a, &e) == 0)
		for (size_t i = 0, n = ct_vol_count(&a.vol); i < n; i++)
			sum += a.vol.data[i];
	else if (a.vol.data || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	ct_any_free(&a);
}

/* All numbers of a file of these bytes, or an error and nothing. */
__attribute__((unused)) static void weights_look(
	const uint8_t *data, size_t size, const struct ct_format *is)
{
	struct ct_any a = {0};
	const struct ct_tensors *w = &a.tensors;
	struct ct_err e = {0};
	float sum = 0;

	if (size == 0)
		return;
	if (ct_format_read_bytes(is, data, size, "fuzz", &a, &e) == 0) {
		for (size_t k = 0; k < w->n; k++)
			for (size_t i = 0, n = ct_tensor_count(&w->t[k]); i < n; i++)
				sum += w->t[k].data[i];
	} else if (w->t || w->meta.n || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	ct_any_free(&a);
}

#endif
