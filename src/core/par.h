/* par.h: the only threads of the project.
 *
 * Work is cut by data, never by the number of threads, and partial results are added in
 * index order by the caller: so any number of threads gives the same bytes.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_PAR_H
#define CT_CORE_PAR_H
#include "core/err.h"

#include <signal.h>
#include <stddef.h>

struct ct_par;

/* One task: index i of [0, n), run by `worker` of [0, ct_par_threads), which picks scratch. */
typedef void ct_par_fn(void *arg, size_t i, size_t worker);

/* A pool of `threads` >= 1, the caller included. */
int ct_par_alloc(struct ct_par **p, size_t threads, struct ct_err *e);
void ct_par_free(struct ct_par *p);
/* NULL counts as one. */
size_t ct_par_threads(const struct ct_par *p);
/* Run fn(arg, i, worker) for all i < n, in any order; returns when all are done. A call from
 * inside a task, or while the pool is busy, runs on the calling thread as worker 0: give a
 * nested loop scratch of its own. */
void ct_par_for(struct ct_par *p, size_t n, ct_par_fn *fn, void *arg);
/* From now on loops end early when *stop is not 0: tasks that have not begun are left out. For a
 * caller that then throws away all that they made. NULL: every loop is whole, as at first. */
void ct_par_heed(struct ct_par *p, const volatile sig_atomic_t *stop);

#endif
