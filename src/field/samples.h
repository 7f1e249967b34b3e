/* samples.h: where the points of one measurement lie: a voxel as a point, a line or a cube; a ray.
 *
 * Positions are in [0,1]^3 of the box of the object; what lies outside is moved to its face. A
 * voxel is its centre and three edges: from the centre to those of the next voxels. Along it a
 * sample is at offset o in [-1, 1] of an edge.
 *
 *   points  the centre
 *   lines   n samples along the third axis, one in each of n equal parts (NeRF: Mildenhall et al.,
 *           ECCV 2020, with the slice axis as the line of sight)
 *   cubes   n = c^3 samples, one in each cell of a lattice of c x c x c, by their distance
 *           r = |o| from the centre (CuNeRF: Chen et al., ICCV 2023)
 *   rays    n samples, one in each of n equal parts of the ray within the box (NAF: Zha et al.,
 *           MICCAI 2022)
 *
 * Of lines and cubes a second pass draws `fine` more samples where the weights of the first are
 * large: t by the inverse of their distribution, piecewise constant between the middles of
 * neighbours; in a cube a random direction at that distance. Both sets together, by t, are the
 * samples of the second field. The draws count as constants of the loss.
 *
 * Random numbers are functions of (seed, stream, item). Pure; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_SAMPLES_H
#define CT_FIELD_SAMPLES_H
#include "core/words.h"

#include <stddef.h>
#include <stdint.h>

#define CT_SAMPLES_LIST(X)                                                                         \
	X(CT_SAMPLES_POINTS, "points")                                                             \
	X(CT_SAMPLES_LINES, "lines")                                                               \
	X(CT_SAMPLES_CUBES, "cubes")                                                               \
	X(CT_SAMPLES_PROFILE, "profile")                                                           \
	X(CT_SAMPLES_RAYS, "rays")
enum ct_samples_kind { CT_SAMPLES_LIST(CT_WORD_VALUE) };

/* More are a mistake. */
enum { CT_SAMPLES_MOST = 4096 };

struct ct_samples {
	enum ct_samples_kind kind;
	size_t n, fine; /* of an item in the first pass; that the second adds, 0: there is none */
};

/* Of one item of a batch. */
struct ct_samples_draw {
	uint64_t seed, stream;
	uint32_t item;
};

/* Samples of an item in pass 0 or 1. */
static inline size_t ct_samples_count(const struct ct_samples *s, size_t pass)
{
	return pass ? s->n + s->fine : s->n;
}

/* How many passes: 2 for lines and cubes. */
static inline size_t ct_samples_passes(const struct ct_samples *s)
{
	return s->fine ? 2 : 1;
}

/* Where t ends: 1 of a line, sqrt(3) of a cube. */
double ct_samples_end(enum ct_samples_kind kind);
/* A voxel in the first pass: places x[n][3], ascending t[n] (of points 0). Scratch: none. */
void ct_samples_voxel(const struct ct_samples *s, float *x, float *t, const double centre[static 3],
	const double edge[static 3][3], const struct ct_samples_draw *draw);
/* The second pass: x[n + fine][3], t[n + fine] from those of the first and its weights w[n]. */
void ct_samples_second(const struct ct_samples *s, float *x, float *t, const float *x1,
	const float *t1, const float *w1, const double centre[static 3],
	const double edge[static 3][3], const struct ct_samples_draw *draw);
/* The part [near, far] of the line from + t along that is in [0,1]^3 and not before t = 0 (unless
 * `both`); 0 if there is none, else far - near. */
double ct_samples_chord(
	double span[static 2], const double from[static 3], const double along[static 3], int both);
/* A ray: x[n][3] in the span. */
void ct_samples_ray(const struct ct_samples *s, float *x, const double from[static 3],
	const double along[static 3], const double span[static 2],
	const struct ct_samples_draw *draw);

#endif
