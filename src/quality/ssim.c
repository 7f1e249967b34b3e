/* ssim.c: see ssim.h.
 *
 * One pass over the rows. A ring holds the last 11 rows of the four horizontally filtered maps
 * x, y, x^2 + y^2, xy (the variances only ever appear added), so memory is a few rows and stays
 * in cache. The gradient is in ssim-gradient.c.
 */
#include "config.h"
#include "quality/ssim.h"
#include "quality/ssim-row.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { BLOCK = CT_SSIM_ROW, RADIUS = CT_SSIM_TAPS / 2, MAPS = 4 };

struct work {
	size_t wp, pitch;   /* width rounded up to BLOCK; of a padded row */
	double *row[MAPS];  /* padded by RADIUS and to wp */
	double *mean[MAPS]; /* filtered maps of the output row */
	double *s;
	double *ring; /* [CT_SSIM_TAPS][MAPS][wp] */
};

static size_t round_up(size_t w)
{
	return (w + BLOCK - 1) / BLOCK * BLOCK;
}

void ct_ssim_rule(struct ct_ssim_rule *r, enum ct_ssim_kind kind, double range)
{
	bool box = kind == CT_SSIM_SKIMAGE || kind == CT_SSIM_SKIMAGE11 || kind == CT_SSIM_3D;
	double sum = 0, voxels = 1;

	*r = (struct ct_ssim_rule){.unbias = 1};
	r->dims = kind == CT_SSIM_3D || kind == CT_SSIM_3D_GAUSS ? 3 : 2;
	r->radius = kind == CT_SSIM_SKIMAGE || kind == CT_SSIM_3D ? 3 : 5;
	for (size_t k = 0; k <= 2 * r->radius; k++) {
		double d = (double)k - (double)r->radius;

		r->tap[k] = box ? 1.0 : exp(-d * d / (2 * 1.5 * 1.5));
		sum += r->tap[k];
	}
	for (size_t k = 0; k <= 2 * r->radius; k++)
		r->tap[k] /= sum;
	for (int d = 0; d < r->dims; d++)
		voxels *= (double)(2 * r->radius + 1);
	if (box)
		r->unbias = voxels / (voxels - 1);
	if (kind != CT_SSIM_R2)
		r->crop = r->radius;
	r->c1 = 0.01 * range * (0.01 * range);
	r->c2 = 0.03 * range * (0.03 * range);
}

size_t ct_ssim_scratch(size_t w)
{
	size_t wp = round_up(w);

	return MAPS * (wp + BLOCK) + (MAPS + 1) * wp + CT_SSIM_TAPS * MAPS * wp;
}

static void lay_out(struct work *k, size_t w, double *scratch)
{
	memset(scratch, 0, ct_ssim_scratch(w) * sizeof *scratch);
	k->wp = round_up(w);
	k->pitch = k->wp + BLOCK; /* 2*RADIUS <= BLOCK */
	for (size_t m = 0; m < MAPS; m++, scratch += k->pitch)
		k->row[m] = scratch;
	for (size_t m = 0; m < MAPS; m++, scratch += k->wp)
		k->mean[m] = scratch;
	k->s = scratch;
	k->ring = k->s + k->wp;
}

/* Map m of the row in the middle of a ring that ends with row `row`. */
static void filter_column(const struct work *k, const struct ct_ssim_rule *r, size_t row, size_t m)
{
	const double *rows[CT_SSIM_TAPS];

	for (size_t i = 0; i <= 2 * r->radius; i++)
		rows[i] = k->ring +
			  ((row + CT_SSIM_TAPS - 2 * r->radius + i) % CT_SSIM_TAPS * MAPS + m) *
				  k->wp;
	CT_SIMD(ct_ssim_row_across)(k->mean[m], rows, k->wp, r->radius, r->tap);
}

/* Bring row r (beyond the image: zeros) into the ring, leave row r - radius in k->mean. */
static void advance(struct work *k, const struct ct_ssim_rule *r, size_t row, size_t h, size_t w,
	const float *x, const float *y)
{
	double *slot = k->ring + row % CT_SSIM_TAPS * MAPS * k->wp, *to[MAPS];

	for (size_t m = 0; m < MAPS; m++)
		to[m] = k->row[m] + r->radius; /* behind zeros that lay_out made */
	if (row < h)
		CT_SIMD(ct_ssim_row_load)(to, w, x + row * w, y + row * w);
	for (size_t m = 0; m < MAPS; m++) {
		if (row < h)
			CT_SIMD(ct_ssim_row_along)
		(slot + m * k->wp, k->row[m], k->wp, r->radius, r->tap);
		else memset(slot + m * k->wp, 0, k->wp * sizeof *slot);
	}
	/* Rows row - 2 radius .. row; those before the image are still zero in the ring. */
	for (size_t m = 0; m < MAPS && row >= r->radius; m++)
		filter_column(k, r, row, m);
}

double ct_ssim(const struct ct_ssim_rule *r, size_t h, size_t w, const float *x, const float *y,
	const float *weight, double *scratch)
{
	struct work k;
	double sum = 0, count = 0;

	if (h <= 2 * r->crop || w <= 2 * r->crop)
		return (double)NAN;
	lay_out(&k, w, scratch);
	for (size_t row = 0; row < h + r->radius; row++) {
		size_t o = row - r->radius;
		double part = 0;

		advance(&k, r, row, h, w, x, y);
		if (row < r->radius + r->crop || o >= h - r->crop)
			continue;
		CT_SIMD(ct_ssim_row_similarity)(k.s, (const double *const *)k.mean, k.wp, r);
		for (size_t j = r->crop; j < w - r->crop; j++) {
			double a = weight ? (double)weight[o * w + j] : 1.0;

			part += a * k.s[j];
			count += a;
		}
		sum += part;
	}
	return count > 0 ? sum / count : (double)NAN;
}
