/* hessian-tv.h: the volume of least second-order variation among those that agree with the data.
 *
 *   min_x sum over voxels of |H x|_F   subject to  |D x - y| <= noise sqrt(M)     (consistency.h)
 *
 * H x the matrix of second differences w_a w_b d_a d_b x, |.|_F its Frobenius norm (Lefkimmiatis,
 * Bourquard, Unser, IEEE TIP 2012): a ramp costs nothing, so shading is not turned into steps and
 * points that the data leave undetermined are joined smoothly. d_a d_a is the central second
 * difference, d_a d_b of two axes the product of forward differences; those that would need a voxel
 * outside are zero.
 *
 * Primal-dual as tv.h, but that the primal step falls from one that is right for strong edges to a
 * twentieth of it, halved every 30 iterations: the dual of faint slopes then comes to rest too, and
 * leaves no texture where a scan is nearly flat. Those 30 are made whatever the tolerance, as a
 * dual of zeros moves little at first. Memory: four volumes beside x, and what dc holds. The same
 * bytes for any number of threads.
 */
#ifndef CT_RESOLUTION_HESSIAN_TV_H
#define CT_RESOLUTION_HESSIAN_TV_H
#include "resolution/tv.h"

/* As ct_tv, whose weights, stopping rule and report it shares. */
int ct_hessian_tv(float *x, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e);

#endif
