/* upsample.h: a volume on a finer grid over the same field, by interpolation or by inverting the
 * operator D (degrade.h) that made it.
 *
 *   LINEAR .. LANCZOS   interpolation at the cell centres (resample.h)
 *   SINC   the band-limited volume through the samples: the cosines of the coarse grid, summed on
 *          the fine one
 *   DC     the B-spline, and its inconsistency taken off: x + D+ (y - D x)
 *   TV     least total variation of all x with D x = y (tv.h): edges stay sharp.
 *          Best where D keeps a clean low band, or takes means; of
 *          point-sampled, aliased scans it makes isolated ones
 *   HTV    least second-order variation, likewise (tv.h): smooth
 *          surfaces, gentle with point-sampled, aliased scans
 *   AUTO   TV; HTV if D takes points and lets more than CT_UPSAMPLE_ALIAS of its
 *          weight through above the Nyquist frequency of the coarse grid, and,
 *          if no noise is known, linear where these are flat (flat.h); the
 *          B-spline if there is no D
 *
 * TV of forward differences moves an edge towards one of its sides. D is the same for a scan that
 * is turned over, so TV in several ways is the mean of the solutions: for the scan as it lies, and
 * turned over along x and z, x and y, and y and z. It agrees with the scan as they do. Each of the
 * last three begins with the volume and the dual of the one before, and makes half of the
 * iterations of the first.
 *
 * With noise > 0 (HU, of y) TV and HTV ask for |D x - y| <= 0.8 noise sqrt(M) instead of equality;
 * DC shows it.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_INVERSE_UPSAMPLE_H
#define CT_INVERSE_UPSAMPLE_H
#include "core/env.h"
#include "core/vol.h"
#include "core/words.h"
#include "inverse/consistency.h"
#include "operator/degrade.h"

#define CT_UPSAMPLE_ALIAS 0.2
/* Of the noise. The volume of least variation at the full noise level is too smooth: it gives up
 * detail until the misfit is used up. From 0.7 to 0.8 of it PSNR is the same and a third as many
 * structures are false: doc/trials.md, "How far noise is taken off". */
#define CT_UPSAMPLE_NOISE_SHARE 0.8

#define CT_UPSAMPLE_LIST(X)                                                                        \
	X(CT_UPSAMPLE_AUTO, "auto")                                                                \
	X(CT_UPSAMPLE_LINEAR, "linear")                                                            \
	X(CT_UPSAMPLE_CUBIC, "cubic")                                                              \
	X(CT_UPSAMPLE_BSPLINE, "bspline")                                                          \
	X(CT_UPSAMPLE_LANCZOS, "lanczos")                                                          \
	X(CT_UPSAMPLE_SINC, "sinc")                                                                \
	X(CT_UPSAMPLE_DC, "dc")                                                                    \
	X(CT_UPSAMPLE_TV, "tv")                                                                    \
	X(CT_UPSAMPLE_HTV, "htv")
enum ct_upsample { CT_UPSAMPLE_LIST(CT_WORD_VALUE) CT_UPSAMPLE_METHODS };

struct ct_upsample_rule {
	enum ct_upsample method;
	bool known; /* is `by` the operator, or only its factor? */
	struct ct_degrade by;
	double noise;        /* HU, >= 0 */
	const double *alike; /* of it, neighbours along the three axes (noise.h); NULL: white */
	struct ct_multipliers *multipliers; /* of the noise (pilot.h); NULL: found */
	size_t iterations;                  /* TV, HTV: at most */
	double tolerance; /* TV, HTV: stop when an iteration moves less than this, HU RMS */
	double spread;  /* TV, HTV: standard deviation of the scan of which lo is a part, HU; 0: of
			   lo */
	double texture; /* HU, with `spread`: of that scan, too (flat.h) */
	bool mirrors;   /* TV also of mirror images of the scan; the mean */
	bool plain;     /* AUTO: HTV as it is, for what was made for that */
	const struct ct_vol *start; /* DC, TV, HTV begin with this, not the B-spline; may be NULL */
};

struct ct_upsample_report {
	enum ct_upsample method; /* the one used */
	double aliasing;         /* largest of the axes; NaN if D is not known */
	double condition;        /* of D; NaN if not used */
	size_t iterations;
	double change;   /* RMS movement of the last iteration, HU */
	double residual; /* RMS of D x - y, HU; NaN if D is not known */
	double texture;  /* HU, where what is flat became linear; else 0 */
};

/* Standard deviation of the values, HU. */
double ct_upsample_spread(const struct ct_vol *v);
const char *ct_upsample_name(enum ct_upsample method);
/* r->method and r->aliasing of what the rule makes on a grid of n voxels. CT_EUSAGE for a method
 * that needs an operator without one. */
int ct_upsample_choose(struct ct_upsample_report *r, const struct ct_upsample_rule *rule,
	const size_t n[static 3], struct ct_err *e);
/* Bytes that a method has in memory at the most, of the volume of n voxels that it makes by the
 * rule (but for its method) of what `by` makes of that, and beside it; DC: those of whatever makes
 * a volume agree. CT_EINPUT, CT_ENOMEM. */
int ct_upsample_bytes(double *bytes, enum ct_upsample method, const struct ct_upsample_rule *rule,
	const size_t n[static 3], struct ct_err *e);
/* Share of the weight (squared) of the rows of D that lies above the Nyquist frequency of the
 * coarse grid: the largest of the axes, of n voxels, that are reduced. CT_EGEOM, CT_EINPUT,
 * CT_ENOMEM. */
int ct_upsample_aliasing(
	double *share, const struct ct_degrade *d, const size_t n[static 3], struct ct_err *e);
/* x <- x + D+ t, in double, t what of y - D x is beyond +-most HU, INFINITY leaves x; *residual <-
 * RMS of D x - y, HU. CT_EGEOM unless D makes the grid of y of that of x. */
int ct_upsample_settle(struct ct_vol *x, const struct ct_vol *y, const struct ct_degrade *d,
	double most, double *residual, const struct ct_env *env, struct ct_err *e);
/* As the published programs refine: linear, with the first and the last samples of both grids laid
 * upon each other (scipy.ndimage.zoom, order 1), and the grid that of ct_degrade_cells_affine,
 * refined. What lies at the beginning stays, what lies at the end moves by factor - 1 fine voxels.
 * CT_EINPUT, CT_ENOMEM. */
int ct_upsample_zoom(struct ct_vol *hi, const struct ct_vol *lo, const double factor[static 3],
	const struct ct_env *env, struct ct_err *e);
/* hi (zeroed struct) gets data, affine and metadata of lo refined. lo must be finite. CT_EUSAGE for
 * a method that needs an operator without one, CT_EGEOM (also for a start on another grid),
 * CT_ENUMERIC, CT_ENOMEM, CT_ESTOP. */
int ct_upsample(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	struct ct_upsample_report *report, const struct ct_env *env, struct ct_err *e);

#endif
