/* refine-cost.c: what ct_refine_run will take; see refine.h.
 *
 *   inversion   (once + each x iterations) x voxels; `once` and `each` are measured on a piece of
 *               about SOLVER_PIECE^3 fine voxels, the number of iterations on one of PRIOR_PIECE^3
 *   prior       each x textured cells + rest x voxels: `each` from STRATA pieces of about CELLS
 *               cells, with much texture and little; `rest` from a flat one. What the first call
 *               takes beside it, as oneDNN then makes its code, comes once.
 *
 * Rehearsals take the same, of the parts of the CT that they make coarser.
 *
 * Processor time, so that other work on the machine does not count.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "refine/refine.h"
#include "refine/rehearsal.h"
#include "refine/slabs.h"
#include "operator/crop.h"
#include "inverse/pilot.h"
#include "restore/patch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	SOLVER_PIECE = 192,
	PRIOR_PIECE = 64,
	ARSSR_PIECE = 12,
	TRIES = 8,
	STRATA = 4,
	LATTICE = 5, /* places of a piece along an axis */
	PLACES = LATTICE * LATTICE * LATTICE,
	MIDDLE = PLACES / 2
};

#define LOOKS 1e5 /* cells at which texture is looked for */

/* The index `by` on along an axis of n, or the last before the border. */
static size_t on(size_t at, ptrdiff_t by, size_t n)
{
	const ptrdiff_t to = (ptrdiff_t)at + by;

	return to < 0 ? 0 : (size_t)to < n ? (size_t)to : n - 1;
}

/* Does v vary in the square of w x w cells, `step` voxels each, of the slice across the axis? */
static bool is_uneven(
	const struct ct_vol *v, const size_t at[3], const size_t step[3], int axis, ptrdiff_t w)
{
	const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
	const double count = (double)(w * w);
	const double first = (double)v->data[(at[2] * v->n[1] + at[1]) * v->n[0] + at[0]];
	double sum = 0, square = 0;
	size_t p[3] = {at[0], at[1], at[2]};

	for (ptrdiff_t q = 0; q < w * w; q++) {
		double d;

		p[a] = on(at[a], (q % w - w / 2) * (ptrdiff_t)step[a], v->n[a]);
		p[b] = on(at[b], (q / w - w / 2) * (ptrdiff_t)step[b], v->n[b]);
		d = (double)v->data[(p[2] * v->n[1] + p[1]) * v->n[0] + p[0]] - first;
		sum += d;
		square += d * d;
	}
	return square / count - sum / count * (sum / count) >
	       (double)(CT_PATCH_FLAT * CT_PATCH_FLAT);
}

double ct_refine_cells(const struct ct_vol *v, const double factor[3], size_t w)
{
	const double most = fmax(factor[0], fmax(factor[1], factor[2]));
	size_t step[3], skip, count = 0, seen = 0;
	double cells = 1;

	for (int a = 0; a < 3; a++) {
		step[a] = factor[a] > 1 ? 1 : (size_t)fmax(nearbyint(most), 1);
		cells *= (double)v->n[a] / (double)step[a];
	}
	skip = (size_t)fmax(ceil(cbrt(cells / LOOKS)), 1);
	for (size_t k = 0; k < v->n[2]; k += skip * step[2])
		for (size_t j = 0; j < v->n[1]; j += skip * step[1])
			for (size_t i = 0; i < v->n[0]; i += skip * step[0])
				for (int axis = 0; axis < 3; axis++, seen++)
					count += is_uneven(v, (const size_t[3]){i, j, k}, step,
						axis, (ptrdiff_t)w);
	return 3 * cells * (double)count / (double)seen;
}
#define CELLS 36000.0 /* of slices of a piece on which the prior is tried */

/* Fine voxels along a side of a piece on which the prior is tried. */
static double side_of(const double factor[3])
{
	return cbrt(CELLS / 3 * pow(fmax(factor[0], fmax(factor[1], factor[2])), 2));
}

/* The coarse voxels that make `fine` voxels along each axis, or fewer, at a place of the lattice,
 * i fastest. */
static int cut(struct ct_vol *piece, const struct ct_vol *in, const double factor[3], double fine,
	int place, struct ct_err *e)
{
	ptrdiff_t start[3];
	size_t n[3];

	for (int a = 0; a < 3; a++, place /= LATTICE) {
		const double most = fmax(ceil(fine / factor[a]), 1);

		n[a] = (double)in->n[a] < most ? in->n[a] : (size_t)most;
		start[a] = (ptrdiff_t)((in->n[a] - n[a]) * (2 * (size_t)(place % LATTICE) + 1) /
				       (2 * LATTICE));
	}
	return ct_crop(piece, in, n, start, 0, e);
}

/* Seconds of the inversion of a piece. */
static int try(double *cpu, struct ct_upsample_report *did, const struct ct_vol *piece,
	const struct ct_upsample_rule *rule, const struct ct_env *env, struct ct_err *e)
{
	const double begin = ct_clock_cpu();
	struct ct_vol out = {0};
	const int rc = ct_upsample(&out, piece, rule, did, env, e);

	*cpu = ct_clock_cpu() - begin;
	ct_vol_free(&out);
	return rc;
}

/* Coarse voxels n[3] of a pilot that is not the whole. */
static bool pilot_of(size_t *n, const struct ct_refine *r, const struct ct_vol *in)
{
	const struct ct_upsample_rule rule = ct_refine_inversion(r).first;

	return r->scan.known && ct_slab_axis(&r->scan.operator, in->n) >= 0 &&
	       ct_pilot_size(n, in, &rule) && (r->slabs > 1 || memcmp(n, in->n, sizeof in->n) != 0);
}

/* Voxels that are refined: what lies about slabs twice, and the pilot. */
static double work_of(const struct ct_refine *r, const struct ct_vol *in)
{
	double plane = (double)ct_vol_count(in), all = 0;
	size_t n[3];

	for (size_t k = 0; k < r->slabs; k++) {
		const struct ct_slab s = ct_slab_at(&r->scan.operator, in->n, k, r->slabs);

		all += plane * (double)(s.hi - s.lo) / (double)s.of;
	}
	if (pilot_of(n, r, in))
		all += (double)n[0] * (double)n[1] * (double)n[2];
	return all;
}

/* CPU seconds: of a voxel of the CT, inverted, and flat to the prior; of a textured cell; once. */
struct rates {
	double inverted, flat, cell, once;
};

/* *each += those of a voxel that one method inverts. */
static int inversion_of(double *each, struct ct_upsample_rule rule, const struct ct_refine *r,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_report small, large;
	struct ct_vol piece = {0};
	double least, once, most;
	double iterations;
	size_t n[3];
	int rc = -1;

	if (cut(&piece, in, r->scan.operator.factor, PRIOR_PIECE, MIDDLE, e) ||
		try(&least, &small, &piece, &rule, env, e))
		goto out;
	iterations = (double)small.iterations;
	if (iterations > 0 && pilot_of(n, r, in))
		iterations = fmin(fmax(iterations, CT_PILOT_LEAST), (double)rule.iterations);
	ct_vol_free(&piece);
	rule.tolerance = 0;
	rule.iterations = 1;
	if (cut(&piece, in, r->scan.operator.factor, SOLVER_PIECE, MIDDLE, e) ||
		try(&most, &large, &piece, &rule, env, e) || /* pages are touched first */
		try(&once, &large, &piece, &rule, env, e))
		goto out;
	rule.iterations = 1 + TRIES;
	if (iterations > 0 && try(&most, &large, &piece, &rule, env, e))
		goto out;
	if (iterations > 0)
		once += fmax(most - once, 0) / TRIES * (iterations - 1);
	*each += once / (double)ct_vol_count(&piece);
	rc = 0;
out:
	ct_vol_free(&piece);
	return rc;
}

static int inversion(struct rates *is, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_inversion v = ct_refine_inversion(r);

	if (inversion_of(&is->inverted, v.first, r, in, env, e))
		return -1;
	return v.second > 0 ? inversion_of(&is->inverted, ct_inversion_second(&v), r, in, env, e)
			    : 0;
}

/* Cells along the side of a patch. */
static size_t patch_cells(const struct ct_slice_prior *prior, const struct ct_degrade *by)
{
	bool axes[3];
	const size_t cell = ct_slice_prior_knows(axes, prior, by, false);

	for (size_t i = 0; i < prior->n; i++)
		if (prior->r[i].shape.cell == cell)
			return (prior->r[i].shape.side + cell / 2) / cell;
	return 1;
}

/* CPU seconds of what the prior adds to a piece. */
static int try_prior(double *cpu, const struct ct_vol *piece, const struct ct_refine *r,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_inversion inversion = ct_refine_inversion(r);
	struct ct_restore_report did;
	struct ct_upsample_report up;
	struct ct_vol x = {0};
	double begin;
	int rc = -1;

	if (ct_inversion_run(&x, piece, &inversion, NULL, &up, env, e) == 0) {
		begin = ct_clock_cpu();
		rc = ct_restore(&x, NULL, piece, r->rule.prior, &r->restore, &did, env, e);
		*cpu = ct_clock_cpu() - begin;
	}
	ct_vol_free(&x);
	return rc;
}

static int by_value(const void *a, const void *b)
{
	const double x = **(const double *const *)a, y = **(const double *const *)b;

	return (x < y) - (x > y);
}

/* STRATA places, evenly of all textured cells, from where they are dense to where they are few: how
 * many of them the network looks at differs. count[]: cells of the piece at each place. */
static int strata(size_t place[STRATA], double count[PLACES], const struct ct_vol *in,
	const double factor[3], size_t cells, struct ct_err *e)
{
	const double *order[PLACES];
	double sum = 0, before = 0;
	size_t k = 0;

	for (int i = 0; i < PLACES; i++) {
		struct ct_vol here = {0};

		if (cut(&here, in, factor, side_of(factor), i, e))
			return -1;
		count[i] = ct_refine_cells(&here, factor, cells);
		ct_vol_free(&here);
		order[i] = &count[i];
		sum += count[i];
	}
	qsort(order, PLACES, sizeof *order, by_value);
	for (size_t q = 0; q < STRATA; q++) {
		while (k + 1 < PLACES && before + *order[k] < sum * ((double)q + 0.5) / STRATA)
			before += *order[k++];
		place[q] = (size_t)(order[k] - count);
	}
	return 0;
}

/* CPU seconds of a piece with no texture: of its voxels, and of a first call. */
static int flat(struct rates *is, double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const double *factor = r->scan.operator.factor;
	struct ct_vol piece = {0}, blank = {0};
	double first;
	int rc = -1;

	if (cut(&piece, in, factor, side_of(factor), MIDDLE, e) || ct_vol_like(&blank, &piece, e))
		goto out;
	memset(blank.data, 0, ct_vol_count(&blank) * sizeof *blank.data);
	if (try_prior(&first, &blank, r, env, e) || try_prior(cpu, &blank, r, env, e))
		goto out;
	is->once = fmax(first - *cpu, 0);
	is->flat = *cpu / (double)ct_vol_count(&blank);
	rc = 0;
out:
	ct_vol_free(&piece);
	ct_vol_free(&blank);
	return rc;
}

static int prior(struct rates *is, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const double *factor = r->scan.operator.factor;
	double count[PLACES], blank, cpu = 0;
	size_t place[STRATA];

	if (flat(is, &blank, r, in, env, e) ||
		strata(place, count, in, factor, patch_cells(r->rule.prior, &r->scan.operator), e))
		return -1;
	for (size_t q = 0; q < STRATA; q++) {
		struct ct_vol piece = {0};
		int rc = 0;

		if (q == 0 || place[q] != place[q - 1])
			rc = cut(&piece, in, factor, side_of(factor), (int)place[q], e) ||
			     try_prior(&cpu, &piece, r, env, e);
		ct_vol_free(&piece);
		if (rc)
			return -1;
		is->cell += fmax(cpu - blank, 0) / fmax(count[place[q]], 1) / STRATA;
	}
	return 0;
}

static int arssr(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_arssr_volume v = r->volume;
	struct ct_vol piece = {0};
	float *out = NULL;
	double begin;
	int rc = -1;

	if (cut(&piece, in, (const double[]){1, 1, 1}, ARSSR_PIECE, MIDDLE, e))
		goto out;
	for (int a = 0; a < 3; a++) {
		v.n[a] = ct_degrade_cover(piece.n[a], r->scan.operator.factor[a]);
		v.tiles[a] = 1;
	}
	v.in = &piece;
	if (ct_alloc(&out, v.n[0] * v.n[1] * v.n[2], sizeof *out, e))
		goto out;
	begin = ct_clock_cpu();
	rc = ct_arssr_volume_run(&v, out, env, e);
	*cpu = (ct_clock_cpu() - begin) * ct_arssr_volume_work(&r->volume) /
	       ct_arssr_volume_work(&v);
out:
	ct_vol_free(&piece);
	free(out);
	return rc;
}

/* Textured cells of a CT that `by` made. */
static double textured(
	const struct ct_refine *r, const struct ct_vol *v, const struct ct_degrade *by)
{
	return r->adds ? ct_refine_cells(v, by->factor, patch_cells(r->rule.prior, by)) : 0;
}

/* One rehearsal of each part; more are for the weight and for the predicted error. */
static int rehearsals(double *cpu, const struct rates *is, const struct ct_refine *r,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	struct ct_degrade own;
	size_t n[3];

	*cpu = 0;
	for (int k = 0; ct_rehearsal_part(n, &own, r, in, k); k++) {
		struct ct_vol part = {0}, coarse = {0};
		ptrdiff_t start[3];
		int rc;

		ct_crop_place(start, in->n, n, CT_CROP_PLACES / 2);
		rc = ct_crop(&part, in, n, start, 0, e) ||
		     ct_degrade_volume(&coarse, &part, &own, 0, 0, env->par, e);
		if (rc == 0)
			*cpu += (is->inverted + is->flat) * (double)ct_vol_count(&coarse) +
				is->cell * textured(r, &coarse, &own);
		ct_vol_free(&part);
		ct_vol_free(&coarse);
		if (rc)
			return -1;
	}
	return 0;
}

static int cost_of(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const double times = ct_rehearsal_weighs(r) + r->rule.error, work = work_of(r, in);
	struct ct_env quiet = *env;
	struct rates is = {0};
	double rehearsed = 0;

	quiet.log = NULL;
	quiet.progress = NULL;
	if (r->rule.method == CT_REFINE_ARSSR)
		return arssr(cpu, r, in, &quiet, e);
	if ((r->inverts && inversion(&is, r, in, &quiet, e)) ||
		(r->adds && prior(&is, r, in, &quiet, e)) ||
		(times > 0 && rehearsals(&rehearsed, &is, r, in, &quiet, e)))
		return -1;
	*cpu = is.once + (is.inverted + is.flat) * work +
	       is.cell * textured(r, in, &r->scan.operator) * work / (double)ct_vol_count(in) +
	       times * rehearsed;
	return 0;
}

int ct_refine_cost(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_vol *hu, *use;
	struct ct_vol own = {0}, mid = {0};
	struct ct_refine turned = *r;
	int rc;

	ct_refine_turn(&turned, r->frame.axis);
	rc = ct_err_any(ct_frame_enter(&own, &hu, &r->frame, in, env->par, e) ||
			ct_refine_first(&mid, &use, &turned, hu, env, e) ||
			cost_of(cpu, &turned, use, env, e));
	ct_vol_free(&own);
	ct_vol_free(&mid);
	return rc;
}
