/* expect-prior.c: see expect-prior.h. */
#include "config.h"
#include "core/clock.h"
#include "resolution/upsample.h"
#include "tools/lib/expect-prior.h"
#include "tools/lib/expect.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { PIECE = 64, PARTS = 8, PLACES = 3 };
#define LOOKS 1e6 /* places of a large scan about which it is looked */

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

/* Cells of slices across the three axes that are not flat once v is refined, nearly: those about
 * which v, in a square of w x w cells of the slice, varies. Of a large scan from some of them. */
static double count_uneven(const struct ct_vol *v, const double factor[3], size_t w)
{
	const double most = largest(factor);
	size_t step[3], skip, count = 0, looks = 0;
	double cells = 1;

	for (int a = 0; a < 3; a++) {
		step[a] = (size_t)fmax(nearbyint(most / factor[a]), 1);
		cells *= (double)v->n[a] / (double)step[a];
	}
	skip = (size_t)fmax(ceil(cbrt(cells / LOOKS)), 1);
	for (size_t k = 0; k < v->n[2]; k += skip * step[2])
		for (size_t j = 0; j < v->n[1]; j += skip * step[1])
			for (size_t i = 0; i < v->n[0]; i += skip * step[0])
				for (int axis = 0; axis < 3; axis++, looks++)
					count += is_uneven(v, (const size_t[3]){i, j, k}, step,
						axis, (ptrdiff_t)w);
	return 3 * cells * (double)count / (double)looks;
}

/* CPU seconds of what the prior adds to a piece, and its cells that are not flat, on top. */
static int try(double *cpu, double *uneven, const struct ct_vol *piece,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule refine = {
		.method = CT_UPSAMPLE_BSPLINE, .known = true, .by = rule->by};
	struct ct_restore_report did;
	struct ct_upsample_report up;
	struct ct_vol x = {0};
	double begin;
	int rc = -1;

	if (ct_upsample(&x, piece, &refine, &up, env, e) == 0) {
		begin = ct_clock_cpu();
		rc = ct_restore(&x, NULL, piece, prior, rule, &did, env, e);
		*cpu += ct_clock_cpu() - begin;
		*uneven +=
			count_uneven(piece, rule->by.factor, patch_cells(prior, rule->by.factor));
	}
	ct_vol_free(&x);
	return rc;
}

/* A place of a piece, and the cells of it that are not flat. */
struct place {
	double at[3], uneven;
};

/* More of them come first. */
static int compare(const void *a, const void *b)
{
	const struct place *x = a, *y = b;

	return (x->uneven < y->uneven) - (x->uneven > y->uneven);
}

/* All places, on a lattice. */
static int survey(struct place p[PLACES * PLACES * PLACES], const struct ct_vol *in,
	const double factor[3], size_t cells, struct ct_err *e)
{
	for (int i = 0; i < PLACES * PLACES * PLACES; i++) {
		const int at[3] = {i % PLACES, i / PLACES % PLACES, i / (PLACES * PLACES)};
		struct ct_vol piece = {0};

		for (int a = 0; a < 3; a++)
			p[i].at[a] = at[a] / (PLACES - 1.0);
		if (expect_piece(&piece, in, factor, PIECE, p[i].at, e))
			return -1;
		p[i].uneven = count_uneven(&piece, factor, cells);
		ct_vol_free(&piece);
	}
	qsort(p, (size_t)(PLACES * PLACES * PLACES), sizeof *p, compare);
	return 0;
}

int expect_prior(double *cpu, const struct ct_vol *in, bool whole,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	const double *factor = rule->by.factor;
	const size_t cells = patch_cells(prior, factor);
	struct place p[PLACES * PLACES * PLACES];
	double uneven = 0, sum = 0, flat = 0, none = 0, share, each;

	if (whole)
		return try(cpu, &uneven, in, prior, rule, env, e);
	if (survey(p, in, factor, cells, e))
		return -1;
	for (int k = 0; k <= PARTS; k++) {
		struct ct_vol piece = {0};
		int rc = expect_piece(&piece, in, factor, PIECE, p[k % PARTS].at, e);

		share = rc ? 0 : (double)ct_vol_count(&piece) / (double)ct_vol_count(in);
		if (rc == 0 && k == PARTS)
			memset(piece.data, 0, ct_vol_count(&piece) * sizeof *piece.data);
		rc = rc || try(k < PARTS ? &sum : &flat, k < PARTS ? &uneven : &none, &piece, prior,
				   rule, env, e);
		ct_vol_free(&piece);
		if (rc)
			return -1;
	}
	each = fmax(sum - PARTS * flat, 0) / fmax(uneven, 1);
	*cpu += flat / share + each * count_uneven(in, factor, cells);
	return 0;
}
