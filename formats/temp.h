/* temp.h: the files, and folders of files, that are not yet what they are to become.
 *
 * PATH.ct-XXXXXX beside PATH, locked by the process that writes it. One whose process was killed
 * has no lock: the next that is made of the same PATH removes it, and those of files whose names
 * begin like it, such as its state.
 */
#ifndef CT_FORMATS_TEMP_H
#define CT_FORMATS_TEMP_H
#include "core/err.h"

#include <stdbool.h>
#include <sys/types.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A file for PATH, empty, open for writing, for its owner alone: its descriptor and name, to be
 * freed after ct_temp_remove or, when it is renamed, ct_temp_forget. CT_EOUTPUT naming PATH,
 * CT_ENOMEM. */
int ct_temp_open(const char *path, char **tmp, struct ct_err *e);
void ct_temp_remove(const char *tmp);
void ct_temp_forget(const char *tmp);
/* The same as a folder; its descriptor holds the lock. */
int ct_temp_folder(const char *path, char **tmp, struct ct_err *e);
/* A folder and the files in it, of the folder `at`: also those that come while it goes. */
void ct_temp_clear(int at, const char *folder);
/* All of this process, from any thread, when it ends. */
void ct_temp_remove_all(void);

/* For the one run that makes PATH: PATH.ct-locked, locked; as above. CT_EOUTPUT naming PATH, also
 * if another run has it (and does not end within two seconds), CT_ENOMEM. */
int ct_temp_claim(const char *path, char **tmp, struct ct_err *e);

/* The process's umask, read and not set, since other threads may make files; 077 if the system does
 * not report it. */
mode_t ct_temp_umask(void);
/* Take the lock of an open file for this process and those it forks: it goes when they are gone.
 * False if another has it, or there is none on such a file system. */
bool ct_temp_lock(int fd);
/* The same, but waits for who has it, two seconds at most: errno is EWOULDBLOCK if that goes on. */
bool ct_temp_wait(int fd);
/* Where those are noted, and use the table of another copy of this file, in a program that loads a
 * module: it ends them all. */
struct ct_temp_kept;
struct ct_temp_kept *ct_temp_table(void);
void ct_temp_share(struct ct_temp_kept *table);

#ifdef __cplusplus
}
#endif
#endif
