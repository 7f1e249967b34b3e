/* slabs.c: see slabs.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/slabs.h"
#include "operator/crop.h"
#include "operator/svd.h"

#include <math.h>
#include <string.h>

/* What lies about a slab: so many fine voxels, and so many of the CT, of a blur that weakens no
 * frequency; one that weakens the weakest k times, REACH k of the CT. For what D D^T undoes of a
 * voxel falls by (k - 1)/(k + 1) from one to the next: doc/blocks.md has what is left. The prior
 * looks at cells that begin at whole numbers of UNIT. */
enum { ABOUT = 32, COARSE_ABOUT = 8, UNIT = 16 };
#define REACH 4
#define BANDS 4 /* above the Nyquist frequency, of which something may be left */

static double sinc(double f)
{
	return f == 0 ? 1 : sin(M_PI * f) / (M_PI * f);
}

/* What the blur of an axis leaves of f cycles a voxel of the CT. */
static double transfer(const struct ct_degrade *by, int axis, double f)
{
	const struct ct_slice_profile *p = &by->profile;
	const double x = by->factor[axis], sigma = by->sigma[axis] / x;
	double sum = 0;

	if (p->n == 0 || p->axis != axis)
		return exp(-2 * pow(M_PI * sigma * f, 2)) *
		       (by->decimate == CT_DECIMATE_MEAN && x > 1 ? sinc(f) : 1);
	for (size_t i = 0; i < p->n; i++)
		sum += p->w[i] * cos(2 * M_PI * f * (p->first + (double)i * p->step));
	return sum * sinc(f * p->step);
}

/* How much D weakens the weakest frequency of the CT, with what aliases to it. */
static double condition(const struct ct_degrade *by, int axis)
{
	const double most = by->factor[axis] / 2;
	double least = 1;

	for (double f = 0; f <= 0.5; f += 1. / 64) {
		double square = 0;

		for (int k = -BANDS; k <= BANDS; k++)
			if (fabs(f + k) <= most)
				square += pow(transfer(by, axis, f + k), 2);
		least = fmin(least, sqrt(square));
	}
	return 1 / least;
}

/* Coarse voxels of which slabs are made: whole UNITs of fine ones. */
static size_t unit_of(size_t factor)
{
	size_t n = 1;

	while (n * factor % UNIT != 0)
		n++;
	return n;
}

/* Coarse voxels about a slab of the axis; 0 if it cannot be cut. */
static size_t about_of(const struct ct_degrade *by, int axis)
{
	const double x = by->factor[axis];
	size_t unit;
	double k;

	if (x != floor(x) || x > UNIT ||
		(x > 1 && by->decimate == CT_DECIMATE_SINC &&
			(by->profile.n == 0 || by->profile.axis != axis)))
		return 0;
	k = condition(by, axis);
	unit = unit_of((size_t)x);
	return k < CT_SVD_LIMIT ? (size_t)ceil(fmax(fmax(ABOUT / x, COARSE_ABOUT), REACH * k) /
					       (double)unit) *
					  unit
				: 0;
}

/* The axis that is cut, or -1, and what is about a slab. */
static int find_axis(size_t *about, const struct ct_degrade *by, const size_t n[static 3])
{
	double most = 0;
	int axis = -1;

	*about = 0;
	for (int a = 2; a >= 0; a--) {
		const size_t its = about_of(by, a);

		if (its > 0 && (double)n[a] / (double)its > most) {
			most = (double)n[a] / (double)its;
			*about = its;
			axis = a;
		}
	}
	return axis;
}

int ct_slab_axis(const struct ct_degrade *by, const size_t n[static 3])
{
	size_t about;

	return find_axis(&about, by, n);
}

size_t ct_slab_most(const struct ct_degrade *by, const size_t n[static 3])
{
	const int axis = ct_slab_axis(by, n);
	const size_t unit = axis < 0 ? 1 : unit_of((size_t)by->factor[axis]);

	return axis < 0 ? 0 : (n[axis] + unit - 1) / unit;
}

/* Slab k of m of an axis of n coarse voxels. */
static struct ct_slab slab_of(int axis, size_t factor, size_t n, size_t about, size_t k, size_t m)
{
	const size_t unit = unit_of(factor), units = (n + unit - 1) / unit;
	struct ct_slab s = {.axis = axis, .factor = factor, .of = n};

	s.from = units * k / m * unit;
	s.to = k + 1 == m ? s.of : units * (k + 1) / m * unit;
	s.lo = s.from > about ? s.from - about : 0;
	s.hi = s.to + about < s.of ? s.to + about : s.of;
	return s;
}

struct ct_slab ct_slab_at(const struct ct_degrade *by, const size_t n[static 3], size_t k, size_t m)
{
	size_t about;
	const int found = find_axis(&about, by, n), axis = found < 0 ? 2 : found;

	return slab_of(axis, (size_t)by->factor[axis], n[axis], about, k, m);
}

size_t ct_slab_widest(const struct ct_degrade *by, const size_t n[static 3], size_t m)
{
	size_t about, widest = 0;
	const int found = find_axis(&about, by, n), axis = found < 0 ? 2 : found;

	for (size_t k = 0; k < m; k++) {
		const struct ct_slab s =
			slab_of(axis, (size_t)by->factor[axis], n[axis], about, k, m);

		widest = s.hi - s.lo > widest ? s.hi - s.lo : widest;
	}
	return widest;
}

int ct_slab_cut(struct ct_vol *part, const struct ct_vol *in, const struct ct_slab *s, bool fine,
	struct ct_err *e)
{
	const size_t times = fine ? s->factor : 1;
	ptrdiff_t start[3] = {0};
	size_t n[3];

	memcpy(n, in->n, sizeof n);
	n[s->axis] = (s->hi - s->lo) * times;
	start[s->axis] = (ptrdiff_t)(s->lo * times);
	return ct_crop(part, in, n, start, 0, e);
}

void ct_slab_put(struct ct_vol *to, const struct ct_vol *part, const struct ct_slab *s)
{
	size_t from[3] = {0}, n[3], at[3] = {0};

	memcpy(n, to->n, sizeof n);
	n[s->axis] = (s->to - s->from) * s->factor;
	from[s->axis] = (s->from - s->lo) * s->factor;
	at[s->axis] = s->from * s->factor;
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			memcpy(to->data + ((at[2] + k) * to->n[1] + at[1] + j) * to->n[0] + at[0],
				part->data +
					((from[2] + k) * part->n[1] + from[1] + j) * part->n[0] +
					from[0],
				n[0] * sizeof *to->data);
}
