/* fuse-state.c: see fuse-state.h. */
#include "config.h"
#include "tools/fuse-state.h"
#include "core/mem.h"
#include "resolution/tv-row.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RESULT "residual"

enum { SCALARS = 13, COUNTS = 4, VOLUMES = 3 };
#define DUAL "dual"

static double *scalar(struct ct_joint_at *a, size_t k)
{
	double *const s[SCALARS] = {&a->fista.norm, &a->first, &a->mu, &a->fista.momentum,
		&a->fista.misfit, &a->best, &a->chosen, &a->trust, &a->fista.next, &a->total[0],
		&a->total[1], &a->total[2], &a->total[3]};

	return s[k];
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

static int pack_at(struct ct_tensors *t, const struct ct_joint *j, struct ct_err *e)
{
	struct ct_joint_at at = j->at;
	char key[24];

	if (ct_meta_setf(&t->meta, e, CT_META_AT, "%zu %zu %d %zu", at.phase, at.done,
		    (int)at.trusted, at.sweeps))
		return -1;
	for (size_t k = 0; k < SCALARS; k++) {
		snprintf(key, sizeof key, "scalar.%zu", k);
		if (ct_meta_setf(&t->meta, e, key, "%a", *scalar(&at, k)))
			return -1;
	}
	return 0;
}

static int put_dual(struct ct_tensors *t, const struct ct_joint *j, struct ct_err *e)
{
	const size_t n = CT_TV_DUAL * j->n;
	struct ct_tensor *to;

	if (ct_tensors_add(t, DUAL, 1, &n, &to, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		to->data[i] = j->dual[i];
	return 0;
}

static int pack(struct ct_tensors *t, const void *joint, struct ct_err *e)
{
	const struct ct_joint *j = joint;

	for (size_t k = 0; k < volumes(&j->at); k++) {
		const char *name;
		const float *x = volume(j, k, &name);

		if (ct_tensors_put(t, name, 1, &j->n, x, e))
			return -1;
	}
	if (j->at.phase != CT_JOINT_DONE && put_dual(t, j, e))
		return -1;
	return pack_at(t, j, e);
}

static int pack_result(struct ct_tensors *t, const void *fuse, struct ct_err *e)
{
	const struct ct_fuse *f = fuse;

	return ct_tensors_put(t, RESULT, 1, &f->joint.n, f->residual, e) || pack_at(t, &f->joint, e)
		       ? -1
		       : 0;
}

int fuse_state_save(void *run, const struct ct_joint *j, struct ct_err *e)
{
	return ct_resume_save(run, pack, j, e);
}

int fuse_state_rescue(struct ct_resume *run, const struct ct_fuse *f, struct ct_err *e)
{
	return ct_resume_rescue(run, pack_result, f, e);
}

static int get_at(struct ct_joint_at *to, const struct ct_meta *m)
{
	const char *at = ct_meta_get(m, CT_META_AT);
	char key[24];
	int trusted;

	if (!at ||
		sscanf(at, "%zu %zu %d %zu", &to->phase, &to->done, &trusted, &to->sweeps) !=
			COUNTS ||
		to->phase > CT_JOINT_DONE || to->sweeps > CT_JOINT_SWEEPS)
		return -1;
	to->trusted = trusted != 0;
	for (size_t k = 0; k < SCALARS; k++) {
		const char *v;
		char *end;

		snprintf(key, sizeof key, "scalar.%zu", k);
		v = ct_meta_get(m, key);
		if (!v)
			return -1;
		*scalar(to, k) = strtod(v, &end);
		if (*end || end == v)
			return -1;
	}
	return 0;
}

static int get(float *x, const struct ct_tensors *t, const char *name, size_t n)
{
	const struct ct_tensor *from = ct_tensors_find(t, name);

	if (!from || ct_tensor_count(from) != n)
		return -1;
	memcpy(x, from->data, n * sizeof *x);
	return 0;
}

static int get_dual(struct ct_joint *j, const struct ct_tensors *t)
{
	const struct ct_tensor *from = ct_tensors_find(t, DUAL);

	if (!from || ct_tensor_count(from) != CT_TV_DUAL * j->n)
		return -1;
	for (size_t i = 0; i < CT_TV_DUAL * j->n; i++) {
		if (!(fabsf(from->data[i]) <= CT_TV_ONE))
			return -1;
		j->dual[i] = (int16_t)from->data[i];
	}
	return 0;
}

static int unpack(void *fuse, const struct ct_tensors *t, struct ct_err *e)
{
	struct ct_fuse *f = fuse;
	struct ct_joint *j = &f->joint;
	int bad = get_at(&j->at, &t->meta);

	if (ct_tensors_find(t, RESULT)) {
		if (ct_alloc(&f->residual, j->n, sizeof *f->residual, e))
			return -1;
		bad |= j->at.phase != CT_JOINT_DONE || get(f->residual, t, RESULT, j->n);
		return bad ? ct_fail(e, CT_EINPUT, "is not the state of such a run") : 0;
	}
	for (size_t k = 0; k < volumes(&j->at); k++) {
		const char *name;
		float *x = volume(j, k, &name);

		bad |= get(x, t, name, j->n);
	}
	if (j->at.phase != CT_JOINT_DONE)
		bad |= get_dual(j, t);
	return bad ? ct_fail(e, CT_EINPUT, "is not the state of such a run") : 0;
}

int fuse_state_load(
	struct ct_fuse *f, struct ct_resume *run, const struct ct_env *env, struct ct_err *e)
{
	int rc = ct_resume_load(run, unpack, f, e);

	if (rc == 0)
		ct_log(env, CT_INFO, "%s: continuing", run->path);
	return rc < 0 ? -1 : 0;
}
