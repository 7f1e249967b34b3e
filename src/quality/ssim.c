/* ssim.c: see ssim.h.
 *
 * One pass over the rows. A ring holds the last 11 rows of the four horizontally filtered maps
 * x, y, x^2 + y^2, xy (the variances only ever appear added), so memory is a few rows and stays
 * in cache. The gradient is in ssim-back.c.
 */
#include "config.h"
#include "quality/ssim.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { BLOCK = 16, RADIUS = CT_SSIM_TAPS / 2, MAPS = 4 };

#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif

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

/* out[j] = sum_k tap[k] in[j + k], j < wp: `in` is padded by the radius on the left. Taps are
 * symmetric: their two ends are added first. */
CLONES static void filter_row(double *restrict out, const double *restrict in, size_t wp,
	size_t radius, const double *restrict tap)
{
	for (size_t j = 0; j < wp; j += BLOCK) {
		double acc[BLOCK];

		for (size_t i = 0; i < BLOCK; i++)
			acc[i] = tap[radius] * in[j + radius + i];
		for (size_t k = 0; k < radius; k++)
			for (size_t i = 0; i < BLOCK; i++)
				acc[i] += tap[k] * (in[j + k + i] + in[j + 2 * radius - k + i]);
		memcpy(out + j, acc, sizeof acc);
	}
}

/* out[j] = sum_k tap[k] ring[(first + k) mod 11][j]; rows of the ring are `pitch` apart. */
CLONES static void filter_column(double *restrict out, const double *restrict ring, size_t pitch,
	size_t first, size_t wp, size_t radius, const double *restrict tap)
{
	const double *row[CT_SSIM_TAPS];

	for (size_t k = 0; k <= 2 * radius; k++)
		row[k] = ring + (first + k) % CT_SSIM_TAPS * pitch;
	for (size_t j = 0; j < wp; j += BLOCK) {
		double acc[BLOCK];

		for (size_t i = 0; i < BLOCK; i++)
			acc[i] = tap[radius] * row[radius][j + i];
		for (size_t k = 0; k < radius; k++) {
			const double *a = row[k] + j, *b = row[2 * radius - k] + j;

			for (size_t i = 0; i < BLOCK; i++)
				acc[i] += tap[k] * (a[i] + b[i]);
		}
		memcpy(out + j, acc, sizeof acc);
	}
}

/* Products of one row of both images, behind RADIUS zeros that lay_out made. */
CLONES static void load_row(struct work *k, size_t at, size_t w, const float *x, const float *y)
{
	for (size_t j = 0; j < w; j++) {
		double a = (double)x[j], b = (double)y[j];

		k->row[0][at + j] = a;
		k->row[1][at + j] = b;
		k->row[2][at + j] = a * a + b * b;
		k->row[3][at + j] = a * b;
	}
}

/* Bring row r (beyond the image: zeros) into the ring, leave row r - radius in k->mean. */
static void advance(struct work *k, const struct ct_ssim_rule *r, size_t row, size_t h, size_t w,
	const float *x, const float *y)
{
	size_t pitch = MAPS * k->wp;
	double *slot = k->ring + row % CT_SSIM_TAPS * pitch;

	if (row < h)
		load_row(k, r->radius, w, x + row * w, y + row * w);
	for (size_t m = 0; m < MAPS; m++) {
		if (row < h)
			filter_row(slot + m * k->wp, k->row[m], k->wp, r->radius, r->tap);
		else
			memset(slot + m * k->wp, 0, k->wp * sizeof *slot);
	}
	if (row < r->radius)
		return;
	/* Rows row - 2 radius .. row; those before the image are still zero in the ring. */
	for (size_t m = 0; m < MAPS; m++)
		filter_column(k->mean[m], k->ring + m * k->wp, pitch,
			row + CT_SSIM_TAPS - 2 * r->radius, k->wp, r->radius, r->tap);
}

CLONES static void similarity(const struct work *k, const struct ct_ssim_rule *r)
{
	const double *restrict mx = k->mean[0], *restrict my = k->mean[1];
	const double *restrict e2 = k->mean[2], *restrict exy = k->mean[3];
	double *restrict s = k->s;

	for (size_t j = 0; j < k->wp; j += BLOCK)
		for (size_t i = j; i < j + BLOCK; i++) {
			double xy = mx[i] * my[i], m2 = mx[i] * mx[i] + my[i] * my[i];

			s[i] = (2 * xy + r->c1) * (2 * r->unbias * (exy[i] - xy) + r->c2) /
			       ((m2 + r->c1) * (r->unbias * (e2[i] - m2) + r->c2));
		}
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
		similarity(&k, r);
		for (size_t j = r->crop; j < w - r->crop; j++) {
			double a = weight ? (double)weight[o * w + j] : 1.0;

			part += a * k.s[j];
			count += a;
		}
		sum += part;
	}
	return count > 0 ? sum / count : (double)NAN;
}
