/* smooth.c: see smooth.h. */
#include "config.h"
#include "quality/smooth.h"
#include "resolution/degrade.h"

int ct_smooth(float *out, const float *x, const size_t n[static 3], const double sigma[static 3],
	struct ct_par *par, struct ct_err *e)
{
	const struct ct_degrade d = {.factor = {1, 1, 1}, .sigma = {sigma[0], sigma[1], sigma[2]}};
	struct ct_separable s = {0};

	if (ct_degrade_plan(&s, &d, n, par, e))
		return -1;
	ct_separable_apply(&s, out, x, par);
	ct_separable_free(&s);
	return 0;
}
