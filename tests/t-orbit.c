/* t-orbit.c: what filtered back-projection finds out about a scan: an orbit of any place, tilt and
 * direction comes back as it was made; where a scan stops being one; weights by their formula.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/fdk.h"
#include "tap.h"

#include <stdbool.h>
#include <string.h>

enum { VIEWS = 100 };

/* A scan made of numbers; angles in degrees, offset of the detector in mm along u and v. */
struct orbit {
	enum ct_beam beam;
	size_t views, w, h;
	double angle[VIEWS];
	double frame[3][3]; /* two axes of the plane, and the axis */
	double centre[3], radius, distance, pitch[2], offset[2], sign;
};

static struct orbit orbit_of(enum ct_beam beam, size_t views, double arc)
{
	struct orbit o = {.beam = beam,
		.views = views,
		.w = 12,
		.h = beam == CT_FAN ? 1 : 5,
		.frame = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}},
		.centre = {30, -20, 11},
		.radius = 400,
		.distance = 700,
		.pitch = {3, 2},
		.sign = 1};

	for (size_t k = 0; k < views; k++)
		o.angle[k] = 25 + arc * (double)k / (double)views;
	return o;
}

static struct ct_stack stack_of(const struct orbit *o)
{
	struct ct_stack s = {0};

	must(ct_stack_alloc(&s, o->views, o->h, o->w, &err));
	s.beam = o->beam;
	for (size_t k = 0; k < o->views; k++) {
		struct ct_view *v = &s.view[k];
		double a = o->angle[k] * M_PI / 180;

		for (int r = 0; r < 3; r++) {
			double out = cos(a) * o->frame[0][r] + sin(a) * o->frame[1][r];
			double u = o->sign * (cos(a) * o->frame[1][r] - sin(a) * o->frame[0][r]);

			v->source[r] = o->centre[r] + o->radius * out;
			v->u[r] = o->pitch[0] * u;
			v->v[r] = -o->pitch[1] * o->frame[2][r];
			v->centre[r] = v->source[r] - o->distance * out + o->offset[0] * u -
				       o->offset[1] * o->frame[2][r];
		}
	}
	return s;
}

/* 0, or the code of the refusal; o is to be freed if 0. */
static int study(struct ct_fdk_weights *w, const struct orbit *o, double radius, bool parker)
{
	struct ct_stack s = stack_of(o);
	int rc = ct_fdk_weights_alloc(w, &s, radius, parker, &err);

	ct_stack_free(&s);
	return rc ? (int)err.code : 0;
}

static double apart3(const double a[3], const double b[3])
{
	return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* Uneven angles, out of order, two of them the same. */
static void t_found(enum ct_beam beam, double sign)
{
	const double gap[6] = {10, 14, 8, 12, 9, 7};
	struct orbit o = orbit_of(beam, 36, 0);
	struct ct_fdk_weights w = {0};
	double worst[6] = {0}, at = 33, step[36], low = beam == CT_PARALLEL ? 0 : 0.75;

	o.sign = sign;
	o.offset[0] = -2;
	o.offset[1] = 1.5;
	for (size_t k = 0; k < 36; k++) { /* the next is at place (k + 1) * 5 */
		double next = gap[k % 6] + (k == 20 ? -8 : k == 19 ? 8 : 0);

		o.angle[k * 5 % 36] = at;
		step[k * 5 % 36] = (next + gap[(k + 5) % 6] + (k == 21 ? -8 : k == 20 ? 8 : 0)) / 2;
		at += next * (beam == CT_PARALLEL ? 0.5 : 1);
	}
	if (beam == CT_PARALLEL) /* half a turn is all */
		for (size_t k = 0; k < 36; k++)
			step[k] /= 2;
	must(study(&w, &o, 10, false));
	worst[0] = apart3(w.axis, o.frame[2]);
	for (size_t k = 0; k < 36; k++) {
		const struct ct_fdk_weights_view *v = &w.view[k];
		double turn = (v->angle - w.view[0].angle) * 180 / M_PI - o.angle[k] + o.angle[0];

		worst[1] = fmax(worst[1], fabs(remainder(turn, 360)));
		worst[1] = v->angle >= 0 && v->angle < 2 * M_PI ? worst[1] : HUGE_VAL;
		worst[2] = fmax(worst[2], fabs(v->step * 180 / M_PI - step[k]));
		worst[3] = fmax(worst[3], fabs(v->distance - 700));
		worst[4] = fmax(worst[4], hypot(v->pitch[0] - 3, v->pitch[1] - 2));
		worst[5] = fmax(worst[5], hypot(v->foot[0] - 5.5 - 2.0 / 3,
						  v->foot[1] - (double)(w.h - 1) / 2 + low));
	}
	OK(worst[0] < 1e-12 && w.sign == sign, "%s: the axis, and which way",
		CT_WORD(CT_BEAM_LIST, beam));
	NEAR(worst[1], 0, 1e-9, "angles");
	NEAR(worst[2], 0, 1e-9, "arcs of uneven angles");
	OK(worst[3] < 1e-9 && worst[4] < 1e-12 && worst[5] < 1e-9, "distance, pitch, foot");
	if (beam == CT_PARALLEL) { /* it is an axis: its height is that of the detectors */
		double d[3], off = 0, along = 0;

		for (int r = 0; r < 3; r++) {
			d[r] = w.centre[r] - o.centre[r];
			along += d[r] * o.frame[2][r];
		}
		for (int r = 0; r < 3; r++)
			off = fmax(off, fabs(d[r] - along * o.frame[2][r]));
		NEAR(off, 0, 1e-9, "the axis of parallel views");
		NEAR(along, -1.5, 1e-9, "and a height");
	} else {
		NEAR(apart3(w.centre, o.centre), 0, 1e-8, "centre");
		NEAR(w.radius, 400, 1e-8, "radius");
	}
	OK(w.closed && fabs(w.arc - (beam == CT_PARALLEL ? M_PI : 2 * M_PI)) < 1e-12, "closed");
	ct_fdk_weights_free(&w);
}

/* 40 views, a gap of so many steps before the first: still closed, or open? */
static void t_gap(double gap, bool closed)
{
	struct orbit o = orbit_of(CT_CONE, 40, 0);
	struct ct_fdk_weights w = {0};
	double step = 360 / (39 + gap), sum = 0, ends;

	for (size_t k = 0; k < 40; k++)
		o.angle[k] = step * ((double)k + (k < 20 ? 39 + gap : 0)) - 100;
	must(study(&w, &o, 10, false));
	for (size_t k = 0; k < 40; k++)
		sum += w.view[k].step;
	ends = (closed ? (gap + 1) / 2 : 1) * step * M_PI / 180;
	OK(w.closed == closed, "a gap of %g steps is %s", gap, closed ? "closed" : "open");
	NEAR(w.arc, closed ? 2 * M_PI : step * 40 * M_PI / 180, 1e-9, "its arc");
	NEAR(sum, w.arc, 1e-9, "is that of all views");
	OK(fabs(w.view[39].step - ends) < 1e-9 && fabs(w.view[0].step - ends) < 1e-9,
		"the ends' too");
	NEAR(remainder(w.first - w.view[0].angle, 2 * M_PI), -step * M_PI / 360, 1e-12,
		"it begins half a step before the first");
	ct_fdk_weights_free(&w);
}

/* One view of 100 is changed by `much` in a way: accepted below a limit, refused above. */
static void change(struct ct_view *v, const struct orbit *o, int way, double much)
{
	double a = o->angle[40] * M_PI / 180;

	for (int r = 0; r < 3; r++) {
		double out = cos(a) * o->frame[0][r] + sin(a) * o->frame[1][r], n = o->frame[2][r];
		double u = v->u[r] / o->pitch[0];

		if (way == 0) { /* nearer */
			v->source[r] -= much * 400 * out;
			v->centre[r] -= much * 400 * out;
		} else if (way == 1) { /* higher */
			v->source[r] += much * 400 * n;
			v->centre[r] += much * 400 * n;
		} else if (way == 5) { /* the source alone */
			v->source[r] += much * 400 * n;
		} else if (way == 2) {
			v->v[r] = -o->pitch[1] * (cos(much) * n + sin(much) * u);
		} else if (way == 3) {
			v->u[r] = o->pitch[0] * (cos(much) * u + sin(much) * n);
		} else {
			v->u[r] = o->pitch[0] * (cos(much) * u + sin(much) * out);
		}
	}
}

static void t_limits(void)
{
	static const struct {
		const char *name, *words;
		double limit;
	} way[] = {{"a radius", "mm from the axis", 0.005}, {"a height", "off the plane", 0.005},
		{"columns that lean", "columns lean", 0.01},
		{"rows that lean", "does not stand upright", 0.01},
		{"rows that turn", "does not stand upright", 0.01}};
	struct orbit o = orbit_of(CT_CONE, VIEWS, 360);

	for (int i = 0; i < 5; i++)
		for (int over = -1; over <= 1; over++)
			for (int sign = -1; sign <= 1; sign += 2) {
				double much = sign * (over > 0 ? 1.04 : 0.96) * way[i].limit;
				struct ct_stack s = stack_of(&o);
				struct ct_fdk_weights w = {0};
				int rc;

				change(&s.view[40], &o, i, much);
				rc = ct_fdk_weights_alloc(&w, &s, 10, false, &err);
				OK(over > 0 ? rc == -1 && err.code == CT_EGEOM &&
							strstr(err.msg, "view 40") &&
							strstr(err.msg, way[i].words)
					    : rc == 0,
					"%s off by %.4g is %s", way[i].name, much,
					over > 0 ? "refused" : "taken");
				ct_fdk_weights_free(&w);
				ct_stack_free(&s);
			}
}

/* The number of a message that is nearest to what it should tell, either sign. */
static void says(const struct orbit *o, int way, double much, double want)
{
	struct ct_stack s = stack_of(o);
	struct ct_fdk_weights w = {0};
	double got = (double)NAN;
	const char *at;

	change(&s.view[40], o, way, much);
	at = ct_fdk_weights_alloc(&w, &s, 10, false, &err) ? strpbrk(err.msg, "(:") : NULL;
	while (at && (at = strpbrk(at, "0123456789"))) {
		char *end;
		double x = strtod(at, &end);

		got = fabs(got - want) < fabs(x - want) ? got : x;
		at = end;
	}
	NEAR(got, want, 0.03 * want, err.msg);
	ct_fdk_weights_free(&w);
	ct_stack_free(&s);
}

/* The first view and the last are looked at, too. */
static void t_ends(void)
{
	struct orbit o = orbit_of(CT_CONE, VIEWS, 360);

	for (size_t k = 0; k < VIEWS; k += VIEWS - 1) {
		struct ct_stack s = stack_of(&o);
		struct ct_fdk_weights w = {0};
		char words[20];

		snprintf(words, sizeof words, "view %zu", k);
		change(&s.view[k], &o, 2, 0.02);
		OK(ct_fdk_weights_alloc(&w, &s, 10, false, &err) == -1 && strstr(err.msg, words),
			"columns that lean in %s are refused", words);
		ct_fdk_weights_free(&w);
		ct_stack_free(&s);
	}
}

static void t_messages(void)
{
	struct orbit o = orbit_of(CT_CONE, VIEWS, 360), flat = orbit_of(CT_PARALLEL, VIEWS, 360);

	says(&flat, 5, 0.5, 15.95); /* atan(200 / 700) */
	says(&o, 0, 0.1, 361);
	says(&o, 1, 0.1, 40);
	says(&o, 2, 0.2, 11.46);
	says(&o, 3, 0.2, 11.46);
	says(&o, 4, 0.2, 11.46);
}

static void refused(const struct orbit *o, double radius, bool parker, const char *words)
{
	struct ct_fdk_weights w = {0};
	int code = study(&w, o, radius, parker);

	OK(code == CT_EGEOM && strstr(err.msg, words), "refused: %s", code ? err.msg : words);
	OK(!w.view, "and nothing is left");
	ct_fdk_weights_free(&w);
}

static void taken(const struct orbit *o, double radius, bool parker, double delta)
{
	struct ct_fdk_weights w = {0};

	OK(study(&w, o, radius, parker) == 0, "just enough");
	OK(w.redundancy == (parker ? CT_RAYS_PARKER : CT_RAYS_EVEN), "weighed as told");
	NEAR(w.delta * 180 / M_PI, delta, 1e-9, "the excess");
	ct_fdk_weights_free(&w);
}

/* Arcs that are too short. Half the fan of a detector of 12 pixels of 3 mm off by 2 is atan(20 /
 * 700), 1.637 degrees. */
static void t_arcs(void)
{
	struct orbit o = orbit_of(CT_CONE, 30, 0);

	for (size_t k = 0; k < 30; k++) /* three in a place are no circle */
		o.angle[k] = k % 2 ? 70 : 250;
	refused(&o, 10, false, "on no circle");
	o = orbit_of(CT_CONE, 2, 360);
	refused(&o, 10, false, "2 views are on no circle");
	o = orbit_of(CT_CONE, 30, 173.5);
	refused(&o, 10, false, "the views span 173.5 degrees");
	o = orbit_of(CT_CONE, 30, 174.8);
	taken(&o, 10, false, 0);
	o = orbit_of(CT_PARALLEL, 30, 150);
	refused(&o, 10, false, "the views span 150 degrees of the 180");
	o = orbit_of(CT_PARALLEL, 30, 0);
	refused(&o, 10, false, "the views span 0 degrees of the 180");
	o = orbit_of(CT_PARALLEL, 30, 180);
	taken(&o, 10, false, 0);
	o = orbit_of(CT_CONE, 90, 182.2);
	o.offset[0] = 2;
	refused(&o, HUGE_VAL, true,
		"need 183.3 degrees (180 and the fan of 3.273), and the views span 182.2");
	for (size_t k = 0; k < 90; k++)
		o.angle[k] = 182.3 * (double)k / 90;
	taken(&o, HUGE_VAL, true, 1.15);
	o.offset[0] = -2;
	taken(&o, HUGE_VAL, true, 1.15);
	for (size_t k = 0; k < 90; k++)
		o.angle[k] = 181.0 * (double)k / 90;
	refused(&o, 10, true, "fan of 2.865"); /* asin(10 / 400), 1.4325 degrees */
	for (size_t k = 0; k < 90; k++)
		o.angle[k] = 182.0 * (double)k / 90;
	taken(&o, 10, true, 1);
}

static void t_backwards(void)
{
	struct orbit o = orbit_of(CT_CONE, 30, 360);
	struct ct_stack s = stack_of(&o);
	struct ct_fdk_weights w = {0};

	for (int r = 0; r < 3; r++)
		s.view[7].u[r] *= -1;
	OK(ct_fdk_weights_alloc(&w, &s, 10, false, &err) && strstr(err.msg, "view 7") &&
			strstr(err.msg, "rows run against"),
		"refused: %s", err.msg);
	ct_stack_free(&s);
}

static void shifted(enum ct_beam beam, double pixels, double radius, enum ct_redundancy want,
	double overlap, size_t before, size_t after)
{
	struct orbit o = orbit_of(beam, 60, 360);
	struct ct_fdk_weights w = {0};

	o.offset[0] = -3 * pixels;
	must(study(&w, &o, radius, false));
	OK(w.redundancy == want && w.widen[0] == before && w.widen[1] == after,
		"%s, off by %g pixels, radius %g: %zu and %zu columns more",
		CT_WORD(CT_BEAM_LIST, beam), pixels, radius, w.widen[0], w.widen[1]);
	NEAR(w.overlap, overlap, 1e-9, "overlap");
	ct_fdk_weights_free(&w);
}

/* 18 mm on each side of the middle. A detector counts as one to the side if the cylinder reaches
 * beyond it, it is off by more than a pixel, and the middle is on it. */
static void t_offset(void)
{
	double r = 400 * sin(atan(13.8 / 700));

	shifted(CT_CONE, 0.9, 100, CT_RAYS_EVEN, 0, 0, 0);
	shifted(CT_CONE, 1.1, 100, CT_RAYS_OFFSET, 14.7, 0, 3);
	shifted(CT_CONE, -1.1, 100, CT_RAYS_OFFSET, 14.7, 3, 0);
	shifted(CT_CONE, 1.4, r * 1.001, CT_RAYS_OFFSET, 13.8, 0, 3);
	shifted(CT_CONE, -1.4, r * 0.999, CT_RAYS_EVEN, 0, 0, 0);
	shifted(CT_CONE, -1.4, 400.1, CT_RAYS_OFFSET, 13.8, 3, 0);
	shifted(CT_PARALLEL, 1.4, 13.9, CT_RAYS_OFFSET, 13.8, 0, 3);
	shifted(CT_PARALLEL, -1.4, 13.7, CT_RAYS_EVEN, 0, 0, 0);
	shifted(CT_CONE, 5.9, 100, CT_RAYS_OFFSET, 0.3, 0, 12);
	shifted(CT_CONE, -6.1, 100, CT_RAYS_EVEN, 0, 0, 0);
}

/* The share of a ray x mm from the middle, the far end of the detector on the side `side`. */
static double share(const struct ct_fdk_weights *w, double x, double side)
{
	double at = side * x / w->overlap;

	if (w->beam != CT_PARALLEL)
		at = side * atan(x / 700) / atan(w->overlap / 700);
	if (w->redundancy == CT_RAYS_OFFSET)
		return at < -1 ? 0 : at > 1 ? 1 : 0.5 + 0.5 * sin(M_PI / 2 * at);
	return w->beam == CT_PARALLEL ? 1 : w->closed ? 0.5 : M_PI / w->arc;
}

static void t_weights(enum ct_beam beam, double arc, double pixels, bool plain)
{
	struct orbit o = orbit_of(beam, 50, arc);
	struct ct_fdk_weights w = {0};
	float got[12 * 5];
	double worst = 0, pitch = beam == CT_PARALLEL ? 3 : 3 * 400.0 / 700;

	o.offset[0] = -3 * pixels;
	o.offset[1] = 5;
	must(study(&w, &o, 390, false));
	ct_fdk_weights_of(&w, 7, plain, got);
	for (size_t i = 0; i < 12 * o.h; i++) {
		double x = 3 * ((double)(i % 12) - 5.5 - pixels);
		double y = 2 * ((double)(i / 12) - (double)(o.h - 1) / 2) + 5;
		double cosine = beam == CT_PARALLEL ? 1 : 700 / sqrt(700 * 700 + x * x + y * y);
		double want = w.view[7].step * share(&w, x, pixels > 0 ? -1 : 1) * cosine;

		worst = fmax(worst, fabs((double)got[i] * (plain ? 1 : pitch) / want - 1));
	}
	OK(worst < 1e-5 && (w.redundancy == CT_RAYS_OFFSET) == (fabs(pixels) > 1),
		"%s over %g degrees, off by %g pixels: weights by their formula (%.2g)",
		CT_WORD(CT_BEAM_LIST, beam), arc, pixels, worst);
	ct_fdk_weights_free(&w);
}

/* 5 x 4 x 6 voxels along the axes of the world, about `middle`. */
static struct ct_vol grid_of(const double middle[3], double scale)
{
	static const double mm[3] = {1, 1.3, 0.8};
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[]){5, 4, 6}, &err));
	for (int a = 0; a < 3; a++) {
		v.affine[a][a] = scale * mm[a];
		v.affine[a][3] = middle[a] - scale * mm[a] * ((double)v.n[a] - 1) / 2;
	}
	return v;
}

static void corner(const struct ct_vol *v, unsigned k, double out, double x[3])
{
	for (int a = 0; a < 3; a++)
		x[a] = v->affine[a][3] +
		       v->affine[a][a] * (k >> a & 1 ? (double)v->n[a] - 1 + out : -out);
}

/* How far from the axis the grid reaches. */
static double reach(const struct ct_vol *v, const struct orbit *o)
{
	double most = 0;

	for (unsigned k = 0; k < 8; k++) {
		double x[3], in[2] = {0};

		corner(v, k, 0.5, x);
		for (int i = 0; i < 2; i++)
			for (int r = 0; r < 3; r++)
				in[i] += (x[r] - o->centre[r]) * o->frame[i][r];
		most = fmax(most, hypot(in[0], in[1]));
	}
	return most;
}

/* A detector that misses a part counts as one to the side: by the cylinder about the orbit's axis
 * that holds the grid, whichever corner of it is farthest. */
static void t_cylinder(void)
{
	struct orbit o = orbit_of(CT_PARALLEL, 20, 360);
	struct ct_stack s;
	size_t right = 0;

	o.offset[0] = 4.2; /* 13.8 mm are left */
	s = stack_of(&o);
	for (unsigned k = 0; k < 8; k++)
		for (int over = -1; over <= 1; over += 2) {
			double middle[3], scale = 2.2;
			struct ct_fdk f = {0};
			struct ct_vol v = {0};

			for (int i = 0; i < 40; i++) { /* it grows with the scale */
				for (int a = 0; a < 3; a++)
					middle[a] = o.centre[a] + (k >> a & 1 ? 1.5 : -1.5);
				ct_vol_free(&v);
				v = grid_of(middle, scale);
				scale *= (13.8 + 0.05 * over) / reach(&v, &o);
			}
			must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_HANN, 1, false, NULL, &err));
			right += (f.orbit.redundancy == CT_RAYS_OFFSET) == (over > 0);
			ct_fdk_free(&f);
			ct_vol_free(&v);
		}
	OK(right == 16, "the cylinder that holds a grid: %zu of 16", right);
	ct_stack_free(&s);
}

/* Column and row of a world point. */
static void seen_at(const struct ct_stack *s, size_t view, const double x[3], double at[2])
{
	const struct ct_view *v = &s->view[view];
	double u = hypot(hypot(v->u[0], v->u[1]), v->u[2]);
	double w = hypot(hypot(v->v[0], v->v[1]), v->v[2]), n[3], near = 0, all = 0;

	for (int r = 0; r < 3; r++) {
		int i = (r + 1) % 3, j = (r + 2) % 3;

		n[r] = v->u[i] * v->v[j] - v->u[j] * v->v[i];
		near += n[r] * (x[r] - v->source[r]);
		all += n[r] * (v->centre[r] - v->source[r]);
	}
	at[0] = ((double)s->w - 1) / 2;
	at[1] = ((double)s->h - 1) / 2;
	for (int r = 0; r < 3; r++) {
		double p = v->source[r] + all / near * (x[r] - v->source[r]) - v->centre[r];

		at[0] += p * v->u[r] / (u * u);
		at[1] += p * v->v[r] / (w * w);
	}
}

/* Views that do not see all voxel centres; a fan sees those within half a row of its plane. */
static void t_seen(void)
{
	struct orbit o = orbit_of(CT_CONE, 24, 360), fan = orbit_of(CT_FAN, 24, 360);
	struct ct_stack s, flat;
	size_t right = 0, some = 0, sliced = 0, refuse = 0;

	o.offset[0] = 1;
	o.h = 9;
	o.w = 8;
	s = stack_of(&o);
	fan.pitch[1] = 12;
	flat = stack_of(&fan);
	for (unsigned k = 0; k < 60; k++) {
		const double middle[3] = {o.centre[0] + 4 * cos(1.0 + k),
			o.centre[1] + 4 * cos(2.0 + 3 * k), o.centre[2] + 4 * cos(3.0 + 5 * k)};
		struct ct_vol v = grid_of(middle, 0.2 + 0.02 * k), w = grid_of(middle, 0.2);
		struct ct_fdk f = {0};
		size_t want = 0;
		bool out = false;
		int rc;

		for (size_t view = 0; view < 24; view++) {
			bool off = false;

			for (unsigned c = 0; c < 8; c++) {
				double x[3], at[2];

				corner(&v, c, 0, x);
				seen_at(&s, view, x, at);
				off |= at[0] < -0.5 || at[0] > 7.5 || at[1] < -0.5 || at[1] > 8.5;
				corner(&w, c, 0, x);
				seen_at(&flat, view, x, at);
				out |= fabs(at[1]) > 0.5;
			}
			want += off;
		}
		must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_HANN, 1, false, NULL, &err));
		right += ct_fdk_truncated(&f) == want;
		some += want > 0 && want < 24;
		ct_fdk_free(&f);
		rc = ct_fdk_alloc(&f, &w, &flat, CT_RAMP_HANN, 1, false, NULL, &err);
		sliced += (rc != 0) == out;
		refuse += out;
		ct_fdk_free(&f);
		ct_vol_free(&v);
		ct_vol_free(&w);
	}
	OK(right == 60 && some > 20, "views that miss voxels: %zu of 60 right, %zu some", right,
		some);
	OK(sliced == 60 && refuse > 10 && refuse < 50, "grids in a fan: %zu of 60, %zu refused",
		sliced, refuse);
	ct_stack_free(&s);
	ct_stack_free(&flat);
}

/* The finest pixel of any view counts, here 1.5 mm for 3 and for 2 mm voxels. */
static void t_finest(void)
{
	struct orbit o = orbit_of(CT_PARALLEL, 24, 360);
	struct ct_stack s = stack_of(&o);
	struct ct_vol v = grid_of(o.centre, 2);

	for (size_t k = 0; k < 25; k += 8) {
		struct ct_fdk f = {0};

		for (int r = 0; r < 3 && k < 24; r++)
			s.view[k == 16 ? 23 : k].u[r] /= 2;
		for (int r = 0; r < 3 && k == 24; r++)
			v.affine[r][r] *= 0.5;
		must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_HANN, 0, false, NULL, &err));
		NEAR(f.cutoff, k < 24 ? 1.5 / 1.6 : 1, 1e-9, "cutoff by the finest pixel");
		ct_fdk_free(&f);
		for (int r = 0; r < 3 && k < 24; r++)
			s.view[k == 16 ? 23 : k].u[r] *= 2;
	}
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* Circles of a hair and of kilometres. */
static void t_sizes(void)
{
	static const double times[] = {1e-6, 1e5};

	for (size_t k = 0; k < sizeof times / sizeof *times; k++) {
		struct orbit o = orbit_of(CT_CONE, 24, 360);
		struct ct_fdk_weights w = {0};
		struct ct_stack s;

		o.radius *= times[k];
		o.distance *= times[k];
		o.pitch[0] *= times[k];
		o.pitch[1] *= times[k];
		s = stack_of(&o);
		OK(ct_fdk_weights_alloc(&w, &s, 10 * times[k], false, &err) == 0 &&
				fabs(w.radius / o.radius - 1) < 1e-6,
			"a circle of %g mm", o.radius);
		ct_fdk_weights_free(&w);
		ct_stack_free(&s);
	}
}

/* What it takes, and how many views go together. */
static void t_bytes(void)
{
	struct orbit o = orbit_of(CT_CONE, 9, 360);
	struct ct_fdk f = {0};
	struct ct_stack s;
	struct ct_vol v;
	size_t one;

	o.w = 2000;
	o.h = 2010;
	o.pitch[0] = o.pitch[1] = 0.02;
	s = stack_of(&o);
	v = grid_of(o.centre, 1);
	must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_HANN, 1, false, NULL, &err));
	one = (2002 * f.back.pitch) * 4;
	OK(f.back.pitch % 16 == 0 && f.back.pitch > 16 + 2010 + 15 &&
			f.back.pitch <= 16 + 2010 + 31,
		"columns of %zu", f.back.pitch);
	OK(f.block == (128 << 20) / one && f.block == 8, "128 MiB: %zu views together", f.block);
	OK(ct_fdk_bytes(&f, 0) == f.block * one, "bytes of views");
	OK(ct_fdk_bytes(&f, 3) - ct_fdk_bytes(&f, 0) == 3 * (2000 * 2010 * 4 + 4096 * 32 * 8),
		"and of each thread");
	ct_fdk_free(&f);
	ct_stack_free(&s);
	ct_vol_free(&v);
}

int main(void)
{
	for (int beam = CT_CONE; beam <= CT_FAN; beam++) {
		t_found((enum ct_beam)beam, 1);
		t_found((enum ct_beam)beam, -1);
	}
	t_cylinder();
	t_seen();
	t_finest();
	t_sizes();
	t_bytes();
	t_gap(2.4, true);
	t_gap(2.6, false);
	t_limits();
	t_messages();
	t_ends();
	t_arcs();
	t_backwards();
	t_offset();
	t_weights(CT_CONE, 360, 0, false);
	t_weights(CT_CONE, 240, 0, true);
	t_weights(CT_FAN, 300, 0, false);
	t_weights(CT_PARALLEL, 180, 0, false);
	t_weights(CT_CONE, 360, 1.8, true);
	t_weights(CT_FAN, 360, -1.8, false);
	t_weights(CT_PARALLEL, 360, -1.8, false);
	return tap_done();
}
