/* tv.h: the volume of least total variation among those that agree with the data.
 *
 *   min_x TV(x)  subject to  |D x - y| <= noise sqrt(M)       (consistency.h; noise 0: D x = y)
 *   TV(x) = sum over voxels of sqrt(sum_a (w_a (x[i + e_a] - x[i]))^2)
 *
 * forward differences, none at the last voxel of an axis; w_a = smallest spacing / spacing of the
 * axis, so that a gradient counts in mm whatever the grid (Rudin, Osher, Fatemi, Physica D 1992).
 *
 * Solved by the primal-dual method of Chambolle and Pock (JMIV 2011) in the order that needs no
 * second copy of x, the dual being what is extrapolated:
 *
 *   p' = project onto |p| <= 1 of  p + s grad x
 *   x' = nearest consistent volume to  x + t div(2 p' - p)         s t |grad|^2 = 1
 *
 * in one sweep over the volume an iteration: a plane is corrected, differenced, its dual moved, the
 * new plane written in place and reduced for the next correction while it is in the cache. p is
 * kept in 16 bits, in units of 1/32767, and what is rounded is what x' is made of: x and p are read
 * and written once each, 20 bytes a voxel. Memory: one and a half volumes beside x, and what dc
 * holds. Planes are cut into slabs by their number, not by threads: the same bytes for any.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_INVERSE_TV_H
#define CT_INVERSE_TV_H
#include "core/env.h"
#include "inverse/consistency.h"

enum { CT_TV_DUAL = 3 };

/* Added to the objective: |x - to|^2 / (2 mu), so that the solution is the proximal point of `to`
 * in the sense of mu TV and consistency. */
struct ct_tv_near {
	const float *to; /* as x; NULL: nothing is added */
	double mu;       /* > 0, in the unit of the values */
	int16_t *dual;   /* (CT_TV_DUAL volumes) begin with it, leave the last there; NULL: zeros */
};

struct ct_tv_rule {
	double weight[3]; /* w_a of each axis, in (0, 1] */
	double step; /* (first) primal step t |grad|, the unit of the values: HU of a strong edge /
			30 */
	size_t iterations; /* at most */
	double tolerance;  /* stop when an iteration moves x by less than this, RMS; 0: never */
	struct ct_tv_near near;
};

struct ct_tv_report {
	size_t iterations;
	double change; /* RMS movement of x in the last step that was measured */
};

/* x: the volume to start from, dc->n; replaced by the solution. CT_ENUMERIC naming the iteration if
 * it diverges, CT_ENOMEM, CT_ESTOP: x is then the volume so far; with near.to, before its
 * correction, and it and the dual are such that a call with the iterations that are left,
 * report->iterations less, makes the same bytes. */
int ct_tv(float *x, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e);

/* The same with second-order variation (hessian-tv.c), which knows no `near`:
 *
 *   min_x sum over voxels of |H x|_F   subject to  |D x - y| <= noise sqrt(M)
 *
 * H x the matrix of second differences w_a w_b d_a d_b x, |.|_F its Frobenius norm (Lefkimmiatis,
 * Bourquard, Unser, IEEE TIP 2012): a ramp costs nothing, so shading is not turned into steps and
 * points that the data leave undetermined are joined smoothly. d_a d_a is the central second
 * difference, d_a d_b of two axes the product of forward differences; those that would need a voxel
 * outside are zero.
 *
 * The primal step falls from one that is right for strong edges to a twentieth of it, halved every
 * 30 iterations: the dual of faint slopes then comes to rest too, and leaves no texture where a
 * scan is nearly flat. Those 30 are made whatever the tolerance, as a dual of zeros moves little at
 * first. Memory: four volumes beside x, and what dc holds. */
int ct_tv_hessian(float *x, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e);

/* |grad|^2 on n voxels, no more than 4 sum w_a^2; 1 for a single voxel. */
double ct_tv_norm(const double weight[static 3], const size_t n[static 3]);

/* The loop of both. */
struct ct_tv_loop {
	const char *what; /* it minimises */
	size_t known;     /* iterations from this on tell how far they move, */
	size_t least;     /* and may be the last */
	/* Iteration `it`; if to measure, the square of how far it moved. */
	double (*iterate)(void *job, size_t it, bool measure, struct ct_par *par);
	void *job;
	size_t voxels;
};
int ct_tv_run(const struct ct_tv_loop *loop, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e);

#endif
