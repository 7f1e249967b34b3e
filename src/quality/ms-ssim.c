/* ms-ssim.c: see ms-ssim.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/ms-ssim.h"
#include "core/mem.h"
#include "quality/ssim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TAPS = CT_SSIM_TAPS, X = 0, Y, XX, YY, XY, PRODUCTS };
/* What a place of the map takes back to the means of x, x^2 and xy. */
enum { D_X, D_XX, D_XY };

void ct_ms_ssim_free(struct ct_ms_ssim *s)
{
	free(s->all);
	*s = (struct ct_ms_ssim){0};
}

int ct_ms_ssim_alloc(struct ct_ms_ssim *s, size_t h, size_t w, struct ct_err *e)
{
	static const double weights[CT_MS_SSIM_MOST] = {0.0448, 0.2856, 0.3001, 0.2363, 0.1333};
	const size_t least = h < w ? h : w, across = h * (w - TAPS + 1);
	double sum = 0, *at;
	size_t pixels = 0;

	*s = (struct ct_ms_ssim){0};
	if (least < TAPS)
		return ct_fail(e, CT_EGEOM, "MS-SSIM of %zux%zu pixels: it needs %d", w, h, TAPS);
	for (size_t l = 0; l < CT_MS_SSIM_MOST && least > (TAPS - 1) * ((size_t)1 << l); l++) {
		s->level[l] = (struct ct_ms_ssim_level){.h = h, .w = w, .weight = weights[l]};
		sum += weights[l];
		pixels += h * w;
		h = (h + 1) / 2;
		w = (w + 1) / 2;
		s->n++;
	}
	if (ct_alloc(&s->all, 2 * pixels + (PRODUCTS + 3) * across + s->level[0].h, sizeof *s->all,
		    e))
		return -1;
	at = s->all;
	for (size_t l = 0; l < s->n; l++) {
		struct ct_ms_ssim_level *k = &s->level[l];

		k->weight /= s->n < CT_MS_SSIM_MOST ? sum : 1;
		k->x = at;
		k->y = at + k->h * k->w;
		at += 2 * k->h * k->w;
	}
	for (int p = 0; p < PRODUCTS; p++, at += across)
		s->across[p] = at;
	for (int p = 0; p < 3; p++, at += across)
		s->map[p] = at;
	s->part = at;
	return 0;
}

struct ms_ssim_job {
	struct ct_ms_ssim *s;
	struct ct_ms_ssim_level *at;
	struct ct_ssim_rule rule;
	bool last; /* S, not cs alone */
};

/* Means along a row, of the five products. */
static void go_across(void *arg, size_t r, size_t worker)
{
	const struct ms_ssim_job *j = arg;
	const size_t w = j->at->w, m = w - TAPS + 1;
	const double *x = j->at->x + r * w, *y = j->at->y + r * w;

	(void)worker;
	for (size_t c = 0; c < m; c++) {
		double sum[PRODUCTS] = {0};

		for (size_t t = 0; t < TAPS; t++) {
			const double a = x[c + t], b = y[c + t], k = j->rule.tap[t];

			sum[X] += k * a;
			sum[Y] += k * b;
			sum[XX] += k * (a * a);
			sum[YY] += k * (b * b);
			sum[XY] += k * (a * b);
		}
		for (int p = 0; p < PRODUCTS; p++)
			j->s->across[p][r * m + c] = sum[p];
	}
}

/* A row of places: the sum of cs or S into part, and its slopes by the means. */
static void compare(void *arg, size_t r, size_t worker)
{
	const struct ms_ssim_job *j = arg;
	const size_t m = j->at->w - TAPS + 1;
	const double c1 = j->rule.c1, c2 = j->rule.c2;
	double all = 0;

	(void)worker;
	for (size_t c = 0; c < m; c++) {
		double sum[PRODUCTS] = {0}, a1, a2, b1, b2, l = 1, cs, slope;

		for (int p = 0; p < PRODUCTS; p++)
			for (size_t t = 0; t < TAPS; t++)
				sum[p] += j->rule.tap[t] * j->s->across[p][(r + t) * m + c];
		a1 = 2 * sum[X] * sum[Y] + c1;
		b1 = sum[X] * sum[X] + sum[Y] * sum[Y] + c1;
		a2 = 2 * (sum[XY] - sum[X] * sum[Y]) + c2;
		b2 = sum[XX] - sum[X] * sum[X] + sum[YY] - sum[Y] * sum[Y] + c2;
		cs = a2 / b2;
		slope = 2 * (sum[X] * cs - sum[Y]) / b2;
		if (j->last) {
			l = a1 / b1;
			slope = l * slope + cs * 2 * (sum[Y] - sum[X] * l) / b1;
		}
		j->s->map[D_X][r * m + c] = slope;
		j->s->map[D_XX][r * m + c] = -l * cs / b2;
		j->s->map[D_XY][r * m + c] = 2 * l / b2;
		all += l * cs;
	}
	j->s->part[r] = all;
}

/* Back to the rows of the image, into `across`, in which the products are not needed any more. */
static void go_back(void *arg, size_t r, size_t worker)
{
	const struct ms_ssim_job *j = arg;
	const size_t m = j->at->w - TAPS + 1, rows = j->at->h - TAPS + 1;

	(void)worker;
	for (int p = 0; p < 3; p++)
		for (size_t c = 0; c < m; c++) {
			double sum = 0;

			for (size_t t = 0; t < TAPS; t++)
				if (r >= t && r - t < rows)
					sum += j->rule.tap[t] * j->s->map[p][(r - t) * m + c];
			j->s->across[p][r * m + c] = sum;
		}
}

/* The gradient of the mean by a row of x, in its place. */
static void finish(void *arg, size_t r, size_t worker)
{
	const struct ms_ssim_job *j = arg;
	const size_t w = j->at->w, m = w - TAPS + 1, places = m * (j->at->h - TAPS + 1);
	double *x = j->at->x + r * w;
	const double *y = j->at->y + r * w;

	(void)worker;
	for (size_t c = 0; c < w; c++) {
		double sum[3] = {0};

		for (size_t t = 0; t < TAPS; t++)
			for (int p = 0; p < 3 && c >= t && c - t < m; p++)
				sum[p] += j->rule.tap[t] * j->s->across[p][r * m + c - t];
		x[c] = (sum[D_X] + 2 * x[c] * sum[D_XX] + y[c] * sum[D_XY]) / (double)places;
	}
}

/* Means of 2x2, of a level into the next. */
static void halve(double *to, const struct ct_ms_ssim_level *l, const double *from)
{
	const size_t wide = (l->w + 1) / 2;

	memset(to, 0, wide * ((l->h + 1) / 2) * sizeof *to);
	for (size_t r = 0; r < l->h; r++)
		for (size_t c = 0; c < l->w; c++)
			to[(r + l->h % 2) / 2 * wide + (c + l->w % 2) / 2] +=
				from[r * l->w + c] / 4;
}

/* Gradients: each level's own times `gain`, and what the next one's says of its means. */
static void add_up(const struct ct_ms_ssim_level *l, double gain, bool more)
{
	const size_t wide = (l->w + 1) / 2;

	for (size_t r = 0; r < l->h; r++)
		for (size_t c = 0; c < l->w; c++) {
			double *x = &l->x[r * l->w + c];

			*x *= gain;
			if (more)
				*x += l[1].x[(r + l->h % 2) / 2 * wide + (c + l->w % 2) / 2] / 4;
		}
}

double ct_ms_ssim_gradient(struct ct_ms_ssim *s, const float *x, const float *y, struct ct_par *par)
{
	struct ms_ssim_job j = {.s = s};
	double all = 1;

	ct_ssim_rule(&j.rule, CT_SSIM_WANG, 1.0);
	for (size_t i = 0, n = s->level[0].h * s->level[0].w; i < n; i++) {
		s->level[0].x[i] = (double)x[i];
		s->level[0].y[i] = (double)y[i];
	}
	for (size_t l = 0; l + 1 < s->n; l++) {
		halve(s->level[l + 1].x, &s->level[l], s->level[l].x);
		halve(s->level[l + 1].y, &s->level[l], s->level[l].y);
	}
	for (size_t l = 0; l < s->n; l++) {
		struct ct_ms_ssim_level *at = &s->level[l];
		const size_t rows = at->h - TAPS + 1;
		double sum = 0;

		j.at = at;
		j.last = l + 1 == s->n;
		ct_par_for(par, at->h, go_across, &j);
		ct_par_for(par, rows, compare, &j);
		ct_par_for(par, at->h, go_back, &j);
		ct_par_for(par, at->h, finish, &j);
		for (size_t r = 0; r < rows; r++)
			sum += s->part[r];
		at->value = fmax(sum / (double)rows / (double)(at->w - TAPS + 1), 0);
		all *= pow(at->value, at->weight);
	}
	for (size_t l = s->n; l-- > 0;) {
		const struct ct_ms_ssim_level *at = &s->level[l];

		add_up(at, all > 0 ? all * at->weight / at->value : 0, l + 1 < s->n);
	}
	return all;
}
