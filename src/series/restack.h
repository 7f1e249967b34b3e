/* restack.h: the planes of a grid from slices that lie beside and between them. */
#ifndef CT_SERIES_RESTACK_H
#define CT_SERIES_RESTACK_H
#include "core/env.h"
#include "series/layout.h"

/* Where slices come from: n columns x rows numbers of slice k into px; and what takes plane k of
 * the grid, out, while it is in the cache. */
struct ct_restack_source {
	int (*read)(void *ctx, size_t k, float *px, struct ct_err *e);
	int (*take)(void *ctx, size_t k, const float *out, struct ct_err *e);
	void *ctx;
};

/* Planes of the grid into data, or for the source to take, if that is NULL. In its plane a slice is
 * moved by Keys' cubic kernel, held to the range of the slice, and what it does not cover becomes
 * `none`; a plane between two slices is their mean, weighted by distance. Slices are asked for in
 * order, each once at most. Codes of the source; CT_ENOMEM. */
int ct_restack_fill(float *data, const struct ct_layout *l, const struct ct_slice *s, float none,
	const struct ct_restack_source *from, const struct ct_env *env, struct ct_err *e);

#endif
