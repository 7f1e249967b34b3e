/* fuse-state.c: see fuse-state.h. */
#include "config.h"
#include "tools/fuse-state.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SCALARS = 8, COUNTS = 3, VOLUMES = 3 };

static double *scalar(struct ct_joint_at *a, size_t k)
{
	double *const s[SCALARS] = {&a->fista.norm, &a->first, &a->mu, &a->fista.momentum,
		&a->fista.misfit, &a->best, &a->chosen, &a->trust};

	return s[k];
}

static float *volume(const struct ct_joint *j, size_t k, const char **name, size_t *count)
{
	static const char *const names[VOLUMES] = {"x", "ahead", "dual"};
	float *const at[VOLUMES] = {j->x, j->ahead, j->dual};

	*name = names[k];
	*count = k == 2 ? CT_TV_DUAL * j->n : j->n;
	return at[k];
}

int fuse_state_save(void *run, const struct ct_joint *j, struct ct_err *e)
{
	struct ct_joint_at at = j->at;
	struct ct_tensors t = {0};
	char key[24];
	int rc = -1;

	if (ct_meta_setf(&t.meta, e, CT_META_AT, "%zu %zu %d", at.phase, at.done, (int)at.trusted))
		goto out;
	for (size_t k = 0; k < SCALARS; k++) {
		snprintf(key, sizeof key, "scalar.%zu", k);
		if (ct_meta_setf(&t.meta, e, key, "%a", *scalar(&at, k)))
			goto out;
	}
	for (size_t k = 0; k < VOLUMES; k++) {
		struct ct_tensor *to;
		const char *name;
		size_t count;
		const float *from = volume(j, k, &name, &count);

		if (ct_tensors_add(&t, name, 1, &count, &to, e))
			goto out;
		memcpy(to->data, from, count * sizeof *from);
	}
	rc = ct_resume_save(run, &t, e);
out:
	ct_tensors_free(&t);
	return rc;
}

static int unpack(struct ct_joint *j, const struct ct_tensors *t, struct ct_err *e)
{
	const char *at = ct_meta_get(&t->meta, CT_META_AT);
	struct ct_joint_at *to = &j->at;
	char key[24];
	int trusted;

	if (!at || sscanf(at, "%zu %zu %d", &to->phase, &to->done, &trusted) != COUNTS ||
		to->phase > CT_JOINT_DONE)
		goto broken;
	to->trusted = trusted != 0;
	for (size_t k = 0; k < SCALARS; k++) {
		const char *v;
		char *end;

		snprintf(key, sizeof key, "scalar.%zu", k);
		v = ct_meta_get(&t->meta, key);
		if (!v)
			goto broken;
		*scalar(to, k) = strtod(v, &end);
		if (*end || end == v)
			goto broken;
	}
	for (size_t k = 0; k < VOLUMES; k++) {
		const char *name;
		size_t count;
		float *x = volume(j, k, &name, &count);
		const struct ct_tensor *from = ct_tensors_find(t, name);

		if (!from || ct_tensor_count(from) != count)
			goto broken;
		memcpy(x, from->data, count * sizeof *x);
	}
	return 0;
broken:
	return ct_fail(e, CT_EINPUT, "is not the state of such a run");
}

int fuse_state_load(
	struct ct_joint *j, const struct ct_resume *run, const struct ct_env *env, struct ct_err *e)
{
	struct ct_tensors t = {0};
	int rc = ct_resume_load(run, &t, e);

	if (rc == 0 && unpack(j, &t, e))
		rc = ct_blame(e, run->path);
	if (rc == 0)
		ct_log(env, CT_INFO, "%s: continuing", run->path);
	ct_tensors_free(&t);
	return rc < 0 ? -1 : 0;
}
