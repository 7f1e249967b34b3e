/* unet-calls forward|step PRIOR SIZE BATCH: answers every line of standard input with the CPU
 * seconds of one call on one thread, the largest memory so far in KiB, and what it gave: the
 * network of PRIOR on BATCH pictures of SIZE x SIZE at timestep 300, the sum of squares; or a step
 * of the training of such a network, the loss. The first line on standard output is the memory
 * before the network. For b-unet.sh. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench.h"
#include "diffusion/train.h"
#include "formats/format.h"

#include <math.h>
#include <string.h>
#include <sys/resource.h>

static struct ct_err err;

static void must(int rc)
{
	if (rc == 0)
		return;
	fprintf(stderr, "unet-calls: %s\n", err.msg);
	exit(1);
}

static long peak(void)
{
	struct rusage u;

	getrusage(RUSAGE_SELF, &u);
	return u.ru_maxrss;
}

static void *room(size_t n, size_t size)
{
	void *p = calloc(n, size);

	if (!p)
		exit(1);
	return p;
}

/* A picture of `pixels` as b-unet.sh makes it. */
static void picture(float *x, size_t pixels)
{
	for (size_t i = 0; i < pixels; i++)
		x[i] = (float)sin(0.37 * (double)i);
}

struct forward {
	struct ct_unet_plan *plan;
	size_t batch, pixels;
	float *x, *y;
};

static double forward(void *arg)
{
	struct forward *f = arg;
	double sum = 0;

	for (size_t b = 0; b < f->batch; b++)
		must(ct_unet_forward(
			f->plan, f->y + b * f->pixels, f->x + b * f->pixels, 300, &err));
	for (size_t i = 0; i < f->batch * f->pixels; i++)
		sum += (double)f->y[i] * (double)f->y[i];
	return sum;
}

static double step(void *arg)
{
	double loss;

	must(ct_train_step(arg, &loss, &err));
	return loss;
}

static void answer(double (*call)(void *), void *arg)
{
	char line[40];

	while (fgets(line, sizeof line, stdin)) {
		const double t = bench_clock(CLOCK_PROCESS_CPUTIME_ID), value = call(arg);

		printf("%.9g %ld %.9g\n", bench_clock(CLOCK_PROCESS_CPUTIME_ID) - t, peak(), value);
		fflush(stdout);
	}
}

static void run(struct ct_tensors *w, size_t size, size_t batch)
{
	struct forward f = {.batch = batch, .pixels = size * size};
	struct ct_unet *n;

	must(ct_unet_alloc(&n, w, &err) || ct_unet_plan_alloc(&f.plan, n, size, size, false, &err));
	f.x = room(2 * batch * f.pixels, sizeof *f.x);
	f.y = f.x + batch * f.pixels;
	for (size_t b = 0; b < batch; b++)
		picture(f.x + b * f.pixels, f.pixels);
	answer(forward, &f);
	ct_unet_plan_free(f.plan);
	ct_unet_free(n);
	free(f.x);
}

static void train(const struct ct_tensors *w, size_t size, size_t batch)
{
	const struct ct_env env = {0};
	const size_t side = 2 * size;
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_pictures s = {0};
	struct ct_train *t = NULL;
	float *px = room(side * side, sizeof *px);

	picture(px, side * side);
	for (size_t i = 0; i < side * side; i++)
		px[i] = 0.5F + 0.5F * px[i];
	must(ct_unet_arch_of(&a, w, &err));
	ct_train_default(&o);
	o.patches.size = a.image_size = size;
	o.batch = batch;
	must(ct_pictures_add(&s, side, side, px, "picture", &err) ||
		ct_train_alloc(&t, &a, &o, &s, &env, &err));
	answer(step, t);
	ct_train_free(t);
	ct_pictures_free(&s);
}

int main(int argc, char **argv)
{
	const size_t size = argc == 5 ? strtoul(argv[3], NULL, 10) : 0;
	const size_t batch = argc == 5 ? strtoul(argv[4], NULL, 10) : 0;
	struct ct_tensors w = {0};

	if (size < 8 || size > 4096 || batch < 1 || batch > 64)
		return 1;
	printf("%ld\n", peak());
	fflush(stdout);
	must(ct_tensors_read(argv[2], &w, &err));
	if (strcmp(argv[1], "step") == 0)
		train(&w, size, batch);
	else
		run(&w, size, batch);
	ct_tensors_free(&w);
	return 0;
}
