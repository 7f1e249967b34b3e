/* patches.c: see patches.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/patches.h"
#include "core/mem.h"
#include "core/rng.h"
#include "diffusion/measurement.h"

#include <stdlib.h>
#include <string.h>

int ct_pictures_add(
	struct ct_pictures *s, size_t h, size_t w, float *px, const char *name, struct ct_err *e)
{
	const size_t n = h * w;
	size_t i = 0;

	while (i < n && px[i] >= 0 && px[i] <= 1)
		i++;
	if (i < n)
		ct_fail(e, CT_ENUMERIC, "%s: row %zu, column %zu is %g, outside [0, 1]", name,
			i / w, i % w, (double)px[i]);
	if (i < n || ct_grow(&s->picture, &s->cap, s->n + 1, sizeof *s->picture, e)) {
		free(px);
		return -1;
	}
	s->picture[s->n++] = (struct ct_picture){h, w, px};
	return 0;
}

void ct_pictures_free(struct ct_pictures *s)
{
	for (size_t i = 0; i < s->n; i++)
		free(s->picture[i].px);
	free(s->picture);
	*s = (struct ct_pictures){0};
}

/* How many of the scales leave the picture as large as a piece. */
static size_t usable(const struct ct_patches *p, const struct ct_picture *pic, size_t *scale)
{
	size_t n = 0;

	for (size_t i = 0; i < p->scales; i++)
		if (pic->h / p->scale[i] >= p->size && pic->w / p->scale[i] >= p->size)
			scale[n++] = p->scale[i];
	return n;
}

size_t ct_patches_count(const struct ct_patches *p, const struct ct_pictures *s)
{
	size_t scale[8], n = 0;

	for (size_t i = 0; i < s->n; i++)
		n += usable(p, &s->picture[i], scale) > 0;
	return n;
}

int ct_patches_check(
	const struct ct_patches *p, const struct ct_pictures *s, const char *what, struct ct_err *e)
{
	if (ct_patches_count(p, s))
		return 0;
	return ct_fail(e, CT_EGEOM, "%s: none of %zu pictures is as large as a piece of %zu x %zu",
		what, s->n, p->size, p->size);
}

void ct_patches_draw(const struct ct_patches *p, const struct ct_pictures *s, float *x,
	uint64_t seed, uint64_t index)
{
	const struct ct_picture *pic;
	const size_t n = p->size;
	size_t scale[8], choices, f, row, col;
	uint64_t draw = 0;
	bool mirror;

	do {
		pic = &s->picture[ct_rng_below(seed, index, draw++, s->n)];
		choices = usable(p, pic, scale);
	} while (!choices); /* ends: ct_patches_check has seen one */
	f = scale[ct_rng_below(seed, index, draw++, choices)];
	row = ct_rng_below(seed, index, draw++, pic->h - n * f + 1);
	col = ct_rng_below(seed, index, draw++, pic->w - n * f + 1);
	mirror = ct_rng_below(seed, index, draw, 2);
	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < n; j++) {
			const size_t to = i * n + (mirror ? n - 1 - j : j);
			const float *at = pic->px + (row + i * f) * pic->w + col + j * f;

			x[to] = 2.0f * (float)ct_measurement_mean(at, pic->w, f) - 1.0f;
		}
	for (size_t c = 1; c < p->channels; c++)
		memcpy(x + c * n * n, x, n * n * sizeof *x);
}
