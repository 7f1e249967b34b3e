/* stop.c: see stop.h. What a signal finds has to be static; all of it is here and in
 * formats/temp.c. */
#include "config.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "core/err.h"
#include "formats/temp.h"

#include <string.h>
#include <sys/time.h>
#include <unistd.h>

#define LIMIT 1.0 /* seconds of CPU time, and of waiting */
#define TICK 0.1
enum { IDLE_TICKS = 10 };

static volatile sig_atomic_t asked, held, deferred;
static const char *name;
static double seen;       /* CPU time at the last tick */
static volatile int idle; /* ticks without any */

static void put(const char *s)
{
	size_t n = strlen(s);

	while (n) {
		ssize_t k = write(STDERR_FILENO, s, n);

		if (k <= 0)
			return;
		s += k;
		n -= (size_t)k;
	}
}

static void end_now(void)
{
	ct_temp_remove_all();
	if (isatty(STDERR_FILENO))
		put("\r\033[K");
	put(name);
	put(": stopped on request\n");
	_exit(CT_ESTOP);
}

static struct timeval time_of(double s)
{
	return (struct timeval){
		.tv_sec = (time_t)s, .tv_usec = (suseconds_t)(1e6 * (s - (time_t)s))};
}

static void on_signal(int sig)
{
	(void)sig;
	if (!held)
		end_now();
	if (asked)
		return;
	asked = 1;
	seen = ct_clock_cpu();
	setitimer(ITIMER_PROF, &(struct itimerval){time_of(TICK), time_of(LIMIT)}, NULL);
	setitimer(ITIMER_REAL, &(struct itimerval){time_of(TICK), time_of(TICK)}, NULL);
}

/* The second of CPU time is over. */
static void on_limit(int sig)
{
	(void)sig;
	if (!deferred)
		end_now();
}

static void on_tick(int sig)
{
	const double now = ct_clock_cpu();

	(void)sig;
	idle = now - seen < 0.01 * TICK && !deferred ? idle + 1 : 0;
	seen = now;
	if (idle >= IDLE_TICKS)
		end_now();
}

static void catch (int sig, void (*fn)(int))
{
	struct sigaction sa = {.sa_handler = fn, .sa_flags = SA_RESTART};

	sigfillset(&sa.sa_mask);
	sigaction(sig, &sa, NULL);
}

void ct_stop_catch(const char *tool)
{
	name = tool;
	catch (SIGALRM, on_tick);
	catch (SIGPROF, on_limit);
	catch (SIGINT, on_signal);
	catch (SIGUSR1, on_signal);
	catch (SIGTERM, on_signal);
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
	deferred = deferred + (on ? 1 : -1);
}
