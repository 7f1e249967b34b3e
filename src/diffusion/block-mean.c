/* block-mean.c: see block-mean.h. Sums are in double and in a fixed order. */
#include "config.h"
#include "diffusion/block-mean.h"

static double block_mean(size_t stride, size_t s, const float *x)
{
	double sum = 0.0;

	for (size_t i = 0; i < s; i++)
		for (size_t j = 0; j < s; j++)
			sum += (double)x[i * stride + j];
	return sum / (double)(s * s);
}

static void block_add(size_t stride, size_t s, float *x, float d)
{
	for (size_t i = 0; i < s; i++)
		for (size_t j = 0; j < s; j++)
			x[i * stride + j] += d;
}

void ct_block_mean_forward(size_t h, size_t w, size_t s, float *restrict y, const float *restrict x)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++)
			y[i * w + j] = (float)block_mean(s * w, s, x + (i * w * s + j) * s);
}

void ct_block_mean_correct(
	size_t h, size_t w, size_t s, float sigma, float *restrict x, const float *restrict y)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++) {
			float *block = x + (i * w * s + j) * s;
			double r = block_mean(s * w, s, block) - (double)y[i * w + j];

			block_add(s * w, s, block, (float)(-(double)sigma * r));
		}
}

void ct_block_mean_analyse(
	size_t h, size_t w, size_t s, double *restrict c, const float *restrict x)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++)
			c[i * w + j] = (double)s * block_mean(s * w, s, x + (i * w * s + j) * s);
}

void ct_block_mean_synth_add(
	size_t h, size_t w, size_t s, float *restrict x, const double *restrict c)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++)
			block_add(s * w, s, x + (i * w * s + j) * s,
				(float)(c[i * w + j] / (double)s));
}
