/* ssim-volume.c: see ssim-volume.h.
 *
 * A task is a block of slices along z. It walks tiles of columns along x, and in each chunks of
 * rows along y. Of every row the maps of the slices of the block and their neighbours are
 * filtered along z, then along x, and put behind the 2 radius rows that the chunk before has left;
 * then the chunk of each slice is filtered along y. Axes that the definition does not filter have
 * radius 0. Outside the volume all maps are zero.
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
 */
#include "config.h"
#include "quality/ssim-volume.h"
#include "core/mem.h"
#include "quality/lanes.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MAPS = 4, R = CT_SSIM_TAPS / 2 };
enum { TX = 128, PX = TX + 16, TZ = 8, CY = 16 }; /* PX >= TX + 2 R, CY >= 2 R */
enum {
	PRODUCTS = MAPS * (TZ + 2 * R) * PX,
	ROWS = MAPS * TZ * PX,
	LAYER = (CY + 2 * R) * TX,
	CHUNK = TZ * MAPS * LAYER,
	TILE = CY * TX,
	SCRATCH = PRODUCTS + ROWS + CHUNK + (MAPS + 1) * TILE + TX
};

struct job {
	const struct ct_ssim_rule *rule;
	const struct ct_ssim_map *map;
	const struct ct_env *env;
	int axis;
	size_t n[3], radius[3], crop[3], block;
	const float *ref, *test, *mask;
	void *scratch;
	double *part; /* [task][2][len]; of slices across z the result itself */
	size_t len;   /* n[axis], rounded up to whole tiles */
	float *most;  /* of each slice */
};

struct place {
	size_t x0, y0, z0, slices, rows;
};

#define REAL float
#define NAME(x) float_##x
#include "quality/ssim-volume-real.h"
#undef REAL
#undef NAME

#define REAL double
#define NAME(x) double_##x
#include "quality/ssim-volume-real.h"
#undef REAL
#undef NAME

CT_LANES_CLONES static float largest(const float *restrict v, size_t n)
{
	float most[CT_LANES_BLOCK] = {0};
	size_t i = 0;

	for (; i + CT_LANES_BLOCK <= n; i += CT_LANES_BLOCK)
		for (size_t k = 0; k < CT_LANES_BLOCK; k++) {
			float a = fabsf(v[i + k]);

			most[k] = a > most[k] ? a : most[k];
		}
	for (; i < n; i++)
		most[0] = fabsf(v[i]) > most[0] ? fabsf(v[i]) : most[0];
	for (size_t k = 1; k < CT_LANES_BLOCK; k++)
		most[0] = most[k] > most[0] ? most[k] : most[0];
	return most[0];
}

static void find_largest(void *arg, size_t k, size_t worker)
{
	const struct job *j = arg;
	size_t slice = j->n[0] * j->n[1];
	float a = largest(j->ref + k * slice, slice), b = largest(j->test + k * slice, slice);

	(void)worker;
	j->most[k] = a > b ? a : b;
}

/* Is no mapped value larger than twice the data range? */
static int suits_float(bool *suits, struct job *j, struct ct_err *e)
{
	const struct ct_ssim_map *m = j->map;
	double range = sqrt(j->rule->c1) / 0.01;
	double most = fmax(fabs(m->lo - m->zero), fabs(m->hi - m->zero));

	if (!isfinite(most)) { /* no window */
		if (ct_alloc(&j->most, j->n[2], sizeof *j->most, e))
			return -1;
		ct_par_for(j->env->par, j->n[2], find_largest, j);
		most = 0;
		for (size_t k = 0; k < j->n[2]; k++)
			most = fmax(most, (double)j->most[k] + fabs(m->zero));
		free(j->most);
	}
	*suits = most * m->scale <= 2 * range;
	return 0;
}

int ct_ssim_volume(double *sum, double *count, const struct ct_ssim_rule *rule, int axis,
	const size_t n[static 3], const float *ref, const float *test, const float *mask,
	const struct ct_ssim_map *map, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.rule = rule,
		.map = map,
		.env = env,
		.axis = axis,
		.ref = ref,
		.test = test,
		.mask = mask,
		.len = (n[axis] + TX - 1) / TX * TX};
	size_t tasks, parts;
	bool small;
	int rc = -1;

	for (int a = 0; a < 3; a++) {
		j.n[a] = n[a];
		j.radius[a] = a == axis && rule->dims == 2 ? 0 : rule->radius;
		j.crop[a] = a == axis && rule->dims == 2 ? 0 : rule->crop;
	}
	j.block = j.radius[2] ? TZ : 1;
	tasks = (n[2] + j.block - 1) / j.block;
	parts = axis == 2 ? 1 : tasks;
	if (suits_float(&small, &j, e) ||
		ct_alloc0(&j.part, parts * 2 * j.len, sizeof *j.part, e) ||
		ct_alloc(&j.scratch, SCRATCH * ct_par_threads(env->par),
			small ? sizeof(float) : sizeof(double), e))
		goto out;
	ct_par_for(env->par, tasks, small ? float_block : double_block, &j);
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

void ct_ssim_clip_row(double *out, const float *v, size_t n, const struct ct_ssim_map *map)
{
	double_clip(out, v, n, map->lo, map->hi, map->zero);
}
