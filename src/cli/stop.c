/* stop.c: see stop.h. The signals are blocked, so that no kernel is interrupted. Threads that a
 * library began before do not block them, so the signals have a handler. It wakes a thread, which
 * may do anything about them. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "formats/temp.h"

#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LIMIT 1.0 /* seconds of CPU time, and of waiting */
#define TICK 0.02
#define IDLE 0.02 /* of a second's CPU time: less is waiting */

static volatile sig_atomic_t asked;
static atomic_int held, deferred, piped;
static const char *program;
static sem_t came;

static void end_now(void)
{
	signal(SIGPIPE, SIG_IGN); /* its handler waits for the thread that writes here */
	ct_temp_remove_all();
	dprintf(STDERR_FILENO, "%s%s: stopped on request\n",
		isatty(STDERR_FILENO) ? "\r\033[K" : "", program);
	_exit(CT_ESTOP);
}

static void end_of_pipe(void)
{
	ct_temp_remove_all();
	signal(SIGPIPE, SIG_DFL);
	raise(SIGPIPE);
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

static const int caught[] = {SIGINT, SIGTERM, SIGUSR1, SIGHUP};
enum { CAUGHT = sizeof caught / sizeof *caught };
static int n_caught = CAUGHT;

static void signals(sigset_t *s)
{
	sigemptyset(s);
	for (int i = 0; i < n_caught; i++)
		sigaddset(s, caught[i]);
}

static void on_each(void (*handler)(int))
{
	const struct sigaction action = {.sa_handler = handler, .sa_flags = SA_RESTART};

	for (int i = 0; i < n_caught; i++)
		sigaction(caught[i], &action, NULL);
}

static void take(int sig)
{
	const int was = errno;

	(void)sig;
	sem_post(&came);
	errno = was;
}

/* The thread that wrote is not to call it an error. */
static void take_pipe(int sig)
{
	piped = 1;
	take(sig);
	while (!held)
		ct_clock_sleep(TICK);
}

static bool ignored(int sig)
{
	struct sigaction now;

	return sigaction(sig, NULL, &now) == 0 && now.sa_handler == SIG_IGN;
}

static void *watch(void *unused)
{
	sigset_t s;

	(void)unused;
	signals(&s);
	pthread_sigmask(SIG_UNBLOCK, &s, NULL);
	while (sem_wait(&came) != 0)
		;
	if (!held && piped)
		end_of_pipe();
	if (!held)
		end_now();
	__atomic_store_n(&asked, 1, __ATOMIC_RELAXED);
	wait_for_end();
	return NULL;
}

int ct_stop_catch(const char *tool, struct ct_err *e)
{
	const struct sigaction pipe_closed = {.sa_handler = take_pipe, .sa_flags = SA_RESTART};
	pthread_t thread;
	sigset_t s;

	program = tool;
	if (ignored(SIGHUP))
		n_caught = CAUGHT - 1; /* nohup */
	signals(&s);
	if (sem_init(&came, 0, 0) != 0)
		return ct_fail(e, CT_EFAIL, "cannot make a semaphore");
	on_each(take);
	if (!ignored(SIGPIPE))
		sigaction(SIGPIPE, &pipe_closed, NULL);
	signal(SIGXFSZ, SIG_IGN); /* a file at its limit is an error of the write */
	pthread_sigmask(SIG_BLOCK, &s, NULL);
	if (pthread_create(&thread, NULL, watch, NULL) != 0)
		return ct_fail(e, CT_ENOMEM, "cannot start a thread");
	pthread_detach(thread);
	return 0;
}

void ct_stop_uncatch(void)
{
	sigset_t s;

	on_each(SIG_DFL);
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

void ct_stop_test(void)
{
	static unsigned calls;
	const char *said = getenv(CT_STOP_TEST);
	char tool[32];
	unsigned at;
	int sig;

	if (!said || sscanf(said, "%31s %u %d", tool, &at, &sig) != 3 ||
		strcmp(tool, program) != 0 || ++calls != at)
		return;
	kill(0, sig);
	while (!asked)
		ct_clock_sleep(TICK);
}
