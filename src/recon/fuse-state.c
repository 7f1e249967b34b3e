/* fuse-state.c: a solver that was interrupted, or its result, as tensors (fuse.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/words.h"
#include "core/mem.h"
#include "recon/fuse.h"
#include "inverse/tv-row.h"

#include <math.h>
#include <string.h>

#define RESULT "residual"
#define DUAL "dual"

enum { SCALARS = 13, COUNTS = 4, VOLUMES = 3 };

static void scalars(struct ct_joint_at *a, double *s[static SCALARS])
{
	double *const all[SCALARS] = {&a->fista.norm, &a->first, &a->mu, &a->fista.momentum,
		&a->fista.misfit, &a->best, &a->chosen, &a->trust, &a->fista.next, &a->total[0],
		&a->total[1], &a->total[2], &a->total[3]};

	memcpy(s, all, sizeof all);
}

/* What a state holds of the volumes: x alone when it is done, and what x is to be near to if that
 * is being looked for. */
static size_t volumes(const struct ct_joint_at *at)
{
	return at->phase == CT_JOINT_DONE ? 1 : at->fista.next > 0 ? VOLUMES : VOLUMES - 1;
}

static float *volume(const struct ct_joint *j, size_t k, const char **name)
{
	static const char *const names[VOLUMES] = {"x", "ahead", "to"};
	float *const at[VOLUMES] = {j->x, j->ahead, j->g};

	*name = names[k];
	return at[k];
}

static int put_at(struct ct_tensors *t, const struct ct_joint *j, struct ct_err *e)
{
	struct ct_joint_at at = j->at;
	double *s[SCALARS];

	scalars(&at, s);
	if (ct_meta_put_scalars(&t->meta, SCALARS, s, e))
		return -1;
	return ct_meta_setf(&t->meta, e, CT_META_AT, "%zu %zu %d %zu", at.phase, at.done,
		(int)at.trusted, at.sweeps);
}

static int put_joint(struct ct_tensors *t, const struct ct_joint *j, struct ct_err *e)
{
	const size_t n = CT_TV_DUAL * j->n;
	struct ct_tensor *dual;
	const char *name;

	for (size_t k = 0; k < volumes(&j->at); k++) {
		const float *x = volume(j, k, &name);

		if (ct_tensors_put(t, name, 1, &j->n, x, e))
			return -1;
	}
	if (j->at.phase == CT_JOINT_DONE)
		return 0;
	if (ct_tensors_add(t, DUAL, 1, &n, &dual, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		dual->data[i] = j->dual[i];
	return 0;
}

int ct_fuse_pack(struct ct_tensors *t, const void *fuse, struct ct_err *e)
{
	const struct ct_fuse *f = fuse;
	const struct ct_joint *j = &f->joint;

	if (f->residual ? ct_tensors_put(t, RESULT, 1, &j->n, f->residual, e) : put_joint(t, j, e))
		return -1;
	return put_at(t, j, e);
}

static bool get_at(struct ct_joint_at *to, const struct ct_meta *m)
{
	const char *at = ct_meta_get(m, CT_META_AT);
	double *s[SCALARS];
	struct ct_err why;
	double n[COUNTS];

	if (!at || !ct_words_numbers(at, ' ', COUNTS, false, n))
		return false;
	for (size_t k = 0; k < COUNTS; k++)
		if (!(n[k] >= 0 && n[k] <= 0x1p53))
			return false;
	to->phase = (size_t)n[0];
	to->done = (size_t)n[1];
	to->trusted = n[2] != 0;
	to->sweeps = (size_t)n[3];
	if (to->phase > CT_JOINT_DONE || to->sweeps > CT_JOINT_SWEEPS)
		return false;
	scalars(to, s);
	return ct_meta_get_scalars(m, SCALARS, s, &why) == 0;
}

static bool get_joint(struct ct_joint *j, const struct ct_tensors *t)
{
	struct ct_err why;
	const bool done = j->at.phase == CT_JOINT_DONE;
	const float *dual = ct_tensors_vector(t, DUAL, CT_TV_DUAL * j->n, &why), *from;
	const char *name;

	for (size_t k = 0; k < volumes(&j->at); k++) {
		float *x = volume(j, k, &name);

		from = ct_tensors_vector(t, name, j->n, &why);
		if (!from)
			return false;
		memcpy(x, from, j->n * sizeof *x);
	}
	for (size_t i = 0; !done && i < CT_TV_DUAL * j->n; i++) {
		if (!dual || !(fabsf(dual[i]) <= CT_TV_ONE))
			return false;
		j->dual[i] = (int16_t)dual[i];
	}
	return true;
}

int ct_fuse_unpack(void *fuse, const struct ct_tensors *t, struct ct_err *e)
{
	struct ct_fuse *f = fuse;
	struct ct_joint *j = &f->joint;
	const float *result = ct_tensors_vector(t, RESULT, j->n, e);
	bool good = get_at(&j->at, &t->meta);

	if (result) {
		if (ct_alloc(&f->residual, j->n, sizeof *f->residual, e))
			return -1;
		memcpy(f->residual, result, j->n * sizeof *result);
		good = good && j->at.phase == CT_JOINT_DONE;
	} else
		good = good && get_joint(j, t);
	return good ? 0 : ct_fail(e, CT_EINPUT, "is not the state of such a run");
}
