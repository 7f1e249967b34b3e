/* cost.h: what a run is expected to take. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_COST_H
#define CT_CORE_COST_H

struct ct_cost {
	char work[200]; /* what takes the time, in words; empty: nothing to say */
	double seconds; /* on the threads of the run */
	double memory;  /* bytes, at the most */
	double disk;    /* bytes of the outputs, at the most */
	double state;   /* bytes beside them until the run is done; 0 if it keeps none */
};

#endif
