/* prior.c: see prior.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/prior.h"
#include "core/clock.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

#define LEAST_SECONDS 0.5 /* seconds of calls that are enough */
enum { CALLS = 16 };

static int check_meta(const struct ct_meta *m, struct ct_err *e)
{
	const char *map = ct_meta_get(m, CT_META_INTENSITY_MAP),
		   *beta = ct_meta_get(m, CT_META_BETA_SCHEDULE);
	double steps = CT_TIMESTEPS;

	if (map && strcmp(map, CT_PRIOR_MAP) != 0)
		return ct_fail(
			e, CT_EINPUT, "intensity_map is \"%.80s\", not \"%s\"", map, CT_PRIOR_MAP);
	if (beta && strcmp(beta, "linear") != 0)
		return ct_fail(e, CT_EINPUT, "beta_schedule is \"%.80s\", not linear", beta);
	if (ct_meta_numbers(m, CT_META_DIFFUSION_STEPS, 1, &steps, e) < 0)
		return -1;
	if (steps != CT_TIMESTEPS)
		return ct_fail(e, CT_EINPUT, "%s is %g, not %d", CT_META_DIFFUSION_STEPS, steps,
			CT_TIMESTEPS);
	return 0;
}

/* Of a network that also learns variances only the first half of the channels out is noise. */
static int drop_variance(struct ct_tensors *w, struct ct_unet_arch *a, struct ct_err *e)
{
	static const char *const last[] = {"out.2.weight", "out.2.bias"};

	for (size_t i = 0; i < 2; i++) {
		struct ct_tensor *t = ct_tensors_find(w, last[i]);

		if (t && t->rank && t->dim[0] == a->out_channels)
			t->dim[0] = a->in_channels;
	}
	a->out_channels = a->in_channels;
	return ct_unet_arch_to_meta(a, &w->meta, e);
}

int ct_prior_alloc(struct ct_prior *p, struct ct_tensors *w, struct ct_err *e)
{
	struct ct_unet_arch a;

	if (check_meta(&w->meta, e) || ct_unet_arch_of(&a, w, e) ||
		(a.out_channels == 2 * a.in_channels && drop_variance(w, &a, e)))
		return -1;
	if (a.in_channels != a.out_channels)
		return ct_fail(e, CT_EINPUT,
			"%zu channels in and %zu out: not a predictor of noise", a.in_channels,
			a.out_channels);
	if (ct_unet_alloc(&p->unet, w, e))
		return -1;
	p->channels = a.in_channels;
	p->factor = a.net == CT_NET_UNET ? 0 : a.factor;
	p->multiple = p->factor ? ct_unet_arch_least(&a) * a.factor : ct_unet_arch_multiple(&a);
	ct_schedule_default(&p->schedule);
	return 0;
}

int ct_prior_classify(struct ct_prior *p, size_t label, struct ct_err *e)
{
	const size_t n = p->unet->arch.num_classes;

	if (label >= n)
		return ct_fail(e, CT_EUSAGE,
			n ? "the prior has classes 0 to %zu, not %zu"
			  : "the prior is not conditioned on classes",
			n - 1, label);
	p->unet->label = label;
	return 0;
}

static int predict(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	return ct_unet_forward(ctx, eps, x, t, e);
}

/* The forward pass is repeated: what it kept belongs to another timestep of the chain by now. */
static int predict_back(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e)
{
	return ct_err_any(predict(ctx, t, x, dx, e) || ct_unet_backward(ctx, NULL, dx, deps, e));
}

static void drop_plans(struct ct_prior *p)
{
	for (size_t k = 0; p->plan && k < p->workers; k++)
		ct_unet_plan_free(p->plan[k]);
	free(p->plan);
	p->plan = NULL;
	p->workers = 0;
}

int ct_prior_plan(
	struct ct_prior *p, size_t workers, size_t high, size_t wide, bool back, struct ct_err *e)
{
	const size_t by = p->factor ? p->factor : 1;

	drop_plans(p);
	if (ct_alloc0(&p->plan, workers, sizeof *p->plan, e))
		return -1;
	p->workers = workers;
	for (size_t k = 0; k < workers; k++) {
		struct ct_unet_plan *plan;

		if (ct_unet_plan_alloc(&plan, p->unet, high / by, wide / by, back, e))
			return -1;
		p->plan[k] = plan;
	}
	p->high = high;
	p->wide = wide;
	return 0;
}

struct ct_denoiser ct_prior_denoiser(const struct ct_prior *p)
{
	return (struct ct_denoiser){.schedule = &p->schedule,
		.channels = p->channels,
		.multiple = p->multiple,
		.eps = predict,
		.back = predict_back,
		.ctx = p->plan};
}

int ct_prior_time(double *call, double *back, const struct ct_prior *p, struct ct_err *e)
{
	const struct ct_denoiser net = ct_prior_denoiser(p);
	size_t n = p->channels * p->high * p->wide;
	float *x = NULL, *y = NULL;
	double start;
	int rc = -1;

	if (ct_alloc0(&x, n, sizeof *x, e) || ct_alloc(&y, n, sizeof *y, e) ||
		net.eps(net.ctx[0], 500, x, y, e)) /* the first is slower */
		goto out;
	start = ct_clock_cpu();
	for (int k = 1; k <= CALLS && (k == 1 || ct_clock_cpu() - start < LEAST_SECONDS); k++) {
		if (net.eps(net.ctx[0], 500, x, y, e))
			goto out;
		*call = (ct_clock_cpu() - start) / k;
	}
	for (int k = 0; back && k < 2; k++) {
		start = ct_clock_cpu();
		if (net.back(net.ctx[0], 500, x, y, x, e))
			goto out;
		*back = ct_clock_cpu() - start;
	}
	rc = 0;
out:
	free(x);
	free(y);
	return rc;
}

void ct_prior_free(struct ct_prior *p)
{
	drop_plans(p);
	ct_unet_free(p->unet);
	*p = (struct ct_prior){0};
}
