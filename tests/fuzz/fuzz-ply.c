/* Hostile PLY, and pickles of R2-Gaussian: the reader must refuse or give a sound set, and leave
 * nothing behind. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/r2.h"
#include "gs/splat.h"
#include "gs/mixture.h"
#include "fuzz-file.h"

#include <stdlib.h>
#include <string.h>

const int fuzz_rounds = 1500;

enum { SIDE = 8, MOST = 200 };

/* Put them on voxels and into a view. */
static void draw(const struct ct_gauss *g)
{
	static const double eye[3][4] = {{1, 0, 0, -4}, {0, 1, 0, -4}, {0, 0, 1, -4}};
	static const struct ct_view view = {
		.source = {-500}, .centre = {500}, .u = {0, 2, 0}, .v = {0, 0, -2}};
	const size_t zero[3] = {0}, n[3] = {SIDE, SIDE, SIDE};
	struct ct_gaussian b[MOST];
	struct ct_mixture v = {0};
	struct ct_splat s = {0};
	struct ct_block block;
	struct ct_camera c;
	struct ct_err e = {0};
	float *out;

	if (g->n > MOST || ct_block_init(&block, eye, zero, n, &e) ||
		ct_camera_init(&c, &view, CT_CONE, SIDE, SIDE, &e))
		return;
	out = malloc(ct_mixture_slice(&block) * SIDE * sizeof *out);
	if (!out)
		return;
	ct_gaussian_resolve(b, g, NULL);
	if (ct_mixture_plan(&v, &block, g->n, b, NULL, &e) == 0)
		ct_mixture_draw(out, &v, NULL);
	if (ct_splat_plan(&s, &c, g->n, b, NULL, &e) == 0)
		ct_splat_draw(out, &s, NULL);
	ct_mixture_free(&v);
	ct_splat_free(&s);
	free(out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_any a = {0};
	const struct ct_gauss *g = &a.gauss;
	struct ct_err e = {0};

	const bool pickle = size > 0 && data[0] == 0x80;

	if (ct_format_read_bytes(
		    pickle ? &ct_format_r2 : &ct_format_ply, data, size, "fuzz", &a, &e) == 0) {
		ct_gauss_check_finite(g, &e);
		draw(g);
	} else if (g->raw || g->meta.n || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += g->n > 0;
	ct_any_free(&a);
	return 0;
}

/* Ours, one with other types, and our pickle. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char foreign[] =
		"ply\nformat binary_little_endian 1.0\n"
		"comment ct:activation=relu\ncomment ct:grid=1,2,3\n"
		"element vertex 2\nproperty double x\nproperty uchar y\nproperty int z\n"
		"property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
		"property float rot_0\nproperty float rot_1\nproperty float rot_2\n"
		"property float rot_3\nproperty ushort density\nend_header\n"
		"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
		"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
	struct ct_gauss g = {.activation = CT_PRELU, .gamma = 0.1, .grid = {4, 5, 6}};
	struct ct_err e = {0};
	size_t n;

	if (k > 2)
		return 0;
	if (k == 1) {
		*data = malloc(sizeof foreign);
		if (!*data)
			exit(99);
		memcpy(*data, foreign, sizeof foreign);
		return sizeof foreign;
	}
	if (ct_gauss_reserve(&g, 3, &e))
		exit(99);
	for (g.n = 0; g.n < 3; g.n++) {
		for (int a = 0; a < 3; a++)
			g.pos[a][g.n] = g.scale[a][g.n] = (float)a;
		for (int a = 0; a < 4; a++)
			g.rot[a][g.n] = 1;
		g.raw[g.n] = -0.5f;
	}
	ct_meta_set(&g.meta, "history", "a\nb\\c", &e);
	for (int a = 0; a < 3; a++)
		g.affine[a][a] = 1;
	n = seed_file(data, (k ? ct_r2_write : ct_gauss_write)(seed_path(), &g, &seed_env, &e));
	ct_gauss_free(&g);
	return n;
}
