/* memory.h: the option --memory: how much of it a command takes, the rest in files (core/room.h).
 */
#ifndef CT_CLI_MEMORY_H
#define CT_CLI_MEMORY_H
#include "cli/cli.h"

#define CT_MEMORY(S, f) CT_MEMORY_AT(S, f, "beside OUT, or in TMPDIR if OUT is a stream")
#define CT_MEMORY_AT(S, f, where, ...)                                                             \
	CT_OPT_IDLE(S, f, 0, "memory", "SIZE", 0, 0,                                               \
		"take no more memory than this, 600M or 2G, and for what does not fit disk " where \
		"; the result is the same, later; what is free if not given" __VA_OPT__(, )        \
			__VA_ARGS__)

/* Bytes of the program, libraries, what is read ahead. */
#define CT_MEMORY_BASE 67108864.0

/* What is expected may be so much more in the end. */
#define CT_MEMORY_SPARE 1.1

/* Bytes of "600M", "1.5G": a number and K, M, G or T, powers of 1024. CT_EUSAGE. */
int ct_memory_bytes(size_t *bytes, const char *text, struct ct_err *e);
/* Bytes of memory that are free to take: of the machine, and of the control groups (v1, v2) that
 * the process is in. `root` is "" but for tests. 0 if nothing tells. */
double ct_memory_free(const char *root);
/* The most bytes of memory that this program has held so far; 0 if nothing tells. (That of
 * getrusage counts what started it.) */
double ct_memory_held(void);
/* Bytes that a run may take, all of its parts together: what is given, or if nothing is most of
 * `free`; infinite if that is 0. */
double ct_memory_most(const char *given, double free);
/* Does a run of `need` bytes fit into what is given, or if nothing is into `free`? */
bool ct_memory_fits(double need, const char *given, double free);
/* The bound of a run that takes `need` bytes: NULL if it needs none, as they are free and within
 * what is given; what is given; or, if nothing is, most of what is free, with a warning that says
 * so. `own` holds the text. */
const char *ct_memory_choose(
	char own[static 32], const char *given, double need, const struct ct_env *env);
/* The memory of a command whose input is large, begun before that is read. */
struct ct_memory {
	const char *given, *text, *out;
	char own[32];
	double enough; /* bytes that need no room */
	bool told;     /* that there is one which nobody asked for */
};

/* A room, from the first volume on if `times` as much as that does not fit: what is `given`, or
 * what is free. CT_EUSAGE. */
int ct_memory_begin(
	struct ct_memory *m, const char *given, const char *out, double times, struct ct_err *e);
/* When it is known what all volumes take: a room, if that does not fit, with a warning if none was
 * asked for. CT_ENOMEM as ct_memory_check. */
int ct_memory_settle(struct ct_memory *m, double need, const size_t n[static 3], double fixed,
	const struct ct_env *env, struct ct_err *e);
/* Open a room of `text`, if it is not open; nothing if it is NULL. CT_EUSAGE for another word. */
int ct_memory_open(const char *text, const char *out, struct ct_err *e);
/* CT_ENOMEM if that is too little for volumes of n voxels, of which a thread has some planes in
 * hand, and for `fixed` bytes that are no volumes. */
int ct_memory_check(const char *text, const size_t n[static 3], double fixed,
	const struct ct_env *env, struct ct_err *e);
/* What a run of so many bytes in volumes takes of memory, and of disk until it is done. */
void ct_memory_cost(double *memory, double *disk, double bytes, const char *text);

#endif
