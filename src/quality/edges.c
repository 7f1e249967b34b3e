/* edges.c: see edges.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/edges.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { REACH = 8, LATERAL = 2, BINS = CT_EDGE_BINS, PER_VOXEL = BINS / (2 * REACH) };
enum { BATCH = 32, MOST_EDGES = 20000, LEAST_EDGES = 12, BALL_RADIUS = 2 };

/* Sums of the edge spread functions, of a batch of edges. */
struct spread {
	double sum[2][BINS], count[BINS]; /* ref, test */
	double at[BINS];                  /* sum of places, in bins */
	size_t edges;
};

struct edges_job {
	const struct ct_vol *ref, *test, *mask;
	const struct ct_env *env;
	double mm[3], voxel; /* voxel: mean spacing */
	size_t margin[3];    /* that the cylinder needs */
	size_t *found;       /* candidates of each slice */
	size_t *edge;        /* chosen ones, as indices */
	size_t edges, stride;
	struct spread *part;
	struct spot *spot; /* [worker][spots] */
	size_t spots;      /* at most, of a cylinder */
};

/* A voxel of a cylinder, and its signed distance from the middle, mm. */
struct spot {
	double d;
	size_t index;
};

/* One edge: where, and what the cylinder about its normal looks like. */
struct fit {
	size_t at[3];
	double normal[3], low, step, place;
};

static double value(const struct ct_vol *v, size_t i, size_t j, size_t k)
{
	return (double)v->data[(k * v->n[1] + j) * v->n[0] + i];
}

/* Squared central difference, HU a voxel; *along is its largest component. */
static double steepness(const struct edges_job *j, const size_t at[3], int *along)
{
	const size_t stride[3] = {1, j->ref->n[0], j->ref->n[0] * j->ref->n[1]};
	const float *p = j->ref->data + at[0] + at[1] * stride[1] + at[2] * stride[2];
	double sum = 0, most = -1;

	for (int a = 0; a < 3; a++) {
		double g =
			((double)p[stride[a]] - (double)*(p - stride[a])) / 2 * j->voxel / j->mm[a];

		if (g * g > most) {
			most = g * g;
			*along = a;
		}
		sum += g * g;
	}
	return sum;
}

/* Is the voxel steep, and steeper than its neighbours along the steepest axis? */
static bool candidate(const struct edges_job *j, const size_t at[3])
{
	size_t near[3] = {at[0], at[1], at[2]};
	double least = CT_EDGE_STEP / 8, here;
	int along = 0, other;

	if (j->mask && value(j->mask, at[0], at[1], at[2]) == 0)
		return false;
	here = steepness(j, at, &along);
	if (here < least * least)
		return false;
	near[along]--;
	if (steepness(j, near, &other) >= here)
		return false;
	near[along] += 2;
	return steepness(j, near, &other) <= here;
}

/* Count the candidates of slice k, and note every stride-th of all when it is known. */
static void search(void *arg, size_t task, size_t worker)
{
	const struct edges_job *j = arg;
	size_t at[3] = {0, 0, task + j->margin[2]}, n = 0, before = j->edge ? j->found[task] : 0;

	(void)worker;
	if (ct_stopping(j->env))
		return;
	for (at[1] = j->margin[1]; at[1] + j->margin[1] < j->ref->n[1]; at[1]++)
		for (at[0] = j->margin[0]; at[0] + j->margin[0] < j->ref->n[0]; at[0]++) {
			if (!candidate(j, at))
				continue;
			if (j->edge && (before + n) % j->stride == 0)
				j->edge[(before + n) / j->stride] =
					(at[2] * j->ref->n[1] + at[1]) * j->ref->n[0] + at[0];
			n++;
		}
	if (!j->edge)
		j->found[task] = n;
}

/* The unit normal, mm, towards larger values: for a ball of the lattice the least-squares slope
 * along an axis is sum(offset value)/sum(offset^2). */
static void fit_normal(const struct edges_job *j, struct fit *f)
{
	double g[3] = {0}, length = 0;

	for (int z = -BALL_RADIUS; z <= BALL_RADIUS; z++)
		for (int y = -BALL_RADIUS; y <= BALL_RADIUS; y++)
			for (int x = -BALL_RADIUS; x <= BALL_RADIUS; x++) {
				const int o[3] = {x, y, z};
				double v;

				if (x * x + y * y + z * z > BALL_RADIUS * BALL_RADIUS)
					continue;
				v = value(j->ref, f->at[0] + (size_t)x, f->at[1] + (size_t)y,
					f->at[2] + (size_t)z);
				for (int a = 0; a < 3; a++)
					g[a] += o[a] * v / j->mm[a];
			}
	for (int a = 0; a < 3; a++)
		length += g[a] * g[a];
	for (int a = 0; a < 3; a++)
		f->normal[a] = g[a] / sqrt(length);
}

/* The voxels of the cylinder about the voxel f->at; how many. */
static size_t cylinder(struct spot *to, const struct edges_job *j, const struct fit *f)
{
	const ptrdiff_t row = (ptrdiff_t)j->ref->n[0], rows = (ptrdiff_t)j->ref->n[1];
	const size_t middle = (f->at[2] * j->ref->n[1] + f->at[1]) * j->ref->n[0] + f->at[0];
	double reach = REACH * j->voxel, lateral = LATERAL * j->voxel;
	size_t n = 0;
	int half[3];

	for (int a = 0; a < 3; a++) {
		double far = (reach * fabs(f->normal[a]) +
				     lateral * sqrt(fmax(0, 1 - f->normal[a] * f->normal[a]))) /
			     j->mm[a];

		half[a] = far > 0 ? (int)fmin(far, (double)j->margin[a]) : 0; /* or no normal */
	}
	for (int z = -half[2]; z <= half[2]; z++)
		for (int y = -half[1]; y <= half[1]; y++)
			for (int x = -half[0]; x <= half[0]; x++) {
				double p[3] = {x * j->mm[0], y * j->mm[1], z * j->mm[2]};
				double d = ct_vec3_dot(p, f->normal);

				if (ct_vec3_dot(p, p) - d * d > lateral * lateral ||
					!(fabs(d) < reach))
					continue;
				to[n].d = d;
				to[n++].index = middle + (size_t)((z * rows + y) * row + x);
			}
	return n;
}

/* Does the cylinder hold a step between two plateaus, its outer halves? Then low and step are. */
static bool fit_step(
	const struct edges_job *j, struct fit *f, const struct spot *spot, size_t spots)
{
	double n[2] = {0}, sum[2] = {0}, square[2] = {0}, least = HUGE_VAL, most = -HUGE_VAL;
	double noise, beyond;

	for (size_t i = 0; i < spots; i++) {
		const double v = (double)j->ref->data[spot[i].index], d = spot[i].d;

		if (fabs(d) > REACH / 2.0 * j->voxel) {
			n[d > 0] += 1;
			sum[d > 0] += v;
			square[d > 0] += v * v;
		}
		least = fmin(least, v);
		most = fmax(most, v);
	}
	if (n[0] < 4 || n[1] < 4)
		return false;
	for (int k = 0; k < 2; k++) {
		sum[k] /= n[k];
		square[k] = square[k] / n[k] - sum[k] * sum[k];
	}
	f->low = sum[0];
	f->step = sum[1] - sum[0];
	noise = 0.01 * f->step * f->step;
	beyond = 0.2 * f->step;
	return f->step >= CT_EDGE_STEP && square[0] <= noise && square[1] <= noise &&
	       least >= sum[0] - beyond && most <= sum[1] + beyond;
}

/* Where the edge crosses one half, by a regression about `centre`. Its weight falls smoothly, to
 * zero at 1.5 voxels, so that the lattice hardly shows. */
static bool fit_place(const struct edges_job *j, struct fit *f, const struct spot *spot,
	size_t spots, double centre)
{
	double m = 0, sd = 0, sv = 0, dd = 0, dv = 0, slope;

	for (size_t i = 0; i < spots; i++) {
		const double v = (double)j->ref->data[spot[i].index], d = spot[i].d;
		const double u = (d - centre) / (1.5 * j->voxel), w = (1 - u * u) * (1 - u * u);

		if (fabs(u) >= 1)
			continue;
		m += w;
		sd += w * d;
		sv += w * v;
		dd += w * d * d;
		dv += w * d * v;
	}
	slope = (dv - sd * sv / m) / (dd - sd * sd / m);
	if (!(slope > 0))
		return false;
	f->place = sd / m + (f->low + f->step / 2 - sv / m) / slope;
	return fabs(f->place) <= 0.75 * j->voxel;
}

static void batch(void *arg, size_t task, size_t worker)
{
	const struct edges_job *j = arg;
	const size_t *n = j->ref->n,
		     end = (task + 1) * BATCH < j->edges ? (task + 1) * BATCH : j->edges;
	struct spot *spot = j->spot + worker * j->spots;
	struct spread *s = &j->part[task];

	*s = (struct spread){.edges = 0};
	if (ct_stopping(j->env))
		return;
	for (size_t k = task * BATCH; k < end; k++) {
		struct fit f = {.at = {j->edge[k] % n[0], j->edge[k] / n[0] % n[1],
					j->edge[k] / (n[0] * n[1])}};
		size_t spots;

		fit_normal(j, &f);
		spots = cylinder(spot, j, &f);
		if (!fit_step(j, &f, spot, spots) || !fit_place(j, &f, spot, spots, 0) ||
			!fit_place(j, &f, spot, spots, f.place))
			continue;
		s->edges++;
		for (size_t i = 0; i < spots; i++) {
			const double place = ((spot[i].d - f.place) / j->voxel + REACH) * PER_VOXEL;
			const double bin = floor(place);
			const size_t at = spot[i].index;

			if (!(bin >= 0 && bin < BINS))
				continue;
			s->count[(size_t)bin] += 1;
			s->at[(size_t)bin] += place;
			s->sum[0][(size_t)bin] += ((double)j->ref->data[at] - f.low) / f.step;
			s->sum[1][(size_t)bin] += ((double)j->test->data[at] - f.low) / f.step;
		}
	}
}

/* Where the line through bins b and b + 1 crosses `level`, in bins. */
static double crossing(const double *e, size_t b, double level)
{
	return (double)b + (level - e[b]) / (e[b + 1] - e[b]);
}

/* |sum_b (e[b+1] - e[b]) exp(-2 pi i f b width)|, f in cycles per mm. */
static double transfer(const double *e, size_t n, double width, double f)
{
	double re = 0, im = 0, x = M_PI * f * width, sinc = x > 0 ? sin(x) / x : 1;

	for (size_t b = 0; b + 1 < n; b++) {
		re += (e[b + 1] - e[b]) * cos(2 * M_PI * f * width * (double)b);
		im += (e[b + 1] - e[b]) * sin(2 * M_PI * f * width * (double)b);
	}
	return sqrt(re * re + im * im) / (sinc * sinc);
}

/* First frequency where the transfer falls below `level`; up to a quarter cycle a bin. */
static double falls_below(const double *e, size_t n, double width, double level)
{
	enum { STEPS = 500 };
	double last = transfer(e, n, width, 0), whole = last;

	for (int k = 1; k <= STEPS; k++) {
		double step = 0.25 / width / STEPS, m = transfer(e, n, width, k * step);

		if (m < level * whole)
			return step * (k - (level * whole - m) / (last - m));
		last = m;
	}
	return (double)NAN;
}

void ct_edge_spread(struct ct_edge_figures *f, const double *spread, size_t n, double width)
{
	double low = 0, high = 0, at[2];
	size_t b = n / 2;

	for (size_t k = 0; k < n / 4; k++) {
		low += spread[k] / (double)(n / 4);
		high += spread[n - 1 - k] / (double)(n / 4);
	}
	*f = (struct ct_edge_figures){(double)NAN, (double)NAN, (double)NAN};
	if (!(high > low))
		return;
	while (b + 2 < n && spread[b] <= low + 0.1 * (high - low))
		b++;
	while (b > 0 && spread[b] > low + 0.1 * (high - low))
		b--;
	at[0] = crossing(spread, b, low + 0.1 * (high - low));
	while (b + 2 < n && spread[b + 1] < low + 0.9 * (high - low))
		b++;
	at[1] = crossing(spread, b, low + 0.9 * (high - low));
	*f = (struct ct_edge_figures){(at[1] - at[0]) * width, falls_below(spread, n, width, 0.5),
		falls_below(spread, n, width, 0.1)};
}

/* y at the middles of all bins, of its n values at the places x: cubic, with the slopes of
 * neighbours. Where a plane lies along the voxels, most bins are empty. */
static void fill(double e[BINS], const double *x, const double *y, size_t n)
{
	size_t i = 0;

	for (size_t b = 0; b < BINS; b++) {
		const double c = (double)b + 0.5;

		while (i + 2 < n && x[i + 1] <= c)
			i++;
		if (n < 2 || c <= x[0] || c >= x[n - 1]) {
			e[b] = c <= x[0] ? y[0] : y[n - 1];
			continue;
		}
		const size_t before = i > 0 ? i - 1 : 0, after = i + 2 < n ? i + 2 : n - 1;
		const double h = x[i + 1] - x[i], t = (c - x[i]) / h, u = 1 - t;
		const double s0 = (y[i + 1] - y[before]) / (x[i + 1] - x[before]);
		const double s1 = (y[after] - y[i]) / (x[after] - x[i]);

		e[b] = u * u * (1 + 2 * t) * y[i] + t * t * (3 - 2 * t) * y[i + 1] +
		       h * t * u * (u * s0 - t * s1);
	}
}

/* Add the batches up in their order and make the figures. */
static void conclude(struct ct_edges *o, const struct edges_job *j, size_t batches)
{
	struct spread all = {.edges = 0};
	double(*e)[BINS] = o->spread, x[BINS], y[2][BINS];
	size_t n = 0;

	for (size_t t = 0; t < batches; t++) {
		all.edges += j->part[t].edges;
		for (size_t b = 0; b < BINS; b++) {
			all.count[b] += j->part[t].count[b];
			all.at[b] += j->part[t].at[b];
			all.sum[0][b] += j->part[t].sum[0][b];
			all.sum[1][b] += j->part[t].sum[1][b];
		}
	}
	o->count = all.edges;
	if (all.edges < LEAST_EDGES)
		return;
	for (size_t b = 0; b < BINS; b++)
		if (all.count[b] > 0) {
			x[n] = all.at[b] / all.count[b];
			for (int k = 0; k < 2; k++)
				y[k][n] = all.sum[k][b] / all.count[b];
			n++;
		}
	for (int k = 0; k < 2; k++)
		fill(e[k], x, y[k], n);
	ct_edge_spread(&o->ref, e[0], BINS, o->width);
	ct_edge_spread(&o->test, e[1], BINS, o->width);
}

/* The candidates, counted, then written down. */
static int find(struct edges_job *j, struct ct_err *e)
{
	size_t slices = j->ref->n[2] - 2 * j->margin[2], total = 0;

	if (ct_alloc0(&j->found, slices, sizeof *j->found, e))
		return -1;
	ct_par_for(j->env->par, slices, search, j);
	for (size_t k = 0; k < slices; k++) {
		size_t n = j->found[k];

		j->found[k] = total;
		total += n;
	}
	j->stride = (total + MOST_EDGES - 1) / MOST_EDGES;
	j->edges = total ? (total + j->stride - 1) / j->stride : 0;
	if (ct_check_stop(j->env, e) || ct_alloc(&j->edge, j->edges, sizeof *j->edge, e))
		return -1;
	if (total > 0)
		ct_par_for(j->env->par, slices, search, j);
	return ct_check_stop(j->env, e);
}

int ct_edges(struct ct_edges *o, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_edge_figures none = {(double)NAN, (double)NAN, (double)NAN};
	struct edges_job j = {.ref = ref, .test = test, .mask = mask, .env = env, .spots = 1};
	size_t batches;
	int rc = -1;

	*o = (struct ct_edges){.ref = none, .test = none};
	ct_vol_spacing(ref, j.mm);
	j.voxel = (j.mm[0] + j.mm[1] + j.mm[2]) / 3;
	o->width = j.voxel / PER_VOXEL;
	for (int a = 0; a < 3; a++) {
		j.margin[a] = (size_t)(hypot(REACH, LATERAL) * j.voxel / j.mm[a]) + 1;
		if (ref->n[a] <= 2 * j.margin[a])
			return ct_fail(e, CT_EGEOM,
				"%zu voxels along axis %d are too few for edges, "
				"which need %zu",
				ref->n[a], a, 2 * j.margin[a] + 1);
		j.spots *= 2 * j.margin[a] + 1;
	}
	if (find(&j, e))
		goto out;
	batches = (j.edges + BATCH - 1) / BATCH;
	if (ct_alloc(&j.part, batches, sizeof *j.part, e) ||
		ct_alloc(&j.spot, j.spots * ct_par_threads(env->par), sizeof *j.spot, e))
		goto out;
	ct_par_for(env->par, batches, batch, &j);
	if (ct_check_stop(env, e))
		goto out;
	conclude(o, &j, batches);
	rc = 0;
out:
	free(j.found);
	free(j.edge);
	free(j.part);
	free(j.spot);
	return rc;
}
