/* stop.c: see stop.h. The signals are blocked everywhere and taken by a thread of their own: no
 * kernel is interrupted, and what is done about them may be anything. */
#include "config.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "formats/temp.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <unistd.h>

#define LIMIT 1.0 /* seconds of CPU time, and of waiting */
#define TICK 0.02
#define IDLE 0.02 /* of a second's CPU time: less is waiting */

static volatile sig_atomic_t asked;
static atomic_int held, deferred;
static const char *program;

static void end_now(void)
{
	ct_temp_remove_all();
	dprintf(STDERR_FILENO, "%s%s: stopped on request\n",
		isatty(STDERR_FILENO) ? "\r\033[K" : "", program);
	_exit(CT_ESTOP);
}

/* The run ends by itself, or is ended. */
static void wait_for_end(void)
{
	const double start = ct_clock_cpu();
	double since = ct_clock_wall(), seen = start;

	for (;;) {
		const double now = ct_clock_cpu();

		if (deferred || now - seen >= IDLE) {
			since = ct_clock_wall();
			seen = now;
		}
		if (!deferred && (now - start >= LIMIT || ct_clock_wall() - since >= LIMIT))
			end_now();
		ct_clock_sleep(TICK);
	}
}

static void signals(sigset_t *s)
{
	sigemptyset(s);
	sigaddset(s, SIGINT);
	sigaddset(s, SIGTERM);
	sigaddset(s, SIGUSR1);
}

static void *watch(void *unused)
{
	sigset_t s;
	int sig;

	(void)unused;
	signals(&s);
	while (sigwait(&s, &sig) != 0)
		;
	if (!held)
		end_now();
	__atomic_store_n(&asked, 1, __ATOMIC_RELAXED);
	wait_for_end();
	return NULL;
}

int ct_stop_catch(const char *tool, struct ct_err *e)
{
	pthread_t thread;
	sigset_t s;

	program = tool;
	signals(&s);
	pthread_sigmask(SIG_BLOCK, &s, NULL);
	if (pthread_create(&thread, NULL, watch, NULL) != 0)
		return ct_fail(e, CT_ENOMEM, "cannot start a thread");
	pthread_detach(thread);
	return 0;
}

void ct_stop_uncatch(void)
{
	sigset_t s;

	signals(&s);
	pthread_sigmask(SIG_UNBLOCK, &s, NULL);
}

const volatile sig_atomic_t *ct_stop_flag(void)
{
	return &asked;
}

void ct_stop_hold(void)
{
	held = 1;
}

void ct_stop_defer(bool on)
{
	atomic_fetch_add(&deferred, on ? 1 : -1);
}
