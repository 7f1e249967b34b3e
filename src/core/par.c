/* par.c: a pool of POSIX threads that wait for a loop; see par.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "core/mem.h"
#include "core/number.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>

enum { STACK = 2 << 20 }; /* bytes, at least */

struct worker {
	struct ct_par *par;
	size_t id;
	pthread_t thread;
};

struct ct_par {
	size_t threads, started;
	struct worker *worker;
	pthread_mutex_t lock;
	pthread_cond_t wake, done;
	unsigned long round; /* number of the loop; a new one wakes the workers */
	size_t running;      /* workers still in the loop */
	bool quit;
	atomic_flag busy;
	atomic_size_t next;
	const volatile sig_atomic_t *stop; /* or NULL */
	size_t n;
	ct_par_fn *fn;
	void *arg;
};

static bool stopping(const struct ct_par *p)
{
	return p && p->stop && __atomic_load_n(p->stop, __ATOMIC_RELAXED);
}

static void drain(struct ct_par *p, size_t id)
{
	for (;;) {
		size_t i = atomic_fetch_add_explicit(&p->next, 1, memory_order_relaxed);

		if (i >= p->n || stopping(p))
			return;
		p->fn(p->arg, i, id);
	}
}

static void *work(void *arg)
{
	struct worker *w = arg;
	struct ct_par *p = w->par;
	unsigned long seen = 0;

	ct_number_point();
	pthread_mutex_lock(&p->lock);
	for (;;) {
		while (!p->quit && p->round == seen)
			pthread_cond_wait(&p->wake, &p->lock);
		if (p->quit)
			break;
		seen = p->round;
		pthread_mutex_unlock(&p->lock);
		drain(p, w->id);
		pthread_mutex_lock(&p->lock);
		if (--p->running == 0)
			pthread_cond_signal(&p->done);
	}
	pthread_mutex_unlock(&p->lock);
	return NULL;
}

/* With room for what kernels put on the stack, however little `ulimit -s` gives. */
static int start(struct worker *w)
{
	pthread_attr_t attr;
	size_t size;
	int rc = pthread_attr_init(&attr);

	if (rc)
		return rc;
	if (pthread_attr_getstacksize(&attr, &size) == 0 && size < STACK)
		rc = pthread_attr_setstacksize(&attr, STACK);
	if (rc == 0)
		rc = pthread_create(&w->thread, &attr, work, w);
	pthread_attr_destroy(&attr);
	return rc;
}

int ct_par_alloc(struct ct_par **out, size_t threads, struct ct_err *e)
{
	struct ct_par *p;

	if (ct_alloc0(&p, 1, sizeof *p, e))
		return -1;
	p->threads = threads ? threads : 1;
	pthread_mutex_init(&p->lock, NULL);
	pthread_cond_init(&p->wake, NULL);
	pthread_cond_init(&p->done, NULL);
	atomic_flag_clear(&p->busy);
	if (ct_alloc0(&p->worker, p->threads, sizeof *p->worker, e)) {
		ct_par_free(p);
		return -1;
	}
	for (size_t i = 1; i < p->threads; i++) {
		p->worker[i] = (struct worker){.par = p, .id = i};
		if (start(&p->worker[i])) {
			ct_par_free(p);
			return ct_fail(
				e, CT_ENOMEM, "cannot start thread %zu of %zu", i + 1, threads);
		}
		p->started++;
	}
	*out = p;
	return 0;
}

void ct_par_free(struct ct_par *p)
{
	if (!p)
		return;
	pthread_mutex_lock(&p->lock);
	p->quit = true;
	pthread_cond_broadcast(&p->wake);
	pthread_mutex_unlock(&p->lock);
	for (size_t i = 1; i <= p->started; i++)
		pthread_join(p->worker[i].thread, NULL);
	pthread_cond_destroy(&p->wake);
	pthread_cond_destroy(&p->done);
	pthread_mutex_destroy(&p->lock);
	free(p->worker);
	free(p);
}

size_t ct_par_threads(const struct ct_par *p)
{
	return p ? p->threads : 1;
}

void ct_par_for(struct ct_par *p, size_t n, ct_par_fn *fn, void *arg)
{
	if (!p || p->threads == 1 || n < 2 || atomic_flag_test_and_set(&p->busy)) {
		for (size_t i = 0; i < n && !stopping(p); i++)
			fn(arg, i, 0);
		return;
	}
	pthread_mutex_lock(&p->lock);
	p->fn = fn;
	p->arg = arg;
	p->n = n;
	atomic_store(&p->next, 0);
	p->running = p->started;
	p->round++;
	pthread_cond_broadcast(&p->wake);
	pthread_mutex_unlock(&p->lock);
	drain(p, 0);
	pthread_mutex_lock(&p->lock);
	while (p->running)
		pthread_cond_wait(&p->done, &p->lock);
	pthread_mutex_unlock(&p->lock);
	atomic_flag_clear(&p->busy);
}

void ct_par_heed(struct ct_par *p, const volatile sig_atomic_t *stop)
{
	if (p)
		p->stop = stop;
}
