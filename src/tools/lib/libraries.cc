/* libraries.cc: too little memory for the libraries in C++ is a failure like others. Makes the
 * linker one of C++, too. In a module (CT_MODULE) who loads it has looked for memory. */
#include "config.h"
#include "core/err.h"
#include "formats/temp.h"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <execinfo.h>
#include <exception>
#include <malloc.h>
#include <new>
#include <sys/mman.h>
#include <unistd.h>

[[noreturn]] static void end(const char *name, const char *why)
{
	std::fprintf(stderr, "%s: not enough memory, or another resource: %s\n", name, why);
	ct_temp_remove_all();
	_exit(CT_ENOMEM);
}

/* Libraries start threads while they are initialised, where no one can catch. */
[[noreturn]] static void give_up()
{
	const char *why = "a library gave up";

	try {
		if (std::current_exception())
			throw;
	} catch (const std::exception &x) {
		end(program_invocation_short_name, x.what());
	} catch (...) {
		why = "a library threw something";
	}
	end(program_invocation_short_name, why);
}

/* An exception that passes a frame of the C library, as that of std::call_once, needs memory for
 * the library that unwinds, the first time. */
__attribute__((constructor)) static void link_unwinder()
{
	void *here[1];

	backtrace(here, 1);
}

/* Where even a little is not to be had nothing is thrown, for some catch it and go on with what
 * they have not got. A hostile file that asks for too much is the business of who reads it. */
static void no_memory()
{
	void *const little = std::malloc((size_t)1 << 20);

	if (!little)
		end(program_invocation_short_name, "std::bad_alloc");
	std::free(little);
	throw std::bad_alloc();
}

static void set_handlers()
{
	std::set_terminate(give_up);
	std::set_new_handler(no_memory);
}

#ifdef CT_MODULE
__attribute__((constructor)) static void first()
{
	set_handlers();
}
#else
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
	set_handlers();
}

#ifndef __SANITIZE_ADDRESS__
/* oneDNN makes its objects of it and does not look whether they are there: where not even a little
 * is to be had the program ends. It is the program's, and so comes before that of the C library. */
extern "C" __attribute__((visibility("default"))) int posix_memalign(
	void **out, size_t align, size_t n) noexcept
{
	void *const got = memalign(align, n);

	if (!got && n <= (size_t)1 << 20)
		end(program_invocation_short_name, "std::bad_alloc");
	if (!got)
		return ENOMEM;
	*out = got;
	return 0;
}
#endif

__attribute__((section(".preinit_array"), used)) static void (*const first)(
	int, char **, char **) = before_all;
#endif
