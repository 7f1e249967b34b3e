/* inflate.h: how far compressed data may grow, so that a small file is not a large memory.
 *
 * Up to CT_INFLATE_FREE bytes come of any file (the pictures of a DICOM series are one); more only
 * if they are no more than so many times what they come from: CT_INFLATE_TIMES, or what the command
 * line allows. Scans are compressed 2 to 10 times, all zeros 1030 times.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_INFLATE_H
#define CT_CORE_INFLATE_H
#include "core/err.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CT_INFLATE_FREE (UINT64_C(1) << 30)
enum { CT_INFLATE_TIMES = 100 };

/* Before anything is read, for all of the process: 0 allows anything. */
void ct_inflate_allow(unsigned times);
unsigned ct_inflate_allowed(void);
/* May so many bytes become so many, by what their header says or so far? CT_EINPUT. */
int ct_inflate_check(uint64_t from, uint64_t to, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
