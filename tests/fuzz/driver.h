/* driver.h: a fuzz target is these two functions; driver.c replays it without a fuzzer.
 *
 * With clang:  clang -fsanitize=fuzzer,address fuzz-x.c ... (driver.c left out).
 * In make check: driver.c feeds every seed and many mutations of it to the target.
 */
#ifndef CT_TESTS_FUZZ_DRIVER_H
#define CT_TESTS_FUZZ_DRIVER_H
#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
/* Valid file number k in *data (from malloc); its size, or 0 when there are no more. */
size_t fuzz_seed(size_t k, unsigned char **data);

#endif
