/* What the libraries in C++ cannot do without memory, or throw where no one catches, is a failure
 * with a message, not an abort. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bound.h"
#include "capture.h"
#include "core/err.h"

#include <sys/resource.h>
#include <sys/wait.h>

/* Of the C++ runtime. */
extern void terminate(void) __asm__("_ZSt9terminatev");
extern void throw_bad_alloc(void) __asm__("_ZSt17__throw_bad_allocv");
extern void *__cxa_allocate_exception(size_t size);
extern void __cxa_throw(void *thrown, void *type, void (*destroy)(void *));
extern char type_of_int __asm__("_ZTIi");

static struct capture shown;

static void throw_int(void)
{
	__cxa_throw(__cxa_allocate_exception(sizeof(int)), &type_of_int, NULL);
}

/* Room for so many MiB more than this program takes, then the program again. */
static void begin_again(long mib)
{
	char program[400], name[] = "again", *argv[] = {name, name, NULL};
	ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);

	if (n <= 0)
		_exit(1);
	program[n] = '\0';
	if (bound_memory(mib))
		execv(program, argv);
	_exit(1);
}

__attribute__((unused)) static void with_little(void)
{
	begin_again(40);
}

__attribute__((unused)) static void with_enough(void)
{
	begin_again(200);
}

/* Does it end so, with these words? */
static bool ends(void (*how)(void), int status, const char *words)
{
	const struct rlimit no_core = {0, 0};
	int got = 0;
	pid_t pid;

	capture_begin(&shown);
	pid = fork();
	if (pid == 0) {
		setrlimit(RLIMIT_CORE, &no_core);
		alarm(20);
		how();
		_exit(99);
	}
	waitpid(pid, &got, 0);
	capture_end(&shown);
	return WIFEXITED(got) && WEXITSTATUS(got) == status && is_text(shown.err, words);
}

#define SAYS ": not enough memory, or another resource: "
int main(int argc, char **argv)
{
	if (argc > 1 && strcmp(argv[1], "again") == 0)
		return 0;
	OK(ends(terminate, CT_ENOMEM, "t-libraries" SAYS "a library gave up\n"), "one gives up");
	OK(ends(throw_bad_alloc, CT_ENOMEM, "t-libraries" SAYS "std::bad_alloc\n"),
		"one has no memory");
	OK(ends(throw_int, CT_ENOMEM, "t-libraries" SAYS "a library threw something\n"),
		"one throws what is no exception");
#ifndef BOUND_NONE
	OK(ends(with_little, CT_ENOMEM, "again" SAYS "the libraries need 64 MiB to begin with\n"),
		"too little to begin with");
	OK(ends(with_enough, 0, ""), "and enough");
#endif
	return tap_done();
}
