/* ctsr-impl.h: what the files of src/ctsr share. Nothing of it is exported.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CTSR_CTSR_IMPL_H
#define CT_CTSR_CTSR_IMPL_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/number.h"
#include "core/stack.h"
#include "core/vol.h"
#include "ctsr/ctsr.h"
#include "formats/io.h"
#include "operator/degrade.h"
#include "steps/window-rule.h"

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

/* One call of the library, CTSR_CALL(__func__): its environment, threads and error. While it lasts
 * the numbers of its threads have a point, whatever the locale of the program; its callbacks run in
 * that. */
struct ctsr_call {
	const char *name; /* of the function */
	locale_t theirs;  /* of the thread, until the call ends */
	ctsr_context c;
	struct ct_io_rule files;
	struct ct_env env;
	struct ct_err err;
	volatile sig_atomic_t stop;
	struct {
		void *at;                   /* where a pointer to it is */
		void (*drop)(void *object); /* frees it */
	} made[2];
	size_t makes;
};
#define CTSR_CALL(function)                                                                        \
	{                                                                                          \
		.name = (function), .theirs = ct_number_point()                                    \
	}

/* A zeroed object; a call that fails frees it and leaves NULL. First of all that a call does. */
int ctsr_make_volume(struct ctsr_call *k, ctsr_volume **v);
int ctsr_make_projections(struct ctsr_call *k, ctsr_projections **p);
int ctsr_call_makes(struct ctsr_call *k, void *at, size_t size, void (*drop)(void *object));
/* CTSR_USAGE unless all arguments are given that must not be NULL. */
int ctsr_call_given(struct ctsr_call *k, bool given);
/* The same, and then threads and what else the context says. */
int ctsr_call_begin(struct ctsr_call *k, bool given, const ctsr_context *c);
/* CTSR_USAGE for the name of a file to write that ends as that of another format. */
int ctsr_call_named(struct ctsr_call *k, const char *path, const char *ends);
/* Every call ends so: 0, or -1 and *e (NULL: nothing) if rc is not 0 or the caller has cancelled.
 */
int ctsr_call_end(struct ctsr_call *k, int rc, ctsr_error *e);
/* theirs, of so many bytes, or NULL <- as much as fits of the defaults. */
void ctsr_give_defaults(void *theirs, size_t size, const void *defaults, size_t known);
/* mine (initialised, of `size` bytes) <- the members that *theirs has; its first is its size.
 * NULL: all defaults. */
int ctsr_take_options(void *mine, size_t size, const void *theirs, struct ct_err *e);
/* A member of options, by its name; with these words of another alone it does something. A list
 * ends with one of no name. */
struct ctsr_member {
	const char *name;
	bool given; /* is it other than by default? */
	unsigned with;
};
/* CTSR_USAGE for a member that is given and does nothing with the word at this place of `words`, as
 * the commands refuse it. */
int ctsr_check_members(const struct ctsr_member *m, const char *what, const char *words, int place,
	struct ct_err *e);
/* Where a message names an option, "--slice-thickness", the member of that meaning,
 * slice_thickness; that of a command that is named with it stays. The text becomes no longer. */
void ctsr_name_members(char *text);
/* ct_words_take of an option, whose word may be NULL: as it is. CTSR_USAGE. */
int ctsr_take_word(
	int *place, const char *words, const char *what, const char *word, struct ct_err *e);
/* The window that is asked for; NaN: none. */
int ctsr_take_window(struct ct_window_rule *r, const double asked[2], struct ct_err *e);
/* As much of a report as fits into the caller's, whose first member is its size; or NULL. A call
 * that takes long looks at that size first. */
int ctsr_check_report(const void *theirs, struct ct_err *e);
int ctsr_give_report(void *theirs, void *mine, size_t size, struct ct_err *e);

/* The line of the context into the metadata, if there is one; "input" goes. */
int ctsr_note_history(
	struct ctsr_call *k, struct ct_meta *m, size_t n, const struct ct_meta *const *in);
/* v (zeroed struct) <- zeros on the grid of `like`. */
int ctsr_zeros_like(struct ct_vol *v, const ctsr_volume *like, struct ct_err *e);
/* The operator of the options and its noise, HU, their numbers checked; nothing of ctsr_degrade
 * alone. */
int ctsr_degrade_of(struct ct_degrade *d, double *noise, const ctsr_operator *o, struct ct_err *e);
/* Values that can be HU, or say what they are, all finite: the message begins with `name`. As
 * ct_vol_read_hu for the commands. */
int ctsr_check_hu(const ctsr_volume *v, const char *name, struct ct_err *e);
/* *to (zeroed struct) <- a copy, metadata too. */
int ctsr_copy_volume(struct ct_vol *to, const ctsr_volume *v, struct ct_err *e);
/* Finite, on a grid. */
int ctsr_check_volume(const ctsr_volume *v, struct ct_err *e);

#endif
