/* libraries.cc: too little memory for the libraries in C++ is refused before the work, and what
 * they throw where no one catches is a failure like others. Until this runs, and where they write
 * to memory that they did not get, they end the program by a signal. Makes the linker one of C++,
 * too. In a module (CT_MODULE) who loads it has looked for memory.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/err.h"
#include "core/mem.h"
#include "formats/temp.h"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <execinfo.h>
#include <exception>
#include <new>
#include <unistd.h>

[[noreturn]] static void end(const char *name, const char *why)
{
	std::fprintf(stderr, "%s: not enough memory, or another resource: %s\n", name, why);
	ct_temp_remove_all();
	_exit(CT_ENOMEM);
}

/* Libraries start threads, where no one can catch. */
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

__attribute__((constructor)) static void first()
{
#ifndef CT_MODULE
	struct ct_err e = {};

	/* some libraries do not look whether there is memory: there has to be, before the work */
	if (ct_mem_room((size_t)64 << 20, &e))
		end(program_invocation_short_name, "the libraries need 64 MiB to begin with");
#endif
	std::set_terminate(give_up);
	std::set_new_handler(no_memory);
}
