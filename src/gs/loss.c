/* loss.c: see loss.h. */
#include "config.h"
#include "gs/loss.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ct_loss_init(struct ct_loss *l, size_t h, size_t w, struct ct_err *e)
{
	*l = (struct ct_loss){.h = h, .w = w};
	ct_ssim_rule(&l->rule, CT_SSIM_R2, 1.0);
	if (ct_alloc(&l->x, h * w, sizeof *l->x, e) || ct_alloc(&l->y, h * w, sizeof *l->y, e) ||
		ct_alloc(&l->g, h * w, sizeof *l->g, e) ||
		ct_alloc(&l->scratch, ct_ssim_scratch(w), sizeof *l->scratch, e)) {
		ct_loss_free(l);
		return -1;
	}
	return 0;
}

void ct_loss_free(struct ct_loss *l)
{
	free(l->x);
	free(l->y);
	free(l->g);
	free(l->scratch);
	*l = (struct ct_loss){0};
}

void ct_loss_image(struct ct_loss *l, struct ct_loss_terms *t, float *dimg, const float *img,
	size_t pitch, const float *base, const float *y, const struct ct_loss_weights *k)
{
	size_t count = l->h * l->w;
	double sum = 0;
	float step = (float)(k->l1 / (double)count), scale = (float)k->scale;

	for (size_t r = 0; r < l->h; r++)
		for (size_t c = 0; c < l->w; c++) {
			size_t at = r * l->w + c;
			float v = img[r * pitch + c] + (base ? base[at] : 0), d;

			l->x[at] = scale * v;
			l->y[at] = scale * y[at];
			d = l->x[at] - l->y[at];
			sum += fabs((double)d);
			l->g[at] = d > 0 ? step : d < 0 ? -step : 0;
		}
	t->l1 = sum / (double)count;
	t->dssim = k->ssim == 0 ? 0
				: 1 - ct_ssim_back(&l->rule, l->h, l->w, l->g, l->x, l->y, -k->ssim,
					      l->scratch);
	for (size_t r = 0; r < l->h; r++) {
		for (size_t c = 0; c < l->w; c++)
			dimg[r * pitch + c] = scale * l->g[r * l->w + c];
		memset(dimg + r * pitch + l->w, 0, (pitch - l->w) * sizeof *dimg);
	}
}

double ct_loss_tv(float *df, const float *f, size_t pitch, const float *base,
	const size_t n[static 3], double weight)
{
	const size_t step[3] = {1, pitch, pitch * n[1]}, bstep[3] = {1, n[0], n[0] * n[1]};
	size_t count =
		(n[0] - 1) * n[1] * n[2] + n[0] * (n[1] - 1) * n[2] + n[0] * n[1] * (n[2] - 1);
	double sum = 0;
	float w = count ? (float)(weight / (double)count) : 0;

	memset(df, 0, pitch * n[1] * n[2] * sizeof *df);
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const size_t at[3] = {i, j, k};
				size_t p = (k * n[1] + j) * pitch + i,
				       b = (k * n[1] + j) * n[0] + i;

				for (int a = 0; a < 3; a++) {
					float d;

					if (at[a] + 1 == n[a])
						continue;
					d = f[p + step[a]] - f[p];
					if (base)
						d += base[b + bstep[a]] - base[b];
					sum += fabs((double)d);
					d = d > 0 ? w : d < 0 ? -w : 0;
					df[p + step[a]] += d;
					df[p] -= d;
				}
			}
	return count ? sum / (double)count : 0;
}
