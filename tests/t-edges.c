/* Sharpness: edges of known blur, in any direction, and what is no edge. */
#include "config.h"
#include "core/rng.h"
#include "quality/edges.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { SIDE = 48 };

static double step(double d, double sigma)
{
	return -1000 + 550 * (1 + erf(d / sqrt(2.0) / sigma));
}

/* A ball of radius 15 mm if n is NULL, else a plane with that normal; spacing 0.7 mm. */
static void make(struct ct_vol *v, const double *n, double sigma, double noise)
{
	const size_t size[3] = {SIDE, SIDE, SIDE};
	struct ct_err e;

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, size, &e))
		exit(1);
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 0.7;
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double p[3] = {(double)(i % SIDE) * 0.7 - 16.3,
			(double)(i / SIDE % SIDE) * 0.7 - 16.6,
			(double)(i / (SIDE * SIDE)) * 0.7 - 16.4};
		double d = n ? (p[0] * n[0] + p[1] * n[1] + p[2] * n[2]) /
					   sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
			     : 9 - sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);

		v->data[i] = (float)(step(d, sigma) + noise * (double)ct_rng_normal(1, 0, i));
	}
}

static void check(const struct ct_edge_figures *f, double sigma, double tolerance, const char *what)
{
	const double pi = acos(-1.0);

	OK(fabs(f->rise / (2.5631 * sigma) - 1) < tolerance, "%s: rise %.4f mm", what, f->rise);
	OK(fabs(f->mtf50 / (sqrt(log(2.0) / 2) / (pi * sigma)) - 1) < tolerance,
		"%s: MTF 50 %% at %.4f", what, f->mtf50);
	OK(fabs(f->mtf10 / (sqrt(log(10.0) / 2) / (pi * sigma)) - 1) < 2 * tolerance,
		"%s: MTF 10 %% at %.4f", what, f->mtf10);
}

static void test_planes(void)
{
	static const double normal[][3] = {
		{1, 0.13, 0.07}, {0.2, -1, 0.4}, {0.1, 0.2, -1}, {-1, 1, 1.2}};
	struct ct_env env = {0};
	struct ct_err e;

	for (size_t k = 0; k < sizeof normal / sizeof *normal; k++) {
		struct ct_vol a, b;
		struct ct_edges o;
		char name[40];

		make(&a, normal[k], 0.6, 0);
		make(&b, normal[k], 1.1, 0);
		OK(ct_edges(&o, &a, &b, NULL, 300, &env, &e) == 0 && o.count > 100, "plane %zu", k);
		snprintf(name, sizeof name, "plane %zu, ref", k);
		check(&o.ref, 0.6, 0.02, name);
		snprintf(name, sizeof name, "plane %zu, test", k);
		check(&o.test, 1.1, 0.02, name);
		ct_vol_free(&a);
		ct_vol_free(&b);
	}
}

static void test_ball(void)
{
	struct ct_vol a, b, mask;
	struct ct_env env = {0}, four = {0};
	struct ct_edges o, p;
	struct ct_err e;

	make(&a, NULL, 0.5, 20);
	make(&b, NULL, 0.9, 20);
	make(&mask, NULL, 0.5, 0);
	ct_edges(&o, &a, &b, NULL, 300, &env, &e);
	OK(o.count > 100, "a ball, with noise: %zu edges", o.count);
	check(&o.ref, 0.5, 0.06, "ref"); /* of radius 9 mm: what is behind the edge narrows */
	check(&o.test, 0.9, 0.06, "test");
	if (ct_par_alloc(&four.par, 4, &e))
		exit(1);
	ct_edges(&p, &a, &b, NULL, 300, &four, &e);
	OK(memcmp(&o, &p, sizeof o) == 0, "1 and 4 threads, same bits");
	ct_par_free(four.par);
	for (size_t i = 0; i < ct_vol_count(&mask); i++)
		mask.data[i] = i % SIDE < SIDE / 2;
	ct_edges(&p, &a, &b, &mask, 300, &env, &e);
	OK(p.count > o.count / 3 && p.count < 2 * o.count / 3, "a mask of one half: %zu", p.count);
	for (size_t i = 0; i < ct_vol_count(&a); i++)
		a.data[i] = 100 * ct_rng_normal(5, 0, i);
	ct_edges(&o, &a, &b, NULL, 300, &env, &e);
	OK(o.count < 12 && isnan(o.ref.rise) && isnan(o.test.mtf50),
		"noise has no edges, and no figures: %zu", o.count);
	a.n[2] = b.n[2] = 17;
	OK(ct_edges(&o, &a, &b, NULL, 300, &env, &e) < 0 && e.code == CT_EGEOM,
		"too few slices are refused");
	ct_vol_free(&a);
	ct_vol_free(&b);
	ct_vol_free(&mask);
}

int main(void)
{
	test_planes();
	test_ball();
	return tap_done();
}
