/* The loop over views with a network that needs no training: shapes, normalisation, samples,
 * stopping and resuming, threads. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "diffusion/sample-views.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { VIEWS = 5, H = 5, W = 6, S = 4, THREADS = 4, CHANNELS = 3, MULTIPLE = 16 };

static struct ct_schedule schedule;

/* What the network's picture is; calls left before the user asks to stop. */
struct net {
	size_t n;
	volatile sig_atomic_t *stop;
	int *left;
	float *first; /* what it was asked first, unless NULL */
};

static float *watched; /* of the next run's networks */

/* Shrinks towards zero, differently at every pixel: any state is restored to something else. */
static int network(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	const struct net *net = ctx;

	(void)e;
	if (net->first)
		memcpy(net->first, x, net->n * sizeof *x);
	for (size_t i = 0; i < net->n; i++)
		eps[i] = 0.9f * x[i] + 0.1f * sinf(3 * x[i] + (float)(i % 7) + (float)t);
	if (net->left && --*net->left == 0)
		*net->stop = 1;
	return 0;
}

static struct ct_superres params(void)
{
	struct ct_superres p = ct_superres_default(S);

	p.steps = 4;
	p.norm = 2;
	return p;
}

/* in = A fine, view by view: the measurement that a fine stack (s h, s w) would have given. */
static bool measured(const struct ct_superres *p, struct ct_stack *in, const struct ct_stack *fine)
{
	struct ct_measurement op = {0};
	struct ct_err e = {0};
	double *t = NULL;
	bool done =
		ct_measurement_alloc(&op, p->op, in->h, in->w, p->scale, p->sigma_det, &e) == 0 &&
		ct_alloc(&t, ct_measurement_scratch(&op), sizeof *t, &e) == 0;

	for (size_t k = 0; done && k < in->views; k++)
		ct_measurement_forward(&op, ct_stack_view(in, k), ct_stack_view(fine, k), t);
	free(t);
	ct_measurement_free(&op);
	return done;
}

static void stacks(struct ct_stack *in, struct ct_stack *out, struct ct_stack *dev)
{
	struct ct_err e = {0};

	if (ct_stack_alloc(in, VIEWS, H, W, &e))
		exit(99);
	for (size_t k = 0; k < VIEWS; k++)
		in->view[k] = (struct ct_view){.source = {100, 0, 0},
			.centre = {-50, 0, 0},
			.u = {0, 2, 0},
			.v = {0, 0, -2}};
	for (size_t i = 0; i < ct_stack_count(in); i++)
		in->data[i] = (float)(2 * ct_rng_uniform(1, 1, i));
	if (ct_stack_like(out, in, S, &e) || (dev && ct_stack_like(dev, in, S, &e)))
		exit(99);
}

static int go(const struct ct_superres *p, const struct ct_stack *in, const struct ct_stack *init,
	struct ct_stack *out, struct ct_stack *dev, bool *done, size_t threads, int *left,
	struct ct_err *e)
{
	volatile sig_atomic_t stop = 0;
	struct ct_env env = {.seed = 3, .stop = &stop};
	struct net net = {.stop = &stop, .left = left, .first = watched};
	void *ctx[THREADS];
	struct ct_denoiser d = {.schedule = &schedule,
		.channels = CHANNELS,
		.multiple = MULTIPLE,
		.eps = network,
		.ctx = ctx};
	size_t high, wide;
	int rc;

	ct_superres_size(p, MULTIPLE, in->h, in->w, &high, &wide);
	net.n = CHANNELS * high * wide;
	for (int k = 0; k < THREADS; k++)
		ctx[k] = &net;
	if (ct_par_alloc(&env.par, threads, e))
		exit(99);
	rc = ct_superres(p, &d, in, init, out, dev, done, &env, e);
	ct_par_free(env.par);
	return rc;
}

static bool same(const struct ct_stack *a, const struct ct_stack *b)
{
	return memcmp(a->data, b->data, ct_stack_count(a) * sizeof *a->data) == 0;
}

static void test_size(void)
{
	struct ct_superres p = params();
	size_t high, wide;

	ct_superres_size(&p, 16, 5, 8, &high, &wide);
	OK(high == 32 && wide == 32, "rounded up to the network's multiple");
	ct_superres_size(&p, 2, 5, 7, &high, &wide);
	OK(high == 20 && wide == 28, "the scale already has the factor");
	p.scale = 3;
	ct_superres_size(&p, 8, 5, 8, &high, &wide);
	OK(high == 24 && wide == 24, "blocks stay whole at 3-fold");
}

/* Does block (i, j) of a view hold a pixel at the limits of the output? */
static bool clamped(const struct ct_stack *s, size_t view, size_t i, size_t j, double norm)
{
	const float *p = ct_stack_view(s, view);

	for (size_t y = 0; y < S; y++)
		for (size_t x = 0; x < S; x++) {
			float v = p[(i * S + y) * s->w + j * S + x];

			if (v <= 0 || v >= (float)(1.049 * norm))
				return true;
		}
	return false;
}

/* Plain DDNM agrees with the measurement where nothing was clamped: block means of the output. */
static void test_measured(void)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, out = {0}, back = {0}, unused = {0};
	struct ct_err e = {0};
	bool done[VIEWS] = {false};
	double worst = 0;
	size_t free_blocks = 0;

	stacks(&in, &out, NULL);
	stacks(&back, &unused, NULL);
	for (size_t i = 0; i < ct_stack_count(&in); i++)
		in.data[i] = 0.8f + 0.2f * in.data[i]; /* far enough from 0 and 2 */
	p.how.rule = CT_SAMPLER_DDNM;
	OK(go(&p, &in, NULL, &out, NULL, done, 2, NULL, &e) == 0, "plain DDNM: %s", e.msg);
	OK(measured(&p, &back, &out), "measured again");
	for (size_t i = 0; i < ct_stack_count(&in); i++)
		if (!clamped(&out, i / (H * W), i / W % H, i % W, p.norm)) {
			worst = fmax(worst, fabs((double)in.data[i] - (double)back.data[i]));
			free_blocks++;
		}
	OK(free_blocks > 50, "%zu of %d blocks without a clamped pixel", free_blocks,
		VIEWS * H * W);
	NEAR(worst, 0, 2e-6, "there the view's pixels are the block means, in its own units");
	ct_stack_free(&in);
	ct_stack_free(&out);
	ct_stack_free(&back);
	ct_stack_free(&unused);
}

/* By its range a view becomes [0, 1], in 256 levels or not, and comes back by it: as the view does
 * that was brought to [0, 1] by hand, of which 1 is 1. */
static void test_ranges(enum ct_superres_range range)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, out = {0}, by_hand = {0}, want = {0};
	struct ct_err e = {0};
	bool done[VIEWS] = {false}, all[VIEWS] = {false};
	double worst = 0;
	size_t beyond = 0;

	stacks(&in, &out, NULL);
	stacks(&by_hand, &want, NULL);
	for (size_t k = 0; k < VIEWS; k++) {
		float *x = ct_stack_view(&in, k), *y = ct_stack_view(&by_hand, k), lo, hi;

		for (size_t i = 0; i < H * W; i++)
			x[i] = (float)(k + 1) * x[i] -
			       3; /* another range in each view, and below 0 */
		lo = hi = x[0];
		for (size_t i = 0; i < H * W; i++) {
			lo = fminf(lo, x[i]);
			hi = fmaxf(hi, x[i]);
		}
		for (size_t i = 0; i < H * W; i++) {
			const double t = ((double)x[i] - (double)lo) / ((double)hi - (double)lo);

			y[i] = (float)(range == CT_SUPERRES_BYTES
					       ? (double)(unsigned char)(255 * t) / 255
					       : t);
		}
	}
	p.range = range;
	OK(go(&p, &in, NULL, &out, NULL, done, 2, NULL, &e) == 0, "%s", e.msg);
	p.range = CT_SUPERRES_STACK;
	p.norm = 1;
	OK(go(&p, &by_hand, NULL, &want, NULL, all, 2, NULL, &e) == 0, "%s", e.msg);
	for (size_t k = 0; k < VIEWS; k++) {
		const float *x = ct_stack_view(&in, k), *a = ct_stack_view(&out, k),
			    *b = ct_stack_view(&want, k);
		float lo = x[0], hi = x[0];

		for (size_t i = 0; i < H * W; i++) {
			lo = fminf(lo, x[i]);
			hi = fmaxf(hi, x[i]);
		}
		for (size_t i = 0; i < out.h * out.w; i++) {
			beyond += b[i] > 1;
			worst = fmax(
				worst, fabs((double)a[i] -
					       ((double)lo + fmin((double)b[i], 1) *
								     ((double)hi - (double)lo))));
		}
	}
	OK(beyond > 0 && worst < 2e-5,
		"range %s: the pictures are those by hand, and stay in their range (%g)",
		CT_WORD(CT_SUPERRES_RANGES, range), worst);
	ct_stack_free(&in);
	ct_stack_free(&out);
	ct_stack_free(&by_hand);
	ct_stack_free(&want);
}

static void test_threads_and_samples(void)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, a = {0}, b = {0}, dev = {0}, dev4 = {0}, one = {0};
	struct ct_err e = {0};
	bool done[VIEWS] = {false};
	double sum = 0;

	stacks(&in, &a, &dev);
	stacks(&one, &b, &dev4);
	p.samples = 3;
	OK(go(&p, &in, NULL, &a, &dev, done, 1, NULL, &e) == 0, "three samples, one thread");
	memset(done, 0, sizeof done);
	OK(go(&p, &in, NULL, &b, &dev4, done, 4, NULL, &e) == 0, "three samples, four threads");
	OK(same(&a, &b) && same(&dev, &dev4), "the same bytes");
	for (size_t i = 0; i < ct_stack_count(&dev); i++)
		sum += (double)dev.data[i];
	OK(sum > 0, "the samples differ");
	OK(memcmp(ct_stack_view(&a, 0), ct_stack_view(&a, 1), 64) != 0,
		"views draw their own noise");
	p.samples = 1;
	memset(done, 0, sizeof done);
	OK(go(&p, &in, NULL, &b, &dev, done, 1, NULL, &e) && e.code == CT_EUSAGE,
		"no deviation of one sample");
	ct_stack_free(&in);
	ct_stack_free(&a);
	ct_stack_free(&b);
	ct_stack_free(&dev);
	ct_stack_free(&dev4);
	ct_stack_free(&one);
}

static void test_resume(void)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, a = {0}, b = {0}, in2 = {0};
	struct ct_err e = {0};
	bool done[VIEWS] = {false}, all[VIEWS] = {false};
	int left = 11; /* of 20 calls */
	size_t n = 0;

	stacks(&in, &a, NULL);
	stacks(&in2, &b, NULL);
	OK(go(&p, &in, NULL, &a, NULL, all, 1, NULL, &e) == 0, "uninterrupted");
	OK(go(&p, &in, NULL, &b, NULL, done, 1, &left, &e) && e.code == CT_ESTOP, "stopped");
	for (int k = 0; k < VIEWS; k++)
		n += done[k];
	OK(n == 2, "%zu of %d views done", n, VIEWS);
	OK(go(&p, &in, NULL, &b, NULL, done, 2, NULL, &e) == 0 && same(&a, &b),
		"resumed with other threads: the same bytes");
	ct_stack_free(&in);
	ct_stack_free(&in2);
	ct_stack_free(&a);
	ct_stack_free(&b);
}

/* From a start at timestep 0 almost nothing is noise, and the network's say is small too. */
static void test_init(void)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, init = {0}, out = {0}, none = {0};
	struct ct_err e = {0};
	bool done[VIEWS] = {false};
	double worst = 0;

	stacks(&in, &init, &out);
	for (size_t i = 0; i < ct_stack_count(&init); i++)
		init.data[i] = (float)(0.5 + ct_rng_uniform(4, 4, i));
	p.start = 0;
	p.steps = 1;
	OK(measured(&p, &in, &init), "measure");
	OK(go(&p, &in, &init, &out, NULL, done, 1, NULL, &e) == 0, "from init at timestep 0");
	for (size_t i = 0; i < ct_stack_count(&out); i++)
		worst = fmax(worst, fabs((double)out.data[i] - (double)init.data[i]));
	OK(worst > 0 && worst < 0.1, "stays near init (%g)", worst);
	OK(ct_stack_like(&none, &in, 2, &e) == 0 &&
			go(&p, &in, &none, &out, NULL, done, 1, NULL, &e) && e.code == CT_EGEOM,
		"an init of another size is refused");
	p.steps = 5;
	OK(go(&p, &in, &init, &out, NULL, done, 1, NULL, &e) && e.code == CT_EUSAGE,
		"five steps do not fit into one timestep");
	ct_stack_free(&in);
	ct_stack_free(&init);
	ct_stack_free(&out);
	ct_stack_free(&none);
}

/* One view of h x w coarse pixels and one step from init at timestep 0: the network sees init
 * beside a hundredth of noise, raised to 0 and continued by reflection at its lower and right
 * border. */
static void reflected(size_t h, size_t w)
{
	enum { ROOM = CHANNELS * 64 * 64 };
	struct ct_superres p = params();
	struct ct_stack in = {0}, init = {0}, out = {0};
	static float seen[ROOM];
	bool done[1] = {false};
	struct ct_err e = {0};
	size_t high, wide, fine_h = h * S, fine_w = w * S, n = 0, far = 0;
	double sum = 0;

	if (ct_stack_alloc(&in, 1, h, w, &e))
		exit(99);
	in.view[0] = (struct ct_view){{100, 0, 0}, {-50, 0, 0}, {0, 2, 0}, {0, 0, -2}, 0};
	if (ct_stack_like(&init, &in, S, &e) || ct_stack_like(&out, &in, S, &e))
		exit(99);
	for (size_t i = 0; i < ct_stack_count(&init); i++)
		init.data[i] = (float)(3 * ct_rng_uniform(4, 4, i) - 0.5);
	p.start = 0;
	p.steps = 1;
	ct_superres_size(&p, MULTIPLE, h, w, &high, &wide);
	watched = seen;
	OK(high * wide <= ROOM / CHANNELS && go(&p, &in, &init, &out, NULL, done, 1, NULL, &e) == 0,
		"%zu x %zu pixels as %zu x %zu", fine_h, fine_w, high, wide);
	watched = NULL;
	for (size_t i = 0; i < CHANNELS * high * wide; i++, n++) {
		size_t y = i / wide % high % (2 * fine_h), x = i % wide % (2 * fine_w);
		double d;

		y = y < fine_h ? y : 2 * fine_h - 1 - y;
		x = x < fine_w ? x : 2 * fine_w - 1 - x;
		d = fmax((double)init.data[y * fine_w + x], 0) - 1; /* norm 2 */
		d = fabs((double)seen[i] - d);
		far += d > 0.06; /* six deviations of the noise */
		sum += d;
	}
	OK(far == 0 && sum < 0.02 * (double)n, "continued by reflection, %zu of %zu far off", far,
		n);
	ct_stack_free(&in);
	ct_stack_free(&init);
	ct_stack_free(&out);
}

/* Block means keep the picture within [0, 1.05] norm, as published; the matched operator does not.
 */
static void test_limits(void)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, out = {0};
	struct ct_err e = {0};

	stacks(&in, &out, NULL);
	for (size_t i = 0; i < ct_stack_count(&in); i++)
		in.data[i] = i % 2 ? 3 : -1;
	p.how.rule = CT_SAMPLER_DDNM;
	for (int k = 0; k < 2; k++) {
		bool done[VIEWS] = {false};
		float least = 9, most = -9;

		p.op = k ? CT_MEASUREMENT_MATCHED : CT_MEASUREMENT_MEAN;
		OK(go(&p, &in, NULL, &out, NULL, done, 2, NULL, &e) == 0, "beyond the limits");
		for (size_t i = 0; i < ct_stack_count(&out); i++) {
			least = fminf(least, out.data[i]);
			most = fmaxf(most, out.data[i]);
		}
		if (k)
			OK(least < -0.5f && most > 2.5f, "matched: to [%g, %g]", (double)least,
				(double)most);
		else
			OK(least >= 0 && least <= 0 && fabs((double)most - 2.1) < 1e-6,
				"mean: [%g, %g]", (double)least, (double)most);
	}
	ct_stack_free(&in);
	ct_stack_free(&out);
}

/* From means of one, two and three samples the samples themselves, and so their deviation. */
static void test_deviation(void)
{
	struct ct_superres p = params();
	struct ct_stack in = {0}, dev = {0}, mean[3] = {{0}};
	struct ct_err e = {0};
	double worst = 0, most = 0;

	stacks(&in, &mean[0], &dev);
	for (size_t k = 0; k < 3; k++) {
		bool done[VIEWS] = {false};

		if (k && ct_stack_like(&mean[k], &in, S, &e))
			exit(99);
		p.samples = k + 1;
		OK(go(&p, &in, NULL, &mean[k], k == 2 ? &dev : NULL, done, 2, NULL, &e) == 0,
			"%zu samples", k + 1);
	}
	for (size_t i = 0; i < ct_stack_count(&dev); i++) {
		double one = (double)mean[0].data[i], two = 2 * (double)mean[1].data[i] - one;
		double m = (double)mean[2].data[i], three = 3 * m - one - two;
		double want = sqrt((pow(one - m, 2) + pow(two - m, 2) + pow(three - m, 2)) / 2);

		worst = fmax(worst, fabs(want - (double)dev.data[i]));
		most = fmax(most, want);
	}
	OK(worst < 1e-5 * most, "three samples' deviation, %g of %g off", worst, most);
	ct_stack_free(&in);
	ct_stack_free(&dev);
	for (int k = 0; k < 3; k++)
		ct_stack_free(&mean[k]);
}

static void test_defaults(void)
{
	struct ct_stack in = {0}, out = {0};
	struct ct_err e = {0};
	double norm;

	stacks(&in, &out, NULL);
	for (size_t i = 0; i < ct_stack_count(&in); i++)
		in.data[i] = i == 7 ? 0.25f : -3;
	OK(ct_superres_norm(&in, &norm, &e) == 0 && norm == 0.25, "the norm is the largest value");
	in.data[7] = 0;
	OK(ct_superres_norm(&in, &norm, &e) == -1 && e.code == CT_EINPUT, "which is more than 0");
	ct_stack_free(&in);
	ct_stack_free(&out);
	NEAR(ct_superres_default(8).how.sigma_y, 0.0015, 0, "sigma_y is the paper's");
	NEAR(ct_superres_default(8).sigma_det, 8 / 2.354820045, 1e-8, "a pixel's width at half");
}

/* Of what the mean of two samples adds to a refined view the cube of their agreement counts. Of two
 * samples a, b the deviation is |a - b| / sqrt 2, so the mean is that far, by sqrt 2, from a. */
static void test_belief(void)
{
	struct ct_superres p = params();
	struct ct_stack coarse = {0}, unused = {0}, in = {0}, one = {0}, two = {0}, dev = {0};
	struct ct_err e = {0};
	bool done[2][VIEWS] = {{false}};
	double worst = 0, most = 0, least = 1;
	size_t n;

	stacks(&coarse, &unused, NULL);
	if (ct_stack_like(&in, &coarse, S, &e) || ct_stack_like(&one, &in, 1, &e) ||
		ct_stack_like(&two, &in, 1, &e) || ct_stack_like(&dev, &in, 1, &e))
		exit(99);
	n = in.h * in.w;
	for (size_t i = 0; i < ct_stack_count(&in); i++)
		in.data[i] = 1 + 0.3f * sinf((float)i);
	p.refined = true;
	OK(go(&p, &in, NULL, &one, NULL, done[0], 2, NULL, &e) == 0,
		"a refined view, one sample (%s)", e.msg);
	p.samples = 2;
	OK(go(&p, &in, NULL, &two, &dev, done[1], 2, NULL, &e) == 0,
		"a refined view, two samples (%s)", e.msg);
	for (size_t v = 0; v < VIEWS; v++) {
		const float *x = ct_stack_view(&in, v), *y = ct_stack_view(&two, v);
		const float *a = ct_stack_view(&one, v), *d = ct_stack_view(&dev, v);
		double var = 0, square = 0, from = 0, to = 1;

		for (size_t i = 0; i < n; i++) {
			var += pow((double)d[i], 2);
			square += pow((double)y[i] - (double)x[i], 2);
		}
		while (to - from > 1e-13) {
			const double c = (from + to) / 2, shift = square / (c * c) - var / 2;
			const double g = shift > 0 ? shift / (shift + var) : 0;

			*(g * g * g > c ? &from : &to) = c;
		}
		least = fmin(least, from);
		for (size_t i = 0; i < n; i++) {
			const double mean = (double)x[i] + ((double)y[i] - (double)x[i]) / from;

			worst = fmax(
				worst, fabs(fabs(mean - (double)a[i]) - (double)d[i] / sqrt(2)));
			most = fmax(most, fabs(mean - (double)x[i]));
		}
	}
	OK(least < 0.95 && worst < 1e-4 * most,
		"of what they add the cube of %.3g or more counts (%.2g of %.2g off)", cbrt(least),
		worst, most);
	ct_stack_free(&coarse);
	ct_stack_free(&unused);
	ct_stack_free(&in);
	ct_stack_free(&one);
	ct_stack_free(&two);
	ct_stack_free(&dev);
}

int main(void)
{
	ct_schedule_default(&schedule);
	test_size();
	test_measured();
	test_ranges(CT_SUPERRES_VIEW);
	test_ranges(CT_SUPERRES_BYTES);
	test_threads_and_samples();
	test_resume();
	test_init();
	reflected(5, 6);
	reflected(1, 7);
	test_limits();
	test_deviation();
	test_belief();
	test_defaults();
	return tap_done();
}
