/* ssim.c: the rules of SSIM, its gradient tile by tile (ssim-tile.c), and that of volumes.
 *
 * The window is separable, so a slice across an axis is the volume filtered along the two other
 * axes, and the 3-D index is the volume filtered along three. A task is a block of slices along z.
 * It walks tiles of columns along x, and in each chunks of rows along y. Of every row the maps of
 * the slices of the block and their neighbours are filtered along z, then along x, and put behind
 * the 2 radius rows that the chunk before has left; then the chunk of each slice is filtered along
 * y. Axes that the definition does not filter have radius 0. Outside the volume all maps are zero.
 *
 * The maps are u = x + y, v = y - x, u^2 and v^2. With means m and variances s,
 *
 *   S = (mu^2 - mv^2 + 2 C1)(su - sv + 2 C2) / ((mu^2 + mv^2 + 2 C1)(su + sv + 2 C2)),
 *
 * the same as of x and y, but what is small, v, is computed as such: an error d of su, the
 * difference of large numbers, changes S by at most d/(4 C2), and not at all where sv is zero. So
 * float suffices, twice as fast, for values up to twice the data range: S of a voxel is then off by
 * a few 1e-4 at the worst, either way, and the mean was within 2e-6 of that in double wherever it
 * was compared. Larger values are computed in double.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "quality/ssim.h"
#include "core/mem.h"
#include "quality/ssim-kernels.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

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

double ct_ssim_back_rows(const struct ct_ssim_rule *r, size_t h, size_t w, size_t first, size_t end,
	float *gx, const float *x, const float *y, const float *weight, double up)
{
	const float scale = (float)(up / ((double)h * (double)w));
	struct ct_ssim_tile t = {.h = h, .w = w, .x = x, .y = y, .weight = weight};
	double sum = 0;

	for (; t.first < w; t.first += CT_SSIM_TILE) {
		t.n = w - t.first < CT_SSIM_TILE ? w - t.first : CT_SSIM_TILE;
		sum += CT_SIMD(ct_ssim_tile_back)(r, &t, first, end, gx, scale);
	}
	return sum;
}

struct ssim_volume_job {
	struct ct_ssim_block b;
	const struct ct_env *env;
	size_t block; /* slices of a task */
	bool small;   /* float suffices */
	void *scratch;
	double *part; /* [task][2][len]; of slices across z the result itself */
	size_t len;   /* n[axis], rounded up to whole tiles */
};

/* Is no mapped value larger than twice the data range? */
static bool suits_float(const struct ct_ssim_rule *rule, const struct ct_ssim_map *m)
{
	double range = sqrt(rule->c1) / 0.01;
	double most = fmax(fabs(m->lo - m->zero), fabs(m->hi - m->zero));

	return most * m->scale <= 2 * range;
}

static void run(void *arg, size_t task, size_t worker)
{
	const struct ssim_volume_job *j = arg;
	const size_t z = task * j->block, left = j->b.n[2] - z;
	const size_t slices = left < j->block ? left : j->block, at = worker * CT_SSIM_SCRATCH;
	double *part = j->part + (j->b.axis == 2 ? 0 : task * 2 * j->len);

	if (ct_stopping(j->env))
		return;
	if (j->small)
		CT_SIMD(ct_ssim_block_float)
	(&j->b, z, slices, (float *)j->scratch + at, part, part + j->len);
	else CT_SIMD(ct_ssim_block_double)(
		&j->b, z, slices, (double *)j->scratch + at, part, part + j->len);
}

int ct_ssim_volume(double *sum, double *count, const struct ct_ssim_rule *rule, int axis,
	const size_t n[static 3], const float *ref, const float *test, const float *mask,
	const struct ct_ssim_map *map, const struct ct_env *env, struct ct_err *e)
{
	struct ssim_volume_job j = {.b = {.rule = rule,
					    .map = map,
					    .axis = axis,
					    .ref = ref,
					    .test = test,
					    .mask = mask},
		.env = env,
		.len = (n[axis] + CT_SSIM_TX - 1) / CT_SSIM_TX * CT_SSIM_TX};
	size_t tasks, parts;
	int rc = -1;

	for (int a = 0; a < 3; a++) {
		bool filtered = a != axis || rule->dims == 3;

		j.b.n[a] = n[a];
		j.b.radius[a] = filtered ? rule->radius : 0;
		j.b.crop[a] = filtered ? rule->crop : 0;
	}
	j.block = j.b.radius[2] ? CT_SSIM_TZ : 1;
	tasks = (n[2] + j.block - 1) / j.block;
	parts = axis == 2 ? 1 : tasks;
	j.small = suits_float(rule, map);
	if (ct_alloc0(&j.part, parts * 2 * j.len, sizeof *j.part, e) ||
		ct_alloc(&j.scratch, CT_SSIM_SCRATCH * ct_par_threads(env->par),
			j.small ? sizeof(float) : sizeof(double), e))
		goto out;
	ct_par_for(env->par, tasks, run, &j);
	for (size_t k = 0; k < n[axis]; k++)
		sum[k] = count[k] = 0;
	for (size_t t = 0; t < parts; t++)
		for (size_t k = 0; k < n[axis]; k++) {
			sum[k] += j.part[t * 2 * j.len + k];
			count[k] += j.part[t * 2 * j.len + j.len + k];
		}
	rc = ct_check_stop(env, e);
out:
	free(j.part);
	free(j.scratch);
	return rc;
}
