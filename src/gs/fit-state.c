/* fit-state.c: a fit as tensors (fit.h). SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/words.h"
#include "core/number.h"
#include "gs/fit.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

enum { STATES = CT_GS_FIELDS + CT_GS_ADAM_COLUMNS, SCALARS = 9, NAME = 16 };

/* The k-th array of a fit, and its name. */
static float *array_of(const struct ct_fit *f, size_t k, char name[NAME])
{
	static const char *const field[] = {"x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0",
		"rot_1", "rot_2", "rot_3", "raw"};
	static const char *const part[] = {"", ".m", ".v"};
	static const char *const seen[] = {"steps", "screen", "seen"};
	const size_t at = k % CT_GS_FIELDS, set = k / CT_GS_FIELDS;

	if (set < 3)
		snprintf(name, NAME, "%s%s", field[at], part[set]);
	else
		snprintf(name, NAME, "%s", seen[at]);
	return set == 0 ? f->g.column[at] : f->adam.column[k - CT_GS_FIELDS];
}

static void scalars(struct ct_fit *f, double *s[static SCALARS])
{
	double *const all[SCALARS] = {&f->g.gamma, &f->gamma.m, &f->gamma.v, &f->first_loss,
		&f->last_loss, &f->first_l1, &f->epoch_l1, &f->error, &f->pace};

	memcpy(s, all, sizeof all);
}

int ct_fit_state_pack(struct ct_tensors *t, const void *fit, struct ct_err *e)
{
	struct ct_fit f = *(const struct ct_fit *)fit; /* the same arrays; only read */
	char name[NAME];
	double *s[SCALARS];

	for (size_t k = 0; k < STATES; k++) {
		const float *x = array_of(&f, k, name);

		if (ct_tensors_put(t, name, 1, &f.g.n, x, e))
			return -1;
	}
	scalars(&f, s);
	if (ct_meta_put_scalars(&t->meta, SCALARS, s, e) ||
		ct_meta_setf(&t->meta, e, CT_META_STEP, "%zu %u", f.g.step, f.gamma.steps) ||
		ct_meta_setf(&t->meta, e, CT_META_AT, "%d", (int)f.end))
		return -1;
	return 0;
}

static int get_arrays(struct ct_fit *f, const struct ct_tensors *t, struct ct_err *e)
{
	const size_t n = f->g.n;

	for (size_t k = 0; k < STATES; k++) {
		char name[NAME];
		float *x = array_of(f, k, name);
		const float *in = ct_tensors_vector(t, name, n, e);
		const bool count = x == f->adam.steps || x == f->adam.seen;

		if (!in)
			return -1;
		for (size_t i = 0; count && i < n; i++)
			if (!(in[i] >= 0 && in[i] <= 16777216.0f))
				return ct_fail(e, CT_EINPUT, "'%s' of the state: %g at %zu", name,
					(double)in[i], i);
		memcpy(x, in, n * sizeof *x);
	}
	return 0;
}

static int get_scalars(struct ct_fit *f, const struct ct_tensors *t, struct ct_err *e)
{
	const char *step = ct_meta_get(&t->meta, CT_META_STEP);
	const char *at = ct_meta_get(&t->meta, CT_META_AT);
	double *s[SCALARS];
	const char *rest;
	double steps[2], end = -1;

	scalars(f, s);
	if (ct_meta_get_scalars(&t->meta, SCALARS, s, e))
		return -1;
	if (!step || !ct_words_numbers(step, ' ', 2, false, steps) ||
		!(steps[0] >= 0 && steps[0] <= (double)f->opt.iterations) ||
		!(steps[1] >= 0 && steps[1] <= UINT_MAX))
		return ct_fail(e, CT_EINPUT, "the state has no valid step");
	f->g.step = (size_t)steps[0];
	f->gamma.steps = (unsigned)steps[1];
	if (!(f->g.gamma > 0))
		return ct_fail(e, CT_EINPUT, "gamma of the state is not positive");
	if (at)
		end = ct_number_begin(at, &rest);
	if (!at || (*rest && *rest != ' ') || !(end >= CT_FIT_RUNNING && end < CT_FIT_EMPTY))
		return ct_fail(e, CT_EINPUT, "the state does not say whether the fit has ended");
	f->end = (enum ct_fit_end)(int)end;
	return 0;
}

int ct_fit_state_unpack(void *fit, const struct ct_tensors *t, struct ct_err *e)
{
	struct ct_fit *f = fit;
	const struct ct_tensor *first = ct_tensors_find(t, "x");
	size_t n;

	if (!first || (n = ct_tensor_count(first)) == 0 || n > UINT32_MAX)
		return ct_fail(e, CT_EINPUT, "the state has no Gaussians");
	if (ct_gauss_reserve(&f->g, n, e) || ct_gs_adam_reserve(&f->adam, 0, n, e))
		return -1;
	f->g.n = n;
	return ct_err_any(get_arrays(f, t, e) || get_scalars(f, t, e));
}
