/* example.h: training pairs (learn.h) from volumes: a cube of one at a random scale, place and
 * phase, degraded as a random scanner would, noise included, and solved by the product's own
 * solver. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_RESTORE_EXAMPLE_H
#define CT_RESTORE_EXAMPLE_H
#include "core/env.h"
#include "core/vol.h"
#include "restore/learn.h"
#include "restore/restore.h"

struct ct_example_rule {
	size_t side;     /* of a cube, voxels at most */
	size_t factor;   /* of the coarse axes */
	bool thick;      /* along one axis at random that is not soft, else along all three */
	bool soft[3];    /* axes along which the volume has no detail to learn from */
	double scale[2]; /* voxels of a cube are so many of the volume's, from .. to */
	double noise;    /* HU, at most; half of the pairs have none */
	double clip[2];  /* HU that half of them are clipped to; NaN: none */
	const struct ct_slice_prior *after; /* adds to what the solver made; or NULL */
	bool whole; /* as ct-sr refines: solved in several ways, then all passes of `after`; else
		       solved once, then its first pass */
	const char *hash; /* of that prior, for who keeps examples; or NULL */
	uint64_t seed;
};

/* Axes along which v is soft: its second differences, relative to its first, are below two thirds
 * of the largest of the three. Scans of thick slices have detail in plane only. */
void ct_example_soft(bool soft[static 3], const struct ct_vol *v);
/* Pair number `index` from the volume v (HU). Allocates base and rest, one block at base. 0, -1, or
 * 1 if the volume is too small for it, or (whole) ct-sr adds nothing to such a scan. */
int ct_example_alloc(struct ct_example *p, const struct ct_vol *v,
	const struct ct_example_rule *rule, uint64_t index, const struct ct_env *env,
	struct ct_err *e);
/* And what rule->after adds to the base of that pair, whose rest becomes what is then still
 * missing. Of a whole one the base is then what ct_restore gives a volume network, the base less
 * that before is what it gives as added, and the regime becomes the one that the network is told.
 * What failed is only to be freed. */
int ct_example_after(struct ct_example *p, const struct ct_example_rule *rule, uint64_t index,
	const struct ct_env *env, struct ct_err *e);
/* Set what made the LR scan of that pair, and the axes along which it is coarse. */
void ct_example_regime(struct ct_example *p, const struct ct_example_rule *rule, uint64_t index);
/* Set the variance of a pair whose rest is there. */
void ct_example_weigh(struct ct_example *p);
void ct_example_free(struct ct_example *p);

#endif
