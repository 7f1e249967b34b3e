/* kept.h: a folder that keeps what the steps of a run make, so that the same run goes on, by
 * content.
 *
 * FOLDER/run.state is text. Its first line has the command and its version. Each other is of a
 * step: its number, its key, what its output held when it was done ("-" while it is made), and a
 * hash of the output's name. A key stands for all that decides what a step makes: words, and what
 * its inputs hold. The last line is of FOLDER/commands.sh. FOLDER/lock is locked by the run.
 */
#ifndef CT_CLI_KEPT_H
#define CT_CLI_KEPT_H
#include "cli/content.h"

#include <stddef.h>

enum { CT_KEPT_STEPS = 12 };

/* As run.state tells of it; "" where nothing is told. */
struct ct_kept_step {
	char key[CT_CONTENT_HEX], made[CT_CONTENT_HEX], name[CT_CONTENT_HEX];
};
enum ct_kept_done { CT_KEPT_NOTHING, CT_KEPT_BEGUN, CT_KEPT_DONE };

struct ct_kept {
	char *folder; /* owned */
	int lock;
	bool fresh, refused; /* this run made the lock; what is there is of no run */
	const char *tool;    /* of the run; borrowed */
	bool other, foreign; /* run.state is of another version; it is no such file */
	struct ct_kept_step step[CT_KEPT_STEPS], script;
};

/* Work in `folder`, made if missing. CT_EOUTPUT, also if another run works in it. */
int ct_kept_open(struct ct_kept *k, const char *folder, const struct ct_env *env, struct ct_err *e);
/* FOLDER/NAME, to be freed; NULL if no memory. */
char *ct_kept_path(const struct ct_kept *k, const char *name);
/* CT_EOUTPUT naming it, unless it is forced, if one of these outputs, or run.state, is a file in
 * the folder that no run in it made. */
int ct_kept_check(struct ct_kept *k, size_t n, const char *const *outputs, const struct ct_env *env,
	struct ct_err *e);
/* Has a run in this folder begun to make `output`, under that name? */
bool ct_kept_owns(const struct ct_kept *k, const char *output);
/* What of step i, which makes `output`, was done, with this key; that output holds `content` now.
 */
enum ct_kept_done ct_kept_look(
	const struct ct_kept *k, size_t i, const char *key, const char *content);
/* Step i makes `output`, or has made it, and that holds `made`; "": it is being made. The key may
 * be
 * "": not known. */
int ct_kept_note(struct ct_kept *k, size_t i, const char *output, const char *key, const char *made,
	struct ct_err *e);
/* Write FOLDER/commands.sh, a text of n bytes. One that somebody has edited stays, forced or not,
 * and that is said; one that no run made is refused as above. CT_EOUTPUT. */
int ct_kept_script(
	struct ct_kept *k, const char *text, size_t n, const struct ct_env *env, struct ct_err *e);
/* The hash of a text: of a key. */
void ct_kept_hash(char hex[static CT_CONTENT_HEX], const char *text, size_t n);
/* Also legal on a struct that is zero but for a lock of -1. */
void ct_kept_close(struct ct_kept *k);

#endif
