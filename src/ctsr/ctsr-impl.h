/* ctsr-impl.h: what the files of src/ctsr share. Nothing of it is exported. */
#ifndef CT_CTSR_CTSR_IMPL_H
#define CT_CTSR_CTSR_IMPL_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/vol.h"
#include "ctsr/ctsr.h"
#include "resolution/degrade.h"

#include <stdbool.h>

struct ctsr_volume {
	struct ct_vol v;
	bool borrowed; /* the data are the caller's */
};
struct ctsr_projections {
	struct ct_stack s;
};
struct ctsr_gaussians {
	struct ct_gauss g;
};

/* One call of the library: its environment, threads and error. */
struct ctsr_call {
	ctsr_context c;
	struct ct_env env;
	struct ct_err err;
	volatile sig_atomic_t stop;
};

/* Every call begins and ends so. begin: 0, or -1 and k->err. end: rc, or -1 if the caller has
 * cancelled; *e (NULL: nothing) <- k->err. */
int ctsr_call_begin(struct ctsr_call *k, const ctsr_context *c);
int ctsr_call_end(struct ctsr_call *k, int rc, ctsr_error *e);
/* The error of a call that needs no threads: rc. */
int ctsr_give_error(int rc, const struct ct_err *err, ctsr_error *e);
/* -1 with CTSR_USAGE: an argument that must not be NULL is. */
int ctsr_no_null(const char *function, ctsr_error *e);
/* mine (initialised, of `size` bytes) <- the members that *theirs has; its first is its size.
 * NULL: all defaults. */
int ctsr_take_options(void *mine, size_t size, const void *theirs, struct ct_err *e);
/* As much of a report as fits into the caller's, whose first member is its size; or NULL. */
int ctsr_give_report(void *theirs, void *mine, size_t size, struct ct_err *e);

/* A zeroed object. */
int ctsr_make_volume(ctsr_volume **v, struct ct_err *e);
int ctsr_make_projections(ctsr_projections **p, struct ct_err *e);
/* The line of the context into the metadata, if there is one; "input" goes. */
int ctsr_note_history(
	struct ctsr_call *k, struct ct_meta *m, size_t n, const struct ct_meta *const *in);
/* d (zeroed struct) <- a copy of v as density in the window, with its grid and no metadata. */
int ctsr_density_of(
	struct ct_vol *d, const struct ct_vol *v, const double window[2], struct ct_err *e);
/* Line integrals of a density into the pixels of s. */
int ctsr_project_into(struct ct_stack *s, const struct ct_vol *density, struct ctsr_call *k);
/* The operator of the options, its numbers checked. */
int ctsr_degrade_of(struct ct_degrade *d, const ctsr_operator *o, struct ct_err *e);
/* Finite, on a grid. */
int ctsr_check_volume(const ctsr_volume *v, struct ct_err *e);

#endif
