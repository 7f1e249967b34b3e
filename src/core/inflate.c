/* inflate.c: see inflate.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"

static unsigned allowed = CT_INFLATE_TIMES; /* written once, before threads and readers */

void ct_inflate_allow(unsigned times)
{
	allowed = times;
}

unsigned ct_inflate_allowed(void)
{
	return allowed;
}

int ct_inflate_check(uint64_t from, uint64_t to, struct ct_err *e)
{
	if (to <= CT_INFLATE_FREE || allowed == 0 || to / allowed <= from)
		return 0;
	return ct_fail(e, CT_EINPUT,
		"%llu compressed bytes become %llu or more, over %u times as many (--expand)",
		(unsigned long long)from, (unsigned long long)to, allowed);
}
