/* complete.h: what a shell offers when a tab is pressed behind a command, from the option table. */
#ifndef CT_CLI_COMPLETE_H
#define CT_CLI_COMPLETE_H
#include "cli/cli.h"
#include "core/words.h"

#define CT_SHELLS(X) X(CT_BASH, "bash") X(CT_ZSH, "zsh") X(CT_FISH, "fish")
enum ct_shell { CT_SHELLS(CT_WORD_VALUE) };

/* To standard output: the file that the shell reads the first time that it completes the command.
 */
void ct_complete_print(const struct ct_tool *t, enum ct_shell shell);

#endif
