/* Hostile states of ct-nabgs: refused, or the fit makes a step from them.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "state-run.h"
#include "cli/resume.h"
#include "gs/fit.h"

#include <math.h>

const int fuzz_rounds = 1500;

enum { SIDE = 8, VIEWS = 4 };

struct scene {
	struct ct_vol base;
	struct ct_stack target, projections;
	struct ct_fit_data data;
	struct ct_fit_options options;
};

static void scene_free(struct scene *s)
{
	ct_vol_free(&s->base);
	ct_stack_free(&s->target);
	ct_stack_free(&s->projections);
}

static void scene_make(struct scene *s)
{
	struct ct_err e = {0};

	*s = (struct scene){.data = {.target = &s->target,
				    .base_projections = &s->projections,
				    .base = &s->base}};
	if (ct_vol_alloc(&s->base, (size_t[3]){SIDE, SIDE, SIDE}, &e) ||
		ct_stack_alloc(&s->target, VIEWS, SIDE, SIDE, &e))
		exit(99);
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = 2;
		s->base.affine[a][3] = 1 - SIDE;
	}
	for (size_t i = 0; i < ct_vol_count(&s->base); i++)
		s->base.data[i] = i % 3 ? 0.5f : 0.25f;
	for (size_t k = 0; k < VIEWS; k++) {
		double t = M_PI * (double)k / VIEWS, c = cos(t), r = sin(t);

		s->target.view[k] = (struct ct_view){{60 * c, 60 * r, 0}, {-30 * c, -30 * r, 0},
			{-3.4 * r, 3.4 * c, 0}, {0, 0, -3.4}, 0};
	}
	if (ct_stack_like(&s->projections, &s->target, 1, &e))
		exit(99);
	for (size_t i = 0; i < ct_stack_count(&s->target); i++) {
		s->projections.data[i] = 1;
		s->target.data[i] = i % 7 ? 1 : 2;
	}
	ct_fit_defaults(&s->options, 4, false, CT_PRELU);
	s->options.iterations = 20;
	s->options.gaussians = s->options.max_gaussians = 10;
	s->options.from_base = true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_env env = {0};
	struct ct_err e = {0};
	struct ct_resume run;
	struct scene s;
	struct ct_fit f;
	int rc;

	scene_make(&s);
	if (ct_fit_init(&f, &s.options, &s.data, &env, &e))
		exit(99);
	state_of(&run, data, size);
	rc = ct_resume_load(&run, ct_fit_state_unpack, &f, &e);
	if (rc <= 0)
		state_check(rc, &e);
	fuzz_taken += rc == 0;
	if (rc == 0 && f.g.step < f.opt.iterations && f.g.n < 1000) {
		f.opt.iterations = f.g.step + 1;
		state_check(ct_fit_run(&f, &s.data, &env, &e), &e);
	}
	ct_resume_close(&run);
	ct_fit_free(&f);
	scene_free(&s);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_env env = {0};
	struct ct_err e = {0};
	struct ct_resume run;
	struct scene s;
	struct ct_fit f;
	size_t n;

	if (k)
		return 0;
	scene_make(&s);
	if (ct_fit_init(&f, &s.options, &s.data, &env, &e))
		exit(99);
	state_run(&run, seed_path());
	n = state_seed(data, ct_resume_save(&run, ct_fit_state_pack, &f, &e));
	ct_resume_close(&run);
	ct_fit_free(&f);
	scene_free(&s);
	return n;
}
