/* memory.h: the option --memory. */
#ifndef CT_CLI_MEMORY_H
#define CT_CLI_MEMORY_H
#include "cli/cli.h"

#define CT_MEMORY(S, f, ...)                                                                       \
	CT_OPT_IDLE(S, f, 0, "memory", "SIZE", 0, 0,                                               \
		"use at most this much memory, such as 600M or 2G; default: what is free. A CT "   \
		"that does not fit is refined in slabs" __VA_OPT__(, ) __VA_ARGS__)

/* Bytes of "600M", "1.5G": a number and K, M, G or T, powers of 1024; 0 for NULL. CT_EUSAGE. */
int ct_memory_bytes(double *bytes, const char *text, struct ct_err *e);
/* The most bytes of memory that this program has held so far; 0 if nothing tells. (That of
 * getrusage counts what started it.) */
double ct_memory_held(void);

#endif
