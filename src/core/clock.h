/* clock.h: the only clock of the project. Thread-safe. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_CLOCK_H
#define CT_CORE_CLOCK_H

/* Seconds since a moment in the past that stays the same while the machine runs; never goes
 * backwards. */
double ct_clock_wall(void);
/* Seconds of CPU time of all threads of this process. */
double ct_clock_cpu(void);
/* Wait that long; a signal ends it early. */
void ct_clock_sleep(double seconds);

#endif
