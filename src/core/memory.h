/* memory.h: how much memory there is. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_MEMORY_H
#define CT_CORE_MEMORY_H

/* Bytes of the program and its libraries: 8 to 16 MiB are held (tests/t-cost.sh). */
#define CT_MEMORY_BASE 25165824.0
/* What is expected may be so much more in the end, of itself. */
#define CT_MEMORY_SPARE 0.1

/* Bytes of memory that are free to take: of the machine, and of the control groups (v1, v2) that
 * the process is in. `root` is "" but for tests. 0 if nothing tells. */
double ct_memory_free(const char *root);
/* The most bytes of memory that this program has held so far; 0 if nothing tells. (That of
 * getrusage counts what started it.) */
double ct_memory_held(void);
/* Those that it holds now; what malloc keeps of what was freed is given back first (glibc). */
double ct_memory_now(void);
/* What a run may take of so many free bytes; infinite if that is 0. */
double ct_memory_most(double free);

#endif
