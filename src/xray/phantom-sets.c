/* phantom-sets.c: which shapes make which phantom; see phantom.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "xray/phantom.h"

#include <math.h>
#include <string.h>

/* The list under construction; positions and sizes in units of half the smallest extent. */
struct set {
	struct ct_shape *shape;
	size_t n;
	double unit;
	uint64_t seed, draws;
};

/* `degrees` turns the shape about world z, counter-clockwise. */
static struct ct_shape *add(struct set *s, enum ct_shape_kind kind, const double centre[3],
	const double half[3], double degrees, double density)
{
	struct ct_shape *p = &s->shape[s->n++];
	double a = degrees * 0.017453292519943295, sa = sin(a), ca = cos(a);

	*p = (struct ct_shape){
		.kind = kind, .axis = {{ca, sa, 0}, {-sa, ca, 0}, {0, 0, 1}}, .density = density};
	for (int r = 0; r < 3; r++) {
		p->centre[r] = centre[r] * s->unit;
		p->half[r] = half[r] * s->unit;
	}
	return p;
}

/* Uniform in [lo, hi]. */
static double draw(struct set *s, double lo, double hi)
{
	return lo + (hi - lo) * ct_rng_uniform(s->seed, 0x7068616e, s->draws++);
}

/* x varied by a factor within 1 +- share. */
static double vary(struct set *s, double x, double share)
{
	return x * draw(s, 1 - share, 1 + share);
}

/* Turn a shape about its centre by a random rotation (a uniform unit quaternion, Shoemake). */
static void tumble(struct set *s, struct ct_shape *p)
{
	double u = draw(s, 0, 1), a = draw(s, 0, 6.283185307179586),
	       b = draw(s, 0, 6.283185307179586);
	double x = sqrt(1 - u) * sin(a), y = sqrt(1 - u) * cos(a), z = sqrt(u) * sin(b),
	       w = sqrt(u) * cos(b);
	const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
		{2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
		{2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			p->axis[i][j] = r[i][j];
}

/* Vessels and nodules inside a lung of centre c and half lengths h. */
static void lung_content(struct set *s, const double c[3], const double h[3])
{
	for (int i = 0; i < 10; i++) {
		double at[3], size[3];

		for (int a = 0; a < 3; a++)
			at[a] = c[a] + h[a] * draw(s, -0.42, 0.42);
		size[0] = draw(s, 0.012, 0.035);
		size[1] = size[0] * draw(s, 0.7, 1.3);
		size[2] = size[0] * (i < 6 ? draw(s, 2.0, 4.0) : 1);
		tumble(s, add(s, CT_ELLIPSOID, at, size, 0, draw(s, 0.10, 0.20)));
	}
}

/* Densities as of the window -1024:3071: soft tissue 0.26, lung 0.04, bone 0.5. Negative shapes lie
 * within the body and clear of one another, so the sum stays within [0, 1]. */
static void chest(struct set *s)
{
	const double body[3] = {vary(s, 0.86, 0.05), vary(s, 0.62, 0.05), 0.96};
	const double front = body[1] / 0.62;
	double heart[3], turn;

	add(s, CT_ELLIPSOID, (const double[3]){0}, body, 0, 0.26);
	for (int side = -1; side <= 1; side += 2) {
		double c[3] = {side * vary(s, 0.40, 0.04), 0.02 * front, vary(s, 0.05, 0.5)};
		double h[3] = {vary(s, 0.25, 0.06), vary(s, 0.36, 0.06), vary(s, 0.56, 0.06)};

		add(s, CT_ELLIPSOID, c, h, 0, -draw(s, 0.205, 0.22));
		lung_content(s, c, h);
	}
	/* drawn one after the other: arguments are in an order of the compiler's */
	turn = draw(s, 20, 50);
	for (int a = 0; a < 3; a++)
		heart[a] = vary(s, a == 0 ? 0.17 : a == 1 ? 0.20 : 0.26, 0.1);
	add(s, CT_ELLIPSOID, (const double[3]){-0.12, 0.16 * front, -0.12}, heart, turn, 0.012);
	add(s, CT_CYLINDER, (const double[3]){0, -0.36 * front, 0},
		(const double[3]){vary(s, 0.075, 0.1), vary(s, 0.07, 0.1), 0.62}, 0, 0.14);
	add(s, CT_CYLINDER, (const double[3]){0, -0.36 * front, 0},
		(const double[3]){0.028, 0.024, 0.6}, 0, -0.1);
	add(s, CT_BOX, (const double[3]){0, 0.47 * front, 0.1}, (const double[3]){0.07, 0.022, 0.3},
		0, 0.13);
	for (int i = 0; i < 10; i++) { /* ribs: short rods along the wall */
		int side = i % 2 ? 1 : -1;
		double z = -0.5 + 0.22 * (i / 2.0), r = sqrt(1 - z * z);
		double density, y;

		turn = side * draw(s, 10, 40) + 90;
		density = draw(s, 0.18, 0.3);
		y = draw(s, -0.2, 0.2) * r;
		add(s, CT_ELLIPSOID, (const double[3]){side * 0.80 * body[0] * r, y, z},
			(const double[3]){0.13, 0.026, 0.035}, turn, density);
	}
}

/* Eight shells in the corners of the grid, clear of one another, turned at random. In each, which
 * may be as full as soft tissue or as empty as a lung, are three solids, smaller and fainter. */
static void shells(struct set *s)
{
	for (int i = 0; i < 8; i++) {
		const double c[3] = {i % 2 - 0.5, i / 2 % 2 - 0.5, i / 4 - 0.5};
		const double wall = exp(draw(s, log(0.02), log(0.12)));
		const double density = draw(s, 0.25, 0.9);
		const double inside = draw(s, 0, 1) < 0.7 ? draw(s, 0.2, 0.28) : draw(s, 0, 0.25);
		double half[3], in[3], axis[3][3];
		struct ct_shape *p;

		for (int a = 0; a < 3; a++)
			half[a] = draw(s, 0.25, 0.48);
		p = add(s, CT_ELLIPSOID, c, half, 0, density);
		tumble(s, p);
		memcpy(axis, p->axis, sizeof axis);
		for (int a = 0; a < 3; a++)
			in[a] = half[a] - wall;
		p = add(s, CT_ELLIPSOID, c, in, 0, inside - density);
		memcpy(p->axis, axis, sizeof axis);
		for (int k = CT_ELLIPSOID; k <= CT_CYLINDER; k++) {
			double at[3], size[3];

			for (int a = 0; a < 3; a++) {
				at[a] = c[a] + draw(s, -0.06, 0.06);
				size[a] = draw(s, 0.01, 0.04);
			}
			p = add(s, (enum ct_shape_kind)k, at, size, 0,
				exp(draw(s, log(0.01), log(0.2))));
			tumble(s, p);
		}
	}
}

static void shepp_logan(struct set *s)
{
	/* density, half lengths, centre, turn about z */
	static const double head[10][8] = {
		{1.0, 0.69, 0.92, 0.81, 0, 0, 0, 0},
		{-0.8, 0.6624, 0.874, 0.78, 0, -0.0184, 0, 0},
		{-0.2, 0.11, 0.31, 0.22, 0.22, 0, 0, -18},
		{-0.2, 0.16, 0.41, 0.28, -0.22, 0, 0, 18},
		{0.1, 0.21, 0.25, 0.41, 0, 0.35, -0.15, 0},
		{0.1, 0.046, 0.046, 0.05, 0, 0.1, 0.25, 0},
		{0.1, 0.046, 0.046, 0.05, 0, -0.1, 0.25, 0},
		{0.1, 0.046, 0.023, 0.05, -0.08, -0.605, 0, 0},
		{0.1, 0.023, 0.023, 0.02, 0, -0.606, 0, 0},
		{0.1, 0.023, 0.046, 0.02, 0.06, -0.605, 0, 0},
	};

	for (int i = 0; i < 10; i++)
		add(s, CT_ELLIPSOID, &head[i][4], &head[i][1], head[i][7], head[i][0]);
}

/* Bars of their own size and density on six sides, so that every exchange or flip of axes shows. */
static void marks(struct set *s)
{
	static const double density[6] = {0.7, 0.2, 0.5, 0.3, 0.6, 0.4}; /* R L A P S I */

	add(s, CT_ELLIPSOID, (const double[3]){0}, (const double[3]){0.3, 0.3, 0.3}, 0, 0.25);
	for (int i = 0; i < 6; i++) {
		int a = i / 2, sign = i % 2 ? -1 : 1;
		double c[3] = {0}, h[3] = {0.1, 0.1, 0.1};

		h[a] = 0.09 + 0.03 * i;
		h[(a + 1) % 3] = 0.05 + 0.01 * i;
		c[a] = sign * 0.6;
		add(s, CT_BOX, c, h, 0, density[i]);
	}
}

size_t ct_phantom_make(enum ct_phantom kind, const double extent[static 3], double density,
	uint64_t seed, struct ct_shape shape[static CT_PH_MAX_SHAPES])
{
	static const double middle[3] = {0}, half[3] = {0.5, 0.5, 0.5}, round[3] = {0.5, 0.5, 0.6};
	struct set s = {.shape = shape,
		.seed = seed,
		.unit = fmin(fmin(extent[0], extent[1]), extent[2]) / 2};

	switch (kind) {
	case CT_PH_ELLIPSOIDS: chest(&s); break;
	case CT_PH_SHELLS: shells(&s); break;
	case CT_PH_SHEPP_LOGAN: shepp_logan(&s); break;
	case CT_PH_SPHERE: add(&s, CT_ELLIPSOID, middle, half, 0, density); break;
	case CT_PH_CUBE: add(&s, CT_BOX, middle, half, 0, density); break;
	case CT_PH_CYLINDER: add(&s, CT_CYLINDER, middle, round, 0, density); break;
	case CT_PH_MARKS: marks(&s); break;
	case CT_PH_CONSTANT:
		add(&s, CT_BOX, middle, half, 0, density);
		for (int a = 0; a < 3; a++)
			shape[0].half[a] = extent[a] / 2;
		break;
	}
	return s.n;
}
