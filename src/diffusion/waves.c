/* waves.c: see waves.h. */
#include "config.h"
#include "diffusion/waves.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Counts a call of the network. */
static int count(struct ct_seat *s, struct ct_err *e)
{
	struct ct_waves *w = s->w;
	size_t done;

	if (atomic_load(&w->failed))
		return ct_fail(e, CT_ESTOP, "given up");
	if (ct_check_stop(w->env, e))
		return -1;
	done = atomic_fetch_add(&w->called, 1) + 1;
	if (s->worker == 0)
		ct_progress(w->env, "sampling", done, w->views * w->calls);
	return 0;
}

static int predict(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	struct ct_seat *s = ctx;
	const struct ct_denoiser *net = s->w->net;

	return count(s, e) || net->eps(net->ctx[s->worker], t, x, eps, e) ? -1 : 0;
}

static int differentiate(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e)
{
	struct ct_seat *s = ctx;
	const struct ct_denoiser *net = s->w->net;

	return count(s, e) || net->back(net->ctx[s->worker], t, x, dx, deps, e) ? -1 : 0;
}

static void normals(void *ctx, size_t draw, size_t n, float *z)
{
	const struct ct_seat *s = ctx;

	ct_superres_normals(s->w->env->seed, s->view, s->sample, draw, n, z);
}

/* What the network makes of y. */
static int ask_once(struct ct_waves *w, struct ct_seat *s, struct ct_err *e)
{
	const size_t n = w->channels * w->op->high * w->op->wide;

	if (predict(s, 0, s->y, s->x, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		if (!isfinite(s->x[i]))
			return ct_fail(e, CT_ENUMERIC, "the network's output is not finite");
	return 0;
}

static int draw(struct ct_waves *w, struct ct_seat *s, float *result, struct ct_err *e)
{
	struct ct_sampler d = {.schedule = w->net->schedule,
		.t = w->times,
		.nt = w->ntimes,
		.how = w->how,
		.op = w->op,
		.channels = w->channels,
		.eps = predict,
		.back = differentiate,
		.eps_ctx = s,
		.normals = normals,
		.normals_ctx = s};

	w->begin(w->ctx, s);
	if (w->how.rule == CT_SAMPLER_ONCE ? ask_once(w, s, e)
					   : ct_sampler_draw(&d, s->x, s->y, s->init, e))
		return -1;
	w->end(w->ctx, s, result);
	return 0;
}

static void run_task(void *arg, size_t i, size_t worker)
{
	struct ct_waves *w = arg;
	struct ct_seat *s = &w->seat[worker];
	char name[40];

	if (atomic_load(&w->failed))
		return;
	s->w = w;
	s->worker = worker;
	s->view = w->view[i / w->p->samples];
	s->sample = i % w->p->samples;
	if (draw(w, s, w->result + i * w->pixels, &w->err[i]) == 0)
		return;
	snprintf(name, sizeof name, "view %zu", s->view);
	if (w->err[i].code != CT_ESTOP)
		ct_blame(&w->err[i], name);
	atomic_store(&w->failed, true);
}

/* The first failure of a wave of so many tasks that is not the request to stop. */
static int wave_failed(struct ct_waves *w, size_t tasks, struct ct_err *e)
{
	bool stop = false;

	if (!atomic_load(&w->failed))
		return 0;
	for (size_t i = 0; i < tasks; i++) {
		stop = stop || w->err[i].code == CT_ESTOP;
		if (w->err[i].code != CT_OK && w->err[i].code != CT_ESTOP) {
			*e = w->err[i];
			return -1;
		}
	}
	return stop ? ct_fail(e, CT_ESTOP, "stopped on request") : 0;
}

/* The next unfinished views from *at on, at most a wave. */
static size_t next_wave(struct ct_waves *w, const bool *done, size_t *at)
{
	size_t n = 0;

	for (; *at < w->views && n < w->wave; ++*at)
		if (!done[*at])
			w->view[n++] = *at;
	return n;
}

static int run(struct ct_waves *w, bool *done, struct ct_err *e)
{
	const struct ct_superres *p = w->p;
	size_t n, at = 0;

	while ((n = next_wave(w, done, &at)) > 0) {
		ct_par_for(w->env->par, n * p->samples, run_task, w);
		if (wave_failed(w, n * p->samples, e)) {
			struct ct_err other = {0};

			if (e->code == CT_ESTOP && p->save && p->save(p->save_ctx, true, &other))
				*e = other;
			return -1;
		}
		for (size_t v = 0; v < n; v++) {
			w->collect(w->ctx, w->result + v * p->samples * w->pixels, w->view[v]);
			done[w->view[v]] = true;
		}
		if (p->save && p->save(p->save_ctx, false, e))
			return -1;
	}
	return 0;
}

/* A wave is the fewest views whose samples fill all threads. */
static int prepare(struct ct_waves *w, struct ct_err *e)
{
	const size_t samples = w->p->samples;
	size_t gradients;

	w->threads = ct_par_threads(w->env->par);
	for (w->wave = 1; w->wave * samples % w->threads; w->wave++)
		;
	if (ct_superres_times(w->p, &w->times, &w->ntimes, e) ||
		ct_superres_calls(w->p, &w->calls, &gradients, e) ||
		ct_alloc(&w->view, w->wave, sizeof *w->view, e) ||
		ct_alloc0(&w->err, w->wave * samples, sizeof *w->err, e) ||
		ct_alloc(&w->result, w->wave * samples, w->pixels * sizeof *w->result, e) ||
		ct_alloc0(&w->seat, w->threads, sizeof *w->seat, e))
		return -1;
	w->calls += gradients;
	for (size_t k = 0; k < w->threads; k++)
		if (ct_alloc(&w->seat[k].room, w->room, sizeof(float), e))
			return -1;
	return 0;
}

int ct_waves_run(struct ct_waves *w, bool *done, struct ct_err *e)
{
	size_t finished = 0;
	int rc = prepare(w, e);

	for (size_t k = 0; k < w->views; k++)
		finished += done[k];
	atomic_store(&w->failed, false);
	atomic_store(&w->called, finished * w->calls);
	if (rc == 0)
		rc = run(w, done, e);
	for (size_t k = 0; w->seat && k < w->threads; k++)
		free(w->seat[k].room);
	free(w->seat);
	free(w->result);
	free(w->err);
	free(w->view);
	free(w->times);
	return rc;
}

void ct_waves_mean(const struct ct_waves *w, const float *result, float *mean, float *dev)
{
	const size_t k = w->p->samples, stride = w->pixels;

	for (size_t i = 0; i < w->pixels; i++) {
		const float *r = result + i;
		double sum = 0, sq = 0, m;

		for (size_t s = 0; s < k; s++)
			sum += (double)r[s * stride];
		m = sum / (double)k;
		mean[i] = (float)m;
		for (size_t s = 0; dev && s < k; s++)
			sq += ((double)r[s * stride] - m) * ((double)r[s * stride] - m);
		if (dev)
			dev[i] = (float)sqrt(sq / (double)(k - 1));
	}
}

/* Index of a line of n pixels that goes on: ... 1 0 | 0 1 ... n-1 | n-1 ... */
static size_t mirror(size_t i, size_t n)
{
	i %= 2 * n;
	return i < n ? i : 2 * n - 1 - i;
}

void ct_waves_extend(size_t high, size_t wide, float *dst, size_t h, size_t w, const float *src)
{
	for (size_t y = 0; y < high; y++)
		for (size_t x = 0; x < wide; x++)
			dst[y * wide + x] = src[mirror(y, h) * w + mirror(x, w)];
}

int ct_waves_deviates(const struct ct_superres *p, const struct ct_stack *deviation,
	const struct ct_stack *out, struct ct_err *e)
{
	if (!deviation)
		return 0;
	if (p->samples < 2)
		return ct_fail(e, CT_EUSAGE, "a standard deviation needs two samples or more");
	return ct_stack_same(deviation, out, e);
}
