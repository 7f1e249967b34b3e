/* apart.cc: see apart.h. */
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

enum { AWAY = 4096 }; /* pictures or files at a time; their marks are as far from what is marked */

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

	while (waitpid(child, &status, 0) < 0)
		if (errno != EINTR)
			return -1;
	return status;
}

} // namespace

int apart(float *out, size_t n, const char *what, ct_err *e,
	const std::function<int(float *, ct_err *)> &f)
{
	const size_t bytes = sizeof(Result) + n * sizeof *out;
	const pid_t parent = getpid();
	void *room =
		mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	Result *r = static_cast<Result *>(room);
	int status, rc;

	if (room == MAP_FAILED)
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
	munmap(room, bytes);
	return rc;
}

std::vector<bool> deadly(size_t n, const std::function<void(size_t)> &f)
{
	const pid_t parent = getpid();
	std::vector<bool> is(n);
	void *room = mmap(
		nullptr, sizeof(size_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	volatile size_t *at = static_cast<volatile size_t *>(room); /* the one at work */

	if (room == MAP_FAILED)
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
	if (room)
		munmap(room, bytes);
}

const float *Ahead::get(size_t i) const
{
	const char *mark = static_cast<const char *>(room);

	if (i >= most || !mark[i])
		return nullptr;
	return reinterpret_cast<const float *>(mark + AWAY) + i * size;
}

void Ahead::make(size_t count, size_t n, size_t processes,
	const std::function<int(size_t, float *, ct_err *)> &f)
{
	const pid_t parent = getpid();
	std::vector<pid_t> child;

	count = std::min<size_t>(count, AWAY);
	if (!room || bytes < AWAY + count * n * sizeof(float)) {
		if (room)
			munmap(room, bytes);
		bytes = AWAY + count * n * sizeof(float);
		room = mmap(
			nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	}
	most = count;
	size = n;
	if (room == MAP_FAILED) {
		room = nullptr;
		most = 0;
		return;
	}
	char *const mark = static_cast<char *>(room);
	std::memset(mark, 0, AWAY);
	child.reserve(processes);
	for (size_t p = 0; p < processes; p++) {
		const pid_t id = fork();

		if (id > 0)
			child.push_back(id);
		if (id != 0)
			continue;
		settle(parent, n);
		mallopt(M_MMAP_THRESHOLD, 1 << 28); /* what one picture took the next one takes */
		mallopt(M_TRIM_THRESHOLD, 1 << 28);
		for (size_t i = p; i < count; i += processes) {
			float *out = reinterpret_cast<float *>(mark + AWAY) + i * n;
			ct_err e = {};

			mark[i] = guard(&e, "", [&] { return f(i, out, &e); }) == 0;
		}
		_exit(0);
	}
	for (pid_t id : child)
		wait_for(id);
}
