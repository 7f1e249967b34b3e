/* sampler.c: see sampler.h. */
#include "config.h"
#include "diffusion/sampler.h"
#include "diffusion/bird.h"
#include "diffusion/draw.h"

#include <assert.h>

struct ct_sampler_how ct_sampler_default(enum ct_sampler_rule rule)
{
	return (struct ct_sampler_how){.rule = rule,
		.eta = rule == CT_SAMPLER_DDIM ? 0 : 0.99,
		.sigma_y = 0.0015,
		.guidance = 2000,
		.iterations = 100,
		.rate = 1e-3,
		.range = 1};
}

size_t ct_sampler_steps(enum ct_sampler_rule rule)
{
	switch (rule) {
	case CT_SAMPLER_GDP: return 1000;
	case CT_SAMPLER_BIRD: return 10;
	case CT_SAMPLER_NONE: return 0;
	case CT_SAMPLER_DDNM:
	case CT_SAMPLER_PLUS:
	case CT_SAMPLER_SIMPLE:
	case CT_SAMPLER_DDIM:
	case CT_SAMPLER_DDPM:
	case CT_SAMPLER_DPM: break;
	}
	return 50;
}

int ct_sampler_draw(
	const struct ct_sampler *s, float *x, const float *y, const float *init, struct ct_err *e)
{
	struct ct_draw w = {0};
	int rc;

	assert(s->how.rule != CT_SAMPLER_NONE);
	rc = ct_draw_alloc(&w, s, y, e);
	if (rc == 0) {
		s->normals(s->normals_ctx, 0, w.all, w.z);
		if (s->how.rule == CT_SAMPLER_BIRD)
			rc = ct_bird(&w, x, y, init, e);
		else {
			ct_draw_begin(&w, x, init);
			rc = ct_draw_run(&w, x, NULL, e);
		}
	}
	ct_draw_free(&w);
	return rc;
}
