/* moment.h: slices of one series at the same places: the times, phases of the heart or of a
 * contrast medium that tell them apart. */
#ifndef CT_SERIES_MOMENT_H
#define CT_SERIES_MOMENT_H
#include "series/slice.h"

/* How a stack is divided: by the value of a field, or by its rank among those at the same place. */
struct ct_moment {
	int field; /* index of the field */
	bool ranked;
	size_t count; /* stacks; 0 or 1: it is not divided */
};

/* Do the two lie at one place, within a thousandth of a millimetre? */
bool ct_moment_together(const struct ct_slice *a, const struct ct_slice *b);
/* Of slices in order of their place: if as many as `most` share one, the first field with that many
 * values, no two of them at one place; or the first that orders those at each place, if there are
 * as many everywhere. */
void ct_moment_find(struct ct_moment *m, const struct ct_slice *s, size_t n);
/* Order them by moment, and in it by place. */
void ct_moment_sort(const struct ct_moment *m, struct ct_slice *s, size_t n);
/* Slices of the moment that begins at k. */
size_t ct_moment_run(const struct ct_moment *m, const struct ct_slice *s, size_t n, size_t k);
/* "AcquisitionNumber 2" of a slice. */
void ct_moment_text(const struct ct_moment *m, const struct ct_slice *s, char *out, size_t room);

#endif
