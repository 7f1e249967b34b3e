/* volume-network.h: a volume network of the prior. It sees a whole volume, where a slice network
 * (slice-network.h) sees a cell and what is near it.
 *
 * "volume-S" is for scans S times coarser along all axes, "volume-thick-S" for those with one such
 * axis. Both are a residual network of convolutions of 3^3 cells, zero outside the volume. A cell,
 * a cube of 4 voxels a side whatever S is, is one place with as many channels as voxels; the last
 * cells of an axis are filled by repeating the border. The network of thick slices sees the coarse
 * axis in the place of the third: those two change places, and do so again in what it makes. In are
 * two volumes: the refined one, and what all passes of slice networks added to it. Out is what the
 * refined one still lacks, HU:
 *
 *   x = a(first * (volume, added) + b(0)),   x += second * a(one * x + b(i)) + b'(i),   i = 1 ..
 *   h = last * x + b''
 *
 * a(t) is t, or .1 t below 0; b(i) are linear in what the scan is: ct_regime, S, and which axes
 * are fine. Weights are learned by bench/train/volume.py with PyTorch; of its tensors, `error` and
 * `error_bias` (the logarithm of the mean square of what is then still missing) are not used.
 *
 * Planes of cells go through all layers in a wave: in a step each layer makes one plane, two steps
 * after the layer before it made that. So only a few planes of each layer are kept. Volumes of many
 * cells are cut into columns, each with CT_VOLUME_NETWORK_HALO cells more at its sides. That is
 * fewer than the network sees: what is left out changes little.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_VOLUME_NETWORK_H
#define CT_RESTORE_VOLUME_NETWORK_H
#include "core/env.h"
#include "core/tensors.h"
#include "restore/predict.h"

enum { CT_VOLUME_NETWORK_CELL = 4, CT_VOLUME_NETWORK_COLUMN = 64, CT_VOLUME_NETWORK_HALO = 8 };

struct ct_volume_network {
	size_t factor;        /* S */
	bool thick;           /* one axis is coarse, else all three */
	size_t width, blocks; /* channels; 0: there is none */
	float *all;           /* owned: the tensors, one after the other */
};

/* The network of w for such scans; none if w has no tensor NAME.shape. CT_EINPUT naming the tensor
 * that is missing or of another shape, CT_ENUMERIC, CT_ENOMEM. *r must be zero. */
int ct_volume_network_get(struct ct_volume_network *r, const struct ct_tensors *w, size_t factor,
	bool thick, struct ct_err *e);
void ct_volume_network_free(struct ct_volume_network *r);
/* Are these the axes that are coarse in its scans? */
bool ct_volume_network_fits(const struct ct_volume_network *r, const bool coarse[static 3]);
/* Bytes that it holds. */
double ct_volume_network_held(const struct ct_volume_network *r);
/* Bytes that ct_volume_network_predict works in for a scene whose x is not looked at. */
double ct_volume_network_bytes(
	const struct ct_volume_network *r, const struct ct_scene *s, size_t threads);
/* h <- what the volume of the scene, which the network fits, still lacks, where the slice networks
 * added `added`. The same bytes for any number of threads. CT_ENOMEM, CT_EFAIL, CT_ESTOP. */
int ct_volume_network_predict(const struct ct_volume_network *r, float *h, const struct ct_scene *s,
	const float *added, const struct ct_env *env, struct ct_err *e);

#endif
