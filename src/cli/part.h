/* part.h: a part of a result that is made in parts, by other processes or on other machines: what
 * it says of itself in its metadata, so that ct-merge can tell what is missing, damaged or of
 * another run. */
#ifndef CT_CLI_PART_H
#define CT_CLI_PART_H
#include "cli/resume.h"
#include "formats/hash.h"

#include <stddef.h>

enum { CT_PART_VIEWS = 3 };

struct ct_part {
	int axis;            /* of a volume, from 0; or CT_PART_VIEWS */
	size_t from, to, of; /* voxels of the axis, or views: to not included */
};

/* "A:B", A < B <= of. CT_EUSAGE naming the option. */
int ct_part_range(
	struct ct_part *p, const char *option, const char *text, size_t of, struct ct_err *e);
/* Note in m which part the values x[n] are, of which run (the key of *run), and their hash. */
int ct_part_put(struct ct_meta *m, const struct ct_part *p, const struct ct_resume *run,
	const float *x, size_t n, struct ct_err *e);
/* What m says: 0; 1 if it says nothing; -1 with CT_EINPUT. */
int ct_part_get(struct ct_part *p, const struct ct_meta *m, struct ct_err *e);
/* CT_EINPUT unless this is the hash of what ct_part_put was given. */
int ct_part_check(const struct ct_meta *m, const struct ct_hash *values, struct ct_err *e);
/* Take what ct_part_put noted out of m. */
void ct_part_drop(struct ct_meta *m);

#endif
