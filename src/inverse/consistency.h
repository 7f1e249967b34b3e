/* consistency.h: data consistency: the volume nearest to x that a degradation D (degrade.h) maps to
 * y.
 *
 * With the singular value decomposition D = U^T G V of each axis (svd.h), V the three-axis
 * product of the V's, and c = V x the coefficients of x in the row space of D:
 *
 *   x <- x + V^T d,  d = c_y - c, c_y = G^-1 U y             |D x - y| = 0, the nearest such x
 *   d = mu g^2 / (1 + mu g^2) (c_y - c)                      |D x - y| <= noise sqrt(M), M voxels
 *
 * in the second case with the least mu >= 0 that meets the bound, none if it is met already.
 * Frequencies that D loses (g = 0) are left as they are.
 *
 * A D of few weights a row, and well conditioned, is not walked by way of V, whose products take as
 * many steps a voxel as the volume is long, but as V = G^-1 U D: D on planes of voxels, U on the
 * few samples that it makes, the same number of steps for any size. Without noise not even U is
 * needed: x <- x + D^T (D D^T)^-1 (y - D x), and D D^T of an axis has few numbers a row.
 *
 * Planes (i,j) are the unit of work, so that a solver can do its own work on a plane while it is
 * in the cache: reduce planes to (m1,m0), correct all of them along k, expand them. A D of few
 * weights is applied along k in the same steps: a plane, reduced, is added to the samples that
 * it is a part of, a slab of planes to its own, so that slabs can be reduced at once; and it is
 * expanded from the few samples that are a part of its correction. All in float
 * with sums of at most n terms: D x = y holds to some 1e-6 of the values; what needs more applies
 * D+ in double once at the end (ct_consistency_pinv_plan).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_INVERSE_CONSISTENCY_H
#define CT_INVERSE_CONSISTENCY_H
#include "operator/banded.h"
#include "operator/cosine.h"
#include "operator/degrade.h"

/* Multipliers of corrections, one after the other: kept while there is room, or, where there is
 * none, given: of those after the last, the last. */
struct ct_multipliers {
	double *mu;
	size_t n, room;
};

enum { CT_CONSISTENCY_SLAB = 16 }; /* planes of a slab; the last may have fewer */

struct ct_consistency {
	size_t n[3], m[3];
	bool same[3];            /* axes that D leaves as they are */
	bool banded;             /* V = G^-1 U D: planes are multiplied by D, and U is left */
	bool exact;              /* and that without noise: D D^T is solved */
	struct ct_banded d[3];   /* if banded */
	struct ct_cosine v[3];   /* V of axes that are not the same, or U; none if exact */
	double *g[3], *unit[3];  /* in the order of the coefficients (g/s: colour); c of one of
				    work */
	size_t stride[2], plane; /* of coefficients along i and j, of which one is 1; m0 m1 */
	float *want, *had;       /* (m2,plane): c_y; c of the volume before the last step. exact:
				    y, NULL */
	float *coef;             /* (m2,plane): work; banded: what D^T makes the correction of */
	float *reduced;          /* (n2,plane): planes reduced, and then their corrections; banded:
				    (.,plane), the samples of each slab */
	struct ct_consistency_slab {
		size_t at, first, count; /* coarse planes first, ... in planes at, ... of reduced;
					    then its first plane, unless D has one weight */
	} * slab;
	bool known;  /* exact: x agreed before the last step */
	float *work; /* of each thread `share` floats: a tile, a plane reduced along one axis, and,
			banded, along both */
	size_t tile, share;
	double *sums;     /* of the column blocks */
	double bound, mu; /* M noise^2, of which 0 is exact; multiplier found last */
	struct ct_multipliers *multipliers; /* kept, or given; the caller's, NULL: neither */
	size_t corrections;
	double condition; /* of D: product over the axes */
};

/* Operator d on volumes of n voxels, all of which it covers (CT_EGEOM else); y has what d makes of
 * n. noise: HU, >= 0. `par` of all calls with dc is this one or has fewer threads. Allocates *dc,
 * which must be zero. CT_EGEOM, CT_EINPUT, CT_ENOMEM. */
int ct_consistency_alloc(struct ct_consistency *dc, const struct ct_degrade *d,
	const size_t n[static 3], const float *y, double noise, struct ct_par *par,
	struct ct_err *e);
/* Bytes of voxels that it has, by the same rules; is there noise? CT_EGEOM, CT_EINPUT, CT_ENOMEM.
 */
int ct_consistency_bytes(double *bytes, const struct ct_degrade *d, const size_t n[static 3],
	bool noise, struct ct_err *e);
/* Noise whose neighbours are so much alike along each axis (estimate/noise.h) instead of white:
 * frequencies count by their part of it, |S^-1 (D x - y)| <= noise sqrt(M), S^2 the powers, of
 * mean 1. Axes that D leaves as they are stay white: their coefficients are samples. Of 3, or NULL:
 * white. Before anything else. CT_ENOMEM. */
int ct_consistency_colour(struct ct_consistency *dc, const double *alike, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_consistency_free(struct ct_consistency *dc);

/* Take in plane k of a volume, x (n1,n0). Thread-safe for different slabs. The planes of a slab are
 * to be given upwards, but its first at any time, at which this is thread-safe too. */
void ct_consistency_reduce(struct ct_consistency *dc, size_t k, const float *x, size_t worker);
/* out = x (NULL is 0) + plane k of the correction; out may be x. Thread-safe. */
void ct_consistency_expand(
	const struct ct_consistency *dc, size_t k, float *out, const float *x, size_t worker);
/* If D is banded, and only along k, and the correction of plane k a multiple of a plane: that one,
 * times *by; else NULL. */
const float *ct_consistency_multiple(const struct ct_consistency *dc, size_t k, float *by);
/* From the planes of a volume x + step, all reduced, to its correction V^T d. Returns
 * |d|^2 + 2 <V step, d>, where V x are the coefficients after the last call: so that
 * |step + V^T d|^2 = |step|^2 + this. NaN in the first call, and maybe if not to `measure`. */
double ct_consistency_correct(struct ct_consistency *dc, bool measure, struct ct_par *par);
/* A whole volume: all its planes taken in; the correction added to all; and the three, x <- nearest
 * consistent volume. */
void ct_consistency_take(struct ct_consistency *dc, float *x, struct ct_par *par);
void ct_consistency_add(struct ct_consistency *dc, float *x, struct ct_par *par);
void ct_consistency_apply(struct ct_consistency *dc, float *x, struct ct_par *par);

/* Powers of noise whose neighbours are so much alike at the m frequencies k/2m cycles a voxel of an
 * axis, of mean 1. */
void ct_consistency_powers(double *power, size_t m, double alike);
/* Parts of these (consistency-planes.c). */
/* Set tile and share. */
void ct_consistency_measure_work(struct ct_consistency *dc);
/* The rest of a banded dc. */
/* Lay out dc->slab, of `planes` of dc->reduced. */
int ct_consistency_cut(struct ct_consistency *dc, size_t *planes, struct ct_err *e);
/* out (n) = want dc->want + made D x, samples [at, at + n) of coarse plane o. */
void ct_consistency_gather(const struct ct_consistency *dc, float *out, size_t o, size_t at,
	size_t n, float want, float made);
/* coef = (D D^T)^-1 (y - D x); returns as ct_consistency_correct. */
double ct_consistency_solve(struct ct_consistency *dc, bool measure, struct ct_par *par);

/* D+ in double for volumes of n voxels. Allocates. */
int ct_consistency_pinv_plan(struct ct_separable *s, const struct ct_degrade *d,
	const size_t n[static 3], const struct ct_par *par, struct ct_err *e);
/* x, n voxels, <- x + D+ t in double, t what of y - D x is beyond +-most: of 0 all of it, INFINITY
 * leaves x. *residual (may be NULL) <- RMS of D x - y then. CT_EGEOM, CT_EINPUT, CT_ENOMEM. */
int ct_consistency_settle(float *x, const float *y, const struct ct_degrade *d,
	const size_t n[static 3], double most, double *residual, struct ct_par *par,
	struct ct_err *e);

#endif
