/* consistency-planes.c: planes reduced and expanded (consistency.h), and what D of few weights
 * makes of them along k: each slab of planes its own share of the samples, and apart, as it may
 * come last, its first plane. Then D+ in double. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "inverse/consistency.h"
#include "operator/svd.h"
#include "solve/vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PARTS = 8, STRIP = 256, LINE = 16 }; /* planes blended at once; columns */

/* Has a slab's first plane a plane of its own? Not where no other plane is in its sample. */
static bool apart(const struct ct_consistency *dc)
{
	return dc->d[2].down.taps > 1;
}

static size_t slabs(const struct ct_consistency *dc)
{
	return (dc->n[2] + CT_CONSISTENCY_SLAB - 1) / CT_CONSISTENCY_SLAB;
}

/* Weight of plane k in coarse plane o. */
static float weight(const struct ct_consistency *dc, size_t o, size_t k)
{
	const struct ct_banded_rows *down = &dc->d[2].down;

	return k < down->first[o] || k >= down->first[o] + down->taps
		       ? 0
		       : down->w[o * down->taps + k - down->first[o]];
}

/* Coarse planes *o, ... that plane k is a part of, and its weights in them; how many. */
static size_t reach(const struct ct_consistency *dc, size_t k, size_t *o, float **w)
{
	const struct ct_banded_rows *up = &dc->d[2].up;
	float *all = up->w + k * up->taps;
	size_t from = 0, to = up->taps;

	while (to > 0 && all[to - 1] == 0)
		to--;
	while (from < to && all[from] == 0)
		from++;
	*o = up->first[k] + from;
	*w = all + from;
	return to - from;
}

int ct_consistency_cut(struct ct_consistency *dc, size_t *planes, struct ct_err *e)
{
	if (ct_alloc0(&dc->slab, slabs(dc), sizeof *dc->slab, e))
		return -1;
	*planes = 0;
	for (size_t s = 0; s < slabs(dc); s++) {
		struct ct_consistency_slab *b = &dc->slab[s];
		const size_t end = (s + 1) * CT_CONSISTENCY_SLAB;

		b->at = *planes;
		for (size_t k = s * CT_CONSISTENCY_SLAB + apart(dc); k < end && k < dc->n[2]; k++) {
			float *w;
			size_t o, count = reach(dc, k, &o, &w);

			if (count == 0)
				continue;
			b->first = b->count ? b->first : o;
			b->count =
				o + count - b->first > b->count ? o + count - b->first : b->count;
		}
		*planes += b->count + apart(dc);
	}
	return 0;
}

/* What is to be blended. */
struct mixture {
	const float *part[PARTS];
	float w[PARTS];
	size_t n;
};

static void mix(struct mixture *m, float *out, const float *part, float w, size_t n)
{
	if (m->n == PARTS) {
		CT_SIMD(ct_banded_blend)(out, m->n, m->part, m->w, n);
		*m = (struct mixture){.part = {out}, .w = {1}, .n = 1};
	}
	m->part[m->n] = part;
	m->w[m->n++] = w;
}

void ct_consistency_gather(const struct ct_consistency *dc, float *out, size_t o, size_t at,
	size_t n, float want, float made)
{
	const struct ct_banded_rows *down = &dc->d[2].down;
	const size_t end = down->first[o] + down->taps;
	struct mixture m = {0};

	if (want != 0)
		mix(&m, out, dc->want + o * dc->plane + at, want, n);
	for (size_t s = down->first[o] / CT_CONSISTENCY_SLAB; s * CT_CONSISTENCY_SLAB < end; s++) {
		const struct ct_consistency_slab *b = &dc->slab[s];
		const float *in = dc->reduced + b->at * dc->plane + at;
		const float w = weight(dc, o, s * CT_CONSISTENCY_SLAB);

		if (o >= b->first && o < b->first + b->count)
			mix(&m, out, in + (o - b->first) * dc->plane, made, n);
		if (apart(dc) && w != 0)
			mix(&m, out, in + b->count * dc->plane, made * w, n);
	}
	CT_SIMD(ct_banded_blend)(out, m.n, m.part, m.w, n);
}

static size_t lines(size_t n)
{
	return (n + LINE - 1) / LINE * LINE;
}

static const double least_power = 0.03; /* of noise at any frequency */

void ct_consistency_powers(double *power, size_t m, double alike)
{
	double sum = 0;

	for (size_t k = 0; k < m; k++) {
		power[k] = 1 + least_power;
		for (int l = 1; l < 16; l++)
			power[k] += 2 * pow(alike, l * l) * cos(M_PI * l * (double)k / (double)m);
		sum += power[k];
	}
	for (size_t k = 0; k < m; k++)
		power[k] *= (double)m / sum;
}

void ct_consistency_measure_work(struct ct_consistency *dc)
{
	for (int a = 0; a < 3; a++) {
		const size_t banded = ct_banded_scratch(&dc->d[a]);
		const size_t cosine = ct_cosine_scratch(&dc->v[a]);
		const size_t most = banded > cosine ? banded : cosine;

		if (!dc->same[a] && most > dc->tile)
			dc->tile = most;
	}
	dc->share = dc->tile + lines(dc->m[1] * dc->n[0]) + (dc->banded ? lines(dc->plane) : 0);
}

/* Within the plane: out (m1,m0), turned unless axis 0 stays as it is, of x (n1,n0). */
static void reduce(struct ct_consistency *dc, float *out, const float *x, float *tile)
{
	float *half = dc->same[0] ? out : tile + dc->tile;
	const size_t n = dc->n[0], m = dc->m[1];
	const float *in = dc->same[1] ? x : half;

	if (dc->same[0] && dc->same[1])
		memcpy(out, x, dc->plane * sizeof *x);
	if (!dc->same[1] && dc->banded)
		CT_SIMD(ct_banded_across)(&dc->d[1].down, half, n, NULL, x, n, n);
	else if (!dc->same[1])
		CT_SIMD(ct_cosine_analyse)(&dc->v[1], half, n, x, n, n, false, tile);
	if (!dc->same[0] && dc->banded)
		CT_SIMD(ct_banded_down)(&dc->d[0], out, m, in, n, m, tile);
	else if (!dc->same[0])
		CT_SIMD(ct_cosine_analyse)(&dc->v[0], out, m, in, n, m, true, tile);
}

/* Coarse plane o of what the slab makes of its planes from `from` to k, of which in is reduced. */
static void add(
	struct ct_consistency *dc, float *out, size_t o, size_t from, size_t k, const float *in)
{
	const float w[2] = {1, weight(dc, o, k)}, *part[2] = {out, in};
	size_t first;

	while (from < k && weight(dc, o, from) == 0)
		from++;
	first = from < k ? 0 : 1;
	CT_SIMD(ct_banded_blend)(out, 2 - first, part + first, w + first, dc->plane);
}

/* Is D banded, and only along k? */
static bool is_flat(const struct ct_consistency *dc)
{
	return dc->banded && dc->same[0] && dc->same[1];
}

/* Plane k, reduced within itself, to what its slab makes. */
static void add_plane(struct ct_consistency *dc, size_t k, const float *x)
{
	const struct ct_consistency_slab *b = &dc->slab[k / CT_CONSISTENCY_SLAB];
	const size_t first = k / CT_CONSISTENCY_SLAB * CT_CONSISTENCY_SLAB + apart(dc);
	float *made = dc->reduced + b->at * dc->plane, *w;
	size_t o, count = reach(dc, k, &o, &w);

	if (k < first && count > 0)
		memcpy(made + b->count * dc->plane, x, dc->plane * sizeof *x);
	for (; k >= first && count-- > 0; o++)
		add(dc, made + (o - b->first) * dc->plane, o, first, k, x);
}

void ct_consistency_reduce(struct ct_consistency *dc, size_t k, const float *x, size_t worker)
{
	float *tile = dc->work + worker * dc->share, *w;
	float *plane = tile + dc->tile + lines(dc->m[1] * dc->n[0]);
	size_t o;

	if (!dc->banded) {
		reduce(dc, dc->reduced + k * dc->plane, x, tile);
	} else if (is_flat(dc)) {
		add_plane(dc, k, x);
	} else if (reach(dc, k, &o, &w) > 0) {
		reduce(dc, plane, x, tile);
		add_plane(dc, k, plane);
	}
}

/* out = x (NULL is 0) + plane k of D^T coef, along k. */
static void combine(const struct ct_consistency *dc, size_t k, float *out, const float *x)
{
	struct ct_banded_rows row = {.n = 1};
	float *w;
	size_t o;

	row.taps = reach(dc, k, &o, &w);
	row.first = &o;
	row.w = w;
	CT_SIMD(ct_banded_across)(&row, out, dc->plane, x, dc->coef, dc->plane, dc->plane);
}

const float *ct_consistency_multiple(const struct ct_consistency *dc, size_t k, float *by)
{
	float *w;
	size_t o, count;

	if (!is_flat(dc))
		return NULL;
	count = reach(dc, k, &o, &w);
	*by = *w; /* 0 if there is none */
	return count > 1 ? NULL : dc->coef + o * dc->plane;
}

void ct_consistency_expand(
	const struct ct_consistency *dc, size_t k, float *out, const float *x, size_t worker)
{
	float *tile = dc->work + worker * dc->share, *half = tile + dc->tile;
	float *plane = half + lines(dc->m[1] * dc->n[0]);
	const float *in = dc->banded ? plane : dc->reduced + k * dc->plane;
	const size_t n = dc->n[0], m = dc->m[1];

	if (is_flat(dc)) {
		combine(dc, k, out, x);
		return;
	}
	if (dc->banded)
		combine(dc, k, plane, NULL);
	if (!dc->same[0] && dc->banded)
		CT_SIMD(ct_banded_up)(&dc->d[0], half, n, in, m, m, tile);
	else if (!dc->same[0])
		CT_SIMD(ct_cosine_synthesise)(&dc->v[0], half, n, NULL, in, m, m, true, tile);
	in = dc->same[0] ? in : half;
	if (!dc->same[1] && dc->banded)
		CT_SIMD(ct_banded_across)(&dc->d[1].up, out, n, x, in, n, n);
	else if (!dc->same[1])
		CT_SIMD(ct_cosine_synthesise)(&dc->v[1], out, n, x, in, n, n, false, tile);
	else
		for (size_t i = 0; i < n * dc->n[1]; i++)
			out[i] = x ? x[i] + in[i] : in[i];
}

struct whole {
	struct ct_consistency *dc;
	float *x;
};

static void reduce_slab(void *arg, size_t slab, size_t worker)
{
	const struct whole *w = arg;
	const size_t from = slab * CT_CONSISTENCY_SLAB, to = from + CT_CONSISTENCY_SLAB;

	for (size_t k = from; k < to && k < w->dc->n[2]; k++)
		ct_consistency_reduce(w->dc, k, w->x + k * w->dc->n[0] * w->dc->n[1], worker);
}

static void expand_one(void *arg, size_t k, size_t worker)
{
	const struct whole *w = arg;
	float *x = w->x + k * w->dc->n[0] * w->dc->n[1];

	ct_consistency_expand(w->dc, k, x, x, worker);
}

void ct_consistency_take(struct ct_consistency *dc, float *x, struct ct_par *par)
{
	struct whole w = {dc, x};

	ct_par_for(par, slabs(dc), reduce_slab, &w);
}

void ct_consistency_add(struct ct_consistency *dc, float *x, struct ct_par *par)
{
	struct whole w = {dc, x};

	ct_par_for(par, dc->n[2], expand_one, &w);
}

void ct_consistency_apply(struct ct_consistency *dc, float *x, struct ct_par *par)
{
	ct_consistency_take(dc, x, par);
	ct_consistency_correct(dc, false, par);
	ct_consistency_add(dc, x, par);
}

/* Axes whose D D^T is a multiple of the identity are solved as the samples are gathered. */
static float multiple(const struct ct_consistency *dc)
{
	float by = 1;

	for (int a = 0; a < 3; a++)
		by *= dc->d[a].plain ? dc->d[a].inverse[0] : 1;
	return by;
}

/* y - D x solved along k, for the columns of a strip. */
static void solve_strip(void *arg, size_t strip, size_t worker)
{
	struct ct_consistency *dc = arg;
	const size_t at = strip * STRIP, n = dc->plane - at < STRIP ? dc->plane - at : STRIP;
	const float by = multiple(dc);

	(void)worker;
	for (size_t o = 0; o < dc->m[2]; o++)
		ct_consistency_gather(dc, dc->coef + o * dc->plane + at, o, at, n, by, -by);
	CT_SIMD(ct_banded_solve)(&dc->d[2], dc->coef + at, dc->plane, n);
}

/* And within plane o. */
static void solve_plane(void *arg, size_t o, size_t worker)
{
	struct ct_consistency *dc = arg;
	float *c = dc->coef + o * dc->plane;
	const float by = multiple(dc);
	const size_t *m = dc->m;

	if (dc->d[2].plain)
		ct_consistency_gather(dc, c, o, 0, dc->plane, by, -by);
	if (!dc->d[0].plain)
		CT_SIMD(ct_banded_solve)(&dc->d[0], c, m[1], m[1]);
	if (!dc->d[1].plain && dc->same[0])
		CT_SIMD(ct_banded_solve)(&dc->d[1], c, m[0], m[0]);
	else if (!dc->d[1].plain)
		CT_SIMD(ct_banded_solve_turned)
	(&dc->d[1], c, m[1], m[0], dc->work + worker * dc->share);
}

/* <y - D x, coef> of plane o. */
static void product(void *arg, size_t o, size_t worker)
{
	struct ct_consistency *dc = arg;
	double sum = 0;

	(void)worker;
	for (size_t at = 0; at < dc->plane; at += STRIP) {
		const size_t n = dc->plane - at < STRIP ? dc->plane - at : STRIP;
		float r[STRIP];

		ct_consistency_gather(dc, r, o, at, n, 1, -1);
		sum += CT_SIMD(ct_vector_dot)(
			n, &(struct ct_vector){.x = r, .w = dc->coef + o * dc->plane + at});
	}
	dc->sums[o] = sum;
}

/* With D x = y before the step, V step = -d. */
double ct_consistency_solve(struct ct_consistency *dc, bool measure, struct ct_par *par)
{
	const bool known = dc->known;
	double sum = 0;

	dc->known = true;
	if (!dc->d[2].plain)
		ct_par_for(par, (dc->plane + STRIP - 1) / STRIP, solve_strip, dc);
	ct_par_for(par, dc->m[2], solve_plane, dc);
	if (!known || !measure)
		return (double)NAN;
	ct_par_for(par, dc->m[2], product, dc);
	for (size_t o = 0; o < dc->m[2]; o++)
		sum += dc->sums[o];
	return -sum;
}

int ct_consistency_pinv_plan(struct ct_separable *s, const struct ct_degrade *d,
	const size_t n[static 3], const struct ct_par *par, struct ct_err *e)
{
	int rc = 0;

	*s = (struct ct_separable){0};
	for (int a = 0; a < 3 && rc == 0; a++) {
		struct ct_taps down = {0};
		struct ct_svd f = {0};

		rc = ct_degrade_axis_taps(&down, d, a, n[a], e) || ct_svd_alloc(&f, &down, e) ||
		     ct_svd_pinv(&s->t[a], &f, e);
		ct_svd_free(&f);
		ct_taps_free(&down);
	}
	if (rc == 0)
		return ct_separable_plan(s, par, e);
	ct_separable_free(s);
	return -1;
}

/* Root of the mean square of a - b. */
static double rms(const float *a, const float *b, size_t n)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
	return sqrt(sum / (double)n);
}

int ct_consistency_settle(float *x, const float *y, const struct ct_degrade *d,
	const size_t n[static 3], double most, double *residual, struct ct_par *par,
	struct ct_err *e)
{
	struct ct_separable down = {0}, up = {0};
	float *lo = NULL;
	size_t m = 1;
	int rc = -1;

	if (ct_degrade_plan(&down, d, n, par, e))
		return -1;
	for (int a = 0; a < 3; a++)
		m *= down.t[a].n_out;
	if (ct_alloc(&lo, m, sizeof *lo, e))
		goto out;
	if (isfinite(most)) {
		if (ct_consistency_pinv_plan(&up, d, n, par, e))
			goto out;
		ct_separable_apply(&down, lo, x, par);
		for (size_t i = 0; i < m; i++) {
			const double r = (double)y[i] - (double)lo[i];

			lo[i] = (float)(r - fmin(fmax(r, -most), most));
		}
		ct_separable_add(&up, x, lo, par);
	}
	if (residual) {
		ct_separable_apply(&down, lo, x, par);
		*residual = rms(lo, y, m);
	}
	rc = 0;
out:
	ct_separable_free(&down);
	ct_separable_free(&up);
	free(lo);
	return rc;
}
