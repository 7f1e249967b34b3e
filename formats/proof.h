/* proof.h: what shows that a file or folder was made by formats/temp.h and by nobody else.
 *
 * A mark is a short text that names the inode that it belongs to, the file that is made, the host
 * and its boot. A copy, another name, another host or a stranger's file does not match. Nothing
 * here asks for memory: there may be none.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_PROOF_H
#define CT_FORMATS_PROOF_H
#include <stdbool.h>
#include <sys/types.h>

/* In a working folder: the mark, and the file or folder that is to get its final name. */
#define CT_TEMP_STEM ".ctsr-tmp-" /* and six letters or digits */
#define CT_TEMP_MARK "mark"
#define CT_TEMP_DATA "data"
#define CT_TEMP_OLD "olds" /* as long: the file that data took the place of, until all is done */
enum { CT_TEMP_RANDOM = 6 };

/* Is this the name of a working folder? */
bool ct_proof_named(const char *name);
/* Write the mark of an inode for a file called `base` to fd. errno. */
int ct_proof_write(int fd, ino_t inode, const char *base);
/* Is the content of fd, a file of our own, the mark of that inode and base (NULL: any)? `hosts`:
 * whatever the host, of a lock. */
bool ct_proof_is(int fd, ino_t inode, const char *base, bool hosts);
/* Remove the working folder `name` of the folder `at` if its mark is of `base`, nobody has its
 * lock, and it holds only what we make: a file, or a folder of files called as `own`. */
void ct_proof_drop_stale(int at, const char *name, const char *base, const char *own);
/* Remove a working folder that this process made, as far as it holds only what we make. False if
 * something is left. */
bool ct_proof_drop(int at, const char *name, const char *own);
/* Is `name` one of the patterns `own`, separated by '|'? NULL: none. */
bool ct_proof_listed(const char *own, const char *name);

#endif
