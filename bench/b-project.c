/* b-project: CPU time a voxel crossing of the projector, rays one at a time and sixteen at once,
 * forward and adjoint, at the level of the processor that is in force (CTSR_CPU).
 *
 * b-project [VOLUME [WINDOW-LO]]: a volume in HU, density from WINDOW-LO to 3071 (-1024); else a
 * chest phantom of 256^3 voxels. The scan has 512x512 pixels and distances as 1000 : 1500.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/bench.h"
#include "formats/format.h"
#include "xray/phantom.h"
#include "xray/ray.h"
#include "xray/geometry.h"
#include "xray/window.h"

#include <math.h>

enum { VIEWS = 4 };

struct side {
	struct ct_projector g;
	struct ct_stack *scan;
	float *vol;
};

static void must(int rc, const struct ct_err *e)
{
	if (rc) {
		fprintf(stderr, "b-project: %s\n", e->msg);
		exit(1);
	}
}

static void volume(struct ct_vol *v, int argc, char **argv)
{
	const size_t n[3] = {256, 256, 256};
	const double extent[3] = {320, 320, 320};
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	struct ct_err e;

	if (argc > 1) {
		double window[2] = {argc > 2 ? atof(argv[2]) : -1024, 3071};

		must(ct_vol_read(argv[1], v, &e), &e);
		ct_window_density(ct_vol_count(v), v->data, v->data, window);
		return;
	}
	must(ct_vol_alloc(v, n, &e), &e);
	for (int a = 0; a < 3; a++) {
		v->affine[a][a] = 1.25;
		v->affine[a][3] = -1.25 * 127.5;
	}
	ct_phantom_voxels(
		v, ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 1, 1, shape), shape, 1, NULL);
}

/* Voxel boundaries that the rays cross, and one a ray. */
static double crossings(const struct ct_projector *g)
{
	const struct ct_stack *s = g->scan;
	double sum = 0;

	for (size_t i = 0; i < ct_stack_count(s); i++) {
		double o[3], d[3], t0 = 0, t1 = HUGE_VAL, across = 0;

		ct_view_ray(s, i / s->w / s->h, i / s->w % s->h, i % s->w, o, d);
		for (int a = 0; a < 3; a++) {
			const double *m = g->inverse[a];
			double x = m[0] * o[0] + m[1] * o[1] + m[2] * o[2] + m[3];
			double k = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
			double p = -x / k, q = ((double)g->n[a] - x) / k;

			t0 = fmax(t0, fmin(p, q));
			t1 = fmin(t1, fmax(p, q));
			across += fabs(k);
		}
		if (t1 > t0)
			sum += (t1 - t0) * across + 1;
	}
	return sum;
}

static void forward(void *arg)
{
	struct side *s = arg;

	ct_project(&s->g, 0, VIEWS, s->scan->data, NULL);
}

static void adjoint(void *arg)
{
	struct side *s = arg;

	ct_project_adjoint(&s->g, 0, VIEWS, s->vol, s->scan->data, NULL);
}

int main(int argc, char **argv)
{
	static const char *const names[] = {"Siddon", "Joseph"};
	struct ct_vol v = {0};
	struct ct_stack scan = {0};
	struct ct_geometry c;
	struct ct_err e;
	double n;

	printf("kernels of level %d\n", ct_simd_level());
	volume(&v, argc, argv);
	ct_geometry_default(&c, CT_CONE, &v);
	c.views = VIEWS;
	c.start = 10;
	c.pitch[0] *= (double)c.w / 512;
	c.pitch[1] = c.pitch[0];
	c.w = c.h = 512;
	must(ct_geometry_fill(&scan, &c, &e), &e);
	for (int method = 0; method < 2; method++) {
		struct side fast = {.scan = &scan, .vol = v.data}, slow = fast;
		char what[80];

		must(ct_projector_init(&fast.g, &v, &scan, &e), &e);
		fast.g.method = slow.g.method = (enum ct_method)method;
		slow.g = fast.g;
		must(ct_projector_reserve(&fast.g, &e), &e);
		ct_projector_load(&fast.g, v.data, NULL);
		ct_projector_load(&slow.g, v.data, NULL);
		n = crossings(&slow.g);
		snprintf(what, sizeof what, "%s, CPU a voxel crossing", names[method]);
		bench_against(what, forward, &fast, "one ray at a time", forward, &slow,
			CLOCK_PROCESS_CPUTIME_ID, 1e9 / n, "ns");
		snprintf(what, sizeof what, "%s adjoint, CPU a voxel crossing", names[method]);
		bench_against(what, adjoint, &fast, "one ray at a time", adjoint, &slow,
			CLOCK_PROCESS_CPUTIME_ID, 1e9 / n, "ns");
		ct_projector_free(&fast.g);
	}
	ct_stack_free(&scan);
	ct_vol_free(&v);
	return 0;
}
