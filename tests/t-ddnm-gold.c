/* The sampler with a real network against trajectories of the public DDNM implementation, fed with
 * the noise that was recorded there. */
#include "config.h"
#include "core/mem.h"
#include "formats/format.h"
#include "net/ddnm.h"
#include "net/prior.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

static struct ct_err e;

static void gold(struct ct_tensors *w, const char *name)
{
	const char *top = getenv("srcdir");
	char path[4096];

	snprintf(path, sizeof path, "%s/tests/gold/%s.safetensors", top ? top : ".", name);
	if (ct_tensors_read(path, w, &e)) {
		printf("Bail out! %s\n", e.msg);
		exit(99);
	}
}

static double number(const struct ct_tensors *w, const char *key)
{
	double x = NAN;

	if (ct_meta_numbers(&w->meta, key, 1, &x, &e))
		exit(99);
	return x;
}

/* x_T is draw 0; noise[k] belongs to move k. */
static void recorded(void *ctx, size_t draw, size_t n, float *z)
{
	const struct ct_tensors *w = ctx;
	const struct ct_tensor *t = ct_tensors_find(w, draw ? "noise" : "x_T");

	memcpy(z, t->data + (draw ? (draw - 1) * n : 0), n * sizeof *z);
}

static void test(const struct ct_tensors *weights, const char *name)
{
	struct ct_tensors w = {0};
	struct ct_prior prior = {0};
	struct ct_operator op = {0};
	struct ct_schedule schedule;
	const struct ct_tensor *y, *want;
	size_t nt, n;
	int *times;
	float *x;
	double worst = 0, most = 0;

	gold(&w, name);
	y = ct_tensors_find(&w, "y");
	want = ct_tensors_find(&w, "out");
	n = ct_tensor_count(want);
	if (ct_prior_alloc(&prior, weights, &e) || ct_prior_plan(&prior, 1, 32, 32, &e) ||
		ct_schedule_betas(&schedule, ct_tensors_find(&w, "betas")->data, &e) ||
		ct_schedule_times(&times, &nt, (size_t)number(&w, "steps"),
			ct_schedule_start((size_t)number(&w, "steps")), 1, 1, &e) ||
		ct_op_alloc(&op, CT_OP_MEAN, y->dim[2], y->dim[3], (size_t)number(&w, "scale"), 0,
			&e) ||
		ct_alloc(&x, n, sizeof *x, &e)) {
		printf("Bail out! %s\n", e.msg);
		exit(99);
	}
	{
		struct ct_denoiser net = ct_prior_denoiser(&prior);
		struct ct_ddnm d = {.schedule = &schedule, .t = times, .nt = nt,
			.rule = strcmp(ct_meta_get(&w.meta, "plus"), "True") == 0 ? CT_DDNM_PLUS
										  : CT_DDNM,
			.eta = number(&w, "eta"), .sigma_y = number(&w, "sigma_y"), .op = &op,
			.channels = 3, .eps = net.eps, .eps_ctx = net.ctx[0],
			.normals = recorded, .normals_ctx = &w};

		OK(ct_ddnm(&d, x, y->data, NULL, &e) == 0, "%s runs", name);
	}
	for (size_t i = 0; i < n; i++) {
		worst = fmax(worst, fabs((double)x[i] - (double)want->data[i]));
		most = fmax(most, fabs((double)want->data[i]));
	}
	NEAR(worst / most, 0, 1e-4, name);
	printf("# %s: relative error %.2g\n", name, worst / most);
	free(x);
	free(times);
	ct_op_free(&op);
	ct_prior_free(&prior);
	ct_tensors_free(&w);
}

int main(void)
{
	struct ct_tensors weights = {0};

	gold(&weights, "unet-a");
	test(&weights, "ddnm-plain-x4");
	test(&weights, "ddnm-plus-x4");
	test(&weights, "ddnm-plus-x8-noisy");
	ct_tensors_free(&weights);
	return tap_done();
}
