/* t-fit-state.c: a fit as tensors and back: every number that is kept, and what is refused.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/fit.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 5, SCALARS = 9, SETS = 3 };

static double *scalar(struct ct_fit *f, int k)
{
	double *const s[SCALARS] = {&f->g.gamma, &f->gamma.m, &f->gamma.v, &f->first_loss,
		&f->last_loss, &f->first_l1, &f->epoch_l1, &f->error, &f->pace};

	return s[k];
}

static float *array(struct ct_fit *f, size_t set, size_t k)
{
	return set == 0 ? f->g.column[k] : set == 1 ? f->adam.m[k] : f->adam.v[k];
}

/* A number of its own for everything that is kept. */
static void make(struct ct_fit *f)
{
	*f = (struct ct_fit){.opt = {.iterations = 50}, .end = CT_FIT_ENOUGH};
	must(ct_gauss_reserve(&f->g, N, &err));
	must(ct_gs_adam_reserve(&f->adam, 0, N, &err));
	f->g.n = N;
	for (size_t i = 0; i < N; i++) {
		for (size_t set = 0; set < SETS; set++)
			for (size_t k = 0; k < CT_GS_FIELDS; k++)
				array(f, set, k)[i] = (float)(1 + i + 10 * k + 200 * set) / 3;
		f->adam.steps[i] = 16777216 - (float)i;
		f->adam.screen[i] = (float)i / 7;
		f->adam.seen[i] = (float)i * 3;
	}
	for (int k = 0; k < SCALARS; k++)
		*scalar(f, k) = (1 + k) / 7.0;
	f->g.step = 50;
	f->gamma.steps = 31;
}

static bool same(struct ct_fit *a, struct ct_fit *b)
{
	bool ok = a->g.n == b->g.n && a->g.step == b->g.step && a->gamma.steps == b->gamma.steps &&
		  a->end == b->end;

	for (int k = 0; k < SCALARS; k++)
		ok &= memcmp(scalar(a, k), scalar(b, k), sizeof(double)) == 0;
	for (size_t set = 0; ok && set < SETS; set++)
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			ok &= memcmp(array(a, set, k), array(b, set, k), N * sizeof(float)) == 0;
	return ok && memcmp(a->adam.steps, b->adam.steps, N * sizeof(float)) == 0 &&
	       memcmp(a->adam.seen, b->adam.seen, N * sizeof(float)) == 0 &&
	       memcmp(a->adam.screen, b->adam.screen, N * sizeof(float)) == 0;
}

/* Into a fit that has begun otherwise. */
static int unpack(struct ct_fit *to, const struct ct_tensors *t)
{
	*to = (struct ct_fit){.opt = {.iterations = 50}};
	return ct_fit_state_unpack(to, t, &err);
}

static bool same_floats(const struct ct_tensors *t, const char *name, const float *x)
{
	return memcmp(ct_tensors_find(t, name)->data, x, N * sizeof *x) == 0;
}

static void and_back(void)
{
	for (int bare = 0; bare < 2; bare++) {
		struct ct_tensors t = {0};
		struct ct_fit f, to;

		make(&f);
		if (bare) {
			f.end = CT_FIT_RUNNING;
			f.g.step = 0;
		}
		must(ct_fit_state_pack(&t, &f, &err));
		must(unpack(&to, &t));
		OK(same(&f, &to), "packed and unpacked: the same, %s",
			bare ? "as it runs" : "at its end");
		OK(same_floats(&t, "y.m", f.adam.m[1]) &&
				same_floats(&t, "scale_2.v", f.adam.v[5]) &&
				same_floats(&t, "rot_0", f.g.rot[0]) &&
				same_floats(&t, "screen", f.adam.screen) &&
				ct_tensors_find(&t, "steps")->data[1] == 16777215 &&
				ct_tensors_find(&t, "seen")->data[1] == 3,
			"by name");
		OK(t.n == SETS * CT_GS_FIELDS + 3, "in %zu tensors", t.n);
		ct_fit_free(&f);
		ct_fit_free(&to);
		ct_tensors_free(&t);
	}
}

static bool refused(const struct ct_tensors *t, const char *word)
{
	struct ct_fit to;
	bool ok;

	err = (struct ct_err){0};
	ok = unpack(&to, t) == -1 && (err.code == CT_EINPUT || err.code == CT_ENUMERIC) &&
	     strstr(err.msg, word);
	ct_fit_free(&to);
	if (!ok)
		printf("# %s: %s\n", word, err.msg);
	return ok;
}

/* A number that none of its kind can be. */
static void numbers(struct ct_tensors *t)
{
	static const struct {
		const char *name;
		float to;
		bool wrong;
	} row[] = {{"x", NAN, true}, {"raw.v", INFINITY, true}, {"screen", -INFINITY, true},
		{"screen", -1, false}, {"steps", -1, true}, {"steps", 16777218, true},
		{"steps", 16777216, false}, {"seen", -1, true}, {"seen", 0, false}};

	for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
		struct ct_tensor *x = ct_tensors_find(t, row[k].name);
		float was = x->data[N - 1];
		struct ct_fit to;

		x->data[N - 1] = row[k].to;
		if (row[k].wrong) {
			OK(refused(t, row[k].name), "%s is never %g", row[k].name,
				(double)row[k].to);
		} else {
			OK(unpack(&to, t) == 0, "%s may be %g", row[k].name, (double)row[k].to);
			ct_fit_free(&to);
		}
		x->data[N - 1] = was;
	}
}

/* A tensor that is missing, or of another shape. */
static void shapes(struct ct_tensors *t)
{
	static const char *const name[] = {"x", "rot_3.m", "raw", "steps", "screen", "seen"};

	for (size_t k = 0; k < sizeof name / sizeof *name; k++) {
		struct ct_tensor *x = ct_tensors_find(t, name[k]);
		const char was = x->name[0];

		x->name[0] = '?';
		OK(refused(t, k ? name[k] : "no Gaussians"), "%s is missing", name[k]);
		x->name[0] = was;
		if (k == 0)
			continue;
		x->dim[0]--;
		OK(refused(t, name[k]), "%s is too short", name[k]);
		x->dim[0]++;
		x->rank = 2;
		x->dim[1] = 1;
		OK(refused(t, name[k]), "%s has two dimensions", name[k]);
		x->rank = 1;
	}
	ct_tensors_find(t, "x")->dim[0] = 0;
	OK(refused(t, "no Gaussians"), "no Gaussian");
	ct_tensors_find(t, "x")->dim[0] = N;
}

/* The metadata: scalars, step, end. */
static void words(struct ct_tensors *t)
{
	static const struct {
		const char *key, *value, *word; /* word NULL: that is fine */
	} row[] = {{CT_META_SCALARS, "1 2 3 4 5 6 7 8", "scalar 8"},
		{CT_META_SCALARS, "1 2 inf 4 5 6 7 8 9", "scalar 2"},
		{CT_META_SCALARS, "1 2 x 4 5 6 7 8 9", "scalar 2"},
		{CT_META_SCALARS, "0 2 3 4 5 6 7 8 9", "gamma"},
		{CT_META_SCALARS, "0x1p-3 2 3 4 5 6 7 8 9", NULL}, {CT_META_STEP, "51 1", "step"},
		{CT_META_STEP, "50", "step"}, {CT_META_STEP, "50 1", NULL},
		{CT_META_AT, "x", "ended"}, {CT_META_AT, "-1 0", "ended"},
		{CT_META_AT, "3 0", "ended"}, {CT_META_AT, "0 0", NULL}, {CT_META_AT, "2 1", NULL}};

	for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
		char *was = strdup(ct_meta_get(&t->meta, row[k].key));
		struct ct_fit to;

		must(ct_meta_set(&t->meta, row[k].key, row[k].value, &err));
		if (row[k].word) {
			OK(refused(t, row[k].word), "%s is refused", row[k].value);
		} else {
			OK(unpack(&to, t) == 0, "%s is taken", row[k].value);
			ct_fit_free(&to);
		}
		must(ct_meta_set(&t->meta, row[k].key, was, &err));
		free(was);
	}
	for (int k = 0; k < 3; k++) {
		struct ct_meta all = t->meta, none = {0};

		t->meta = none;
		if (k > 0)
			must(ct_meta_set(&t->meta, CT_META_SCALARS, "1 2 3 4 5 6 7 8 9", &err));
		if (k > 1)
			must(ct_meta_set(&t->meta, CT_META_STEP, "1 1", &err));
		OK(refused(t, k == 0   ? "scalar 0"
			      : k == 1 ? "step"
				       : "ended"),
			"without metadata %d", k);
		ct_meta_free(&t->meta);
		t->meta = all;
	}
}

int main(void)
{
	struct ct_tensors t = {0};
	struct ct_fit f;

	and_back();
	make(&f);
	must(ct_fit_state_pack(&t, &f, &err));
	numbers(&t);
	shapes(&t);
	words(&t);
	ct_tensors_free(&t);
	ct_fit_free(&f);
	return tap_done();
}
