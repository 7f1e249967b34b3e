/* random-stream.h: which stream of random numbers (core/rng.h) belongs to which draw of a fit. */
#ifndef CT_GS_RANDOM_STREAM_H
#define CT_GS_RANDOM_STREAM_H
#include <stdint.h>

/* Iterations and epochs are added where there are such. */
#define CT_STREAM_PLACE ((uint64_t)0x67730000 << 32)
#define CT_STREAM_TV ((uint64_t)0x67730001 << 32)
#define CT_STREAM_VIEW ((uint64_t)0x67730002 << 32)
#define CT_STREAM_SPLIT ((uint64_t)0x67730003 << 32)
#define CT_STREAM_LOWRES ((uint64_t)0x67730004 << 32)
#define CT_STREAM_JITTER ((uint64_t)0x67730005 << 32)

#endif
