/* estimate.h: how a CT was sampled, measured from the CT itself.
 *
 * Who refines a volume must know how it was blurred, and a clinical scan has no header that says
 * so. Sharpness is measured on edges of the anatomy, as Sanders, Hurwitz and Samei do (Med Phys 43,
 * 5330, 2016), axis by axis; noise as the local deviation that most of the flat tissue shows, as
 * Christianson et al. do (AJR 205, W93, 2015).
 *
 * Edges. Along axis a, the differences d_k of neighbours around a strong local maximum (8 voxels,
 * 7 differences) are kept if the step |sum d| is 150 HU or more (10 times the noise if that is
 * more, at most 400), if most of it goes one way (|sum d| > 0.75 sum |d|), and if the surface is
 * not inclined by more than 45 degrees, in voxels. A step edge under a Gaussian of sigma voxels and
 * an ideal low-pass at the Nyquist frequency has differences of power spectrum
 *
 *   S(f) = sinc(f)^2 exp(-4 pi^2 sigma^2 f^2),  |f| < 1/2,
 *
 * whose autocorrelation ratio rho = r(1)/r(0) grows with sigma from 1/6 to 0.82 at 1. `measured` is
 * the sigma of the mean ratio, every edge scaled to a unit step.
 *
 * Safety. Anatomy is soft itself: edges show at least the blur, mostly more. Assuming too little
 * blur is safe for the solvers, too much is not. So `sigma` takes rho two standard errors lower,
 * subtracts the half voxel of the finer grid that the truth on that grid would show too, and is
 * shrunk:  sigma = 0.83 sqrt(low^2 - (0.5/factor)^2). The constants were fitted on nine CTs (the z
 * axis of one, resampled from slices several voxels thick, left out), so that sigma is at most 1.1
 * times the truth on 19 of 20 axes; so were the limits of `sampling`.
 *
 * How good. Six other CTs (a chest, a head, a torso, a thorax phantom, and with two kernels a skull
 * phantom) were reduced 2, 3, 4, 8 and 1x1x4 times by the operators P1, P2, P3 of degrade.h, and
 * the 78 axes of each operator measured; truth for P3 and an even factor includes the mean of two:
 *
 *                       unknown  measured/truth 5%, median, 95%  sigma/truth median, 95%, worst
 *   P1, 0.425 voxel        2        0.68  0.94  1.12                0.66  0.82  0.93
 *   P2, 0.25               4        0.85  1.12  1.46                0.67  0.96  1.11
 *   P3, 0.125 to 0.28      2        0     0.35  1.50                0     0.85  1.00
 *
 * `aliasing` ranges (5 to 95%) over 0.16-0.31 for P1, 0.24-0.37 for P2, 0.39-0.68 for P3 when
 * reduced 3, 4, 8 and 1x1x4 times. `sampling` then said well of 33 of 58 axes under P1, sharp of 28
 * of 56 under P2, aliased of 58 of 58 under P3: these six are sharper than the nine, and all
 * the rest but two were called too sharp, which is safe. (Limits 0.24 and 0.37 give 44, 48, 57, but were
 * found with the six in view; fresh scans must confirm them.) Reduced twice, P2 and P3 cannot be
 * told apart: P3 blurs more then, and aliases what the scan hardly has.
 *
 * What it cannot tell: soft anatomy, surfaces oblique to thick slices, or slices thicker than their
 * spacing, from blur (then sigma can be too large: 1.9 times the truth on the z axis left out); a
 * sharpening kernel from less blur; the blur of an axis along which there are no step edges
 * (unknown, sigma 0). A volume masked to a constant, or clipped, has artificial edges that count as
 * sharp: safe. Below -1100 HU is padding, not looked at. White noise of 60 HU, added to three scans
 * reduced 4 times, moved sigma by up to 0.17 voxel, up as well as down, but not above the truth.
 *
 * Noise is assumed to vary within 3 voxels and to be about the same in all flat tissue. Where hardly
 * any tissue is flat, as in a scan reduced 4 times, `noise` is texture and ringing of the low-pass:
 * under P1 it was 1.1 to 2.7 times that of the scan before, of which little is left, and 25 to 90
 * times for the skull phantom. White noise added to it is then found to 10-40%.
 */
#ifndef CT_KERN_ESTIMATE_H
#define CT_KERN_ESTIMATE_H
#include "core/vol.h"
#include "core/par.h"

#include <stddef.h>

/* What the blur means for who refines the axis. */
enum ct_sampling {
	CT_SAMPLING_UNKNOWN, /* fewer than 12 edges: nothing can be said */
	CT_SAMPLING_ALIASED, /* aliasing >= 0.334, as P3: do not force consistency */
	CT_SAMPLING_SHARP,   /* 0.214 to 0.334, as P2 */
	CT_SAMPLING_WELL,    /* less, as P1 */
};

struct ct_estimate_axis {
	double measured; /* standard deviation of the blur that the edges show, voxels of v, in
			    [0, 1]; NaN if unknown */
	double sigma; /* the one that is safe to assume, voxels of v, <= measured; 0 if unknown */
	double aliasing; /* power of the edges at 0.4 cycles a voxel over that at 0: 0.18 for a step
			    under P1, 0.39 under P2, towards 1 if point sampled; NaN if unknown */
	size_t edges;	 /* it rests on so many */
	enum ct_sampling sampling;
};

struct ct_estimate {
	struct ct_estimate_axis axis[3];
	double noise; /* standard deviation, HU, of what is not linear over 3 voxels; 0 if none can
			 be seen. Noise of longer scale is not in it. */
};

/* Measure v, in HU, which will be refined factor[a] >= 1 times (whole or not) along axis a; in
 * voxels of the finer grid the blur to assume is axis[a].sigma * factor[a]. An axis of fewer than 8
 * voxels is unknown. CT_ENUMERIC for NaN and infinite voxels, CT_EINPUT for a factor below 1,
 * CT_ENOMEM. The result does not depend on the number of threads. */
int ct_estimate_of(struct ct_estimate *out, const struct ct_vol *v, const double factor[static 3],
	struct ct_par *par, struct ct_err *e);
/* "unknown", "aliased", "sharp", "well". */
const char *ct_sampling_name(enum ct_sampling s);

#endif
