/* rng.h: counter-based random numbers: Philox4x32-10 (Salmon et al., SC 2011).
 *
 * A number is a function of (seed, stream, index) and of nothing else, so neither order nor
 * threads nor a resumed run can change it. Pure; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_RNG_H
#define CT_CORE_RNG_H
#include <stddef.h>
#include <stdint.h>

/* Ten rounds of Philox4x32 on the counter; known answers in tests/t-core.c. */
void ct_philox(uint32_t out[4], const uint32_t counter[4], const uint32_t key[2]);
/* Uniform in [0, 1), 53 bits. */
double ct_rng_uniform(uint64_t seed, uint64_t stream, uint64_t index);
/* Uniform integer in [0, n), n > 0, unbiased to 2^-64. */
uint64_t ct_rng_below(uint64_t seed, uint64_t stream, uint64_t index, uint64_t n);
/* Standard normal (Box-Muller on one Philox block a pair). */
float ct_rng_normal(uint64_t seed, uint64_t stream, uint64_t index);
/* out[k] = ct_rng_normal(seed, stream, first + k), k < n. */
void ct_rng_normals(size_t n, float *out, uint64_t seed, uint64_t stream, uint64_t first);

#endif
