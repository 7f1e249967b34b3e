/* guard.cc: see guard.h. */
#include "config.h"
#include "shim/guard.h"

#include <cerrno>
#include <cstdio>
#include <exception>
#include <new>
#include <sys/mman.h>
#include <unistd.h>

int guard_failed(struct ct_err *e, const char *what) noexcept
{
	try {
		throw;
	} catch (const std::bad_alloc &) {
		return ct_fail(e, CT_ENOMEM, "%s: no memory", what);
	} catch (const std::exception &x) {
		return ct_fail(e, CT_EFAIL, "%s: %s", what, x.what());
	} catch (...) {
		return ct_fail(e, CT_EFAIL, "%s: unknown exception", what);
	}
}

[[noreturn]] static void end(const char *name, const char *why)
{
	std::fprintf(stderr, "%s: not enough memory, or another resource: %s\n", name, why);
	_exit(CT_ENOMEM);
}

/* Libraries start threads while they are initialised, where no one can catch. */
[[noreturn]] static void give_up()
{
	ct_err e = {};

	if (std::current_exception())
		guard_failed(&e, "a library");
	end(program_invocation_short_name, e.msg);
}

/* Runs before the libraries are initialised, and so before a sanitizer is. Some of them do not look
 * whether there is memory: there has to be. */
__attribute__((no_sanitize("address", "undefined"))) static void before_all(
	int, char **argv, char **)
{
	const size_t need = (size_t)64 << 20;
	void *const p =
		mmap(nullptr, need, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);

	if (p == MAP_FAILED)
		end(argv[0], "the libraries need 64 MiB to begin with");
	munmap(p, need);
	std::set_terminate(give_up);
}

__attribute__((section(".preinit_array"), used)) static void (*const first)(
	int, char **, char **) = before_all;
