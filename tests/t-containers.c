/* Volumes, stacks, tensors and sets of Gaussians: sizes, places, and each thing that is refused.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "tap.h"

#include <stdbool.h>
#include <string.h>

/* Turned, oblique, of 2, 0.5 and 4 mm; in every row all entries differ. */
static const double oblique[3][4] = {
	{1.2, -0.4, 0, 5}, {1.6, 0.3, 0, -6}, {0, 0, -4, 7}}; /* (0.6, 0.8), (-0.8, 0.6) */

static void volume(struct ct_vol *v, size_t a, size_t b, size_t c, const double affine[3][4])
{
	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, (const size_t[3]){a, b, c}, &err));
	if (affine)
		memcpy(v->affine, affine, sizeof v->affine);
}

static void test_places(void)
{
	struct ct_vol v = {0};
	double mm[3];
	bool unit = true;

	for (int a = 0; a < 3; a++) {
		size_t n[3] = {1, 1, 1};

		n[a] = 0;
		unit = unit && ct_vol_alloc(&v, n, &err) < 0 && err.code == CT_EINPUT && !v.data;
	}
	OK(unit, "no volume of nothing");
	volume(&v, 1, 1, 1, NULL);
	ct_vol_free(&v);
	volume(&v, 4, 6, 8, NULL);
	for (int i = 0; i < 12; i++)
		unit = unit && v.affine[i / 4][i % 4] == (i / 4 == i % 4);
	OK(unit && ct_vol_count(&v) == 192, "a new volume: voxels of 1 mm");
	memcpy(v.affine, oblique, sizeof oblique);
	ct_vol_spacing(&v, mm);
	OK(fabs(mm[0] - 2) + fabs(mm[1] - 0.5) + fabs(mm[2] - 4) < 1e-12, "spacings");
	ct_vol_world(&v, (const double[3]){10, 100, 1000}, mm);
	OK(fabs(mm[0] + 23) + fabs(mm[1] - 40) + fabs(mm[2] + 3993) < 1e-9,
		"the place of an index");
	ct_vol_centre(&v, mm);
	OK(fabs(mm[0] - 5.8) + fabs(mm[1] + 2.85) + fabs(mm[2] + 7) < 1e-12, "the centre");
	ct_vol_free(&v);
	OK(!v.data && v.n[0] == 0, "nothing is left");
}

/* Turned by 30 degrees about x, then 90 about z: (x, y, z) goes to (-c y + s z, x, s y + c z). */
static void test_turned(void)
{
	const double c = sqrt(0.75), s = 0.5;
	const double want[3][3] = {{0, -c, s}, {1, 0, 0}, {0, s, c}};
	double before[3], after[3], off = 0;
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[3]){8, 6, 4}, &err));
	ct_vol_centre(&v, before);
	ct_vol_rotate(&v, (const double[3]){30, 0, 90});
	ct_vol_centre(&v, after);
	for (int i = 0; i < 9; i++)
		off = fmax(off, fabs(v.affine[i / 3][i % 3] - want[i / 3][i % 3]));
	OK(off < 1e-12, "a volume is turned by degrees, about x before z");
	off = 0;
	for (int a = 0; a < 3; a++)
		off = fmax(off, fabs(after[a] - before[a]));
	OK(off < 1e-12, "a volume is turned about its centre");
	ct_vol_free(&v);
}

static bool refused(const struct ct_vol *v, const char *word)
{
	return ct_vol_check_grid(v, &err) < 0 && err.code == CT_EGEOM && strstr(err.msg, word);
}

static void test_grid(void)
{
	static const double size[] = {0, 5e-10, 1.1e6, 2e-9, 0.9e6};
	static const char *const pair[] = {"0 and 1", "1 and 2", "2 and 0"};
	struct ct_vol v = {.n = {2, 3, 4}};
	bool finite = true, sizes = true, right = true;

	memcpy(v.affine, oblique, sizeof oblique);
	OK(ct_vol_check_grid(&v, &err) == 0, "an oblique grid is fine");
	for (int i = 0; i < 12; i++) {
		memcpy(v.affine, oblique, sizeof oblique);
		v.affine[i / 4][i % 4] = i % 2 ? (double)NAN : (double)INFINITY;
		finite = finite && refused(&v, "not finite");
	}
	OK(finite, "an affine that is not finite, wherever");
	for (int a = 0; a < 3; a++)
		for (int k = 0; k < 5; k++) {
			char word[20];

			memset(v.affine, 0, sizeof v.affine);
			for (int d = 0; d < 3; d++)
				v.affine[d][d] = d == a ? size[k] : 1;
			snprintf(word, sizeof word, "along axis %d", a);
			sizes = sizes &&
				(k < 3 ? refused(&v, word) : ct_vol_check_grid(&v, &err) == 0);
		}
	OK(sizes, "voxels of no size, and of a kilometre");
	for (int a = 0; a < 3; a++)
		for (int k = 0; k < 4; k++) {
			const int b = (a + 1) % 3;
			const double lean = (k / 2 ? 1.1e-3 : 0.9e-3) * (k % 2 ? -1 : 1);

			memset(v.affine, 0, sizeof v.affine);
			for (int d = 0; d < 3; d++)
				v.affine[d][d] = 3 + d;
			v.affine[a][b] = lean * v.affine[b][b];
			right = right &&
				(k / 2 ? refused(&v, pair[a]) : ct_vol_check_grid(&v, &err) == 0);
		}
	OK(right, "axes that lean by more than a thousandth");
}

/* Every number of an affine may be off by what moves the farthest corner by a thousandth of the
 * least spacing. */
static void test_same_grid(void)
{
	static const size_t n[3] = {5, 9, 17};
	struct ct_vol a = {.n = {5, 9, 17}}, b = {.n = {5, 9, 17}};
	bool same = true, other = true, size = true;

	for (int least = 0; least < 3; least++)
		for (int i = 0; i < 12; i++)
			for (int sign = -1; sign <= 1; sign += 2) {
				const double far = i % 4 == 3 ? 1 : (double)n[i % 4] - 1;

				memset(a.affine, 0, sizeof a.affine);
				for (int d = 0; d < 3; d++)
					a.affine[d][d] = d == least ? 0.5 : 2;
				memcpy(b.affine, a.affine, sizeof b.affine);
				b.affine[i / 4][i % 4] += sign * 0.9e-3 * 0.5 / far;
				same = same && ct_vol_same_grid(&a, &b, &err) == 0;
				b.affine[i / 4][i % 4] += sign * 0.2e-3 * 0.5 / far;
				other = other && ct_vol_same_grid(&a, &b, &err) < 0 &&
					err.code == CT_EGEOM && strstr(err.msg, "corner");
			}
	OK(same, "a grid is the same within a thousandth of a voxel at each corner");
	OK(other, "and no longer beyond");
	for (int d = 0; d < 3; d++) {
		memcpy(b.affine, a.affine, sizeof b.affine);
		memcpy(b.n, n, sizeof b.n);
		b.n[d]++;
		size = size && ct_vol_same_grid(&a, &b, &err) < 0 && strstr(err.msg, "5x9x17 and");
	}
	OK(size, "nor of another size");
	for (int d = 0; d < 3; d++) { /* of 2x2x2, at the first corner or the last alone */
		for (int k = 0; k < 4; k++) {
			const double part = 1e-3 * 0.5 * (k / 2 ? 1 : 0.8);

			for (int i = 0; i < 3; i++)
				a.n[i] = b.n[i] = 2;
			memcpy(b.affine, a.affine, sizeof b.affine);
			b.affine[d][3] += (k % 2 ? -0.7 : 1.1) * part;
			for (int i = 0; i < 3; i++)
				b.affine[d][i] += (k % 2 ? 0.6 : -0.6) * part;
			size = size && (ct_vol_same_grid(&a, &b, &err) < 0) == (k / 2);
		}
	}
	OK(size, "at whatever corner");
	b.affine[1][3] = (double)NAN;
	OK(ct_vol_same_grid(&a, &b, &err) < 0, "nor where nobody knows");
}

/* One oblique grid, stored in 48 ways. */
static void test_stored_otherwise(void)
{
	static const int order[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	const struct ct_vol a = {
		.n = {5, 9, 17}, .affine = {{1.9, 0.2, 0, 7}, {-0.2, 1.9, 0, -3}, {0, 0, 4, 11}}};
	int named = 0, moved = 0;

	for (int k = 1; k < 48; k++) {
		struct ct_vol b = {0};

		for (int r = 0; r < 3; r++)
			b.affine[r][3] = a.affine[r][3];
		for (int d = 0; d < 3; d++) {
			const int o = order[k / 8][d], sign = k >> d & 1 ? -1 : 1;

			b.n[d] = a.n[o];
			for (int r = 0; r < 3; r++) {
				b.affine[r][d] = sign * a.affine[r][o];
				if (sign < 0)
					b.affine[r][3] += a.affine[r][o] * (double)(a.n[o] - 1);
			}
		}
		named += ct_vol_same_grid(&a, &b, &err) < 0 && err.code == CT_EGEOM &&
			 strstr(err.msg, "--reorient RAS");
		b.affine[2][3] += 1;
		moved += ct_vol_same_grid(&a, &b, &err) < 0 && !strstr(err.msg, "--reorient");
	}
	OK(named == 47, "a grid that is only stored otherwise is refused with what mends it");
	OK(moved == 47, "a grid that is also moved is refused for that");
}

/* In more than two blocks of 4096. */
static void test_finite(void)
{
	struct ct_vol v;
	bool named = true;

	volume(&v, 21, 20, 24, NULL);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = i % 3 ? 3e38f : -3e38f;
	OK(ct_vol_check_finite(&v, &err) == 0, "the largest numbers are finite");
	for (size_t i = 0; i < ct_vol_count(&v); i += i < 40 ? 1 : 61) {
		const float was = v.data[i];
		char want[80];

		v.data[i] = i % 2 ? NAN : -INFINITY;
		snprintf(want, sizeof want, "voxel (%zu,%zu,%zu) is %s", i % 21, i / 21 % 20,
			i / 420, i % 2 ? "NaN" : "infinite");
		named = named && ct_vol_check_finite(&v, &err) < 0 && err.code == CT_ENUMERIC &&
			strcmp(err.msg, want) == 0;
		v.data[i] = was;
	}
	OK(named, "what is not finite is named, wherever it is");
	ct_vol_free(&v);
}

static const double U[3] = {0.3, 0.4, -0.1}, V[3] = {0.1, -0.2, -0.7};

/* Three views of 5x4 pixels, the source 100 times their normal away. */
static void stack(struct ct_stack *s)
{
	const double n[3] = {
		U[1] * V[2] - U[2] * V[1], U[2] * V[0] - U[0] * V[2], U[0] * V[1] - U[1] * V[0]};

	*s = (struct ct_stack){0};
	must(ct_stack_alloc(s, 3, 4, 5, &err));
	for (size_t k = 0; k < 3; k++)
		for (int a = 0; a < 3; a++) {
			s->view[k].centre[a] = 10 * (a + 1);
			s->view[k].source[a] = 10 * (a + 1) + 100 * n[a];
			s->view[k].u[a] = U[a];
			s->view[k].v[a] = V[a];
		}
}

/* The numbers of a view, one after the other. */
static double *number(struct ct_view *v, int i)
{
	double *const field[] = {v->source, v->centre, v->u, v->v};

	return field[i / 3] + i % 3;
}

static bool no_view(const struct ct_stack *s, size_t k, const char *word)
{
	char view[40];

	snprintf(view, sizeof view, "view %zu: ", k);
	return ct_stack_check(s, &err) < 0 && err.code == CT_EGEOM && strstr(err.msg, view) &&
	       strstr(err.msg, word);
}

static void test_views(void)
{
	struct ct_stack s;
	struct ct_view was;
	bool finite = true, flat = true, off = true;

	stack(&s);
	was = s.view[2];
	OK(ct_stack_check(&s, &err) == 0, "oblique views are fine");
	for (int i = 0; i < 12; i++) {
		s.view[2] = was;
		*number(&s.view[2], i) = i % 2 ? (double)NAN : (double)INFINITY;
		finite = finite && no_view(&s, 2, "not finite");
	}
	OK(finite, "a view that is not finite, wherever");
	for (int a = 0; a < 3; a++)           /* apart by 0.8e-6, and by 1.3e-6 */
		for (int k = 0; k < 4; k++) { /* pixels of 1 mm and 0.05 mm */
			const double u = k / 2 ? 0.05 : 1, v = k / 2 ? 1 : 0.05;

			s.view[2] = was;
			for (int b = 0; b < 3; b++) {
				s.view[2].u[b] = u * (b == a);
				s.view[2].v[b] =
					v * (b == a                    ? -1
						    : b == (a + 1) % 3 ? (k % 2 ? 1.3e-6 : 0.8e-6)
								       : 0);
				s.view[2].source[b] = was.centre[b] + (b == (a + 2) % 3);
			}
			flat = flat &&
			       (k % 2 ? ct_stack_check(&s, &err) == 0 : no_view(&s, 2, "parallel"));
		}
	for (int k = 0; k < 2; k++) {
		s.view[2] = was;
		memset(k ? s.view[2].u : s.view[2].v, 0, sizeof was.u);
		flat = flat && no_view(&s, 2, "parallel or zero");
	}
	OK(flat, "axes that are parallel, or none");
	s.view[2] = was;
	for (int k = 0; k < 8; k++) {
		const double along = k < 4 ? k : -3, down = k < 4 ? 4 - k : 20,
			     up = k / 4 * (k % 2 ? 1 : -1);

		s.view[1] = was; /* of 30 pixels' distance 1e-5 and 1e-7 out of the plane */
		for (int a = 0; a < 3; a++)
			s.view[1].source[a] =
				was.centre[a] + along * U[a] + down * V[a] +
				up * (k < 6 ? 1e-5 : 1e-3) * (was.source[a] - was.centre[a]) / 28;
		off = off &&
		      (k < 6 ? no_view(&s, 1, "detector plane") : ct_stack_check(&s, &err) == 0);
	}
	memcpy(s.view[1].source, s.view[1].centre, sizeof was.source);
	OK(off && no_view(&s, 1, "detector plane"), "a source in the plane of the detector");
	ct_stack_free(&s);
}

static void test_pixels(void)
{
	struct ct_stack s;
	bool named = true;

	stack(&s);
	memset(s.data, 0, ct_stack_count(&s) * sizeof *s.data);
	OK(ct_stack_count(&s) == 60 && ct_stack_view(&s, 2) == s.data + 40 &&
			ct_stack_check_finite(&s, &err) == 0,
		"three views of 20 pixels");
	for (size_t i = 0; i < 60; i++) {
		char want[80];

		s.data[i] = i % 2 ? NAN : INFINITY;
		snprintf(want, sizeof want, "view %zu, row %zu, column %zu is %s", i / 20,
			i / 5 % 4, i % 5, i % 2 ? "NaN" : "infinite");
		named = named && ct_stack_check_finite(&s, &err) < 0 && err.code == CT_ENUMERIC &&
			strcmp(err.msg, want) == 0;
		s.data[i] = 0;
	}
	OK(named, "a pixel that is not finite is named");
	ct_stack_free(&s);
}

/* The least pitch is that of u; the larger side has 5 pixels. */
static void test_same_views(void)
{
	const double tol = 1e-3 * sqrt(0.26);
	struct ct_stack a, b;
	bool same = true, other = true, size = true;

	for (int turn = 0; turn < 2; turn++) {
		stack(&a);
		stack(&b);
		for (size_t k = 0; k < 3 && turn; k++)
			for (int d = 0; d < 3; d++) {
				a.view[k].u[d] = b.view[k].u[d] = V[d];
				a.view[k].v[d] = b.view[k].v[d] = U[d];
			}
		if (turn) {
			a.w = b.w = 4;
			a.h = b.h = 5;
		}
		for (int i = 0; i < 12; i++)
			for (int sign = -1; sign <= 1; sign += 2) {
				double *at = number(&b.view[2], i), was = *at;

				*at = was + sign * 0.9 * tol / (i < 6 ? 1 : 5);
				same = same && ct_stack_same(&a, &b, &err) == 0;
				*at = was + sign * 1.1 * tol / (i < 6 ? 1 : 5);
				other = other && ct_stack_same(&a, &b, &err) < 0 &&
					err.code == CT_EGEOM && strstr(err.msg, "view 2");
				*at = was;
			}
		ct_stack_free(&a);
		ct_stack_free(&b);
	}
	OK(same && other, "views are the same within a thousandth of a pixel");
	stack(&a);
	stack(&b);
	b.view[0].centre[1] += 1;
	OK(ct_stack_same(&a, &b, &err) < 0 && strstr(err.msg, "view 0"), "the first one too");
	b.view[0].centre[1] -= 1;
	b.beam = CT_FAN;
	OK(ct_stack_same(&a, &b, &err) < 0 && strstr(err.msg, "cone and fan"), "beams differ");
	b.beam = a.beam;
	for (int k = 0; k < 3; k++) {
		b.views = a.views + (k == 0);
		b.h = a.h + (k == 1);
		b.w = a.w + (k == 2);
		size = size && ct_stack_same(&a, &b, &err) < 0 && strstr(err.msg, "5x4 and");
	}
	OK(size, "sizes differ");
	ct_stack_free(&a);
	ct_stack_free(&b);
}

static void test_like(void)
{
	static const double refuse[] = {0.5, 0.2, 1.1, 0, -1, (double)NAN};
	struct ct_stack s, t = {0};
	bool none = true, pitch = true;
	int word;

	stack(&s);
	s.beam = CT_PARALLEL;
	s.view[1].angle = 33;
	must(ct_meta_set(&s.meta, "method", "siddon", &err));
	for (size_t k = 0; k < sizeof refuse / sizeof *refuse; k++)
		none = none && ct_stack_like(&t, &s, refuse[k], &err) < 0 && err.code == CT_EGEOM;
	OK(none, "parts of pixels are refused");
	must(ct_stack_like(&t, &s, 3, &err));
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 12; i++)
			pitch = pitch && fabs(*number(&t.view[k], i) * (i < 6 ? 1 : 3) -
						 *number(&s.view[k], i)) < 1e-12;
	OK(t.views == 3 && t.h == 12 && t.w == 15 && pitch && t.view[1].angle == 33,
		"pixels of a third, the same views");
	OK(t.beam == CT_PARALLEL && ct_meta_get(&t.meta, "method"), "beam and metadata");
	ct_stack_free(&t);
	s.h = 5;
	must(ct_stack_like(&t, &s, 0.2, &err));
	OK(t.h == 1 && t.w == 1, "down to one pixel");
	ct_stack_free(&t);
	ct_stack_free(&s);
	OK(ct_words_take(&word, CT_WORDS(CT_BEAM_LIST), "beam", "fan", &err) == 0 &&
			word == CT_FAN &&
			ct_words_take(&word, CT_WORDS(CT_BEAM_LIST), "beam", "cone", &err) == 0 &&
			word == CT_CONE && strcmp(CT_WORD(CT_BEAM_LIST, CT_FAN), "fan") == 0,
		"beams have words");
	OK(ct_words_take(&word, CT_WORDS(CT_BEAM_LIST), "beam", "con", &err) < 0 &&
			err.code == CT_EINPUT &&
			strcmp(err.msg,
				"beam 'con' is not one of cone|parallel|fan; did you mean cone?") ==
				0,
		"and no others");
	for (size_t k = 0; k < 4; k++)
		none = none &&
		       ct_stack_alloc(&t,
			       k == 0   ? 0
			       : k == 3 ? CT_MAX_VIEWS + 1
					: 2,
			       k != 1, k != 2, &err) < 0 &&
		       err.code == CT_EINPUT && !t.data && !t.view;
	OK(none && ct_stack_alloc(&t, CT_MAX_VIEWS, 1, 1, &err) == 0, "and views of no number");
	ct_stack_free(&t);
}

static void test_tensors(void)
{
	const size_t dim[CT_MAX_RANK + 1] = {2, 3, 1, 1, 2, 1, 1, 5, 1},
				       huge[2] = {1ul << 40, 1ul << 40};
	struct ct_tensors w = {0};
	struct ct_tensor *t = NULL;

	must(ct_tensors_add(&w, "none", 0, dim, &t, &err));
	OK(ct_tensor_count(t) == 1 && w.n == 1, "a number");
	must(ct_tensors_add(&w, "all", CT_MAX_RANK, dim, &t, &err));
	OK(ct_tensor_count(t) == 60 && t->rank == CT_MAX_RANK && t->dim[7] == 5, "all dimensions");
	OK(ct_tensors_add(&w, "more", CT_MAX_RANK + 1, dim, &t, &err) < 0 && err.code == CT_EINPUT,
		"and no more");
	OK(ct_tensors_add(&w, "huge", 2, huge, &t, &err) < 0 && err.code == CT_EINPUT && w.n == 2,
		"nor a size that is none");
	OK(ct_tensors_find(&w, "all") == &w.t[1] && ct_tensors_find(&w, "none") == &w.t[0] &&
			!ct_tensors_find(&w, "more"),
		"found by name");
	ct_tensors_free(&w);
	OK(!w.t && w.n == 0, "nothing is left");
}

static float *field(struct ct_gauss *g, int f)
{
	return f < 3 ? g->pos[f] : f < 6 ? g->scale[f - 3] : f < 10 ? g->rot[f - 6] : g->raw;
}

static void test_gauss(void)
{
	struct ct_gauss g = {.gamma = 0.1};
	bool kept = true, named = true;

	must(ct_gauss_reserve(&g, 5, &err));
	g.n = 5;
	for (int f = 0; f < 11; f++)
		for (int i = 0; i < 5; i++)
			field(&g, f)[i] = (float)(f + 20 * i) / 2;
	must(ct_gauss_reserve(&g, 900, &err));
	for (int f = 0; f < 11; f++)
		for (int i = 0; i < 5; i++)
			kept = kept && field(&g, f)[i] == (float)(f + 20 * i) / 2;
	OK(kept && g.cap >= 900 && g.n == 5, "room for more, and what was there");
	must(ct_gauss_reserve(&g, 3, &err));
	OK(g.cap >= 900 && ct_gauss_check_finite(&g, &err) == 0, "room that is there stays");
	for (int f = 0; f < 11; f++) {
		const float was = field(&g, f)[3];

		field(&g, f)[3] = f % 2 ? NAN : INFINITY;
		named = named && ct_gauss_check_finite(&g, &err) < 0 && err.code == CT_ENUMERIC &&
			strcmp(err.msg, "Gaussian 3 is not finite") == 0;
		field(&g, f)[3] = was;
	}
	g.scale[1][4] = 89; /* e^89 mm */
	named = named && ct_gauss_check_finite(&g, &err) < 0 && strstr(err.msg, "Gaussian 4");
	OK(named, "one that is not finite is named");
	g.scale[1][4] = 0;
	g.gamma = (double)INFINITY;
	OK(ct_gauss_check_finite(&g, &err) < 0 && strstr(err.msg, "gamma"), "gamma is not finite");
	ct_gauss_free(&g);
	OK(!g.raw && g.cap == 0, "nothing is left");
}

int main(void)
{
	test_places();
	test_turned();
	test_grid();
	test_same_grid();
	test_stored_otherwise();
	test_finite();
	test_views();
	test_pixels();
	test_same_views();
	test_like();
	test_tensors();
	test_gauss();
	return tap_done();
}
