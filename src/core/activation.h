/* activation.h: the activations phi that make densities of what Gaussians learn, and their slopes.
 *
 *   prelu      phi(z) = z for z >= 0, gamma z below: signed (the paper, section NAB-GS)
 *   softplus   ln(1 + e^z): positive (3-D Gaussian splatting, R2-Gaussian)
 *   relu       max(0, z)
 *   sine       sin z: signed, bounded
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_ACTIVATION_H
#define CT_CORE_ACTIVATION_H
#include "core/words.h"

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

#endif
