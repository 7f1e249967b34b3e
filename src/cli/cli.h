/* cli.h: one option table gives parsing, --help, the OPTIONS of the man page, and the checks.
 *
 * The type of an option is deduced from the field of the tool's params struct and its default
 * is read from the tool's defaults, so neither can drift. ct_cli_main owns the common options
 * (-h -q -v -t -f --version, and -s --json --dry-run --units where the tool declares them), the
 * thread pool, signals, progress, the error line and the exit status.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_CLI_H
#define CT_CLI_CLI_H
#include "cli/command.h"
#include "core/env.h"
#include "core/err.h"
#include "core/words.h"
#include "formats/ends.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

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

/* A condition of the modes that an option belongs to: on another field of the params struct. */
enum ct_when_kind {
	CT_WHEN_ALWAYS, /* none */
	CT_WHEN_SET,    /* the field is not at its default */
	CT_WHEN_WORD,   /* it is a choice, and one of these words */
	CT_WHEN_FILE,   /* it is an operand, and not a stream */
	CT_WHEN_UNSET,  /* it is at its default: the two options exclude each other */
	CT_WHEN_OTHER,  /* it is a choice, and none of these words */
};
struct ct_when {
	enum ct_when_kind kind;
	size_t at;      /* offset of the field */
	unsigned words; /* bit i: the word of index i */
};
#define CT_CONDITION_(...)                                                                         \
	{                                                                                          \
		__VA_ARGS__                                                                        \
	}
#define CT_ALWAYS CT_CONDITION_(CT_WHEN_ALWAYS, 0, 0)
#define CT_IF(f) CT_CONDITION_(CT_WHEN_SET, offsetof(CT_PARAMS, f), 0)
#define CT_IF_WORD(f, bits) CT_CONDITION_(CT_WHEN_WORD, offsetof(CT_PARAMS, f), bits)
#define CT_IF_FILE(f) CT_CONDITION_(CT_WHEN_FILE, offsetof(CT_PARAMS, f), 0)
#define CT_UNLESS(f) CT_CONDITION_(CT_WHEN_UNSET, offsetof(CT_PARAMS, f), 0)
#define CT_UNLESS_WORD(f, bits) CT_CONDITION_(CT_WHEN_OTHER, offsetof(CT_PARAMS, f), bits)
enum { CT_WHENS = 4 };
/* What a run does with the file that a row names: files.h. */
enum ct_role {
	CT_NO_FILE,
	CT_READS,
	CT_WRITES,
	CT_REWRITES,      /* its own when it goes on: with --resume or --keep it may be there */
	CT_READS_WRITES,  /* of a list the last is written, unless another row names the output */
	CT_WRITES_BESIDE, /* one more output, that does not take the place of that last one */
};

/* How the names of what a row writes end (formats/ends.h): as the first of whose condition holds.
 * Another end that is known is refused. */
struct ct_ends {
	const char *ends;
	struct ct_when when;
};
enum { CT_ENDINGS = 4 };

struct ct_opt {
	char c;           /* short letter, or 0 */
	const char *name; /* long name; NULL for an operand */
	enum ct_type type;
	size_t at;         /* offset in the params struct */
	const char *arg;   /* name of the value; for a choice the words: "linear|cubic" */
	const char *label; /* name of an operand that is a choice */
	const char *help;
	double lo, hi;     /* inclusive range of a number; lo == hi means any */
	bool choice;       /* int field: index of the word in arg */
	bool optional;     /* operand that may be absent */
	const char *alone; /* what an option means without a value, which then follows "=" alone */
	bool expert;       /* a key of --expert, not an option */
	bool common;       /* of those that ct_cli_main owns */
	enum ct_counts counts;
	/* Modes that take it (modes.h): any of the positive conditions if there are any, and all of
	 * UNSET and OTHER. Where it would do nothing it is an error, and help and man page say so.
	 */
	struct ct_when when[CT_WHENS];
	enum ct_role role;
	struct ct_ends ends[CT_ENDINGS]; /* of every row that writes */
	/* An output that may also be DICOM: a file that ends in .dcm, or a folder, whose files
	 * match this. */
	const char *dicom;
};

/* The rows of a table. f is a field of CT_PARAMS, the struct that the file defines it as. */
#define CT_TYPE_(f)                                                                                \
	_Generic(((CT_PARAMS *)0)->f, bool: CT_T_FLAG, int: CT_T_INT, double: CT_T_REAL, \
		const char *: CT_T_STR, struct ct_list: CT_T_LIST)
#define CT_ROW_(f, ch, nm, what, ...)                                                              \
	{                                                                                          \
		.c = ch, .name = nm, .type = CT_TYPE_(f), .at = offsetof(CT_PARAMS, f),            \
		.arg = what, __VA_ARGS__                                                           \
	}
/* Behind its help a row may say what modes take it, CT_WHEN(CT_IF(...), ...), and that it decides
 * nothing that is computed, CT_IDLE. */
#define CT_WHEN(...) .when = {__VA_ARGS__}
#define CT_IDLE .counts = CT_COUNTS_NOT
/* A number, a text, a flag. */
#define CT_OPT(f, c, name, arg, from, to, ...)                                                     \
	CT_ROW_(f, c, name, arg, .lo = from, .hi = to, .help = __VA_ARGS__)
#define CT_TEXT(f, c, name, arg, ...) CT_ROW_(f, c, name, arg, .help = __VA_ARGS__)
#define CT_FLAG(f, c, name, ...) CT_ROW_(f, c, name, NULL, .help = __VA_ARGS__)
/* A number that need not be given: --name, or --name=VALUE. */
#define CT_OPT_ALONE(f, name, arg, from, to, value, ...)                                           \
	CT_ROW_(f, 0, name, arg, .lo = from, .hi = to, .alone = value, .help = __VA_ARGS__)
/* An int field that takes one of the words "a|b|c" (CT_WORDS of the list of an enum) and holds its
 * index. */
#define CT_CHOICE(f, c, name, words, ...)                                                          \
	CT_ROW_(f, c, name, words, .choice = true, .help = __VA_ARGS__)
/* A constant of the method that only its developers change: a key of --expert KEY=VALUE, whose
 * value is text, a number, or for a bool yes or no. */
#define CT_EXPERT(f, name, arg, from, to, ...)                                                     \
	CT_ROW_(f, 0, name, arg, .expert = true, .lo = from, .hi = to, .help = __VA_ARGS__)
#define CT_EXPERT_CHOICE(f, name, words, ...)                                                      \
	CT_ROW_(f, 0, name, words, .choice = true, .expert = true, .help = __VA_ARGS__)
/* The name of an input, of one that decides nothing that is computed, and of an output, with how
 * it ends: a list of ends, or CT_ENDS_IF. */
#define CT_INPUT(f, c, name, arg, ...)                                                             \
	CT_ROW_(f, c, name, arg, .counts = CT_COUNTS_CONTENT, .role = CT_READS, .help = __VA_ARGS__)
#define CT_INPUT_IDLE(f, c, name, arg, ...)                                                        \
	CT_ROW_(f, c, name, arg, CT_IDLE, .role = CT_READS, .help = __VA_ARGS__)
#define CT_OUTPUT(f, c, name, arg, end, ...)                                                       \
	CT_ROW_(f, c, name, arg, CT_IDLE, .role = CT_WRITES, .ends = {{.ends = end}},              \
		.help = __VA_ARGS__)
#define CT_OUTPUT_BESIDE(f, c, name, arg, end, ...)                                                \
	CT_ROW_(f, c, name, arg, CT_IDLE, .role = CT_WRITES_BESIDE, .ends = {{.ends = end}},       \
		.help = __VA_ARGS__)
/* One that may be there when a run goes on: its own. */
#define CT_OUTPUT_OWN(f, c, name, arg, end, ...)                                                   \
	CT_ROW_(f, c, name, arg, CT_IDLE, .role = CT_REWRITES, .ends = {{.ends = end}},            \
		.help = __VA_ARGS__)
/* An operand; a struct ct_list takes all that are left. */
#define CT_ARG(f, what, arg, ...)                                                                  \
	CT_ROW_(f, 0, NULL, arg, CT_IDLE, .role = what, .help = __VA_ARGS__)
/* One that is written, the last of a list if that is CT_READS_WRITES. */
#define CT_ARG_OUT(f, what, arg, end, ...)                                                         \
	CT_ROW_(f, 0, NULL, arg, CT_IDLE, .role = what, .ends = {{.ends = end}},                   \
		.help = __VA_ARGS__)
/* For `end`: one list under a condition, else another. */
#define CT_ENDS_IF(condition, then, other)                                                         \
	then, condition                                                                            \
	}                                                                                          \
	,                                                                                          \
	{                                                                                          \
		.ends = other
/* One that is a choice. */
#define CT_ARG_CHOICE(f, lab, words, ...)                                                          \
	CT_ROW_(f, 0, NULL, words, .label = lab, .choice = true, CT_IDLE, .help = __VA_ARGS__)
/* The last one, that may be missing. */
#define CT_ARG_MAYBE(f, what, arg, ...)                                                            \
	CT_ROW_(f, 0, NULL, arg, .optional = true, CT_IDLE, .role = what, .help = __VA_ARGS__)
#define CT_OPT_END                                                                                 \
	{                                                                                          \
		.type = CT_T_END                                                                   \
	}

enum ct_tool_flags {
	CT_SEEDED = 1,  /* has -s/--seed */
	CT_REPORTS = 2, /* has --json of what it finds */
	CT_LONG = 4,    /* has --dry-run, and --json of that */
	CT_IN_HU = 8,   /* has --units */
	CT_TELLS = 16,  /* has --json of its result, and prints none without */
};

struct ct_tool {
	const char *name, *brief;
	const struct ct_opt *opts;
	const void *defaults;
	size_t size;
	int (*run)(const void *params, const struct ct_env *env, struct ct_err *e);
	unsigned flags;
};

/* Of the environment: a file that is there, to which every command appends its warnings, --quiet or
 * not, as standard error shows them, and a line when it ends: "ct-upsample: took 12.3 s, 20.1 s of
 * CPU time, 345 MiB". A dry run appends nothing. What cannot be written is not said. */
#define CT_LOG_NAME "CTSR_LOG"

/* Parse, run, report; the value to return from main. */
int ct_cli_main(const struct ct_tool *t, int argc, char **argv);
/* The main of a command, whose file has its `opts`, `defaults` and `run`. */
#define CT_CLI_MAIN(tool_name, tool_brief, tool_flags)                                             \
	int main(int argc, char **argv)                                                            \
	{                                                                                          \
		static const struct ct_tool tool = {                                               \
			tool_name, tool_brief, opts, &defaults, sizeof defaults, run, tool_flags}; \
		return ct_cli_main(&tool, argc, argv);                                             \
	}

/* A word of a command as its history tells it; `hidden`, or NULL, says what stands for the name of
 * a file that is not to be told, and NULL for others. And is an option of this name not told, as it
 * says how to work and not what to make? */
typedef const char *ct_cli_hidden(const void *ctx, const char *name);
void ct_cli_put_history(FILE *f, const char *word, ct_cli_hidden *hidden, const void *ctx);
bool ct_cli_is_idle(const char *name);

/* Values of options that are more than one number. CT_EUSAGE naming the option. */
/* "a,b,c" (also "axbxc" with sep 'x'): exactly n numbers, or one that stands for all if spread. */
int ct_cli_numbers(const char *option, const char *s, char sep, size_t n, bool spread, double *v,
	struct ct_err *e);
/* The same by commas, each in [lo, hi]. */
int ct_cli_within(const char *option, const char *s, size_t n, bool spread, double lo, double hi,
	double *v, struct ct_err *e);
/* One to `most` of them, counted in *n. */
int ct_cli_list(const char *option, const char *s, size_t most, double lo, double hi, double *v,
	size_t *n, struct ct_err *e);
/* "WxHxD": n positive integers. */
int ct_cli_dims(const char *option, const char *s, size_t n, size_t *v, struct ct_err *e);
/* "LO:HI", LO < HI. */
int ct_cli_range(const char *option, const char *s, double v[2], struct ct_err *e);
/* The option --memory. */
#define CT_MEMORY(f, ...)                                                                           \
	CT_TEXT(f, 0, "memory", "SIZE",                                                             \
		"use at most this much memory, such as 600M or 2G; default: the free memory. A CT " \
		"that does not fit is refined in slabs",                                            \
		CT_IDLE __VA_OPT__(, ) __VA_ARGS__)
/* Bytes of its value, "600M", "1.5G": a number and K, M, G or T, powers of 1024; 0 for NULL. */
int ct_cli_memory(double *bytes, const char *text, struct ct_err *e);

#endif
