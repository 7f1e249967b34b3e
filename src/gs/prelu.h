/* prelu.h: slopes and inverse of PReLU and the other activations phi, which map the raw density z
 * of a Gaussian to its density rho = phi(z): ct_activation_apply of core/gauss.h. PReLU makes
 * densities signed.
 *
 *   prelu      rho = z for z >= 0, gamma z below: signed (the paper, section NAB-GS)
 *   softplus   rho = ln(1 + e^z): positive (3-D Gaussian splatting, R2-Gaussian)
 *   relu       rho = max(0, z)
 *   sine       rho = sin z: signed, bounded
 *
 * Pure.
 */
#ifndef CT_GS_PRELU_H
#define CT_GS_PRELU_H
#include "core/gauss.h"

/* A slope outside makes phi not invertible (0, negative) or steeper below than above. */
#define CT_GAMMA_MIN 0.01
#define CT_GAMMA_MAX 1.0
#define CT_GAMMA_INIT 0.25
/* Least density that softplus and relu can be asked to start from; below, they stand still. */
#define CT_ACTIVATION_LEAST 1e-6

/* d rho / dz. At the kink of prelu and relu the slope from above, so that z = 0 can learn. */
double ct_activation_slope(enum ct_activation a, double gamma, double z);
/* d rho / d gamma: 0 for all but prelu. */
double ct_activation_dgamma(enum ct_activation a, double z);
/* z with phi(z) = rho; the nearest if rho is out of reach. */
double ct_activation_inverse(enum ct_activation a, double gamma, double rho);

#endif
