/* training.h: what tests of training share: a picture, a small training, its vectors.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_TRAINING_H
#define CT_TESTS_TRAINING_H
#include "diffusion/train.h"
#include "tap.h"

enum { SIZE = 8 };

/* Value of a pixel: no two pieces, mirrored or not, are alike. */
__attribute__((unused)) static float value(size_t row, size_t col)
{
	return (float)(0.1 + 0.01 * (double)row + 0.001 * (double)(col * col % 97));
}

__attribute__((unused)) static void picture(struct ct_pictures *s, size_t h, size_t w)
{
	float *px = malloc(h * w * sizeof *px);

	for (size_t i = 0; px && i < h * w; i++)
		px[i] = value(i / w, i % w);
	must(!px || ct_pictures_add(s, h, w, px, "a picture", &err));
}

__attribute__((unused)) static void options(struct ct_train_opts *o, struct ct_unet_arch *a)
{
	ct_train_default(o);
	o->patches.size = SIZE;
	o->batch = 3;
	o->seed = 17;
	o->adam.lr = 0.02;
	ct_unet_arch_default(a);
	a->levels = 1;
	a->num_res_blocks = 1;
}

/* The weights, their average and their moments. */
__attribute__((unused)) static const struct ct_tensor *vector(
	const struct ct_tensors *state, const char *name)
{
	const struct ct_tensor *t = ct_tensors_find(state, name);

	if (!t)
		exit(99);
	return t;
}

#endif
