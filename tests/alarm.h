/* alarm.h: a run that is asked to stop at some time, for tests.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_ALARM_H
#define CT_TESTS_ALARM_H
#include <signal.h>
#include <sys/time.h>

static volatile sig_atomic_t alarm_rang;

static void alarm_ring(int sig)
{
	(void)sig;
	__atomic_store_n(&alarm_rang, 1, __ATOMIC_RELAXED); /* threads read it so */
}

/* alarm_rang is 1 in so many seconds, and 0 until then; 0 seconds: never. */
static inline void alarm_in(double seconds)
{
	const struct itimerval t = {
		.it_value = {.tv_sec = (time_t)seconds,
			.tv_usec = (suseconds_t)(1e6 * (seconds - (double)(time_t)seconds))}};

	setitimer(ITIMER_REAL, &(struct itimerval){0}, NULL);
	signal(SIGALRM, alarm_ring);
	__atomic_store_n(&alarm_rang, 0, __ATOMIC_RELAXED);
	setitimer(ITIMER_REAL, &t, NULL);
}

#endif
