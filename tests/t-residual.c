/* What projections lack: the part that is known is held, what is missing is estimated as it was
 * made, the mean and the spread of samples of a network whose answers are known, its weight,
 * threads, views that are done, metadata. */
#include "config.h"
#include "diffusion/residual.h"
#include "numbers.h"

#include <string.h>

enum { VIEWS = 3, S = 4, H = 20, W = 24, N = H * W, SAMPLES = 3, THREADS = 4 };

static struct ct_schedule schedule;

/* A network that expects `truth`, and `part` of the state beside it, of pictures of n pixels. */
struct net {
	size_t n;
	const float *truth;
	double part;
	float *seen; /* the condition, unless NULL */
};

static int velocity(void *ctx, double t, const float *x, float *v, struct ct_err *e)
{
	const struct net *net = ctx;
	const double abar = ct_schedule_abar(&schedule, (int)t), a = sqrt(abar),
		     sig = sqrt(1 - abar);

	(void)e;
	if (net->seen)
		memcpy(net->seen, x + net->n, 2 * net->n * sizeof *x);
	for (size_t i = 0; i < net->n; i++) {
		const double x0 = (double)net->truth[i % net->n] + net->part * (double)x[i];

		v[i] = (float)((a * (double)x[i] - x0) / sig);
	}
	return 0;
}

static void stack(struct ct_stack *s)
{
	float *x = normals(VIEWS * N, 7, 1, 1);

	must(ct_stack_alloc(s, VIEWS, H, W, &err));
	for (size_t k = 0; k < VIEWS; k++)
		s->view[k] = (struct ct_view){.source = {100, 0, 0},
			.centre = {-50, 0, 0},
			.u = {0, 2, 0},
			.v = {0, 0, -2}};
	for (size_t i = 0; i < VIEWS * N; i++)
		s->data[i] = 10 + x[i];
	free(x);
}

static struct ct_superres rule(size_t steps, size_t samples)
{
	struct ct_superres p = ct_superres_default(S);

	p.how = ct_sampler_default(CT_SAMPLER_DDNM);
	p.how.eta = 0;
	p.steps = steps;
	p.samples = samples;
	p.start = CT_TIMESTEPS - 1;
	return p;
}

static int go(const struct ct_residual *r, double weight, const struct ct_superres *p,
	struct net *net, size_t multiple, const struct ct_stack *b, struct ct_stack *out,
	struct ct_stack *dev, bool *done, size_t threads)
{
	struct ct_env env = {.seed = 3};
	void *ctx[THREADS] = {net, net, net, net};
	const struct ct_denoiser d = {.schedule = &schedule,
		.channels = CT_RESIDUAL_PLANES,
		.multiple = multiple,
		.eps = velocity,
		.ctx = ctx};
	int rc;

	must(ct_par_alloc(&env.par, threads, &err));
	rc = ct_residual_draw(r, weight, p, &d, b, out, dev, done, &env, &err);
	ct_par_free(env.par);
	return rc;
}

/* Energy of x in the cosines below (h, w), over all of it. */
static double share(const float *x, size_t h, size_t w)
{
	struct ct_measurement band = {0};
	static double c[N], t[4 * N];
	double sum = 0;

	must(ct_measurement_band(&band, h, w, H, W, &err));
	ct_measurement_analyse(&band, c, x, t);
	for (size_t i = 0; i < h * w; i++)
		sum += c[i] * c[i];
	ct_measurement_free(&band);
	return sum / dot(N, x, x);
}

static void test_hold(void)
{
	struct ct_residual_frame f = {0};
	float *x = normals(N, 1, 1, 1), once[N], wave[N], held[N];
	double *t;

	must(ct_residual_frame_alloc(&f, S, H, W, &err));
	t = calloc(ct_residual_frame_scratch(&f), sizeof *t);
	NEAR(share(x, H / 2, W / 2), 0.25, 0.1, "a quarter of what is white is known");
	memcpy(once, x, sizeof once);
	ct_residual_hold(&f, once, t);
	OK(share(once, H / 2, W / 2) < 1e-12, "nothing of it is left");
	memcpy(held, once, sizeof held);
	ct_residual_hold(&f, held, t);
	OK(apart(N, held, once) < 1e-6, "twice is once");
	for (int known = 0; known < 2;
		known++) { /* cosines on both sides of the limit of columns */
		const double k = W / 2 - known;

		for (size_t i = 0; i < N; i++)
			wave[i] = (float)cos(M_PI * k * ((double)(i % W) + 0.5) / W);
		memcpy(held, wave, sizeof held);
		ct_residual_hold(&f, held, t);
		OK(known ? maxdiff(N, held, NULL) < 1e-6 : apart(N, held, wave) < 1e-6, "%s",
			known ? "the last wave that is known is taken off" : "the next one stays");
	}
	ct_residual_frame_free(&f);
	OK(ct_residual_frame_alloc(&f, S, H + 2, W, &err) && err.code == CT_EGEOM,
		"other sides are refused");
	ct_residual_frame_free(&f);
	free(t);
	free(x);
}

/* A stack with an octave of a known RMS, and as much below and above it. */
static void test_octave(void)
{
	struct ct_stack b = {0};
	double rms;

	stack(&b);
	for (size_t i = 0; i < VIEWS * N; i++) {
		const double x = (double)(i % W) + 0.5, y = (double)(i % N / W) + 0.5;

		b.data[i] = (float)(50 + 9 * cos(M_PI * 2 * x / W) + /* known well */
				    3 * cos(M_PI * 7 * x / W) * cos(M_PI * 2 * y / H) +
				    4 * cos(M_PI * 9 * y / H) +  /* the octave: 3/2, 4/sqrt 2 */
				    7 * cos(M_PI * 17 * x / W)); /* beyond what is known */
	}
	must(ct_residual_octave(&rms, &b, S, &err));
	NEAR(rms, sqrt(9.0 / 4 + 16.0 / 2), 1e-5, "the octave below what is missing");
	for (size_t i = 0; i < VIEWS * N; i++)
		b.data[i] = 0;
	OK(ct_residual_octave(&rms, &b, S, &err) && err.code == CT_EINPUT, "nothing tells nothing");
	ct_stack_free(&b);
}

static void test_answer(void)
{
	const struct ct_residual r = {S, 0.5, 0, 0};
	struct ct_residual_frame f = {0};
	struct ct_stack b = {0}, out = {0}, dev = {0}, more = {0};
	struct ct_superres p = rule(4, SAMPLES);
	bool done[VIEWS] = {false};
	float *truth = normals(N, 2, 1, 1), *z = normals(N, 2, 2, 1), told[N], held[N], seen[2 * N],
	      *big;
	struct net net = {N, truth, 0, seen};
	double m, most, *t, worst = 0, mean[N] = {0}, sq[N] = {0};

	stack(&b);
	must(ct_stack_like(&out, &b, 1, &err) || ct_stack_like(&dev, &b, 1, &err) ||
		ct_stack_like(&more, &b, 1, &err) || ct_residual_octave(&m, &b, S, &err) ||
		ct_residual_frame_alloc(&f, S, H, W, &err));
	m *= r.missing;
	t = calloc(ct_residual_frame_scratch(&f), sizeof *t);
	must(go(&r, 0.75, &p, &net, 4, &b, &out, &dev, done, 1));
	net.seen = NULL;
	memcpy(told, truth, sizeof told);
	ct_residual_hold(&f, told, t);
	for (size_t k = 0; k < VIEWS; k++)
		for (size_t i = 0; i < N; i++) {
			const double want = (double)b.data[k * N + i] + 0.75 * m * (double)told[i];

			worst = fmax(worst, fabs((double)out.data[k * N + i] - want));
		}
	OK(done[0] && done[VIEWS - 1] && worst < 1e-5, "what is expected is added, by its weight");
	OK(maxdiff(VIEWS * N, dev.data, NULL) < 1e-4 * m, "where it is certain there is no spread");
	for (size_t i = 0; i < VIEWS * N; i++)
		more.data[i] = out.data[i] - b.data[i];
	OK(share(more.data, H / 2, W / 2) < 1e-9, "and what is known stays");
	must(ct_superres_norm(&b, &most, &err));
	for (size_t i = 0; i < N; i++)
		held[i] = (float)(2 * (double)b.data[(VIEWS - 1) * N + i] / most - 1);
	NEAR(maxdiff(N, seen, held), 0, 1e-6, "the network sees what it adds to, from 0 to 1");
	NEAR(share(seen + N, H / 4, W / 4), 0, 1e-12, "and its detail");
	NEAR(sqrt(dot(N, seen + N, seen + N) / N), m > 0 ? 2 : 0, 0.6, "in units of the octave");

	/* half of the state beside it: one step, whose mean and spread are those of the noise */
	p = rule(1, SAMPLES);
	net.part = 0.5;
	memset(done, 0, sizeof done);
	must(go(&r, 0.75, &p, &net, 4, &b, &out, &dev, done, 3));
	for (size_t s = 0; s < SAMPLES; s++) {
		ct_superres_normals(3, 1, s, 0, N, z);
		for (size_t i = 0; i < N; i++)
			held[i] = truth[i] + 0.5f * z[i];
		ct_residual_hold(&f, held, t);
		for (size_t i = 0; i < N; i++) {
			mean[i] += (double)held[i] / SAMPLES;
			sq[i] += (double)held[i] * (double)held[i] / SAMPLES;
		}
	}
	worst = 0;
	for (size_t i = 0; i < N; i++) {
		const double sd = sqrt((sq[i] - mean[i] * mean[i]) * SAMPLES / (SAMPLES - 1));

		worst = fmax(worst, fabs((double)dev.data[N + i] - m * sd));
		worst = fmax(worst,
			fabs((double)(out.data[N + i] - b.data[N + i]) - 0.75 * m * mean[i]));
	}
	OK(worst < 1e-4 * m, "mean and spread of samples (worst %.2g of %.2g)", worst, m);

	/* other samplers, which clip elsewhere: a step is the same */
	p.how = ct_sampler_default(CT_SAMPLER_DDIM);
	memcpy(more.data, dev.data, VIEWS * N * sizeof *dev.data);
	memset(done, 0, sizeof done);
	must(go(&r, 0.75, &p, &net, 4, &b, &out, &dev, done, 3));
	OK(apart(VIEWS * N, dev.data, more.data) < 1e-5, "nothing is clipped by ddim");

	/* the answer is that of the first step, however many follow */
	p = rule(5, SAMPLES);
	memset(done, 0, sizeof done);
	done[0] = true;
	memcpy(more.data, b.data, VIEWS * N * sizeof *b.data);
	must(go(&r, 0.75, &p, &net, 4, &b, &more, NULL, done, 1));
	OK(memcmp(more.data + N, out.data + N, (VIEWS - 1) * N * sizeof *out.data) == 0,
		"the answer does not depend on later steps, nor on threads");
	OK(memcmp(more.data, b.data, N * sizeof *b.data) == 0,
		"views that are done are left alone");

	memset(done, 0, sizeof done);
	must(go(&r, 0, &p, NULL, 4, &b, &out, NULL, done, 2));
	OK(memcmp(out.data, b.data, VIEWS * N * sizeof *b.data) == 0,
		"a weight of 0 adds nothing, and asks nobody");

	/* a network that wants larger pictures: they are continued, and what is known stays all the
	 * same */
	big = normals(32 * 32, 2, 3, 1);
	net = (struct net){32 * 32, big, 0, NULL};
	memset(done, 0, sizeof done);
	must(go(&r, 1, &p, &net, 16, &b, &out, NULL, done, 2));
	for (size_t i = 0; i < VIEWS * N; i++)
		more.data[i] = out.data[i] - b.data[i];
	OK(rms(N, more.data, NULL) > 0.5 * m && share(more.data, H / 2, W / 2) < 1e-9,
		"also at the edge of a picture that was continued");
	free(big);

	p.how.rule = CT_SAMPLER_PLUS;
	OK(go(&r, 1, &p, &net, 4, &b, &out, NULL, done, 1) && err.code == CT_EUSAGE,
		"samplers that do not hold are refused");
	p = rule(1, 1);
	OK(go(&r, 1, &p, &net, 4, &b, &out, &dev, done, 1) && err.code == CT_EUSAGE,
		"one sample has no deviation");
	p.scale = 2;
	OK(go(&r, 1, &p, &net, 4, &b, &out, NULL, done, 1) && err.code == CT_EUSAGE,
		"another factor is refused");
	ct_residual_frame_free(&f);
	ct_stack_free(&b);
	ct_stack_free(&out);
	ct_stack_free(&dev);
	ct_stack_free(&more);
	free(t);
	free(z);
	free(truth);
}

static void test_metadata(void)
{
	const struct ct_residual r = {4, 0.375, 0.5, 0.25};
	struct ct_residual back;
	struct ct_meta m = {0};

	OK(ct_residual_get(&back, &m, &err) == 1, "another prior is none");
	must(ct_residual_put(&r, &m, &err));
	must(ct_residual_get(&back, &m, &err));
	OK(back.factor == 4 && back.missing == 0.375 && back.sampled == 0.5 && back.aliased == 0.25,
		"metadata and back");
	must(ct_meta_set(&m, CT_META_WEIGHT, "0.5,1.5", &err));
	OK(ct_residual_get(&back, &m, &err) == -1 && err.code == CT_EINPUT, "a weight above 1");
	must(ct_residual_put(&r, &m, &err));
	ct_meta_drop(&m, CT_META_MISSING);
	OK(ct_residual_get(&back, &m, &err) == -1 && err.code == CT_EINPUT,
		"one that is not there");
	ct_meta_free(&m);
}

int main(void)
{
	ct_schedule_default(&schedule);
	test_hold();
	test_octave();
	test_answer();
	test_metadata();
	return tap_done();
}
