/* cache.h: examples of volumes (restore/example.h) as files, so that the next training finds
 * them made. A file is named by all that makes it: what the volume holds, the rule, the index. */
#ifndef CT_TRAIN_CACHE_H
#define CT_TRAIN_CACHE_H
#include "core/vol.h"
#include "restore/example.h"

/* Make the folder if it is not there. CT_EOUTPUT. */
int train_cache_open(const char *folder, struct ct_err *e);
/* ct_example_alloc, and ct_example_after if the rule says so, through the folder, which then has
 * both; folder NULL: without one. v carries the hash of what it
 * holds (CT_META_INPUT); `bytes` are the HU of the bytes 0 and 255 of the file, NaN if it holds HU.
 * A file that is damaged or another is made anew. */
int train_cache_example(struct ct_example *p, const char *folder, const struct ct_vol *v,
	const double bytes[static 2], const struct ct_example_rule *rule, uint64_t index,
	const struct ct_env *env, struct ct_err *e);

#endif
