/* cost.c: what ct_refine_run will take; see refine.h.
 *
 *   inversion   (once + each x iterations) x voxels; `once` and `each` are measured on a piece of
 *               about SOLVER_PIECE^3 fine voxels, the number of iterations on one of PRIOR_PIECE^3
 *   prior       each x textured cells + rest x voxels: `each` from pieces of about CELLS cells, at
 *               those of a lattice of places that have most texture; `rest` from a flat one
 *
 * Processor time, so that other work on the machine does not count. */
#include "config.h"
#include "core/clock.h"
#include "refine/refine.h"
#include "refine/slabs.h"
#include "resolution/crop.h"
#include "resolution/pilot.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
	SOLVER_PIECE = 192,
	PRIOR_PIECE = 64,
	TRIES = 9,
	PLACES = 3,
	LATTICE = PLACES * PLACES * PLACES
};
/* Pieces on which the prior is tried, their cells, and cells at which texture is looked for. */
enum { PARTS = 3, CELLS = 12000 };
#define LOOKS 1e5

static const double middle[3] = {0.5, 0.5, 0.5};

/* The coarse voxels that make `fine` voxels along each axis, or fewer, at a place in [0, 1]^3. */
static int cut(struct ct_vol *piece, const struct ct_vol *in, const double factor[3], double fine,
	const double at[3], struct ct_err *e)
{
	ptrdiff_t start[3];
	size_t n[3];

	for (int a = 0; a < 3; a++) {
		const double most = fmax(ceil(fine / factor[a]), 1);

		n[a] = (double)in->n[a] < most ? in->n[a] : (size_t)most;
		start[a] = (ptrdiff_t)(at[a] * (double)(in->n[a] - n[a]));
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
	const struct ct_upsample_rule rule = ct_refine_inversion(r);

	return r->is.known && ct_slab_axis(&r->is.by, in->n) >= 0 && ct_pilot_size(n, in, &rule) &&
	       (r->slabs > 1 || memcmp(n, in->n, sizeof in->n) != 0);
}

/* Voxels that are refined: what lies about slabs twice, and the pilot. */
static double work_of(const struct ct_refine *r, const struct ct_vol *in)
{
	double plane = (double)ct_vol_count(in), all = 0;
	size_t n[3];

	for (size_t k = 0; k < r->slabs; k++) {
		const struct ct_slab s = r->slabs > 1 ? ct_slab_at(&r->is.by, in->n, k, r->slabs)
						      : (struct ct_slab){.hi = 1, .of = 1};

		all += plane * (double)(s.hi - s.lo) / (double)s.of;
	}
	if (pilot_of(n, r, in))
		all += (double)n[0] * (double)n[1] * (double)n[2];
	return all;
}

static int inversion(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule rule = ct_refine_inversion(r);
	struct ct_upsample_report small, large;
	struct ct_vol piece = {0};
	double least, once, most;
	double iterations;
	size_t n[3];
	int rc = -1;

	if (cut(&piece, in, r->is.by.factor, PRIOR_PIECE, middle, e) ||
		try(&least, &small, &piece, &rule, env, e))
		goto out;
	iterations = (double)small.iterations;
	if (iterations > 0 && pilot_of(n, r, in))
		iterations = fmin(fmax(iterations, CT_PILOT_LEAST), (double)rule.iterations);
	ct_vol_free(&piece);
	rule.tolerance = 0;
	rule.iterations = 1;
	if (cut(&piece, in, r->is.by.factor, SOLVER_PIECE, middle, e) ||
		try(&once, &large, &piece, &rule, env, e))
		goto out;
	rule.iterations = 1 + TRIES;
	if (iterations > 0 && try(&most, &large, &piece, &rule, env, e))
		goto out;
	if (iterations > 0)
		once += fmax(most - once, 0) / TRIES * (iterations - 1);
	*cpu += once * work_of(r, in) / (double)ct_vol_count(&piece);
	rc = 0;
out:
	ct_vol_free(&piece);
	return rc;
}

static double largest(const double factor[3])
{
	return fmax(factor[0], fmax(factor[1], factor[2]));
}

/* Cells along the side of a patch. */
static size_t patch_cells(const struct ct_slice_prior *prior, const double factor[3])
{
	const size_t cell = (size_t)largest(factor);

	for (size_t i = 0; i < prior->n; i++)
		if (prior->r[i].shape.cell == cell)
			return (prior->r[i].shape.side + cell / 2) / cell;
	return 1;
}

/* Does v vary in the square of w x w cells, `step` voxels each, of the slice across the axis? */
static bool is_uneven(
	const struct ct_vol *v, const size_t at[3], const size_t step[3], int axis, ptrdiff_t w)
{
	const int side[2] = {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
	const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};
	const float *x = v->data + at[0] + at[1] * stride[1] + at[2] * stride[2];
	const double count = (double)(w * w);
	double sum = 0, square = 0;

	for (ptrdiff_t q = 0; q < w * w; q++) {
		const ptrdiff_t cell[2] = {q % w - w / 2, q / w - w / 2};
		ptrdiff_t to = 0;
		double d;

		for (int s = 0; s < 2; s++) {
			const int a = side[s];
			const ptrdiff_t last = (ptrdiff_t)v->n[a] - 1, from = (ptrdiff_t)at[a];
			const ptrdiff_t i = from + cell[s] * (ptrdiff_t)step[a];

			to += ((i < 0 ? 0 : i > last ? last : i) - from) * (ptrdiff_t)stride[a];
		}
		d = (double)x[to] - (double)*x;
		sum += d;
		square += d * d;
	}
	return square / count - sum / count * (sum / count) >
	       (double)(CT_PATCH_FLAT * CT_PATCH_FLAT);
}

/* Cells of slices across the three axes that are textured once v is refined, nearly: those about
 * which v, in a square of w x w cells of the slice, varies. Of a large scan from some of them. */
static double count_uneven(const struct ct_vol *v, const double factor[3], size_t w)
{
	const double most = largest(factor);
	size_t step[3], skip, count = 0, seen = 0;
	double cells = 1;

	for (int a = 0; a < 3; a++) {
		step[a] = (size_t)fmax(nearbyint(most / factor[a]), 1);
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

/* CPU seconds of what the prior adds to a piece, and its textured cells, on top. */
static int try_prior(double *cpu, double *uneven, const struct ct_vol *piece,
	const struct ct_refine *r, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule refine = {
		.method = CT_UPSAMPLE_BSPLINE, .known = true, .by = r->is.by};
	const double *factor = r->is.by.factor;
	struct ct_restore_report did;
	struct ct_upsample_report up;
	struct ct_vol x = {0};
	double begin;
	int rc = -1;

	if (ct_upsample(&x, piece, &refine, &up, env, e) == 0) {
		begin = ct_clock_cpu();
		rc = ct_restore(&x, NULL, piece, r->rule.prior, &r->restore, &did, env, e);
		*cpu += ct_clock_cpu() - begin;
		*uneven += count_uneven(piece, factor, patch_cells(r->rule.prior, factor));
	}
	ct_vol_free(&x);
	return rc;
}

/* A place of a piece, and its textured cells. */
struct place {
	double at[3], uneven;
};

/* More of them come first. */
static int compare(const void *a, const void *b)
{
	const struct place *x = a, *y = b;

	return (x->uneven < y->uneven) - (x->uneven > y->uneven);
}

/* Fine voxels along the side of a piece of CELLS cells, of slices across three axes. */
static double side_of(const double factor[3])
{
	return cbrt(CELLS / 3.0 * pow(largest(factor), 2));
}

/* All places of a lattice. */
static int survey(struct place p[LATTICE], const struct ct_vol *in, const double factor[3],
	size_t cells, struct ct_err *e)
{
	for (int i = 0; i < LATTICE; i++) {
		const int at[3] = {i % PLACES, i / PLACES % PLACES, i / (PLACES * PLACES)};
		struct ct_vol piece = {0};

		for (int a = 0; a < 3; a++)
			p[i].at[a] = at[a] / (PLACES - 1.0);
		if (cut(&piece, in, factor, side_of(factor), p[i].at, e))
			return -1;
		p[i].uneven = count_uneven(&piece, factor, cells);
		ct_vol_free(&piece);
	}
	qsort(p, LATTICE, sizeof *p, compare);
	return 0;
}

static int prior(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const double *factor = r->is.by.factor;
	const size_t cells = patch_cells(r->rule.prior, factor);
	const double times = work_of(r, in) / (double)ct_vol_count(in);
	struct place p[LATTICE];
	double uneven = 0, sum = 0, flat = 0, none = 0, share = 1, each;

	if (survey(p, in, factor, cells, e))
		return -1;
	for (int k = 0; k <= PARTS; k++) {
		struct ct_vol piece = {0};
		int rc = cut(&piece, in, factor, side_of(factor), p[k % PARTS].at, e);

		share = rc ? 1 : (double)ct_vol_count(&piece) / (double)ct_vol_count(in);
		if (rc == 0 && k == PARTS)
			memset(piece.data, 0, ct_vol_count(&piece) * sizeof *piece.data);
		rc = rc || try_prior(k < PARTS ? &sum : &flat, k < PARTS ? &uneven : &none, &piece,
				   r, env, e);
		ct_vol_free(&piece);
		if (rc)
			return -1;
	}
	each = fmax(sum - PARTS * flat, 0) / fmax(uneven, 1);
	*cpu += times * (flat / share + each * count_uneven(in, factor, cells));
	return 0;
}

int ct_refine_cost(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env quiet = *env;

	quiet.log = NULL;
	quiet.progress = NULL;
	*cpu = 0;
	if ((r->rule.method != CT_REFINE_PRIOR || !r->rule.start) &&
		inversion(cpu, r, in, &quiet, e))
		return -1;
	return r->adds ? prior(cpu, r, in, &quiet, e) : 0;
}
