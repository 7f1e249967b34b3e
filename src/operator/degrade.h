/* degrade.h: the operator D that makes a low-resolution CT from a high-resolution one.
 *
 * Along each axis, with factor s >= 1, whole or not: m = floor(n/s) cells of s voxels are laid
 * about the middle of the N = ceil(m s) voxels that are left when floor((n - N)/2) are left out at
 * the beginning and the rest at the end; a Gaussian of standard deviation sigma (HR voxels), cut
 * at 4 sigma and normalised, filters those N; and m samples are taken at the centres of the cells:
 *
 *   sinc   after the ideal low-pass at the LR Nyquist frequency: the first m coefficients of the
 *          N-point DCT-II, summed at the centres. In space a Dirichlet kernel, a sinc that has
 *          reached the borders.
 *   point  as they are, linearly between two: for a whole s the middle sample, or the mean of the
 *          two if s is even. Aliases.
 *   mean   the mean over the cell of the voxels, which are boxes. A scanner's thick slice.
 *
 * Beyond the border the volume is continued by reflection about the border's face (d c b a | a b
 * c d), for the Gaussian and the sinc alike. The rows of D sum to one. Three such operators are
 * reported side by side, since none is known to be what a scanner does:
 *
 *   P1  sigma = s/2.3548 (full width at half maximum s), sinc: band-limited
 *   P2  sigma = s/4, sinc: band-limited; the blur of the paper's release at 4x, in voxels of 1 mm
 *   P3  sigma = s/8, point: aliased
 *
 * A fourth is that of the paper's release (ct-references(7)), which is not symmetric and is not
 * inverted as such: sigma = 1 voxel, and of each cell its first voxel. Cells are laid from the
 * first voxel on, and what is left over lies at the end. The affine says where the samples are:
 * their cells, as it reads, begin (s - 1)/2 voxels before the volume.
 *
 * An axis with s = 1 is not touched unless its sigma is positive.
 *
 * One axis may have a slice profile instead: samples of any shape (slice-profile.h makes them).
 * Each sample is the weight of its step. Along that axis D is the profile about the centre of each
 * cell, summed over the voxels and normalised. It counts together with its mirror image, as one
 * half each: D stays symmetric, as its decomposition asks (svd.h). sigma, and decimate where no
 * other axis is reduced, are then those of the same spread. What needs no more than the spread
 * takes them: prior, choice of method, expected errors.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_DEGRADE_H
#define CT_OPERATOR_DEGRADE_H
#include "core/meta.h"
#include "core/vol.h"
#include "core/words.h"
#include "operator/separable.h"

#include <stdint.h>

#define CT_DECIMATE_LIST(X)                                                                        \
	X(CT_DECIMATE_SINC, "sinc")                                                                \
	X(CT_DECIMATE_POINT, "point")                                                              \
	X(CT_DECIMATE_MEAN, "mean")
/* And the first voxel of each cell, of a whole factor, for what makes a CT; metadata call it point,
 * and first: where a sample lies, the affine says. Takes no slice profile. */
enum ct_decimate { CT_DECIMATE_LIST(CT_WORD_VALUE) CT_DECIMATE_FIRST };

enum { CT_SLICE_PROFILE_LEAST = 3, CT_SLICE_PROFILE_MOST = 128 };
struct ct_slice_profile {
	size_t n;           /* samples; 0: there is no profile */
	int axis;           /* that has it */
	double first, step; /* centre of the first sample, and from one to the next: LR voxels */
	double w[CT_SLICE_PROFILE_MOST]; /* their sum is 1 */
};

struct ct_degrade {
	double factor[3]; /* >= 1 */
	double sigma[3];  /* HR voxels, >= 0 */
	enum ct_decimate decimate;
	struct ct_slice_profile profile;
};

/* Set sigma and decimate from the factors: protocol 1, 2, 3, or 4 that of the release. sigma is 0
 * where the factor is 1. */
void ct_degrade_protocol(struct ct_degrade *d, int protocol);
/* Standard deviation of what a sample is the mean of along axis a, LR voxels: blur and sampling. */
double ct_degrade_spread(const struct ct_degrade *d, int a);
/* Axis a becomes what axis[a] was. */
void ct_degrade_turn(struct ct_degrade *d, const int axis[static 3]);
/* LR voxels that n HR voxels give, floor(n/factor), and HR voxels N that m LR voxels cover. */
size_t ct_degrade_size(size_t n, double factor);
size_t ct_degrade_cover(size_t m, double factor);
/* *m <- LR voxels of an axis. CT_EINPUT for a factor that is none, CT_EGEOM if the axis is shorter
 * than it. */
int ct_degrade_cells(size_t *m, size_t n, double factor, struct ct_err *e);
/* Table of one axis. Allocates. CT_EGEOM if the axis is shorter than the factor. */
int ct_degrade_taps(struct ct_taps *t, size_t n, double factor, double sigma,
	enum ct_decimate decimate, struct ct_err *e);
/* The same of an axis of D, with its profile if it has one. */
int ct_degrade_axis_taps(
	struct ct_taps *t, const struct ct_degrade *d, int axis, size_t n, struct ct_err *e);
/* D for a volume of n samples. Allocates. */
int ct_degrade_plan(struct ct_separable *s, const struct ct_degrade *d, const size_t n[static 3],
	const struct ct_par *par, struct ct_err *e);
/* out <- x, n voxels, under a Gaussian cut at 4 sigma, continued by reflection about its faces (d c
 * b a | a b c d); sigma along each axis in voxels, 0 leaves it as it is. Memory: two volumes while
 * it runs. CT_EINPUT for an absurd sigma, CT_ENOMEM. */
int ct_degrade_smooth(float *out, const float *x, const size_t n[static 3],
	const double sigma[static 3], struct ct_par *par, struct ct_err *e);
/* Affine of the LR grid of the n HR voxels. lo may be hi. */
void ct_degrade_affine(double lo[3][4], const double hi[3][4], const size_t n[static 3],
	const struct ct_degrade *d);
/* Affine of the HR grid that covers m LR voxels: N of each axis. hi may be lo. */
void ct_degrade_refine(double hi[3][4], const double lo[3][4], const size_t m[static 3],
	const double factor[static 3]);
/* Add normal noise of standard deviation sd; value i draws number i of (seed, stream 0). */
void ct_degrade_noise(float *data, size_t n, double sd, uint64_t seed, struct ct_par *par);
/* lo (zeroed struct) <- D of hi, and noise of standard deviation `noise`, HU, if above 0. Its
 * metadata name the operator. CT_EGEOM, CT_EINPUT, CT_ENOMEM. */
int ct_degrade_volume(struct ct_vol *lo, const struct ct_vol *hi, const struct ct_degrade *d,
	double noise, uint64_t seed, struct ct_par *par, struct ct_err *e);

/* The metadata keys factor, sigma, decimate, first, profile. */
int ct_degrade_put(struct ct_meta *m, const struct ct_degrade *d, struct ct_err *e);
/* The affine of samples that are the first voxels of their cells becomes that of the cells, in
 * which the volume lay that they were taken of: where the published programs take them to be.
 * Others, and a volume that was refined since, stay. CT_EINPUT. */
int ct_degrade_cells_affine(double affine[3][4], const struct ct_meta *m, struct ct_err *e);
/* Where lr is the first voxels of cells, x may lie about them, or in these cells: *d, the operator
 * that lr names, becomes that of the first. */
void ct_degrade_take_first(struct ct_degrade *d, const struct ct_vol *lr, const struct ct_vol *x);
/* They go, where voxels are no longer what a degradation left. */
void ct_degrade_drop(struct ct_meta *m);
/* 0; 1 if there is no key "factor" (d untouched); -1 with CT_EINPUT naming the key that is wrong. A
 * missing sigma is 0, a missing decimate sinc. */
int ct_degrade_get(const struct ct_meta *m, struct ct_degrade *d, struct ct_err *e);

#endif
