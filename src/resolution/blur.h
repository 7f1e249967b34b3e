/* blur.h: how a CT was sampled, measured from the CT itself.
 *
 * Who refines a volume must know how it was blurred, and a clinical scan has no header that says
 * so. Sharpness is measured on edges of the anatomy, as Sanders, Hurwitz and Samei do (Med Phys 43,
 * 5330, 2016), axis by axis. The noise (noise.h) says which steps count.
 *
 * Edges. Along axis a, the 7 differences d_k of 8 neighbours are kept if the middle one is the
 * steepest, if the step |sum d| is 150 HU or more (10 times the noise if that is more, at most
 * 400), if most of it goes one way (|sum d| > 0.75 sum |d|), and if the surface is not inclined by
 * more than 45 degrees, in voxels. A step edge under a Gaussian of sigma voxels and an ideal
 * low-pass at the Nyquist frequency has differences of power spectrum
 *
 *   S(f) = sinc(f)^2 exp(-4 pi^2 sigma^2 f^2),  |f| < 1/2,
 *
 * whose autocorrelation ratio rho = r(1)/r(0) grows with sigma from 1/6 to 0.82 at 1. `measured` is
 * the sigma of the mean ratio, every edge scaled to a unit step.
 *
 * Safety. Anatomy is soft itself: edges show at least the blur, mostly more. Assuming too little
 * blur is safe for the solvers, too much is not. So `sigma` takes rho two standard errors lower,
 * subtracts what the truth on the finer grid would show too, and is shrunk:
 * sigma = 0.64 sqrt(low^2 - (0.6/factor)^2). Below -1100 HU is padding, not looked at,
 * and neither is that of padding.h.
 *
 * Where the constants come from, how good the figures are, and what cannot be told from them:
 * doc/blur-estimate.md.
 */
#ifndef CT_RESOLUTION_BLUR_H
#define CT_RESOLUTION_BLUR_H
#include "core/vol.h"
#include "core/par.h"
#include "core/words.h"

#include <stddef.h>

/* What the blur means for who refines the axis. */
#define CT_SAMPLING_LIST(X)                                                                        \
	X(CT_SAMPLING_UNKNOWN, "unknown") /* fewer than 12 edges: nothing can be said */           \
	X(CT_SAMPLING_ALIASED, "aliased") /* aliasing >= 0.292, as P3: do not force consistency */ \
	X(CT_SAMPLING_SHARP, "sharp")     /* 0.141 to 0.292, as P2 */                              \
	X(CT_SAMPLING_WELL, "well")       /* less, as P1 */
enum ct_sampling { CT_SAMPLING_LIST(CT_WORD_VALUE) };

struct ct_blur_axis {
	double measured; /* standard deviation of the blur that the edges show, voxels of v, in
			    [0, 1]; NaN if unknown */
	double sigma; /* the one that is safe to assume, voxels of v, <= measured; 0 if unknown */
	double aliasing; /* power of the edges at 0.4 cycles a voxel over that at 0: 0.18 for a step
			    under P1, 0.39 under P2, towards 1 if point sampled; NaN if unknown */
	size_t edges;    /* it rests on so many */
	enum ct_sampling sampling;
};

struct ct_blur {
	struct ct_blur_axis axis[3];
	double noise, sure; /* HU, as noise.h has them */
};

/* Measure v, in HU, which will be refined factor[a] >= 1 times (whole or not) along axis a; in
 * voxels of the finer grid the blur to assume is axis[a].sigma * factor[a]. An axis of fewer than 8
 * voxels is unknown. CT_ENUMERIC for NaN and infinite voxels, CT_EINPUT for a factor below 1,
 * CT_ENOMEM. The result does not depend on the number of threads. */
int ct_blur_estimate(struct ct_blur *out, const struct ct_vol *v, const double factor[static 3],
	struct ct_par *par, struct ct_err *e);

#endif
