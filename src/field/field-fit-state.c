/* field-fit-state.c: a fit as tensors (field-fit.h). SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/field-fit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { ARRAYS = 3, NAME = 16 };

/* Array k of a pass, and its name. */
static float *array_of(const struct ct_field_pass *p, size_t pass, size_t k, char name[static NAME])
{
	static const char *const word[ARRAYS] = {"weights", "m", "v"};
	float *const x[ARRAYS] = {p->field->weights, p->m, p->v};

	snprintf(name, NAME, "%s.%zu", word[k], pass);
	return x[k];
}

int ct_field_fit_pack(struct ct_tensors *t, const void *fit, struct ct_err *e)
{
	const struct ct_field_fit *f = fit;
	char name[NAME];

	for (size_t p = 0; p < ct_samples_passes(&f->rule.samples); p++) {
		const size_t n = f->pass[p].field->count;

		for (size_t k = 0; k < ARRAYS; k++) {
			const float *x = array_of(&f->pass[p], p, k, name);

			if (ct_tensors_put(t, name, 1, &n, x, e))
				return -1;
		}
	}
	if (ct_meta_setf(&t->meta, e, CT_META_STEP, "%zu", f->step) ||
		ct_meta_setf(&t->meta, e, CT_META_AT, "%d", (int)f->whole))
		return -1;
	return ct_meta_setf(&t->meta, e, CT_META_SCALARS, "%a %a %a", f->used, f->first, f->last);
}

int ct_field_fit_unpack(void *fit, const struct ct_tensors *t, struct ct_err *e)
{
	struct ct_field_fit *f = fit;
	const size_t most = f->rule.iterations;
	double *const scalars[] = {&f->used, &f->first, &f->last};
	char name[NAME];
	double step, whole;

	for (size_t p = 0; p < ct_samples_passes(&f->rule.samples); p++) {
		const size_t n = f->pass[p].field->count;

		for (size_t k = 0; k < ARRAYS; k++) {
			float *to = array_of(&f->pass[p], p, k, name);
			const float *x = ct_tensors_vector(t, name, n, e);

			if (!x)
				return -1;
			for (size_t i = 0; k == 2 && i < n; i++)
				if (x[i] < 0)
					return ct_fail(e, CT_EINPUT, "tensor %s: value %zu is %g",
						name, i, (double)x[i]);
			memcpy(to, x, n * sizeof *to);
		}
	}
	if (ct_meta_numbers(&t->meta, CT_META_STEP, 1, &step, e) || step != floor(step) ||
		!(step >= 0 && step <= (most ? (double)most : 0x1p53)))
		return ct_fail(e, CT_EINPUT, "the state has no valid step");
	if (ct_meta_numbers(&t->meta, CT_META_AT, 1, &whole, e) ||
		ct_meta_get_scalars(&t->meta, 3, scalars, e) || !(f->used >= 0))
		return ct_fail(e, CT_EINPUT, "the state has no scalars, or wrong ones");
	f->step = (size_t)step;
	f->whole = whole != 0;
	return 0;
}
