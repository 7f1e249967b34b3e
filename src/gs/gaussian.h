/* gaussian.h: one Gaussian of the mixture (core/gauss.h), resolved to density, axes and lengths; in
 * double: Sigma = A diag(s^2) A^T, A the rotation of the normalised quaternion, p and s in mm, rho
 * the activation of the raw density. The mixture is summed in voxels by mixture.h, its
 * line integrals by splat.h.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_GAUSSIAN_H
#define CT_GS_GAUSSIAN_H
#include "core/err.h"
#include "core/gauss.h"
#include "core/par.h"
#include "core/simd.h"

#include <stdint.h>

/* Where the raw parameters of a Gaussian stand among its columns. */
enum ct_gs_field {
	CT_GS_POS = 0,
	CT_GS_SCALE = 3,
	CT_GS_ROT = 6,
	CT_GS_RAW = 10,
	CT_GS_FIELDS = CT_GAUSS_COLUMNS,
};

/* Which stream of random numbers (core/rng.h) belongs to which draw of a fit; iterations and epochs
 * are added where there are such. */
#define CT_STREAM_PLACE ((uint64_t)0x67730000 << 32)
#define CT_STREAM_TV ((uint64_t)0x67730001 << 32)
#define CT_STREAM_VIEW ((uint64_t)0x67730002 << 32)
#define CT_STREAM_SPLIT ((uint64_t)0x67730003 << 32)
#define CT_STREAM_LOWRES ((uint64_t)0x67730004 << 32)
#define CT_STREAM_JITTER ((uint64_t)0x67730005 << 32)

/* Gaussians that one task takes. Results do not depend on it; speed a little. */
enum { CT_GS_CHUNK = 512 };

struct ct_gaussian {
	double p[3], a[3][3], s[3], rho;
};

/* Gradient of one Gaussian: density, position, shape (the N of ct_gaussian_backward), and of the
 * centre of its projection (columns, rows). */
struct ct_gaussian_gradient {
	double rho, p[3], shape[6], m[2];
};

/* The gradient of a loss with respect to a set: d[k][i] of raw parameter k of Gaussian i, dL/drho
 * in place of the raw density; screen[i] = |(w/2 dL/dcolumn, h/2 dL/drow)|, negative if nothing was
 * drawn. */
struct ct_gradient {
	size_t cap;
	union {
		struct {
			float *d[CT_GS_FIELDS], *screen;
		};
		float *column[CT_GS_FIELDS + 1];
	};
};

/* Room for n, contents kept. CT_ENOMEM. */
int ct_gradient_reserve(struct ct_gradient *g, size_t n, struct ct_err *e);
/* Also legal on a zeroed struct. */
void ct_gradient_free(struct ct_gradient *g);
void ct_gaussian_make(struct ct_gaussian *b, const double p[static 3], const double ln_s[static 3],
	const double q[static 4], double rho);
/* b[g->n], activation applied. */
void ct_gaussian_resolve(struct ct_gaussian *b, const struct ct_gauss *g, struct ct_par *par);
/* Its kernel: positions, axes and lengths of b[first, end). */
CT_SIMD_DECLARE(void, ct_gaussian_resolve_some,
	(struct ct_gaussian * b, const struct ct_gauss *g, size_t first, size_t end));
/* From N = diag(s) A^T dL/dSigma A diag(s) (symmetric: 00 01 02 11 12 22), which has no large terms
 * that cancel, to the logarithms of the standard deviations and the quaternion q as it is stored.
 */
void ct_gaussian_backward(double dln_s[static 3], double dq[static 4], const double n[static 6],
	const struct ct_gaussian *b, const double q[static 4]);

#endif
