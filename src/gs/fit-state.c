/* fit-state.c: see fit-state.h. Numbers that a float cannot hold stand in the metadata, in
 * hexadecimal. */
#include "config.h"
#include "gs/fit-state.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 3 * CT_GS_FIELDS + 3, SCALARS = 9 };

static const char *const field_name[CT_GS_FIELDS] = {
	"x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "raw"};

/* The k-th array of a fit, float or (*count != NULL) whole numbers, and its name. */
static void array_of(struct ct_fit *f, size_t k, char name[40], float **x, uint32_t **count)
{
	static const char *const part[] = {"", ".m", ".v"};
	size_t field = k % CT_GS_FIELDS, set = k / CT_GS_FIELDS;

	*x = NULL;
	*count = NULL;
	if (set < 3) {
		snprintf(name, 40, "%s%s", field_name[field], part[set]);
		*x = set == 0   ? ct_gaussian_field(&f->g, field)
		     : set == 1 ? f->adam.m[field]
				: f->adam.v[field];
		return;
	}
	snprintf(name, 40, "%s", field == 0 ? "steps" : field == 1 ? "screen" : "seen");
	if (field == 1)
		*x = f->adam.screen;
	else
		*count = field == 0 ? f->adam.steps : f->adam.seen;
}

static double *scalar(struct ct_fit *f, size_t k)
{
	double *const s[SCALARS] = {&f->g.gamma, &f->gamma.m, &f->gamma.v, &f->first_loss,
		&f->last_loss, &f->first_l1, &f->epoch_l1, &f->error, &f->pace};

	return s[k];
}

/* The curve: points x 3. */
static int pack_points(struct ct_tensors *t, const struct ct_fit *f, struct ct_err *e)
{
	const size_t dim[2] = {f->points, sizeof *f->point / sizeof(float)};
	return f->points ? ct_tensors_put(t, "points", 2, dim, (const float *)f->point, e) : 0;
}

static int unpack_points(struct ct_fit *f, const struct ct_tensors *t, struct ct_err *e)
{
	const struct ct_tensor *in = ct_tensors_find(t, "points");

	f->points = 0;
	if (!in)
		return 0;
	if (in->rank != 2 || in->dim[1] != sizeof *f->point / sizeof(float))
		return ct_fail(e, CT_EINPUT, "'points' of the state are not triples");
	if (ct_grow(&f->point, &f->points_cap, in->dim[0], sizeof *f->point, e))
		return -1;
	f->points = in->dim[0];
	memcpy(f->point, in->data, f->points * sizeof *f->point);
	return 0;
}

int ct_fit_state_pack(struct ct_tensors *t, const struct ct_fit *fit, struct ct_err *e)
{
	struct ct_fit f = *fit; /* the same arrays; only read */
	size_t n = f.g.n;
	char text[SCALARS * 32];
	int at = 0;

	for (size_t k = 0; k < STATES; k++) {
		struct ct_tensor *out;
		char name[40];
		uint32_t *count;
		float *x;

		array_of(&f, k, name, &x, &count);
		if (ct_tensors_add(t, name, 1, &n, &out, e))
			goto fail;
		for (size_t i = 0; i < n; i++)
			out->data[i] = x ? x[i] : (float)count[i]; /* whole below 2^24 */
	}
	if (pack_points(t, &f, e))
		goto fail;
	for (size_t k = 0; k < SCALARS; k++)
		at += snprintf(text + at, sizeof text - (size_t)at, "%a ", *scalar(&f, k));
	if (ct_meta_set(&t->meta, CT_META_SCALARS, text, e) ||
		ct_meta_setf(&t->meta, e, CT_META_STEP, "%zu %u", f.g.step, f.gamma.steps) ||
		ct_meta_setf(&t->meta, e, CT_META_AT, "%d", (int)f.end))
		goto fail;
	return 0;
fail:
	ct_tensors_free(t);
	return -1;
}

/* Whether the fit has ended. */
static int get_end(struct ct_fit *f, const struct ct_tensors *t, struct ct_err *e)
{
	const char *at = ct_meta_get(&t->meta, CT_META_AT);
	int end;

	if (!at || sscanf(at, "%d", &end) != 1 || end < CT_FIT_RUNNING || end >= CT_FIT_EMPTY)
		return ct_fail(e, CT_EINPUT, "the state does not say whether the fit has ended");
	f->end = (enum ct_fit_end)end;
	return 0;
}

static int get_scalars(struct ct_fit *f, const struct ct_tensors *t, struct ct_err *e)
{
	const char *s = ct_meta_get(&t->meta, CT_META_SCALARS),
		   *step = ct_meta_get(&t->meta, CT_META_STEP);
	char *end;

	for (size_t k = 0; s && k < SCALARS; k++, s = end) {
		*scalar(f, k) = strtod(s, &end);
		if (end == s || !isfinite(*scalar(f, k)))
			return ct_fail(e, CT_EINPUT, "scalar %zu of the state is not a number", k);
	}
	if (!s || !step || sscanf(step, "%zu %u", &f->g.step, &f->gamma.steps) != 2 ||
		f->g.step > f->opt.iterations)
		return ct_fail(e, CT_EINPUT, "the state has no scalars, or no valid step");
	if (!(f->g.gamma > 0))
		return ct_fail(e, CT_EINPUT, "gamma of the state is not positive");
	return 0;
}

int ct_fit_state_unpack(struct ct_fit *f, const struct ct_tensors *t, struct ct_err *e)
{
	const struct ct_tensor *first = ct_tensors_find(t, field_name[0]);
	size_t n;

	if (!first || (n = ct_tensor_count(first)) == 0 || n > UINT32_MAX)
		return ct_fail(e, CT_EINPUT, "the state has no Gaussians");
	if (ct_gauss_reserve(&f->g, n, e) || ct_gs_adam_reserve(&f->adam, 0, n, e))
		return -1;
	f->g.n = n;
	for (size_t k = 0; k < STATES; k++) {
		const struct ct_tensor *in;
		char name[40];
		uint32_t *count;
		float *x;

		array_of(f, k, name, &x, &count);
		in = ct_tensors_find(t, name);
		if (!in || in->rank != 1 || in->dim[0] != n)
			return ct_fail(
				e, CT_EINPUT, "the state has no '%s' of %zu numbers", name, n);
		for (size_t i = 0; i < n; i++) {
			if (!isfinite(in->data[i]) ||
				(count && !(in->data[i] >= 0 && in->data[i] <= 16777216.0f)))
				return ct_fail(e, CT_EINPUT, "'%s' of the state: %g at %zu", name,
					(double)in->data[i], i);
			if (x)
				x[i] = in->data[i];
			else
				count[i] = (uint32_t)in->data[i];
		}
	}
	return unpack_points(f, t, e) || get_scalars(f, t, e) || get_end(f, t, e) ? -1 : 0;
}
