/* guard.h: no exception leaves C++ (for the .cc files of this folder only).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_GUARD_H
#define CT_SHIM_GUARD_H
#include "core/err.h"

#include <cerrno>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include <fcntl.h>
#include <unistd.h>

/* The system lacks something: no fault of a file, so it does not count as damaged. */
class Lack : public std::exception
{
	std::string words;

      public:
	explicit Lack(const std::string &what)
	    : words(what + ": " + std::strerror(errno) +
		      (errno == EMFILE ? ": close some, or raise ulimit -n" : ""))
	{
	}
	const char *what() const noexcept override
	{
		return words.c_str();
	}
	/* Throws if the file cannot be opened because of that: libraries do not say why. */
	static void check(const char *path)
	{
		const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

		if (fd >= 0)
			close(fd);
		else if (is(errno))
			throw Lack(path);
	}
	static bool is(int why)
	{
		return why == EMFILE || why == ENFILE || why == ENOMEM;
	}
};

/* f() returns 0 or -1 after ct_fail; what it throws becomes a failure naming `what`. */
template <class F> int guard(struct ct_err *e, const char *what, F f) noexcept
{
	try {
		return f();
	} catch (const std::bad_alloc &) {
		return ct_fail(e, CT_ENOMEM, "%s: no memory", what);
	} catch (const Lack &x) {
		return ct_fail(e, CT_ENOMEM, "%s: %s", what, x.what());
	} catch (const std::exception &x) {
		return ct_fail(e, CT_EFAIL, "%s: %s", what, x.what());
	} catch (...) {
		return ct_fail(e, CT_EFAIL, "%s: unknown exception", what);
	}
}

#endif
