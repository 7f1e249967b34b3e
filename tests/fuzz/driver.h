/* driver.h: a fuzz target is these two functions and a number.
 *
 * In make check driver.c feeds it its own seeds, mutations of them, and the inputs of
 * tests/fuzz/corpus/x.tar. scripts/fuzz.sh builds the same target for libFuzzer, which looks for
 * more.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TESTS_FUZZ_DRIVER_H
#define CT_TESTS_FUZZ_DRIVER_H
#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
/* Valid file number k in *data (from malloc); its size, or 0 when there are no more. */
size_t fuzz_seed(size_t k, unsigned char **data);
/* Mutations of each seed in make check; 0 where a library that is not ours decodes. */
extern const int fuzz_rounds;
/* Inputs that were not refused: the target counts them, and driver.c wants every seed taken. */
extern size_t fuzz_taken;

#endif
