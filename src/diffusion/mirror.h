/* mirror.h: a line of pixels continued by reflection (half-sample symmetry). */
#ifndef CT_DIFFUSION_MIRROR_H
#define CT_DIFFUSION_MIRROR_H
#include <stddef.h>

/* Index of a line of n pixels that goes on: ... 1 0 | 0 1 ... n-1 | n-1 ... */
static inline size_t ct_mirror_index(size_t i, size_t n)
{
	i %= 2 * n;
	return i < n ? i : 2 * n - 1 - i;
}

#endif
