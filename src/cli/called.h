/* called.h: what a file between the steps of a chain is called in what a command says: the user's
 * own name of what it was made of. */
#ifndef CT_CLI_CALLED_H
#define CT_CLI_CALLED_H
#include <stddef.h>

/* Of the environment: the name of the file, and on the next line what it is called. */
#define CT_CALLED "CTSR_CALLED"

/* out (size n) <- text, cut off if it is too long, with that in the place of the file. */
void ct_called_put(char *out, size_t n, const char *text);

#endif
