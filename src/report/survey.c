/* survey.c: see report.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "report/report.h"
#include "core/vec3.h"

#include <math.h>
#include <string.h>

/* A NaN is passed over; it is the start. Without a call of fmin: of all voxels. */
static void widen(double range[2], double x)
{
	range[0] = isnan(range[0]) || x < range[0] ? x : range[0];
	range[1] = isnan(range[1]) || x > range[1] ? x : range[1];
}

void ct_survey_range_of(struct ct_survey_range *r, size_t n, const float *x)
{
	double sum = 0, square = 0, range[2] = {(double)NAN, (double)NAN}, shift = 0;
	size_t good = 0;

	*r = (struct ct_survey_range){0};
	for (size_t i = 0; i < n; i++) {
		double v = (double)x[i];

		if (!isfinite(v)) {
			r->nan += isnan(v) != 0;
			r->inf += isnan(v) == 0;
			continue;
		}
		if (!good++)
			shift = v; /* keeps the square small */
		widen(range, v);
		sum += v - shift;
		square += (v - shift) * (v - shift);
	}
	sum /= (double)good; /* NaN for none */
	square = square / (double)good - sum * sum;
	r->min = range[0];
	r->max = range[1];
	r->mean = sum + shift;
	r->sd = sqrt(square < 0 ? 0 : square);
}

/* Unit normal of a detector on the side away from the source, or the beam. */
static void principal(double d[3], const struct ct_stack *s, size_t k)
{
	const struct ct_view *w = &s->view[k];
	double along[3], norm;

	ct_vec3_minus(along, w->centre, w->source);
	ct_vec3_cross(d, w->u, w->v);
	if (s->beam == CT_PARALLEL)
		memcpy(d, along, sizeof along);
	norm = ct_vec3_dot(d, along) < 0 ? -ct_vec3_length(d) : ct_vec3_length(d);
	for (int a = 0; a < 3; a++)
		d[a] /= norm;
}

/* Least squares over x of the distances to the lines source + t d, the zero of
 * sum (I - d d^T)(x - source), by Cramer's rule; false if they are near parallel. */
static bool nearest_point(double x[3], const struct ct_stack *s)
{
	double m[3][3] = {{0}}, b[3] = {0}, dual[3][3], det;

	for (size_t k = 0; k < s->views; k++) {
		double d[3];

		principal(d, s, k);
		for (int i = 0; i < 3; i++)
			for (int j = 0; j < 3; j++) {
				double p = (i == j) - d[i] * d[j];

				m[i][j] += p;
				b[i] += p * s->view[k].source[j];
			}
	}
	det = ct_vec3_dual(dual, m[0], m[1], m[2]);
	if (!(fabs(det) > 1e-9 * pow((double)s->views, 3)))
		return false;
	for (int i = 0; i < 3; i++)
		x[i] = ct_vec3_dot(dual[i], b) / det;
	return true;
}

void ct_survey_of(struct ct_survey *r, const struct ct_stack *s)
{
	const struct ct_view *first = &s->view[0], *last = &s->view[s->views - 1];
	const double none = (double)NAN;

	*r = (struct ct_survey){
		.dso = {none, none}, .dsd = {none, none}, .offset = {{none, none}, {none, none}}};
	r->pitch[0] = ct_vec3_length(first->u);
	r->pitch[1] = ct_vec3_length(first->v);
	r->size[0] = r->pitch[0] * (double)s->w;
	r->size[1] = r->pitch[1] * (double)s->h;
	r->angle[0] = first->angle;
	r->angle[1] = last->angle;
	r->step = s->views > 1 ? (last->angle - first->angle) / (double)(s->views - 1) : 0;
	r->has_iso = s->beam != CT_PARALLEL && nearest_point(r->iso, s);
	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *w = &s->view[k];
		double d[3], away[3], to[3], along, off;

		principal(d, s, k);
		ct_vec3_minus(away, w->centre, w->source);
		widen(r->dsd, ct_vec3_dot(away, d));
		widen(r->offset[0], ct_vec3_dot(away, w->u) / ct_vec3_length(w->u));
		widen(r->offset[1], ct_vec3_dot(away, w->v) / ct_vec3_length(w->v));
		if (r->has_iso) {
			ct_vec3_minus(to, r->iso, w->source);
			along = ct_vec3_dot(to, d);
			off = ct_vec3_dot(to, to) - along * along;
			widen(r->dso, along);
			r->miss = fmax(r->miss, sqrt(fmax(off, 0)));
		}
	}
}

static bool finite_gauss(const struct ct_gauss *g, size_t i)
{
	float sum = 0;

	for (size_t k = 0; k < CT_GAUSS_COLUMNS; k++)
		sum += g->column[k][i];
	return isfinite(sum);
}

void ct_survey_gauss_of(struct ct_survey_gauss *r, const struct ct_gauss *g)
{
	const double none = (double)NAN;
	double logs = 0;
	size_t good = 0;

	*r = (struct ct_survey_gauss){.sigma = {none, none},
		.raw = {none, none},
		.lo = {none, none, none},
		.hi = {none, none, none}};
	for (size_t i = 0; i < g->n; i++) {
		if (!finite_gauss(g, i)) {
			r->bad++;
			continue;
		}
		good++;
		r->positive += g->raw[i] > 0 || g->activation == CT_SOFTPLUS;
		r->negative +=
			g->raw[i] < 0 && g->activation != CT_SOFTPLUS && g->activation != CT_RELU;
		widen(r->raw, (double)g->raw[i]);
		for (int a = 0; a < 3; a++) {
			widen(r->sigma, exp((double)g->scale[a][i]));
			logs += (double)g->scale[a][i];
			r->lo[a] = fmin(r->lo[a], (double)g->pos[a][i]);
			r->hi[a] = fmax(r->hi[a], (double)g->pos[a][i]);
		}
	}
	r->mean_sigma = exp(logs / (3 * (double)good)); /* NaN for none */
}

void ct_survey_orientation(char code[4], const double affine[3][4])
{
	static const char plus[] = "RAS", minus[] = "LPI";
	bool used[3] = {false};

	for (int j = 0; j < 3; j++) {
		int best = 0;

		for (int a = 1; a < 3; a++)
			if (fabs(affine[a][j]) > fabs(affine[best][j]))
				best = a;
		code[j] = used[best] ? '?' : affine[best][j] > 0 ? plus[best] : minus[best];
		used[best] = true;
	}
	code[3] = '\0';
}
