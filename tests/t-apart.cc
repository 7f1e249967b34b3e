/* What runs in a process of its own: its numbers, failures, exceptions and deaths; its limits.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
extern "C" {
#include "tap.h"
}
#include "core/inflate.h"
#include "shim/apart.h"
#include "shim/guard.h"

#include <csignal>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

enum { N = 1000 };

static float out[N];

static void nothing(int)
{
}

/* A picture comes back whole, though a signal interrupts the wait for it. */
static void numbers()
{
	struct sigaction act = {}, was = {};
	struct itimerval soon = {}, never = {};
	const pid_t parent = getpid();
	int wrong = 0, rc;

	act.sa_handler = nothing; /* without SA_RESTART */
	sigaction(SIGALRM, &act, &was);
	soon.it_value.tv_usec = soon.it_interval.tv_usec = 20000;
	setitimer(ITIMER_REAL, &soon, nullptr);
	rc = apart(out, N, "a picture", &err, [&](float *to, ct_err *) {
		for (int i = 0; i < N; i++)
			to[i] = static_cast<float>(i + (getpid() == parent ? N : 0));
		poll(nullptr, 0, 100);
		return 0;
	});
	if (getpid() != parent) /* not even it comes back */
		kill(parent, SIGKILL);
	setitimer(ITIMER_REAL, &never, nullptr);
	sigaction(SIGALRM, &was, nullptr);
	for (int i = 0; i < N; i++)
		wrong += out[i] != static_cast<float>(i);
	OK(rc == 0 && wrong == 0, "%d numbers from another process", N);
	OK(waitpid(-1, nullptr, WNOHANG) == -1, "which is waited for");
}

/* Alone, silent, with a minute of the processor, no core, and the usual ends of signals. */
static void limits()
{
	const int was = dup(STDOUT_FILENO), also = dup(STDERR_FILENO);
	const int words = open("words", O_RDWR | O_CREAT | O_TRUNC, 0600);
	struct rlimit core, minute;
	struct stat s = {};
	int rc;

	signal(SIGSEGV, nothing);
	signal(SIGABRT, SIG_IGN);
	fflush(stdout);
	dup2(words, STDOUT_FILENO);
	dup2(words, STDERR_FILENO);
	rc = apart(out, 6, "limits", &err, [](float *to, ct_err *) {
		struct rlimit cpu, none;
		int sig = 0;

		printf("words\n");
		fflush(stdout);
		fprintf(stderr, "words\n");
		getrlimit(RLIMIT_CPU, &cpu);
		getrlimit(RLIMIT_CORE, &none);
		prctl(PR_GET_PDEATHSIG, &sig);
		to[0] = static_cast<float>(cpu.rlim_cur);
		to[1] = static_cast<float>(none.rlim_max);
		to[2] = static_cast<float>(sig);
		to[3] = signal(SIGSEGV, SIG_DFL) == SIG_DFL;
		to[4] = signal(SIGABRT, SIG_DFL) == SIG_DFL;
		to[5] = static_cast<float>(cpu.rlim_max);
		return 0;
	});
	dup2(was, STDOUT_FILENO);
	dup2(also, STDERR_FILENO);
	fstat(words, &s);
	close(words);
	close(was);
	close(also);
	unlink("words");
	OK(rc == 0 && s.st_size == 0, "it is silent");
	OK(out[0] == 60 && out[5] == 60 && out[1] == 0 && out[2] == SIGKILL,
		"%g s, %g of core, signal %g", (double)out[0], (double)out[1], (double)out[2]);
	OK(out[3] == 1 && out[4] == 1, "and dies of what one dies of");
	getrlimit(RLIMIT_CPU, &minute);
	getrlimit(RLIMIT_CORE, &core);
	OK(minute.rlim_cur != 60 && signal(SIGSEGV, SIG_DFL) == nothing, "its parent does not");
	signal(SIGABRT, SIG_DFL);
}

static void failed(const char *what, ct_code code, const char *word,
	const std::function<int(float *, ct_err *)> &f)
{
	int rc;

	memset(&err, 0, sizeof err);
	out[0] = 7;
	rc = apart(out, 1, "x.dcm", &err, f);
	OK(rc && err.code == code && strstr(err.msg, word) && out[0] == 7, "%s: %s", what, err.msg);
}

static void failures()
{
	failed("a failure", CT_EGEOM, "no picture of 5",
		[](float *, ct_err *e) { return ct_fail(e, CT_EGEOM, "no picture of %d", 5); });
	failed("no memory", CT_ENOMEM, "x.dcm: no memory: its decoder has 1024 MB (--expand)",
		[](float *, ct_err *) -> int { throw std::bad_alloc(); });
	failed("an exception", CT_EINPUT, "x.dcm: damaged: why",
		[](float *, ct_err *) -> int { throw std::runtime_error("why"); });
	failed("a death", CT_EINPUT, "x.dcm: damaged: its decoder dies of it (status 9)",
		[](float *to, ct_err *) {
			to[0] = 1;
			raise(SIGKILL);
			return 0;
		});
	failed("an exit", CT_EINPUT, "x.dcm: damaged", [](float *, ct_err *) -> int { _exit(0); });
}

/* Pages of so many MB, or none. */
static int take(float *to, size_t mb)
{
	void *room = mmap(nullptr, mb << 20, PROT_READ | PROT_WRITE,
		MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);

	to[0] = room != MAP_FAILED;
	return 0;
}

/* A stream may say of itself that it is large, whatever the file around it says. */
static void memory()
{
	apart(out, 1, "x.dcm", &err, [](float *to, ct_err *) { return take(to, 900); });
	OK(out[0] == 1, "900 MB are there");
	apart(out, 1, "x.dcm", &err, [](float *to, ct_err *) { return take(to, 1100); });
	OK(out[0] == 0, "1100 are not");
	ct_inflate_allow(0);
	apart(out, 1, "x.dcm", &err, [](float *to, ct_err *) { return take(to, 1100); });
	OK(out[0] == 1, "unless any growth is allowed");
	ct_inflate_allow(CT_INFLATE_TIMES);
}

static void guarded()
{
	OK(guard(&err, "y", [] { return 0; }) == 0, "nothing thrown");
	OK(guard(&err, "y", []() -> int { throw std::bad_alloc(); }) == -1 &&
			err.code == CT_ENOMEM && strstr(err.msg, "y: no memory"),
		"%s", err.msg);
	OK(guard(&err, "y", []() -> int { throw std::runtime_error("why"); }) == -1 &&
			err.code == CT_EFAIL && strstr(err.msg, "y: why"),
		"%s", err.msg);
	OK(guard(&err, "y", []() -> int { throw 5; }) == -1 && err.code == CT_EFAIL &&
			strstr(err.msg, "y: unknown"),
		"%s", err.msg);
}

/* Pictures ahead, in other processes: those that cannot be made are not there, the others are. */
static void ahead()
{
	enum { COUNT = 11 };
	const pid_t parent = getpid();
	int good = 0, again = 0;
	Ahead a;

	OK(a.get(0) == nullptr, "nothing is ahead at first");
	for (size_t processes : {1, 2, 3, 20}) {
		a.make(COUNT, N, processes, 2 * processes + 1, [&](size_t i, float *to, ct_err *e) {
			if (i == 2)
				return ct_fail(e, CT_EINPUT, "no");
			if (i == 4)
				throw std::runtime_error("no");
			if (i == COUNT - 1)
				abort(); /* and what this process was to make next */
			for (int k = 0; k < N; k++)
				to[k] = static_cast<float>(
					static_cast<int>(i) + (getpid() == parent ? N : 0));
			return 0;
		});
		for (size_t i = 0; i < COUNT + 2; i++) {
			const float *px = a.get(i);

			if (i == 2 || i == 4 || i >= COUNT - 1)
				again += px == nullptr;
			else
				good += px && px[0] == static_cast<float>(i) &&
					px[N - 1] == static_cast<float>(i);
		}
		OK(waitpid(-1, nullptr, WNOHANG) == -1, "%zu processes are waited for", processes);
	}
	OK(good == 4 * (COUNT - 3), "%d pictures are made", good);
	OK(again == 4 * 5, "%d are not", again);
}

/* No more are made than are kept; what is passed over is gone; who waits is ended. */
static void kept()
{
	void *room = mmap(
		nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	int *made = static_cast<int *>(room);
	Ahead a;

	a.make(100, N, 3, 6, [&](size_t i, float *to, ct_err *) {
		__atomic_add_fetch(made, 1, __ATOMIC_SEQ_CST);
		to[0] = static_cast<float>(i);
		return 0;
	});
	OK(a.get(0) && a.get(1) && a.get(2), "three are there");
	poll(nullptr, 0, 200);
	OK(__atomic_load_n(made, __ATOMIC_SEQ_CST) <= 6 + 2, "%d of 100 are made", *made);
	const float *px = a.get(7);
	OK(px && px[0] == 7 && !a.get(3) && !a.get(7), "5 are passed over");
	a.stop();
	OK(!a.get(8) && waitpid(-1, nullptr, WNOHANG) == -1, "all are ended");
	a.make(4, 2 * N, 2, 2, [](size_t i, float *to, ct_err *) {
		to[2 * N - 1] = static_cast<float>(i);
		return 0;
	});
	px = a.get(3);
	OK(px && px[2 * N - 1] == 3, "others, larger ones, are made");
	munmap(room, sizeof(int));
}

/* Which of many kill: each of them is found, and what is behind it is tried. */
static void killers()
{
	const auto none = deadly(0, [](size_t) {});
	const auto all = deadly(5, [](size_t) { abort(); });
	const auto some = deadly(5000, [](size_t i) {
		if (i == 0 || i == 4999)
			abort();
		if (i == 4095)
			throw std::runtime_error("no");
		if (i == 4096)
			raise(SIGKILL);
	});
	size_t count = 0;

	for (bool k : some)
		count += k;
	OK(none.empty() && all == std::vector<bool>(5, true), "none, and all of them");
	OK(some.size() == 5000 && count == 4 && some[0] && some[4095] && some[4096] && some[4999],
		"%zu of 5000", count);
}

int main()
{
	numbers();
	limits();
	failures();
	memory();
	guarded();
	ahead();
	kept();
	killers();
	return tap_done();
}
