/* resume.h: the state of a long run in OUT.state, so that it can go on after an interruption.
 *
 * A state belongs to one run: the command and its version, the seed, the options that decide what
 * is computed (enum ct_counts of their rows, and what is added here), and what the inputs hold. It
 * is refused, by the name of what differs, if any of these is another; an input of another name
 * that holds the same is the same. So is a state that holds other than what was saved. The state is
 * for its owner alone, is never seen half-written, and a run without --resume does not write over
 * one unless it is forced. A file of that name that is no state, or that another run has put there
 * meanwhile, is neither written over nor removed. A run that keeps one is stopped where it has
 * saved it (stop.h).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_RESUME_H
#define CT_CLI_RESUME_H
#include "cli/cli.h"
#include "core/tensors.h"
#include "formats/temp.h"

struct ct_resume {
	char *path;           /* NULL: nothing is kept, as OUT is a stream or the run is dry */
	struct ct_temp claim; /* held while this run makes OUT */
	bool wanted;          /* go on from what is there */
	bool own;             /* what is there, if anything, is a state that this run may replace */
	struct ct_meta key;   /* what the run is, in the order in which it is compared */
	const struct ct_opt *opts;
	const void *params;
};

/* For the run that the options ask for; `wanted` is --resume. CT_EUSAGE if OUT is a stream and it
 * is wanted, or a report as JSON, CT_EOUTPUT if it is not and there is a state, if another run is
 * making OUT, or if OUT.state is another file of the run, CT_ENOMEM. */
int ct_resume_open(struct ct_resume *r, const char *out, bool wanted, const struct ct_opt *opts,
	const void *params, const struct ct_env *env, struct ct_err *e);
/* Also what the input `name` holds, "IN" or "--base": the hash of its content, and its metadata but
 * for history and foreign extensions. NULL: not given. Every CT_INPUT of the table has to be added.
 * CT_ENOMEM. */
int ct_resume_input(
	struct ct_resume *r, const char *name, const struct ct_meta *m, struct ct_err *e);
/* Also this value, printf-like. CT_ENOMEM. */
int ct_resume_value(struct ct_resume *r, struct ct_err *e, const char *name, const char *fmt, ...)
	__attribute__((format(printf, 4, 5)));
/* Takes what is done of the work from the tensors of a state. */
typedef int ct_resume_unpack(void *work, const struct ct_tensors *state, struct ct_err *e);
/* Go on from the state, when all is added: 0; 1 if none is wanted or there; -1 with the code of
 * `unpack`, or CT_EINPUT naming the file, and what is another. */
int ct_resume_load(struct ct_resume *r, ct_resume_unpack *unpack, void *work, struct ct_err *e);
/* Puts what is done of the work into tensors, zeroed. */
typedef int ct_resume_pack(struct ct_tensors *state, const void *work, struct ct_err *e);
/* Write the state, over the one before; nothing if none is kept. If it cannot be there, it is kept
 * in the folder for temporary files, and *e says where; -1. Codes of `pack` and the writer. */
int ct_resume_save(struct ct_resume *r, ct_resume_pack *pack, const void *work, struct ct_err *e);
/* The work is done, but *e says that its result could not be written: keep it, as the state, in
 * OUT.state or, where that cannot be, in the folder for temporary files; *e says where. -1. */
int ct_resume_rescue(struct ct_resume *r, ct_resume_pack *pack, const void *work, struct ct_err *e);
/* The run is done: no state is left. */
void ct_resume_done(const struct ct_resume *r);
/* Also legal on zeroes. */
void ct_resume_close(struct ct_resume *r);

#endif
