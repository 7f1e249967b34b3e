/* t-gauss-far.c: Gaussians as a hostile file may hold them, far away or wider than any number:
 * nothing is written beside the pixels, and what is there is finite.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/splat.h"
#include "gs/mixture.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 8, PITCH = N + 32, GUARD = 64 };

/* Centres in pixels and ln of the standard deviations. */
static const double far[] = {
	0, 3, 1e6, 4e6 + 1, 1e7 + 3, 16777217, 33554435, 67108867, 9.9e7, 1e9, 1e18, 1e30};
static const double wide[] = {0, -30, -80, 5, 15, 17, 19, 30, 43, 60, 88, 200, 360, 700, 800, 1e22};
enum { FAR = sizeof far / sizeof *far, WIDE = sizeof wide / sizeof *wide };

/* Is all that is beside the n pixels as it was, and all in them finite? */
static bool sound(const float *p, size_t n)
{
	bool ok = true;

	for (size_t i = 0; i < GUARD; i++)
		ok &= p[i] == 7 && p[GUARD + n + i] == 7;
	for (size_t i = GUARD; i < GUARD + n; i++)
		ok &= isfinite(p[i]);
	return ok;
}

static void paint(float *p, size_t n)
{
	for (size_t i = 0; i < n + 2 * GUARD; i++)
		p[i] = 7;
}

static void make(struct ct_gaussian *b, size_t k, int axis, int turn)
{
	const double s = wide[k / FAR % WIDE], x = far[k % FAR];
	double p[3] = {3.3, 3.6, 3.1}, ln_s[3] = {1, 1, 1}, q[4] = {1, 0, 0, 0};

	p[axis] = turn & 1 ? -x : x;
	ln_s[0] = s;
	ln_s[1] = turn & 2 ? s : 0.5;
	ln_s[2] = turn & 4 ? s : -s;
	if (turn & 8)
		q[1] = 0.3, q[2] = -0.4, q[3] = 0.2;
	ct_gaussian_make(b, p, ln_s, q, 0.5);
}

static bool voxels(const struct ct_gaussian *b)
{
	static const double eye[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
	static float room[PITCH * N * N + 2 * GUARD];
	const size_t zero[3] = {0}, n[3] = {N, N, N};
	struct ct_mixture v = {0};
	struct ct_block block;
	size_t count;

	must(ct_block_init(&block, eye, zero, n, &err));
	count = ct_mixture_slice(&block) * N;
	paint(room, count);
	must(ct_mixture_plan(&v, &block, 1, b, NULL, &err));
	ct_mixture_draw(room + GUARD, &v, NULL);
	ct_mixture_free(&v);
	return sound(room, count);
}

static bool pixels(const struct ct_gaussian *b)
{
	static float room[PITCH * N + 2 * GUARD];
	const struct ct_view view = {
		.source = {-500, 3, 3}, .centre = {500, 3, 3}, .u = {0, 2, 0}, .v = {0, 0, -2}};
	const size_t count = ct_rasterise_pitch(N) * N;
	struct ct_splat s = {0};
	struct ct_camera c;
	bool ok = true;

	for (int beam = 0; beam < 2; beam++) {
		must(ct_camera_init(&c, &view, beam ? CT_CONE : CT_PARALLEL, N, N, &err));
		paint(room, count);
		must(ct_splat_plan(&s, &c, 1, b, NULL, &err));
		ct_splat_draw(room + GUARD, &s, NULL);
		ok &= sound(room, count);
	}
	ct_splat_free(&s);
	return ok;
}

/* A size that no float holds is none. */
static void sizes(void)
{
	struct ct_gauss g = {.gamma = 1};

	must(ct_gauss_reserve(&g, 1, &err));
	for (int a = 0; a < 3; a++)
		g.pos[a][0] = g.scale[a][0] = 0;
	for (int a = 0; a < 4; a++)
		g.rot[a][0] = 1;
	g.raw[0] = 1;
	g.n = 1;
	g.scale[1][0] = 80;
	OK(ct_gauss_check_finite(&g, &err) == 0, "e^80 mm is a size");
	g.scale[1][0] = 89;
	OK(ct_gauss_check_finite(&g, &err) == -1 && err.code == CT_ENUMERIC, "e^89 mm is not: %s",
		err.msg);
	ct_gauss_free(&g);
}

int main(void)
{
	size_t tried = 0, bad[2] = {0};
	struct ct_gaussian b;

	for (size_t k = 0; k < FAR * WIDE; k++)
		for (int axis = 0; axis < 3; axis++)
			for (int turn = 0; turn < 16; turn++, tried++) {
				make(&b, k, axis, turn);
				bad[0] += !voxels(&b);
				bad[1] += !pixels(&b);
			}
	sizes();
	OK(bad[0] == 0, "%zu of %zu Gaussians write beside the voxels, or no numbers", bad[0],
		tried);
	OK(bad[1] == 0, "%zu of %zu Gaussians write beside the pixels, or no numbers", bad[1],
		tried);
	return tap_done();
}
