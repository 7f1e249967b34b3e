/* arssr-piece.c: see arssr-piece.h. */
#include "config.h"
#include "arssr/arssr-piece.h"
#include "core/mem.h"
#include "core/rng.h"
#include "resolution/degrade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE_MOST = 128, TRIES = 8, DRAWS = 4 };
#define STREAM ((uint64_t)1 << 33)
#define FLAT 100.0f /* HU: a cube of less is drawn anew, TRIES times */

int ct_arssr_piece_alloc(
	struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r, struct ct_err *e)
{
	const size_t voxels = r->side * r->side * r->side;

	if (r->side < 4 || r->side > SIDE_MOST)
		return ct_fail(
			e, CT_EINPUT, "pieces of %zu voxels: expected 4 to %d", r->side, SIDE_MOST);
	p->points = CT_ARSSR_PIECE_POINTS * voxels;
	if (ct_alloc(&p->lo, voxels + p->points, sizeof *p->lo, e) ||
		ct_alloc(&p->at, p->points, sizeof *p->at, e))
		return -1;
	p->want = p->lo + voxels;
	return 0;
}

void ct_arssr_piece_free(struct ct_arssr_piece *p)
{
	free(p->lo);
	free(p->at);
	*p = (struct ct_arssr_piece){0};
}

size_t ct_arssr_piece_least(const struct ct_arssr_piece_rule *r)
{
	return ct_degrade_cover(r->side, r->factor[1]);
}

/* n^3 voxels from a place on, within the window; true if they vary. */
static bool cut(
	struct ct_vol *to, const struct ct_vol *v, const size_t at[3], const double window[2])
{
	const float lo = (float)window[0], hi = (float)window[1];
	const size_t n = to->n[0];
	float least = hi, most = lo, *x = to->data;

	for (size_t k = 0; k < n; k++)
		for (size_t j = 0; j < n; j++) {
			const float *from =
				v->data + ((at[2] + k) * v->n[1] + at[1] + j) * v->n[0] + at[0];

			for (size_t i = 0; i < n; i++, x++) {
				*x = fminf(fmaxf(from[i], lo), hi);
				least = fminf(least, *x);
				most = fmaxf(most, *x);
			}
		}
	return most - least >= FLAT;
}

/* Random voxels of the cube, and where they are in the LR one. */
static void ask(struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r,
	const struct ct_vol *hi, double factor, uint64_t stream)
{
	const double scale = 1 / (r->window[1] - r->window[0]);
	const double rest = ((double)hi->n[0] - factor * (double)r->side) / 2;
	const size_t n = hi->n[0];

	for (size_t i = 0; i < p->points; i++) {
		const size_t k = ct_rng_below(r->seed, stream, DRAWS * (TRIES + 1) + i, n * n * n);
		const size_t ijk[3] = {k % n, k / n % n, k / n / n};

		for (int a = 0; a < 3; a++)
			p->at[i][a] =
				ct_cell_index((ct_cell_centre((double)ijk[a]) - rest) / factor);
		p->want[i] = (float)(((double)hi->data[k] - r->window[0]) * scale);
	}
}

int ct_arssr_piece_draw(struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r,
	const struct ct_vol *v, size_t n, uint64_t number, struct ct_err *e)
{
	const uint64_t stream = STREAM + number;
	const double factor =
		r->factor[0] + (r->factor[1] - r->factor[0]) * ct_rng_uniform(r->seed, stream, 0);
	const double scale = 1 / (r->window[1] - r->window[0]);
	const size_t side = ct_degrade_cover(r->side, factor), count[3] = {side, side, side};
	struct ct_degrade d = {.factor = {factor, factor, factor}};
	struct ct_vol hi = {0}, lo = {0};
	int rc = -1;

	ct_degrade_protocol(&d, 1);
	if (ct_vol_alloc(&hi, count, e))
		return -1;
	for (uint64_t q = 1; q <= TRIES; q++) {
		const struct ct_vol *from = &v[ct_rng_below(r->seed, stream, DRAWS * q, n)];
		size_t at[3];

		for (uint64_t a = 0; a < 3; a++)
			at[a] = ct_rng_below(
				r->seed, stream, DRAWS * q + 1 + a, from->n[a] - side + 1);
		if (cut(&hi, from, at, r->window))
			break;
	}
	if (ct_degrade_volume(&lo, &hi, &d, 0, 0, NULL, e))
		goto out;
	if (lo.n[0] != r->side) {
		ct_fail(e, CT_EGEOM, "factor %g makes %zu of %zu voxels", factor, lo.n[0], side);
		goto out;
	}
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		p->lo[i] = (float)(((double)lo.data[i] - r->window[0]) * scale);
	ask(p, r, &hi, factor, stream);
	rc = 0;
out:
	ct_vol_free(&hi);
	ct_vol_free(&lo);
	return rc;
}
