/* kept.h: a folder that keeps what the steps of a run make, so that the same run goes on, and a
 * person may put a file of their own in the place of one.
 *
 * FOLDER/run.state is text. Its first line has the command and its version. Each other is of one
 * output: its place, whether this version made it, a key, the hash of what it held when it was done
 * ("-": it was begun), and its name. A key is a hash of all that decides what the output is: words,
 * and what its inputs hold. The line of FOLDER/commands.sh is the last. FOLDER/lock is locked by
 * the run.
 *
 * A file in the folder that does not hold what was noted is a person's own: it is used as it is, or
 * refused if what it stands for is another by now. It is never written over. An output elsewhere
 * that does not is refused, too; with force it is made again.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_KEPT_H
#define CT_CLI_KEPT_H
#include "formats/hash.h"

#include <stdbool.h>

enum { CT_KEPT_SCRIPT = 15, CT_KEPT_PLACES };
enum ct_kept_is { CT_KEPT_MISSING, CT_KEPT_BEGUN, CT_KEPT_DONE, CT_KEPT_OWN };

/* As run.state has it; its name is NULL if nothing is noted. */
struct ct_kept_note {
	char key[CT_HASH_HEX], made[CT_HASH_HEX], *name;
	bool old; /* made by another version */
};

struct ct_kept {
	char *folder; /* owned */
	int lock;
	const char *tool; /* of the run; borrowed */
	bool noted;       /* a run has worked here */
	bool made;        /* this run made the folder */
	struct ct_kept_note note[CT_KEPT_PLACES];
};

/* Work in `folder`, made if missing. CT_EOUTPUT naming it, also if another run works in it, or if
 * no run has and one of these n outputs, run.state or commands.sh is there; with force that goes.
 */
int ct_kept_open(struct ct_kept *k, const char *folder, size_t n, const char *const *outputs,
	const struct ct_env *env, struct ct_err *e);
/* Has a run in this folder begun to make that output, under that name? */
bool ct_kept_owns(const struct ct_kept *k, size_t place, const char *output);
/* CT_EOUTPUT if an output that lies elsewhere was made by a run and does not hold that, unless
 * force is set. */
int ct_kept_unchanged(const struct ct_kept *k, size_t place, const char *output,
	const struct ct_env *env, struct ct_err *e);
/* *is <- what an output with this key is now; `of_own`: it is made of a person's own file, so that
 * it may be another one, too. `hex` <- what it holds. A file of a run that is out of date is
 * removed if it lies in the folder. CT_EOUTPUT for a person's own that is, and as
 * ct_kept_unchanged. */
int ct_kept_look(enum ct_kept_is *is, char hex[static CT_HASH_HEX], struct ct_kept *k, size_t place,
	const char *output, const char *key, bool of_own, const struct ct_env *env,
	struct ct_err *e);
/* It is being made ("-"), or it is done and holds `made`. CT_EOUTPUT. */
int ct_kept_note(struct ct_kept *k, size_t place, const char *output, const char *key,
	const char *made, struct ct_err *e);
/* Write FOLDER/commands.sh, a text of n bytes. One that a person has edited stays, forced or not,
 * with a warning. CT_EOUTPUT. */
int ct_kept_script(
	struct ct_kept *k, const char *text, size_t n, const struct ct_env *env, struct ct_err *e);
/* A folder that this run made, and made nothing in, goes. Also legal on a struct that is zero but
 * for a lock of -1. */
void ct_kept_close(struct ct_kept *k);

#endif
