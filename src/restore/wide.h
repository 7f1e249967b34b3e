/* wide.h: the wide network of the prior. It looks at a whole volume, where a slice network
 * (slice-network.h) looks at a cell and what is near it.
 *
 * It is a residual network of convolutions of 3^3 cells, zero outside the volume. A cell, a cube of
 * `cell` voxels a side, is one place with as many channels as voxels (64):
 *
 *   x = a(first * volume + b(0)),   x += second * a(one * x + b(i)) + b'(i),   i = 1 .. blocks
 *   h = last * x + b''
 *
 * a(t) is t, or .1 t below 0; b(i) are linear in what the scan is (ct_regime). h is what the volume
 * lacks beside what the slice networks expect of it, HU.
 *
 * Planes of cells go through all layers in a wave: in a step each layer makes one plane, two steps
 * after the layer before it made that. So only a few planes of each layer are kept. Volumes of many
 * cells are cut into columns, each with CT_WIDE_HALO cells more at its sides, fewer than the
 * network sees: what is left out changes little.
 */
#ifndef CT_RESTORE_WIDE_H
#define CT_RESTORE_WIDE_H
#include "core/env.h"
#include "core/tensors.h"
#include "restore/slice-network.h"

enum { CT_WIDE_CELL = 4, CT_WIDE_COLUMN = 64, CT_WIDE_HALO = 8 };

struct ct_wide {
	size_t width, blocks; /* channels; 0: there is none */
	float *all;           /* owned: the tensors, one after the other */
};

/* The network NAME of w; none if there is no tensor NAME.shape. CT_EINPUT naming the tensor that is
 * missing or of another shape, CT_ENUMERIC, CT_ENOMEM. *r must be zero. */
int ct_wide_alloc(
	struct ct_wide *r, const struct ct_tensors *w, const char *name, struct ct_err *e);
void ct_wide_free(struct ct_wide *r);
/* Bytes that ct_wide_predict works in. */
double ct_wide_bytes(const struct ct_wide *r, const size_t n[static 3]);
/* h[n] <- what the volume x of n voxels, of whole cells, lacks. The same bytes for any number of
 * threads. CT_ENOMEM, CT_EFAIL, CT_ESTOP. */
int ct_wide_predict(const struct ct_wide *r, float *h, const float *x, const size_t n[static 3],
	const struct ct_regime *regime, const struct ct_env *env, struct ct_err *e);

#endif
