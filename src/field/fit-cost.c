/* fit-cost.c: what a fit will take (fit.h). */
#include "config.h"
#include "core/clock.h"
#include "field/fit.h"

#include <stdio.h>
#include <string.h>

int ct_field_fit_cost(struct ct_cost *cost, struct ct_field_fit *f, const struct ct_field_data *d,
	const struct ct_vol *grid, const struct ct_env *env, struct ct_err *e)
{
	enum { TRIAL = 3, VOXELS = 512 };
	const struct ct_env quiet = {.par = env->par, .seed = env->seed};
	const double threads = (double)ct_par_threads(env->par);
	double begun = 0, loss, step, volume;
	struct ct_vol some = {0};
	int rc;

	for (int k = 0; k <= TRIAL; k++) {
		if (k == 1) /* the first one takes its memory */
			begun = ct_clock_cpu();
		if (ct_field_fit_step(f, d, 0, true, &loss, &quiet, e))
			return -1;
	}
	step = (ct_clock_cpu() - begun) / TRIAL;
	if (ct_vol_alloc(&some, (const size_t[]){VOXELS, 1, 1}, e))
		return -1;
	memcpy(some.affine, grid->affine, sizeof some.affine);
	begun = ct_clock_cpu();
	rc = ct_field_fit_volume(&some, f, d, &quiet, e);
	volume = (ct_clock_cpu() - begun) / VOXELS * (double)ct_vol_count(grid);
	ct_vol_free(&some);
	cost->seconds = (volume + (f->rule.seconds > 0 ? f->rule.seconds
						       : step * (double)f->rule.iterations)) /
			threads;
	snprintf(cost->work, sizeof cost->work,
		"iterations of %.3g s of processor time, and %.3g s for %.0f voxels", step, volume,
		(double)ct_vol_count(grid));
	return rc;
}
