/* stack.h: projections with the geometry of every view.
 *
 * data[(view*h + row)*w + col], float. Pixel (row, col), integers at pixel centres, lies at
 *   centre + (col - (w-1)/2) u + (row - (h-1)/2) v      (world mm, RAS+)
 * so u and v carry the pixel pitch. Row 0 is the top of the picture (highest z when the axis
 * is the patient's): v points down. Beam CT_CONE and CT_FAN: rays leave the point `source`. Beam
 * CT_PARALLEL: all rays of a view run along centre - source, and `source` is any point of the
 * central ray upstream.
 *
 * Line integrals are density x mm, density = (HU - LO)/(HI - LO) of the metadata "window".
 * Metadata "quantity": lineIntegral | residual | intensity. What is made of samples carries how far
 * they differ, which ct-nabgs and ct-fuse weight pixels by.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_STACK_H
#define CT_CORE_STACK_H
#include "core/err.h"
#include "core/meta.h"
#include "core/words.h"

#include <stddef.h>

#define CT_BEAM_LIST(X)                                                                            \
	X(CT_CONE, "cone")                                                                         \
	X(CT_PARALLEL, "parallel")                                                                 \
	X(CT_FAN, "fan")
enum ct_beam { CT_BEAM_LIST(CT_WORD_VALUE) };

enum { CT_MAX_VIEWS = 65535 };

struct ct_view {
	double source[3], centre[3], u[3], v[3]; /* mm */
	double angle; /* degrees, for people; the vectors are the truth */
};

struct ct_stack {
	size_t views, h, w;
	enum ct_beam beam;
	struct ct_view *view; /* owned, [views] */
	float *data;          /* owned */
	struct ct_meta meta;
	float *deviation; /* owned: one standard deviation of each pixel; or NULL */
};

/* Zeroed views, uninitialised data; *s must be zero. */
int ct_stack_alloc(struct ct_stack *s, size_t views, size_t h, size_t w, struct ct_err *e);
void ct_stack_free(struct ct_stack *s);
size_t ct_stack_count(const struct ct_stack *s);
/* Pixels of view k. */
float *ct_stack_view(const struct ct_stack *s, size_t k);
/* CT_EGEOM naming the view unless its vectors are finite, u and v independent, and the source off
 * the detector plane. */
int ct_stack_check(const struct ct_stack *s, struct ct_err *e);
/* CT_ENUMERIC naming the first pixel that is not finite. */
int ct_stack_check_finite(const struct ct_stack *s, struct ct_err *e);
/* CT_EGEOM unless sizes, beam and vectors agree (1e-3 of a pixel). */
int ct_stack_same(const struct ct_stack *a, const struct ct_stack *b, struct ct_err *e);
/* Geometry and metadata of src (same detector area, pixels `factor` times finer if > 1 in both
 * directions; h*factor and w*factor must be whole), data uninitialised. CT_EGEOM, and for a factor
 * of a fan, which has one row. */
int ct_stack_like(
	struct ct_stack *dst, const struct ct_stack *src, double factor, struct ct_err *e);
/* The detector of src with pixels s times larger, but for the one row of a fan, and its metadata;
 * data uninitialised. CT_EGEOM unless s divides it. */
int ct_stack_coarsen(struct ct_stack *dst, const struct ct_stack *src, size_t s, struct ct_err *e);

#endif
