/* waves.c: see waves.h. */
#include "config.h"
#include "diffusion/waves.h"
#include "core/mem.h"

#include <stdio.h>
#include <stdlib.h>

static size_t gcd(size_t a, size_t b)
{
	while (b) {
		size_t r = a % b;

		a = b;
		b = r;
	}
	return a;
}

/* Views of a wave: the fewest whose samples fill all threads. */
static size_t wave_of(const struct ct_waves *w)
{
	const size_t threads = ct_par_threads(w->env->par);

	return threads / gcd(threads, w->samples);
}

size_t ct_waves_places(const struct ct_waves *w)
{
	return wave_of(w) * w->samples;
}

int ct_waves_call(struct ct_waves *w, size_t worker, struct ct_err *e)
{
	size_t done;

	if (atomic_load(&w->failed))
		return ct_fail(e, CT_ESTOP, "given up");
	if (ct_check_stop(w->env, e))
		return -1;
	done = atomic_fetch_add(&w->called, 1) + 1;
	if (worker == 0)
		ct_progress(w->env, "sampling", done, w->views * w->calls);
	return 0;
}

static void run_task(void *arg, size_t i, size_t worker)
{
	struct ct_waves *w = arg;
	const size_t view = w->view[i / w->samples];
	char name[40];

	if (atomic_load(&w->failed) ||
		w->draw(w->ctx, i, view, i % w->samples, worker, &w->err[i]) == 0)
		return;
	snprintf(name, sizeof name, "view %zu", view);
	if (w->err[i].code != CT_ESTOP)
		ct_blame(&w->err[i], name);
	atomic_store(&w->failed, true);
}

/* The first real failure of the wave; a sample given up because of another is not one. */
static int wave_failed(const struct ct_waves *w, size_t tasks, struct ct_err *e)
{
	const struct ct_err *stop = NULL;

	if (!atomic_load(&w->failed))
		return 0;
	for (size_t i = 0; i < tasks; i++) {
		if (w->err[i].code == CT_ESTOP)
			stop = &w->err[i];
		else if (w->err[i].code != CT_OK) {
			*e = w->err[i];
			return -1;
		}
	}
	return stop ? ct_fail(e, CT_ESTOP, "stopped on request") : 0;
}

/* The next unfinished views from *at on, at most `wave`. */
static size_t next_wave(struct ct_waves *w, const bool *done, size_t *at, size_t wave)
{
	size_t n = 0;

	for (; *at < w->views && n < wave; ++*at)
		if (!done[*at])
			w->view[n++] = *at;
	return n;
}

static int run(struct ct_waves *w, size_t wave, bool *done, struct ct_err *e)
{
	size_t n, at = 0;

	while ((n = next_wave(w, done, &at, wave)) > 0) {
		ct_par_for(w->env->par, n * w->samples, run_task, w);
		if (wave_failed(w, n * w->samples, e)) {
			struct ct_err other = {0};

			if (e->code == CT_ESTOP && w->save && w->save(w->save_ctx, true, &other))
				*e = other;
			return -1;
		}
		for (size_t v = 0; v < n; v++) {
			w->collect(w->ctx, v * w->samples, w->view[v]);
			done[w->view[v]] = true;
		}
		if (w->save && w->save(w->save_ctx, false, e))
			return -1;
	}
	return 0;
}

int ct_waves_run(struct ct_waves *w, bool *done, struct ct_err *e)
{
	const size_t wave = wave_of(w);
	size_t finished = 0;
	int rc = -1;

	for (size_t k = 0; k < w->views; k++)
		finished += done[k];
	atomic_store(&w->failed, false);
	atomic_store(&w->called, finished * w->calls);
	if (ct_alloc(&w->view, wave, sizeof *w->view, e) == 0 &&
		ct_alloc0(&w->err, wave * w->samples, sizeof *w->err, e) == 0)
		rc = run(w, wave, done, e);
	free(w->view);
	free(w->err);
	return rc;
}
