/* gauss.h: a set of signed 3-D Gaussians, and the activations phi.
 *
 *   f(X) = sum_i rho_i exp(-1/2 (X - p_i)^T Sigma_i^-1 (X - p_i)),  Sigma = R diag(s^2) R^T
 *
 *   prelu      phi(z) = z for z >= 0, gamma z below: signed (the paper, section NAB-GS)
 *   softplus   ln(1 + e^z): positive (3-D Gaussian splatting, R2-Gaussian)
 *   relu       max(0, z)
 *   sine       sin z: signed, bounded
 *
 * Structure of arrays, raw (pre-activation) values: rho_i = phi(raw_i), in density of the metadata
 * "window". Positions and standard deviations in world mm, RAS+; scale stores ln(s/mm); the
 * quaternion is (w,x,y,z), normalised on use.
 */
#ifndef CT_CORE_GAUSS_H
#define CT_CORE_GAUSS_H
#include "core/err.h"
#include "core/meta.h"
#include "core/words.h"

#include <stddef.h>

enum { CT_GAUSS_COLUMNS = 11 };

#define CT_ACTIVATION_LIST(X)                                                                      \
	X(CT_PRELU, "prelu")                                                                       \
	X(CT_SOFTPLUS, "softplus")                                                                 \
	X(CT_RELU, "relu")                                                                         \
	X(CT_SINE, "sine")
enum ct_activation { CT_ACTIVATION_LIST(CT_WORD_VALUE) };
/* A slope outside makes phi not invertible (0, negative) or steeper below than above. */
#define CT_GAMMA_MIN 0.01
#define CT_GAMMA_MAX 1.0
#define CT_GAMMA_INIT 0.25
/* Least density that softplus and relu can be asked to start from; below, they stand still. */
#define CT_ACTIVATION_LEAST 1e-6
/* phi(z). */
double ct_activation_apply(enum ct_activation a, double gamma, double z);
/* d rho / dz. At the kink of prelu and relu the slope from above, so that z = 0 can learn. */
double ct_activation_slope(enum ct_activation a, double gamma, double z);
/* d rho / d gamma: 0 for all but prelu. */
double ct_activation_dgamma(enum ct_activation a, double z);
/* z with phi(z) = rho; the nearest if rho is out of reach. */
double ct_activation_inverse(enum ct_activation a, double gamma, double rho);

struct ct_gauss {
	size_t n, cap;
	union {
		struct {
			float *pos[3];   /* mm */
			float *scale[3]; /* ln of standard deviation in mm */
			float *rot[4];   /* quaternion w x y z, need not be normalised */
			float *raw;      /* raw density z */
		};
		float *column[CT_GAUSS_COLUMNS]; /* these, in this order */
	};
	enum ct_activation activation;
	double gamma;   /* PReLU slope, > 0 */
	size_t grid[3]; /* grid the set was made for; 0 if none */
	double affine[3][4];
	size_t step; /* optimiser step of the checkpoint */
	struct ct_meta meta;
};

/* Room for n more than none: capacity >= n, contents and n kept. */
int ct_gauss_reserve(struct ct_gauss *g, size_t n, struct ct_err *e);
void ct_gauss_free(struct ct_gauss *g);
/* Room for n in each of `count` columns that have room for *cap, contents kept; and none. */
int ct_gauss_grow(float **column, size_t count, size_t *cap, size_t n, struct ct_err *e);
void ct_gauss_drop(float **column, size_t count);
/* CT_ENUMERIC naming the first Gaussian that is not finite. */
int ct_gauss_check_finite(const struct ct_gauss *g, struct ct_err *e);

#endif
