/* ddnm.h: restoration of a picture from y = A x with a diffusion prior, without training for A:
 * DDNM and DDNM+ (Wang, Yu, Zhang: Zero-shot image restoration using denoising diffusion null-space
 * model, ICLR 2023).
 *
 * From timestep t to j < t (abar of schedule.h, a = sqrt(abar_j), sig = sqrt(1 - abar_j)):
 *   x0  = (x - sqrt(1 - abar_t) eps(x, t)) / sqrt(abar_t)
 *   x0h = x0 - V^T diag(lam) V (x0 - A+ y)
 *   x   = a x0h + noise
 * lam is the Sigma_t of the CT super-resolution paper, Lambda_t in the DDNM paper; with lam = 1 x0h
 * is their A+ y + (I - A+ A) x0, the range-null step.
 * eta is the fraction of the noise that is fresh (z), q = sqrt(1 - eta^2) the rest; eta 0 is
 * the deterministic DDIM, and eta is not DDIM's own.
 *
 * CT_DDNM        lam = 1, noise = sig (eta z + q eps). The last x agrees with y exactly.
 * CT_DDNM_PLUS   y has noise of standard deviation sy. For a component of singular value s:
 *                  lam = 1 if sig >= a sy / s, else sig q s / (a sy)
 *                  noise = d z there, d = sqrt(sig^2 - (a sy / s)^2) if sig > a sy / s, else sig
 * eta and sig (eta z + q eps) where nothing is measured. So the last step, sig = 0, leaves the
 * network's own estimate. sy = 0 is CT_DDNM. CT_DDNM_SIMPLE the variant of the authors'
 * --simplified: with sig' = sqrt(1 - abar_j^2), lam = min(1, sig' / (abar_j sy)), gam = sqrt(max(0,
 * sig'^2 - (abar_j sy)^2)) noise = gam sig (eta z + q eps), the same everywhere.
 *
 * Pictures are in [-1, 1], y too; sigma_y is on the [0, 1] scale of the picture, so sy =
 * 2 sigma_y. Channels are restored together by the network and apart by A.
 */
#ifndef CT_DIFFUSION_DDNM_H
#define CT_DIFFUSION_DDNM_H
#include "core/words.h"
#include "diffusion/measurement.h"
#include "diffusion/schedule.h"

#define CT_DDNM_LIST(X)                                                                            \
	X(CT_DDNM, "ddnm")                                                                         \
	X(CT_DDNM_PLUS, "ddnm+")                                                                   \
	X(CT_DDNM_SIMPLE, "simple")
enum ct_ddnm_rule { CT_DDNM_LIST(CT_WORD_VALUE) };

/* The prior: noise eps in x, both (channels, s h, s w), at timestep t. */
typedef int ct_eps_fn(void *ctx, double t, const float *x, float *eps, struct ct_err *e);
/* n standard normals; draw 0 starts the chain, draw k + 1 belongs to move k. */
typedef void ct_normals_fn(void *ctx, size_t draw, size_t n, float *z);

struct ct_ddnm {
	const struct ct_schedule *schedule;
	const int *t; /* nt timesteps of ct_schedule_times, the last -1 */
	size_t nt;
	enum ct_ddnm_rule rule;
	double eta, sigma_y;
	const struct ct_measurement *op;
	size_t channels;
	ct_eps_fn *eps;
	void *eps_ctx;
	ct_normals_fn *normals;
	void *normals_ctx;
};

/* x (channels, s h, s w) from y (channels, h, w). The chain begins at timestep t[0] with pure
 * noise, or, if init is not NULL, with init (as x) noised to that level. x is not clipped.
 * CT_ENUMERIC naming the timestep if the network gives a value that is not finite, CT_ENOMEM, or
 * what eps returns. Reentrant if the callbacks are. */
int ct_ddnm(const struct ct_ddnm *d, float *x, const float *y, const float *init, struct ct_err *e);

#endif
