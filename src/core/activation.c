/* activation.c: see activation.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/activation.h"

#include <math.h>

double ct_activation_apply(enum ct_activation a, double gamma, double z)
{
	switch (a) {
	case CT_SOFTPLUS: return z > 30 ? z : log1p(exp(z));
	case CT_RELU: return z > 0 ? z : 0;
	case CT_SINE: return sin(z);
	case CT_PRELU: break;
	}
	return z >= 0 ? z : gamma * z;
}

double ct_activation_slope(enum ct_activation a, double gamma, double z)
{
	switch (a) {
	case CT_SOFTPLUS: return 1 / (1 + exp(-z));
	case CT_RELU: return z >= 0;
	case CT_SINE: return cos(z);
	case CT_PRELU: break;
	}
	return z >= 0 ? 1 : gamma;
}

double ct_activation_dgamma(enum ct_activation a, double z)
{
	return a == CT_PRELU && z < 0 ? z : 0;
}

double ct_activation_inverse(enum ct_activation a, double gamma, double rho)
{
	switch (a) {
	case CT_SOFTPLUS: /* ln(e^rho - 1) without overflow */
		rho = fmax(rho, CT_ACTIVATION_LEAST);
		return rho + log(-expm1(-rho));
	case CT_RELU: return fmax(rho, CT_ACTIVATION_LEAST);
	case CT_SINE: return asin(fmax(-1, fmin(1, rho)));
	case CT_PRELU: break;
	}
	return rho >= 0 ? rho : rho / gamma;
}
