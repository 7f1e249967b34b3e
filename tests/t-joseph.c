/* t-joseph.c: line integrals by interpolation against the formula, through the volume, along its
 * faces and beside it; the window of densities. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "xray/project.h"
#include "xray/window.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { NX = 7, NY = 5, NZ = 6, H = 29, W = 37 };

/* Linear between voxel centres, 0 from one voxel beyond the outermost on. */
static double value(const struct ct_vol *v, const double x[3])
{
	double sum = 0, w[3];

	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % NX, i / NX % NY, i / NX / NY};

		for (int a = 0; a < 3; a++)
			w[a] = fmax(0, 1 - fabs(x[a] - (double)at[a]));
		sum += w[0] * w[1] * w[2] * (double)v->data[i];
	}
	return sum;
}

/* The sum over the slices across the dominant axis, by the definition; voxels of 1, 2 and 3 mm with
 * the first centre at the origin. */
static double by_hand(
	const struct ct_vol *v, const struct ct_view *view, size_t row, size_t col, bool cone)
{
	double from[3], dir[3], mm = 0, sum = 0;
	int a = 0;

	for (int k = 0; k < 3; k++) {
		double off = view->u[k] * ((double)col - (W - 1) / 2.0) +
			     view->v[k] * ((double)row - (H - 1) / 2.0);

		from[k] = view->source[k] + (cone ? 0 : off);
		dir[k] = view->centre[k] + off - from[k];
		mm += dir[k] * dir[k];
		from[k] /= k + 1; /* in voxels */
		dir[k] /= k + 1;
	}
	for (int k = 1; k < 3; k++)
		if (fabs(dir[k]) > fabs(dir[a]))
			a = k;
	for (size_t k = 0; k < v->n[a]; k++) {
		double t = ((double)k - from[a]) / dir[a], x[3];

		for (int b = 0; b < 3; b++)
			x[b] = from[b] + t * dir[b];
		x[a] = (double)k;
		sum += value(v, x);
	}
	return sum * sqrt(mm) / fabs(dir[a]);
}

/* Rays a quarter of a voxel apart, from outside on one side to outside on the other. */
static void rays(enum ct_beam beam, double turn, double tilt)
{
	struct ct_vol v = {0};
	struct ct_stack s = {0};
	struct ct_projector g;
	const double mid[3] = {(NX - 1) / 2.0, NY - 1, (NZ - 1) * 1.5};
	const double out[3] = {cos(turn) * cos(tilt), sin(turn) * cos(tilt), sin(tilt)};
	const double u[3] = {-sin(turn), cos(turn), 0};
	double worst = 0, most = 0;
	size_t lit = 0;

	must(ct_vol_alloc(&v, (const size_t[]){NX, NY, NZ}, &err) ||
		ct_stack_alloc(&s, 1, H, W, &err));
	for (int a = 0; a < 3; a++)
		v.affine[a][a] = a + 1;
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)(1 + ct_rng_uniform(1, 1, i));
	s.beam = beam;
	for (int a = 0; a < 3; a++) {
		int b = (a + 1) % 3, c = (a + 2) % 3;

		s.view[0].source[a] = mid[a] + 60 * out[a];
		s.view[0].centre[a] = mid[a] - 20 * out[a];
		s.view[0].u[a] = 0.5 * u[a];
		s.view[0].v[a] = 0.8 * (out[b] * u[c] - out[c] * u[b]);
	}
	must(ct_projector_init(&g, &v, &s, &err));
	g.method = CT_JOSEPH;
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, 1, s.data, NULL);
	for (size_t i = 0; i < H * W; i++) {
		double want = by_hand(&v, s.view, i / W, i % W, beam == CT_CONE);

		worst = fmax(worst, fabs((double)s.data[i] - want));
		most = fmax(most, want);
		lit += want > 0;
	}
	if (!OK(worst < 2e-5 * most && lit > 100 && lit < H * W,
		    "%s from %.3g, %.3g: %zu of %d rays", CT_WORD(CT_BEAM_LIST, beam), turn, tilt,
		    lit, H * W))
		printf("# %g of %g off\n", worst, most);
	ct_vol_free(&v);
	ct_stack_free(&s);
}

static void window(void)
{
	static const float hu[] = {-2000, -1024, -1023.5f, 0, 3070.5f, 3071, 9000};
	const double limits[2] = {-1024, 3071};
	float density[7], back[7];
	double worst = 0;

	ct_window_density(7, density, hu, limits);
	for (int i = 0; i < 7; i++)
		worst = fmax(worst,
			fabs((double)density[i] - fmin(1, fmax(0, ((double)hu[i] + 1024) / 4095))));
	NEAR(worst, 0, 1e-7, "a window is clipped at both ends");
	OK(density[2] > 0 && density[4] < 1, "and at no other place");
	ct_window_hu(7, back, density, limits);
	OK(fabsf(back[3]) < 1e-3f && back[0] == -1024 && back[6] == 3071, "and back");
}

int main(void)
{
	for (int k = 0; k < 12; k++) {
		rays(CT_PARALLEL, 0.6 * k, 0.04 * k);
		rays(CT_CONE, 0.55 * k + 0.1, 0.1 - 0.03 * k);
	}
	rays(CT_PARALLEL, 0, 0);
	rays(CT_PARALLEL, 1.7, 1.3);
	rays(CT_CONE, 2.9, -1.4);
	window();
	return tap_done();
}
