/* What steps hand on in memory is what a reader would make of the file between them.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/format.h"
#include "formats/io.h"
#include "scratch.h"

static const struct ct_env env = {
	.tool = "ct-t", .files = &(const struct ct_io_rule){.force = true}};

static bool same_meta(const struct ct_meta *a, const struct ct_meta *b)
{
	bool same = a->n == b->n;

	for (size_t i = 0; i < a->n && same; i++)
		same = strcmp(a->pair[i].key, b->pair[i].key) == 0 &&
		       strcmp(a->pair[i].value, b->pair[i].value) == 0;
	return same;
}

/* Metadata that no file keeps as they are: text that is no UTF-8, the name of what was read, a key
 * that is one of the format, and one that is too long for EXR. */
static void fill(struct ct_meta *m, const char *foreign)
{
	must(ct_meta_set(m, CT_META_INPUT, "x.nii xxh3:0", &err));
	must(ct_meta_set(m, "a key that is longer than the 31 characters", "v\n\xc3\xa4", &err));
	must(ct_meta_set(m, CT_META_HISTORY, "ct-a 1 a b\nct-b \\ 'c'", &err));
	must(ct_meta_set(m, "beam", "\xff latin \xe4", &err));
	must(ct_meta_set(m, "gamma", "a key of the format", &err));
	if (foreign)
		must(ct_meta_set(m, "nifti.ext.0", foreign, &err));
	must(ct_meta_set(m, "last", "", &err));
}

static bool volume(float step, const char *code, const char *foreign)
{
	const size_t n[3] = {3, 4, 5};
	struct ct_vol a = {.n = {0}}, b = {.n = {0}};
	bool same;

	must(ct_vol_alloc(&a, n, &err));
	for (int i = 0; i < 12; i++) /* oblique, of no float32 numbers */
		a.affine[i / 4][i % 4] =
			(double[]){0.6, -0.8, 0, 10.1, 0.8, 0.6, 0, -20.3, 0, 0, 1.7, 1.0 / 3}[i];
	for (size_t i = 0; i < ct_vol_count(&a); i++)
		a.data[i] = (float)i * step - 20;
	a.data[7] = -0.0f;
	fill(&a.meta, foreign);
	if (code)
		must(ct_meta_set(&a.meta, CT_META_NIFTI_CODE, code, &err));
	must(ct_vol_write("v.nii", &a, &env, &err));
	must(ct_vol_read("v.nii", &b, &err));
	must(ct_vol_as_read(&a, "elsewhere/v.nii", &err));
	same = memcmp(a.n, b.n, sizeof a.n) == 0 &&
	       memcmp(a.affine, b.affine, sizeof a.affine) == 0 &&
	       memcmp(a.data, b.data, ct_vol_count(&a) * sizeof *a.data) == 0 &&
	       same_meta(&a.meta, &b.meta);
	ct_vol_free(&a);
	ct_vol_free(&b);
	return same;
}

static bool stack(void)
{
	struct ct_stack a = {0}, b = {0};
	bool same;

	must(ct_stack_alloc(&a, 3, 4, 5, &err));
	for (size_t k = 0; k < 3; k++)
		a.view[k] = (struct ct_view){.source = {1000.1, (double)k / 3, 0},
			.centre = {-500, 1e-7, 0.1},
			.u = {0, 0.7, 0},
			.v = {0, 0, -0.7},
			.angle = 57.3 * (double)k};
	for (size_t i = 0; i < ct_stack_count(&a); i++)
		a.data[i] = (float)i * 0.1f - 2;
	fill(&a.meta, NULL);
	must(ct_stack_write("s.exr", &a, &env, &err));
	must(ct_stack_read("s.exr", &b, &err));
	must(ct_stack_as_read(&a, "s.exr", &err));
	same = a.views == b.views && a.h == b.h && a.w == b.w && a.beam == b.beam &&
	       memcmp(a.view, b.view, a.views * sizeof *a.view) == 0 &&
	       memcmp(a.data, b.data, ct_stack_count(&a) * sizeof *a.data) == 0 &&
	       same_meta(&a.meta, &b.meta);
	ct_stack_free(&a);
	ct_stack_free(&b);
	return same;
}

static bool gaussians(size_t n)
{
	struct ct_gauss a = {.activation = CT_PRELU,
				.gamma = 1.0 / 3,
				.step = 7,
				.grid = {3, 4, 5}},
			b = {0};
	bool same;

	must(ct_gauss_reserve(&a, n + 1, &err));
	a.n = n;
	for (size_t k = 0; k < CT_GAUSS_COLUMNS; k++)
		for (size_t i = 0; i < n; i++)
			a.column[k][i] = (float)(k + i) * 0.1f - 0.5f;
	for (int i = 0; i < 3; i++)
		a.affine[i][i] = 1.0 / 3;
	fill(&a.meta, NULL);
	must(ct_gauss_write("g.ply", &a, &env, &err));
	must(ct_gauss_read("g.ply", &b, &err));
	must(ct_gauss_as_read(&a, "g.ply", &err));
	same = a.n == b.n && a.gamma == b.gamma && a.step == b.step &&
	       a.activation == b.activation && memcmp(a.grid, b.grid, sizeof a.grid) == 0 &&
	       memcmp(a.affine, b.affine, sizeof a.affine) == 0 && same_meta(&a.meta, &b.meta);
	for (size_t k = 0; k < CT_GAUSS_COLUMNS && same; k++)
		same = n == 0 || memcmp(a.column[k], b.column[k], n * sizeof **a.column) == 0;
	ct_gauss_free(&a);
	ct_gauss_free(&b);
	return same;
}

static void test_errors(void)
{
	struct ct_err e = {0};
	struct ct_vol v = {.n = {0}};
	struct ct_stack s = {0};

	must(ct_vol_alloc(&v, (const size_t[3]){2, 2, 2}, &err));
	memset(v.data, 0, 8 * sizeof *v.data);
	v.affine[0][1] = 1;
	OK(ct_vol_as_read(&v, "v.nii", &e) == -1 && e.code == CT_EGEOM &&
			strncmp(e.msg, "v.nii: ", 7) == 0,
		"a volume that no file holds is refused as its writer does: %s", e.msg);
	ct_vol_free(&v);
	must(ct_stack_alloc(&s, 1, 2, 2, &err));
	memset(s.data, 0, 4 * sizeof *s.data);
	OK(ct_stack_as_read(&s, "s.exr", &e) == -1 && e.code == CT_EGEOM &&
			strncmp(e.msg, "s.exr: ", 7) == 0,
		"a stack that no file holds is refused as its writer does: %s", e.msg);
	ct_stack_free(&s);
}

int main(void)
{
	scratch_begin();
	OK(volume(0.1f, NULL, NULL), "a volume of float32 is as its file is read");
	OK(volume(1, NULL, NULL), "a volume that is int16 in its file has one zero");
	OK(volume(0.1f, "2", "4 aGVsbG8A"),
		"codes and extensions of others come back as from a file");
	OK(volume(0.1f, "0", NULL), "a volume of no place has one afterwards, as from a file");
	OK(stack(), "a stack is as its file is read");
	OK(gaussians(50), "Gaussians are as their file is read");
	OK(gaussians(0), "a set of no Gaussians is as its file is read");
	test_errors();
	return tap_done();
}
