/* stop.h: what SIGINT, SIGTERM, SIGUSR1 and SIGHUP do: end the program, soon and with status 75.
 * SIGHUP is what a terminal sends that is closed; under nohup it stays ignored. SIGPIPE, of a pipe
 * whose reader is gone, ends a program with that signal, when its temporary files are gone too, and
 * one that keeps a state as the others do.
 *
 * A program that has nothing to save ends at once, wherever it is; its temporary files are gone.
 * One that keeps a state holds: the signal raises a flag (env->stop), and the run ends by itself,
 * its state saved. It has one second of CPU time for what comes before the saving, and may not
 * wait for longer than a second (for a pipe that nobody writes into): else it is ended, with the
 * state that it saved last. To be asked again, by whatever signal, changes nothing: a terminal
 * and a batch system signal the whole group, and ct-sr passes on what it was told.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_STOP_H
#define CT_CLI_STOP_H
#include "core/err.h"

#include <signal.h>
#include <stdbool.h>

/* Catch the signals, for a program of this name, before it starts threads. CT_ENOMEM, CT_EFAIL. */
int ct_stop_catch(const char *tool, struct ct_err *e);
/* Their defaults, in a process that is to become another program. */
void ct_stop_uncatch(void);
/* The flag, for env->stop. */
const volatile sig_atomic_t *ct_stop_flag(void);
/* From here on the run ends by itself. */
void ct_stop_hold(void);
/* What is done between true and false takes as long as it takes; they may be nested. */
void ct_stop_defer(bool on);

/* For tests, so that no signal comes too early or too late: if the environment says
 * CTSR_TEST_SIGNAL="TOOL N SIGNAL", the N-th call in that tool sends the signal of that number to
 * the process group, and goes on when it was taken. */
#define CT_STOP_TEST "CTSR_TEST_SIGNAL"
void ct_stop_test(void);

#endif
