/* loss.c: see loss.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/loss.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STRIP = 64 }; /* rows of a task */

static size_t strips(const struct ct_loss_image *l)
{
	return (l->h + STRIP - 1) / STRIP;
}

int ct_loss_image_init(struct ct_loss_image *l, size_t h, size_t w, bool multi, struct ct_err *e)
{
	*l = (struct ct_loss_image){.h = h, .w = w};
	ct_ssim_rule(&l->rule, CT_SSIM_R2, 1.0);
	if (ct_alloc(&l->x, h * w, 3 * sizeof *l->x, e) ||
		ct_alloc(&l->part, 2 * strips(l), sizeof *l->part, e) ||
		(multi && ct_ms_ssim_alloc(&l->multi, h, w, e)))
		return -1;
	l->y = l->x + h * w;
	l->g = l->y + h * w;
	return 0;
}

void ct_loss_image_free(struct ct_loss_image *l)
{
	free(l->x);
	free(l->part);
	ct_ms_ssim_free(&l->multi);
	*l = (struct ct_loss_image){0};
}

struct loss_image_job {
	struct ct_loss_image *l;
	const struct ct_loss_view *v;
	double count; /* of pixels, weighted */
};

static void rows(const struct ct_loss_image *l, size_t strip, size_t *first, size_t *end)
{
	*first = strip * STRIP;
	*end = *first + STRIP < l->h ? *first + STRIP : l->h;
}

/* Half of the L1 of a row is of max(x, 0), which x becomes, and so is its gradient: what is cut off
 * is -0, of which SSIM has no gradient. What the sum of the sizes changes by. */
static double clamp_row(const struct ct_loss_row *row, size_t w)
{
	double change = 0;

	for (size_t c = 0; c < w; c++) {
		const double x = (double)row->x[c], y = (double)row->y[c];

		if (x > 0)
			continue;
		change += (fabs(y) - fabs(x - y)) / 2 * (row->weight ? (double)row->weight[c] : 1);
		row->g[c] /= 2;
		row->x[c] = -0.0f;
	}
	return change;
}

static void l1_strip(void *arg, size_t strip, size_t worker)
{
	const struct loss_image_job *j = arg;
	const struct ct_loss_view *v = j->v;
	struct ct_loss_image *l = j->l;
	double sum = 0;
	size_t r, end;

	(void)worker;
	for (rows(l, strip, &r, &end); r < end; r++) {
		const size_t at = r * l->w;
		const struct ct_loss_row row = {l->x + at, l->y + at, l->g + at,
			v->img + r * v->pitch, v->base ? v->base + at : NULL, v->y + at,
			v->weight ? v->weight + at : NULL};

		sum += CT_SIMD(ct_loss_row_l1)(
			&row, l->w, (float)v->scale, (float)(v->l1 / j->count));
		sum += v->clamp ? clamp_row(&row, l->w) : 0;
	}
	l->part[2 * strip] = sum;
}

/* Of MS-SSIM, to the gradient of rows that have that of L1. */
static void add_multi(
	const struct ct_loss_image *l, const struct ct_loss_view *v, size_t r, size_t end)
{
	for (size_t i = r * l->w; i < end * l->w; i++)
		if (!signbit(l->x[i]))
			l->g[i] -= (float)(v->ssim * l->multi.level[0].x[i]);
}

static void ssim_strip(void *arg, size_t strip, size_t worker)
{
	const struct loss_image_job *j = arg;
	const struct ct_loss_view *v = j->v;
	const float scale = (float)v->scale;
	struct ct_loss_image *l = j->l;
	size_t r, end;

	(void)worker;
	rows(l, strip, &r, &end);
	if (v->ssim != 0 && l->multi.n)
		add_multi(l, v, r, end);
	else if (v->ssim != 0)
		l->part[2 * strip + 1] = ct_ssim_back_rows(&l->rule, l->h, l->w, r, end, l->g, l->x,
			l->y, v->weight, -(v->ssim / v->mean_weight));
	for (; r < end; r++) {
		float *restrict to = v->dimg + r * v->pitch;
		const float *restrict from = l->g + r * l->w;

		for (size_t c = 0; c < l->w; c++)
			to[c] = scale * from[c];
		memset(to + l->w, 0, (v->pitch - l->w) * sizeof *to);
	}
}

void ct_loss_image_gradient(struct ct_loss_image *l, struct ct_loss_terms *t,
	const struct ct_loss_view *v, struct ct_par *par)
{
	struct loss_image_job j = {l, v, (double)l->h * (double)l->w * v->mean_weight};
	double l1 = 0, less = 0;

	ct_par_for(par, strips(l), l1_strip, &j);
	if (v->ssim != 0 && l->multi.n)
		less = (1 - ct_ms_ssim_gradient(&l->multi, l->x, l->y, par)) * j.count;
	ct_par_for(par, strips(l), ssim_strip, &j);
	for (size_t i = 0; i < strips(l); i++) {
		l1 += l->part[2 * i];
		less += v->ssim == 0 || l->multi.n ? 0 : l->part[2 * i + 1];
	}
	t->l1 = l1 / j.count;
	t->dssim = less / j.count;
}
