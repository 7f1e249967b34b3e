/* scan-source.h: the projections of a file, of any kind that ct-convert makes a stack of, and what
 * it says of its scanner. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_SCAN_SOURCE_H
#define CT_TOOLS_SCAN_SOURCE_H
#include "tools/convert.h"
#include "xray/geometry.h"

struct scan_source {
	size_t n[3];        /* views, rows, columns */
	double most;        /* of the file's numbers the one that is 1 here; 0: not known */
	float *data;        /* owned */
	float *flat, *dark; /* owned, means, [rows][columns]; or NULL */
	bool counts;        /* no line integrals yet, as the file says */
	bool placed;        /* it has a geometry: `scan`, or of our own stacks `stack` */
	struct ct_geometry scan;
	struct ct_stack stack; /* without data */
};
void scan_source_free(struct scan_source *s);
/* What the inputs of p hold; *s must be zero. CT_EINPUT, CT_EGEOM, CT_EUSAGE, CT_ENOMEM. */
int scan_source_read(
	struct scan_source *s, const struct convert *p, const struct ct_env *env, struct ct_err *e);
/* The mean picture, of h by w pixels, of a field: a picture, or views of numpy, whose type is that
 * of the views where `most` of them is known. free() it. */
int scan_source_field(float **mean, const char *path, size_t h, size_t w, double most,
	const struct convert *p, struct ct_err *e);

#endif
