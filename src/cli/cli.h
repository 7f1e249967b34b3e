/* cli.h: one option table gives parsing, --help, the OPTIONS of the man page, and the checks.
 *
 * The type of an option is deduced from the field of the tool's params struct and its default
 * is read from the tool's defaults, so neither can drift. ct_cli_main owns the common options
 * (-h -q -v -t -f --version, and -s --json --dry-run where the tool declares them), the thread
 * pool, signals, progress, the error line and the exit status.
 */
#ifndef CT_CLI_CLI_H
#define CT_CLI_CLI_H
#include "core/env.h"
#include "core/err.h"
#include "core/words.h"

#include <stdbool.h>
#include <stddef.h>

enum ct_type { CT_T_END, CT_T_FLAG, CT_T_INT, CT_T_REAL, CT_T_STR, CT_T_LIST };

/* Operands that may repeat. */
struct ct_list {
	size_t n;
	const char *const *v; /* borrowed from argv */
};

/* What of an option decides what a run computes, so that its state is of no use to a run where it
 * differs (resume.h). */
enum ct_counts {
	CT_COUNTS_VALUE,   /* its value */
	CT_COUNTS_CONTENT, /* it names an input: what that holds, whatever its name */
	CT_COUNTS_NOT,     /* nothing: outputs, reports, when to save */
};

/* What a run does with the file that a row names: files.h. */
enum ct_role {
	CT_NO_FILE,
	CT_READS,
	CT_WRITES,
	CT_REWRITES,     /* its own when it goes on: with --resume it may be there */
	CT_READS_WRITES, /* of a list the last is written, unless another row names the output */
};

struct ct_opt {
	char c;           /* short letter, or 0 */
	const char *name; /* long name; NULL for an operand */
	enum ct_type type;
	size_t at;       /* offset in the params struct */
	const char *arg; /* name of the value; for a choice the words: "linear|cubic" */
	const char *help;
	double lo, hi; /* inclusive range of a number; lo == hi means any */
	bool choice;   /* int field: index of the word in arg */
	bool optional; /* operand that may be absent */
	enum ct_counts counts;
	enum ct_role role;
};

#define CT_TYPE_(S, f)                                                                             \
	_Generic(((S *)0)->f, bool: CT_T_FLAG, int: CT_T_INT, double: CT_T_REAL, \
		const char *: CT_T_STR, struct ct_list: CT_T_LIST)
#define CT_ROW_(S, f, ch, nm, what, text, ...)                                                     \
	{                                                                                          \
		.c = ch, .name = nm, .type = CT_TYPE_(S, f), .at = offsetof(S, f), .arg = what,    \
		.help = text, __VA_ARGS__                                                          \
	}
#define CT_OPT(S, f, c, name, arg, from, to, help)                                                 \
	CT_ROW_(S, f, c, name, arg, help, .lo = from, .hi = to)
/* One that decides nothing that is computed. */
#define CT_OPT_IDLE(S, f, c, name, arg, from, to, help)                                            \
	CT_ROW_(S, f, c, name, arg, help, .lo = from, .hi = to, .counts = CT_COUNTS_NOT)
/* The name of an input, of one that decides nothing that is computed, and of an output. */
#define CT_INPUT(S, f, c, name, arg, help)                                                         \
	CT_ROW_(S, f, c, name, arg, help, .counts = CT_COUNTS_CONTENT, .role = CT_READS)
#define CT_INPUT_IDLE(S, f, c, name, arg, help)                                                    \
	CT_ROW_(S, f, c, name, arg, help, .counts = CT_COUNTS_NOT, .role = CT_READS)
#define CT_OUTPUT(S, f, c, name, arg, help)                                                        \
	CT_ROW_(S, f, c, name, arg, help, .counts = CT_COUNTS_NOT, .role = CT_WRITES)
/* An int field that takes one of the words "a|b|c" (CT_WORDS of the list of an enum) and holds its
 * index. */
#define CT_CHOICE(S, f, c, name, words, help) CT_ROW_(S, f, c, name, words, help, .choice = true)
/* An operand; a struct ct_list takes all that are left. */
#define CT_ARG(S, f, what, arg, help)                                                              \
	CT_ROW_(S, f, 0, NULL, arg, help, .counts = CT_COUNTS_NOT, .role = what)
/* The last one, that may be missing. */
#define CT_ARG_MAYBE(S, f, what, arg, help)                                                        \
	CT_ROW_(S, f, 0, NULL, arg, help, .optional = true, .counts = CT_COUNTS_NOT, .role = what)
#define CT_OPT_END                                                                                 \
	{                                                                                          \
		.type = CT_T_END                                                                   \
	}

enum ct_tool_flags {
	CT_SEEDED = 1,  /* has -s/--seed */
	CT_REPORTS = 2, /* has --json */
	CT_LONG = 4,    /* has --dry-run */
};

struct ct_tool {
	const char *name, *brief;
	const struct ct_opt *opts;
	const void *defaults;
	size_t size;
	int (*run)(const void *params, const struct ct_env *env, struct ct_err *e);
	unsigned flags;
};

/* Parse, run, report; the value to return from main. */
int ct_cli_main(const struct ct_tool *t, int argc, char **argv);

/* Values of options that are more than one number. CT_EUSAGE naming the option. */
/* "a,b,c" (also "axbxc" with sep 'x'): exactly n numbers, or one that stands for all if spread. */
int ct_cli_numbers(const char *option, const char *s, char sep, size_t n, bool spread, double *v,
	struct ct_err *e);
/* "WxHxD": n positive integers. */
int ct_cli_dims(const char *option, const char *s, size_t n, size_t *v, struct ct_err *e);
/* "LO:HI", LO < HI. */
int ct_cli_range(const char *option, const char *s, double v[2], struct ct_err *e);

#endif
