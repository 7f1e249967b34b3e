/* block-mean.h: the s-by-s block mean A, its pseudo-inverse A+ (replication), and the range-space
 * correction of DDNM (Wang, Yu, Zhang, ICLR 2023, eq. 13 and 17).
 *
 *   (A x)[i,j] = mean of block (i,j)        (A+ y)[block i,j] = y[i,j]
 *   A A+ = I,   A^T = A+ / s^2,   all singular values are 1/s
 *
 * One image: x is (s*h, s*w), y is (h, w), row by row. Pure, thread-safe.
 */
#ifndef CT_DIFFUSION_BLOCK_MEAN_H
#define CT_DIFFUSION_BLOCK_MEAN_H

#include <stddef.h>

/* y = A x */
void ct_block_mean_forward(
	size_t h, size_t w, size_t s, float *restrict y, const float *restrict x);
/* x <- x - sigma A+ (A x - y); sigma 1 makes A x = y. */
void ct_block_mean_correct(
	size_t h, size_t w, size_t s, float sigma, float *restrict x, const float *restrict y);
/* Coefficients of x on the right singular vectors, the blocks of constant 1/s: c = s A x, (h, w).
 */
void ct_block_mean_analyse(
	size_t h, size_t w, size_t s, double *restrict c, const float *restrict x);
/* Its adjoint, added: x <- x + A+ c / s. */
void ct_block_mean_synth_add(
	size_t h, size_t w, size_t s, float *restrict x, const double *restrict c);

#endif
