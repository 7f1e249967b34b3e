/* A run over views: channels, progress, what is saved and when, which failure is told, and what is
 * refused. The network knows the answer. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "diffusion/sample-views.h"
#include "tap.h"

#include <string.h>

enum { VIEWS = 5, H = 2, W = 3, S = 2, THREADS = 4, CHANNELS = 3, MULTIPLE = 4 };
enum { HIGH = 4, WIDE = 8, PIXELS = HIGH * WIDE, STEPS = 4 };

static struct ct_schedule schedule;
static struct ct_stack in, out;

/* What the network does at a call, and what was heard of the run. */
static struct {
	int calls, nan_at, stop_at; /* 0: never */
	volatile sig_atomic_t stop;
	size_t first, last, total, told, anew;
	int saved, ended, save_fails;
} run;

static double answer(size_t channel, size_t pixel)
{
	return 0.1 * (double)channel - 0.3 + 0.4 * sin((double)pixel);
}

static int network(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	double abar = ct_schedule_abar(&schedule, (int)t);

	(void)ctx;
	(void)e;
	for (size_t i = 0; i < CHANNELS * PIXELS; i++)
		eps[i] = (float)(((double)x[i] - sqrt(abar) * answer(i / PIXELS, i % PIXELS)) /
				 sqrt(1 - abar));
	run.calls++;
	if (run.calls == run.stop_at)
		run.stop = 1;
	if (run.calls == run.nan_at)
		eps[0] = NAN;
	return 0;
}

static void heard(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	(void)likely;
	(void)env;
	(void)what;
	if (total == 0) {
		run.anew++;
		return;
	}
	if (run.told++ == 0)
		run.first = done;
	run.last = done;
	run.total = total;
}

static int save(void *ctx, bool last, struct ct_err *e)
{
	(void)ctx;
	run.saved += !last;
	run.ended += last;
	return run.save_fails ? ct_fail(e, CT_EFAIL, "no room") : 0;
}

static struct ct_superres params(void)
{
	struct ct_superres p = ct_superres_default(S);

	p.steps = STEPS;
	p.norm = 2;
	p.save = save;
	return p;
}

static int go(const struct ct_superres *p, struct ct_stack *deviation, bool *done, size_t threads)
{
	struct ct_env env = {.seed = 3, .stop = &run.stop, .progress = heard};
	void *ctx[THREADS] = {0};
	struct ct_denoiser d = {.schedule = &schedule,
		.channels = CHANNELS,
		.multiple = MULTIPLE,
		.eps = network,
		.ctx = ctx};
	int rc;

	memset(&err, 0, sizeof err);
	must(ct_par_alloc(&env.par, threads, &err));
	rc = ct_superres(p, &d, &in, NULL, &out, deviation, done, &env, &err);
	ct_par_free(env.par);
	return rc;
}

static void again(void)
{
	memset(&run, 0, sizeof run);
}

/* DDNM+ ends with the network's own estimate: the mean of its channels, or the first. */
static void channels(void)
{
	for (int first = 0; first < 2; first++) {
		struct ct_superres p = params();
		bool done[VIEWS] = {false};
		double worst = 0;

		again();
		p.first = first;
		OK(go(&p, NULL, done, 1) == 0, "a network that knows the answer");
		for (size_t i = 0; i < ct_stack_count(&out); i++) {
			size_t at = i / (W * S) % (H * S) * WIDE + i % (W * S);
			double v = answer(0, at);

			if (!first)
				v = (v + answer(1, at) + answer(2, at)) / 3;
			worst = fmax(worst, fabs((double)out.data[i] - (v + 1)));
		}
		NEAR(worst, 0, 1e-5, first ? "its first channel" : "the mean of its channels");
	}
}

static void progress(void)
{
	struct ct_superres p = params();
	bool done[VIEWS] = {true, false, false, true, false};
	size_t calls = 0, gradients = 0;

	again();
	p.samples = 3;
	OK(go(&p, NULL, done, 1) == 0, "two of five views were done");
	OK(run.anew == 1, "they are no measure of the speed of the others");
	OK(run.told == 36 && run.first == 25 && run.last == 60 && run.total == 60,
		"%zu times from %zu to %zu of %zu", run.told, run.first, run.last, run.total);
	OK(run.saved == 3 && run.ended == 0 && done[1] && done[2] && done[4],
		"saved after every view");
	OK(ct_superres_calls(&p, &calls, &gradients, &err) == 0 && calls == 12, "%zu calls a view",
		calls);
	p.travel_length = p.travel_repeat = 2;
	OK(ct_superres_calls(&p, &calls, &gradients, &err) == 0 && calls == 3 * (4 + 2),
		"%zu calls with time travel", calls);
	p.steps = 1000;
	p.samples = p.travel_repeat = 1;
	OK(ct_superres_calls(&p, &calls, &gradients, &err) == 0 && calls == 1000,
		"a thousand steps");
}

/* The third sample of the first view that is not done. */
static void failures(size_t threads)
{
	struct ct_superres p = params();
	bool done[VIEWS] = {true, true, false, false, false};

	again();
	p.samples = 3;
	run.nan_at = threads == 1 ? 9 : 1;
	OK(go(&p, NULL, done, threads) == -1 && err.code == CT_ENUMERIC &&
			strncmp(err.msg, "view 2: timestep ", 17) == 0,
		"%zu threads: %s", threads, err.msg);
	OK(run.saved == 0 && run.ended == 0 && !done[2], "nothing is saved");
	OK(threads > 1 || run.calls == 9, "and nothing is begun after it");
}

static void stops(void)
{
	struct ct_superres p = params();
	bool done[VIEWS] = {false};

	again();
	run.stop_at = 6; /* in the second view */
	OK(go(&p, NULL, done, 1) == -1 && err.code == CT_ESTOP && !strstr(err.msg, "view"), "%s",
		err.msg);
	OK(run.saved == 1 && run.ended == 1 && done[0] && !done[1] && run.calls == 6,
		"the first view is saved, and once more at the end");
	again();
	run.stop_at = 6;
	memset(done, 0, sizeof done);
	run.save_fails = 1;
	OK(go(&p, NULL, done, 1) == -1 && err.code == CT_EFAIL && run.calls == 4,
		"what cannot be saved ends it");
	again();
	run.stop_at = 1;
	run.save_fails = 1;
	memset(done, 0, sizeof done);
	OK(go(&p, NULL, done, 1) == -1 && err.code == CT_EFAIL && run.ended == 1,
		"and is told before that it was stopped");
}

static void refused(struct ct_superres p, enum ct_code code, const char *what)
{
	bool done[VIEWS] = {false};

	again();
	OK(go(&p, NULL, done, 1) == -1 && err.code == code && run.calls == 0, "%s: %s", what,
		err.msg);
}

static void options(void)
{
	struct ct_superres p = params();
	bool done[VIEWS];

	for (int k = 0; k < 3; k++) {
		memset(done, 0, sizeof done);
		again();
		p.how.eta = k;
		p.how.sigma_y = 0;
		p.norm = 0.5;
		OK((go(&p, NULL, done, 1) == 0) == (k < 2), "eta %d", k);
	}
}

/* A stack of which one side is not the scale times the other's. */
static void other_size(size_t views, size_t h, size_t w)
{
	struct ct_superres p = params();
	struct ct_stack other = {0}, was = out;

	must(ct_stack_alloc(&other, views, h, w, &err));
	out = other;
	refused(p, CT_EGEOM, "nor written");
	out = was;
	p.samples = 2;
	again();
	OK(go(&p, &other, (bool[VIEWS]){false}, 1) == -1 && err.code == CT_EGEOM,
		"nor be a deviation");
	ct_stack_free(&other);
}

static void defaults(void)
{
	const struct ct_superres p = ct_superres_default(4);

	OK(p.scale == 4 && p.steps == 50 && p.samples == 1 && p.start == -1 && p.norm == 0 &&
			p.how.eta == 0.99,
		"50 steps from pure noise, one sample");
	OK(p.travel_length == 1 && p.travel_repeat == 1 && p.how.rule == CT_SAMPLER_PLUS &&
			p.op == CT_MEASUREMENT_MEAN && !p.first && !p.save,
		"DDNM+ with block means and no time travel");
}

int main(void)
{
	ct_schedule_default(&schedule);
	must(ct_stack_alloc(&in, VIEWS, H, W, &err));
	for (size_t k = 0; k < VIEWS; k++)
		in.view[k] = (struct ct_view){.source = {100, 0, 0},
			.centre = {-50, 0, 0},
			.u = {0, 2, 0},
			.v = {0, 0, -2}};
	for (size_t i = 0; i < ct_stack_count(&in); i++)
		in.data[i] = (float)ct_rng_uniform(1, 1, i);
	must(ct_stack_like(&out, &in, S, &err));
	channels();
	progress();
	failures(1);
	failures(4);
	stops();
	options();
	other_size(VIEWS + 1, H * S, W * S);
	other_size(VIEWS, H * S + 1, W * S);
	other_size(VIEWS, H * S, W * S + 1);
	defaults();
	ct_stack_free(&in);
	ct_stack_free(&out);
	return tap_done();
}
