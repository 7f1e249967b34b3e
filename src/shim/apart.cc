/* apart.cc: see apart.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/apart.h"
#include "shim/guard.h"
extern "C" {
#include "core/inflate.h"
}

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace
{

/* What the child leaves for its parent, the numbers behind it. */
struct Result {
	ct_err err;
	int rc;
	alignas(64) float out[1];
};

const int died = -2;

enum { AWAY = 4096 }; /* files at a time */

/* What the decoder of n numbers may take beside what there is, whatever the stream says of itself.
 */
size_t most_memory(size_t n)
{
	return CT_INFLATE_FREE + 8 * n * sizeof(float);
}

void limit_memory(size_t n)
{
	unsigned long data = 0;
	FILE *f = ct_inflate_allowed() ? std::fopen("/proc/self/statm", "r") : nullptr;

	if (!f)
		return;
	if (std::fscanf(f, "%*u %*u %*u %*u %*u %lu", &data) == 1) {
		const rlim_t most =
			data * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + most_memory(n);
		const struct rlimit limit = {most, most};

		setrlimit(RLIMIT_DATA, &limit);
	}
	std::fclose(f);
}

/* Alone, silent, and with the usual ends. */
void settle(pid_t parent, size_t n)
{
	const struct rlimit minute = {60, 60}, none = {0, 0};
	const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);

	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != parent)
		_exit(1);
	for (int s : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGXCPU})
		std::signal(s, SIG_DFL);
	setrlimit(RLIMIT_CPU, &minute);
	limit_memory(n);
	setrlimit(RLIMIT_CORE, &none);
	if (null >= 0) {
		dup2(null, STDOUT_FILENO);
		dup2(null, STDERR_FILENO);
	}
}

int wait_for(pid_t child)
{
	int status = 0;

	return TEMP_FAILURE_RETRY(waitpid(child, &status, 0)) < 0 ? -1 : status;
}

/* Memory that children share, or nullptr. */
void *share(size_t bytes)
{
	void *p = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);

	return p == MAP_FAILED ? nullptr : p;
}

/* A byte; false at the end. */
bool receive(int end, char *c)
{
	return TEMP_FAILURE_RETRY(recv(end, c, 1, 0)) == 1;
}

} // namespace

int apart(float *out, size_t n, const char *what, ct_err *e,
	const std::function<int(float *, ct_err *)> &f)
{
	const size_t bytes = sizeof(Result) + n * sizeof *out;
	const pid_t parent = getpid();
	Result *r = static_cast<Result *>(share(bytes));
	int status, rc;

	if (!r)
		return ct_fail(e, CT_ENOMEM, "%s: no memory to decode it", what);
	r->rc = died;
	const pid_t child = fork();
	if (child == 0) {
		settle(parent, n);
		r->rc = guard(&r->err, what, [&] { return f(r->out, &r->err); });
		_exit(0);
	}
	status = child > 0 ? wait_for(child) : 0;
	rc = r->rc;
	if (child < 0)
		rc = ct_fail(e, CT_ENOMEM, "%s: no process to decode it: %s", what,
			std::strerror(errno));
	else if (rc == died)
		rc = ct_fail(e, CT_EINPUT, "%s: damaged: its decoder dies of it (status %d)", what,
			status);
	else if (rc && r->err.code == CT_ENOMEM)
		rc = ct_fail(e, CT_ENOMEM, "%s: no memory: its decoder has %zu MB (--expand)", what,
			most_memory(n) >> 20);
	else if (rc && r->err.code == CT_EFAIL) /* thrown */
		rc = ct_fail(
			e, CT_EINPUT, "%s: damaged%.300s", what, r->err.msg + std::strlen(what));
	else if (rc)
		*e = r->err;
	else
		std::memcpy(out, r->out, n * sizeof *out);
	munmap(r, bytes);
	return rc;
}

std::vector<bool> deadly(size_t n, const std::function<void(size_t)> &f)
{
	const pid_t parent = getpid();
	std::vector<bool> is(n);
	void *room = share(sizeof(size_t));
	volatile size_t *at = static_cast<volatile size_t *>(room); /* the one at work */

	if (!room)
		return {};
	for (size_t begin = 0; begin < n;) {
		const size_t end = std::min(begin + AWAY, n); /* in a minute of the processor */

		*at = begin;
		const pid_t child = fork();
		if (child == 0) {
			settle(parent, 0);
			for (; *at < end; *at = *at + 1) {
				ct_err e = {};

				if (guard(&e, "", [&] { return f(*at), 0; }))
					_exit(1);
			}
			_exit(0);
		}
		if (child < 0) {
			is.clear();
			break;
		}
		wait_for(child);
		begin = *at;
		if (begin < end)
			is[begin++] = true;
	}
	munmap(room, sizeof(size_t));
	return is;
}

Ahead::~Ahead()
{
	stop();
	if (room)
		munmap(room, bytes);
}

void Ahead::stop()
{
	for (const Maker &m : maker) {
		if (m.end >= 0)
			close(m.end);
		if (m.id > 0) {
			kill(m.id, SIGKILL);
			wait_for(m.id);
		}
	}
	maker.clear();
	most = 0;
}

/* Each maker has places of its own, taken in turn. */
float *Ahead::place(size_t i) const
{
	const size_t p = i % maker.size(), turn = i / maker.size();

	return static_cast<float *>(room) + (p * each + turn % each) * size;
}

/* All pictures of maker p, no more of them ahead than it has places. */
void Ahead::run(size_t p, int end, const std::function<int(size_t, float *, ct_err *)> &f) const
{
	for (size_t i = p, made = 0; i < most; i += maker.size(), made++) {
		ct_err e = {};
		char good;

		if (made >= each && !receive(end, &good))
			return;
		good = guard(&e, "", [&] { return f(i, place(i), &e); }) == 0;
		if (send(end, &good, 1, MSG_NOSIGNAL) != 1)
			return;
	}
}

void Ahead::make(size_t count, size_t n, size_t processes, size_t kept,
	const std::function<int(size_t, float *, ct_err *)> &f)
{
	const pid_t parent = getpid();
	const size_t need = kept * n * sizeof(float);

	stop();
	processes = std::min({processes, kept, count});
	if (processes == 0)
		return;
	if (room && bytes < need) {
		munmap(room, bytes);
		room = nullptr;
	}
	if (!room) {
		room = share(need);
		bytes = need;
	}
	if (!room)
		return;
	size = n;
	most = count;
	each = kept / processes;
	at = 0;
	maker.resize(processes, {-1, -1});
	for (size_t p = 0; p < processes; p++) {
		int end[2];

		if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, end) != 0)
			continue;
		maker[p] = {fork(), end[0]};
		if (maker[p].id != 0) {
			close(end[1]); /* that it ends when the process does */
			continue;
		}
		settle(parent, n);
		mallopt(M_MMAP_THRESHOLD, 1 << 28); /* what one picture took the next one takes */
		mallopt(M_TRIM_THRESHOLD, 1 << 28);
		run(p, end[1], f);
		_exit(0);
	}
}

const float *Ahead::get(size_t i)
{
	char good = 0;

	if (i >= most)
		return nullptr;
	for (; at <= i; at++) {
		if (at > 0) /* there is room again */
			(void)send(maker[(at - 1) % maker.size()].end, "", 1, MSG_NOSIGNAL);
		if (!receive(maker[at % maker.size()].end, &good))
			good = 0;
	}
	const float *out = good ? place(i) : nullptr;
	if (at == most)
		stop();
	return out;
}
