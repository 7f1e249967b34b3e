/* The sampler with a real network against trajectories of the public DDNM implementation, fed with
 * the noise that was recorded there. */
#include "config.h"
#include "core/mem.h"
#include "formats/format.h"
#include "diffusion/ddnm.h"
#include "diffusion/prior.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

static void gold(struct ct_tensors *w, const char *name)
{
	const char *top = getenv("srcdir");
	char path[4096];

	snprintf(path, sizeof path, "%s/tests/gold/%s.safetensors", top ? top : ".", name);
	if (ct_tensors_read(path, w, &err)) {
		printf("Bail out! %s\n", err.msg);
		exit(99);
	}
}

static double number(const struct ct_tensors *w, const char *key)
{
	double x = NAN;

	if (ct_meta_numbers(&w->meta, key, 1, &x, &err))
		exit(99);
	return x;
}

/* The public code, in Lambda_noise of its block means, takes noise and eps of a block as
 * coefficients of its basis V without analysing them first, so both come out rotated by V within
 * the block. Ours analyses them. So its recorded noise is rotated here, with what its rotated eps
 * adds: z' = V (z + q/eta (eps - V^T eps) where nothing is measured) V is LAPACK's for the row
 * 1/r^2 ... 1/r^2: a Householder reflection, its first column -1/r. */
struct record {
	const struct ct_tensors *w;
	struct ct_denoiser net;
	size_t r;
	double eta;
	float eps[3 * 32 * 32];
};

static int remember(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	struct record *r = ctx;

	if (r->net.eps(r->net.ctx[0], t, x, eps, e))
		return -1;
	memcpy(r->eps, eps, sizeof r->eps);
	return 0;
}

static double basis(size_t n, size_t i, size_t j)
{
	double r = sqrt((double)n), vi = i ? 1 / (1 + r) : 1, vj = j ? 1 / (1 + r) : 1;

	return (i == j ? 1.0 : 0.0) - (1 + r) / r * vi * vj;
}

static void rotate_block(const struct record *k, float *z, const float *eps)
{
	size_t r = k->r, n = r * r;
	double q = sqrt(1 - k->eta * k->eta) / k->eta, c[64];

	for (size_t i = 0; i < n; i++) {
		double vt = 0;

		for (size_t j = 0; j < n; j++)
			vt += basis(n, j, i) * (double)eps[j / r * 32 + j % r];
		c[i] = (double)z[i / r * 32 + i % r];
		if (i)
			c[i] += q * ((double)eps[i / r * 32 + i % r] - vt);
	}
	for (size_t i = 0; i < n; i++) {
		double sum = 0;

		for (size_t j = 0; j < n; j++)
			sum += basis(n, i, j) * c[j];
		z[i / r * 32 + i % r] = (float)sum;
	}
}

/* x_T is draw 0; noise[k] belongs to move k. */
static void recorded(void *ctx, size_t draw, size_t n, float *z)
{
	const struct record *k = ctx;
	const struct ct_tensor *t = ct_tensors_find(k->w, draw ? "noise" : "x_T");

	memcpy(z, t->data + (draw ? (draw - 1) * n : 0), n * sizeof *z);
	if (!draw || strcmp(ct_meta_get(&k->w->meta, "plus"), "True") != 0)
		return;
	for (size_t c = 0; c < 3; c++)
		for (size_t y = 0; y < 32; y += k->r)
			for (size_t x = 0; x < 32; x += k->r) {
				size_t at = (c * 32 + y) * 32 + x;

				rotate_block(k, z + at, k->eps + at);
			}
}

static void test(const struct ct_tensors *weights, const char *name)
{
	struct ct_tensors w = {0};
	struct ct_prior prior = {0};
	struct ct_measurement op = {0};
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
	if (ct_prior_alloc(&prior, weights, &err) || ct_prior_plan(&prior, 1, 32, 32, &err) ||
		ct_schedule_betas(&schedule, ct_tensors_find(&w, "betas")->data, &err) ||
		ct_schedule_times(&times, &nt, (size_t)number(&w, "steps"),
			ct_schedule_start((size_t)number(&w, "steps")), 1, 1, &err) ||
		ct_measurement_alloc(&op, CT_MEASUREMENT_MEAN, y->dim[2], y->dim[3],
			(size_t)number(&w, "scale"), 0, &err) ||
		ct_alloc(&x, n, sizeof *x, &err)) {
		printf("Bail out! %s\n", err.msg);
		exit(99);
	}
	{
		struct record k = {.w = &w,
			.net = ct_prior_denoiser(&prior),
			.r = (size_t)number(&w, "scale"),
			.eta = number(&w, "eta")};
		struct ct_ddnm d = {.schedule = &schedule,
			.t = times,
			.nt = nt,
			.rule = strcmp(ct_meta_get(&w.meta, "plus"), "True") == 0 ? CT_DDNM_PLUS
										  : CT_DDNM,
			.eta = number(&w, "eta"),
			.sigma_y = number(&w, "sigma_y"),
			.op = &op,
			.channels = 3,
			.eps = remember,
			.eps_ctx = &k,
			.normals = recorded,
			.normals_ctx = &k};

		OK(ct_ddnm(&d, x, y->data, NULL, &err) == 0, "%s runs", name);
	}
	for (size_t i = 0; i < n; i++) {
		worst = fmax(worst, fabs((double)x[i] - (double)want->data[i]));
		most = fmax(most, fabs((double)want->data[i]));
	}
	NEAR(worst / most, 0, 1e-4, name);
	printf("# %s: relative error %.2g\n", name, worst / most);
	free(x);
	free(times);
	ct_measurement_free(&op);
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
