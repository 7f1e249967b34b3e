/* arssr-piece.h: what ArSSR learns from: a cube of a volume at a random place, the same reduced by
 * a random factor as a band-limited scanner does (P1 of resolution/degrade.h), and random voxels of
 * it. A function of (seed, number).
 */
#ifndef CT_ARSSR_ARSSR_PIECE_H
#define CT_ARSSR_ARSSR_PIECE_H
#include "core/vol.h"

#include <stdint.h>

struct ct_arssr_piece_rule {
	uint64_t seed;
	size_t side;      /* LR voxels along each axis */
	double factor[2]; /* from .. to */
	double window[2]; /* HU of 0 and 1 */
};
/* The paper's. */
#define CT_ARSSR_PIECE_SIDE 10
#define CT_ARSSR_PIECE_FACTORS                                                                     \
	{                                                                                          \
		2, 4                                                                               \
	}

struct ct_arssr_piece {
	size_t points;   /* CT_ARSSR_PIECE_POINTS a LR voxel */
	float *lo;       /* [side]^3, owned with what follows */
	float *want;     /* [points] */
	double (*at)[3]; /* [points]: x, y, z, in LR voxels; owned */
};
enum { CT_ARSSR_PIECE_POINTS = 8 };

/* CT_EINPUT for a side that is none, CT_ENOMEM. */
int ct_arssr_piece_alloc(
	struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r, struct ct_err *e);
void ct_arssr_piece_free(struct ct_arssr_piece *p);
/* Voxels that a volume must have along each axis. */
size_t ct_arssr_piece_least(const struct ct_arssr_piece_rule *r);
/* Piece number `number` of n volumes, HU. Codes of ct_degrade_volume. */
int ct_arssr_piece_draw(struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r,
	const struct ct_vol *v, size_t n, uint64_t number, struct ct_err *e);

#endif
