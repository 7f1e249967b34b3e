/* How a run ends that is told to: at once, where it has saved its state, or soon in any case. Each
 * case is a process, all at the same time. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/resume.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "core/err.h"
#include "formats/temp.h"
#include "scratch.h"

#include <glob.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#define MOST 30 /* seconds: what does not end is ended */

static struct ct_temp temporary;

static void catch (void)
{
	struct ct_err e = {0};

	if (ct_stop_catch("ct-t", &e))
		_exit(1);
}

static void begin(void)
{
	catch ();
	ct_stop_hold();
	if (*ct_stop_flag())
		_exit(2);
	kill(getpid(), SIGTERM);
	while (!*ct_stop_flag())
		ct_clock_sleep(0.01);
}

static void burn(double seconds)
{
	const double until = ct_clock_cpu() + seconds;

	while (ct_clock_cpu() < until)
		;
}

static void told(int sig)
{
	struct ct_err e = {0};
	int fd = ct_temp_open("half", &temporary, &e);

	if (fd < 0 || write(fd, "x", 1) != 1)
		_exit(1);
	catch ();
	kill(getpid(), sig);
	ct_clock_sleep(MOST);
	_exit(0);
}

static void by_int(void)
{
	told(SIGINT);
}

static void by_term(void)
{
	told(SIGTERM);
}

static void by_usr1(void)
{
	told(SIGUSR1);
}

static void by_hup(void)
{
	signal(SIGHUP, SIG_DFL); /* whatever the tests run under */
	told(SIGHUP);
}

static void by_nohup(void)
{
	signal(SIGHUP, SIG_IGN);
	catch ();
	kill(getpid(), SIGHUP);
	ct_clock_sleep(0.3);
	_exit(0);
}

/* Waits for what does not come. */
static void waits(void)
{
	begin();
	ct_clock_sleep(MOST);
	_exit(0);
}

/* Has just begun to wait. */
static void works_then_waits(void)
{
	begin();
	burn(0.2);
	ct_clock_sleep(MOST);
	_exit(0);
}

/* Works and does not look whether it should stop. */
static void works(void)
{
	begin();
	burn(MOST);
	_exit(0);
}

/* Works a little all the time, and then ends by itself. */
static void works_a_little(void)
{
	begin();
	for (int i = 0; i < 8; i++) {
		burn(0.06);
		ct_clock_sleep(0.3);
	}
	_exit(0);
}

/* Saves its state for longer than it would be left alone. */
static void saves(void)
{
	begin();
	ct_stop_defer(true);
	ct_stop_defer(true);
	ct_clock_sleep(1.2);
	ct_stop_defer(false);
	burn(1.2);
	put_text("saved", "x");
	ct_stop_defer(false);
	ct_clock_sleep(MOST);
	_exit(0);
}

static int pack(struct ct_tensors *t, const void *work, struct ct_err *e)
{
	(void)t;
	(void)work;
	(void)e;
	return 0;
}

/* Has saved, and does not any more. */
static void saved(void)
{
	char path[] = "of-a-run.state";
	struct ct_resume r = {.path = path, .own = true};
	struct ct_err e;

	if (ct_resume_save(&r, pack, NULL, &e))
		_exit(1);
	waits();
}

/* What it starts is told by the signals again. */
static void starts(void)
{
	sigset_t blocked;

	signal(SIGHUP, SIG_DFL);
	catch ();
	pthread_sigmask(SIG_BLOCK, NULL, &blocked);
	if (!sigismember(&blocked, SIGINT) || !sigismember(&blocked, SIGTERM) ||
		!sigismember(&blocked, SIGUSR1) || !sigismember(&blocked, SIGHUP) ||
		sigismember(&blocked, SIGALRM))
		_exit(1);
	ct_stop_uncatch();
	pthread_sigmask(SIG_BLOCK, NULL, &blocked);
	_exit(sigismember(&blocked, SIGINT) || sigismember(&blocked, SIGTERM) ||
		sigismember(&blocked, SIGUSR1) || sigismember(&blocked, SIGHUP));
}

/* How it should end, at what time, in seconds of the clock after 0, and with how much work. */
static const struct plan {
	const char *name;
	void (*run)(void);
	int status;
	double least, cpu_least, cpu_most;
} plans[] = {
	{"SIGINT", by_int, CT_ESTOP, 0, 0, 0.5},
	{"SIGTERM", by_term, CT_ESTOP, 0, 0, 0.5},
	{"SIGUSR1", by_usr1, CT_ESTOP, 0, 0, 0.5},
	{"SIGHUP", by_hup, CT_ESTOP, 0, 0, 0.5},
	{"SIGHUP under nohup is ignored", by_nohup, 0, 0, 0, 0.5},
	{"one that waits ends soon", waits, CT_ESTOP, 0.9, 0, 0.5},
	{"one that begins to wait", works_then_waits, CT_ESTOP, 1.1, 0.2, 0.7},
	{"one that works on ends soon", works, CT_ESTOP, 0.9, 0.95, 3},
	{"one that works a little is let alone", works_a_little, 0, 2.4, 0.4, 1},
	{"one that saves is waited for", saves, CT_ESTOP, 2.4, 1.2, 4},
	{"one that has saved", saved, CT_ESTOP, 0.9, 0, 0.5},
	{"signals are free again", starts, 0, 0, 0, 0.5},
};
enum { N = sizeof plans / sizeof *plans };

/* How it did. */
static struct end {
	pid_t pid;
	double start, took, cpu;
	int status;
	bool says;
} ends[N];

static void launch(int i)
{
	char name[20];

	ends[i].start = ct_clock_wall();
	ends[i].pid = fork();
	if (ends[i].pid)
		return;
	snprintf(name, sizeof name, "err%d", i);
	if (!freopen(name, "w", stderr))
		_exit(1);
	alarm(MOST);
	plans[i].run();
	_exit(1);
}

static double seconds(struct timeval t)
{
	return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

static void gather(void)
{
	struct rusage u;
	char name[20];
	int s, i = 0;
	pid_t got = wait4(-1, &s, 0, &u);

	while (ends[i].pid != got)
		i++;
	snprintf(name, sizeof name, "err%d", i);
	ends[i].took = ct_clock_wall() - ends[i].start;
	ends[i].cpu = seconds(u.ru_utime) + seconds(u.ru_stime);
	ends[i].status = WIFEXITED(s) ? WEXITSTATUS(s) : -WTERMSIG(s);
	ends[i].says = strcmp(text_of(name), "ct-t: stopped on request\n") == 0;
}

static bool as_planned(const struct end *e, const struct plan *p)
{
	return e->status == p->status && e->took >= p->least && e->cpu >= p->cpu_least &&
	       e->cpu <= p->cpu_most && e->says == (p->status == CT_ESTOP);
}

int main(void)
{
	glob_t found;

	scratch_begin();
	for (int i = 0; i < N; i++)
		launch(i);
	for (int i = 0; i < N; i++)
		gather();
	for (int i = 0; i < N; i++) {
		if (!as_planned(
			    &ends[i], &plans[i])) { /* no CPU was left for it? once more, alone */
			launch(i);
			gather();
		}
		OK(as_planned(&ends[i], &plans[i]), "%s: status %d after %.2f s, %.2f of work",
			plans[i].name, ends[i].status, ends[i].took, ends[i].cpu);
	}
	OK(is_there("saved"), "what is being saved is saved");
	OK(glob("half*", 0, NULL, &found) == GLOB_NOMATCH, "nothing half-written stays");
	globfree(&found);
	return tap_done();
}
