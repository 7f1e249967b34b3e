/* fuse-state.c: see fuse-state.h. */
#include "config.h"
#include "tools/fuse-state.h"
#include "formats/format.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void fuse_state_free(struct fuse_state *s)
{
	free(s->path);
	free(s->run);
}

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

int fuse_state_save(void *ctx, const struct ct_joint *j, struct ct_err *e)
{
	const struct fuse_state *s = ctx;
	struct ct_env env = *s->env;
	struct ct_joint_at at = j->at;
	struct ct_tensors t = {0};
	char key[24];
	int rc = -1;

	if (!s->path)
		return 0;
	env.force = true; /* over the state before */
	if (ct_meta_set(&t.meta, "run", s->run, e) ||
		ct_meta_setf(&t.meta, e, "at", "%zu %zu %d", at.phase, at.done, (int)at.trusted))
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
	rc = ct_tensors_write(s->path, &t, false, &env, e);
out:
	ct_tensors_free(&t);
	return rc;
}

static int unpack(struct ct_joint *j, const struct ct_tensors *t, const struct fuse_state *s,
	struct ct_err *e)
{
	const char *run = ct_meta_get(&t->meta, "run"), *at = ct_meta_get(&t->meta, "at");
	struct ct_joint_at *to = &j->at;
	char key[24];
	int trusted;

	if (!run || strcmp(run, s->run) != 0)
		return ct_fail(
			e, CT_EINPUT, "%s: is of a run with other inputs or options", s->path);
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
	ct_log(s->env, CT_INFO, "%s: continuing", s->path);
	return 0;
broken:
	return ct_fail(e, CT_EINPUT, "%s: is not the state of such a run", s->path);
}

int fuse_state_resume(struct ct_joint *j, const struct fuse_state *s, struct ct_err *e)
{
	struct ct_tensors t = {0};
	int rc = -1;

	if (access(s->path, F_OK) != 0 && errno == ENOENT)
		return 0;
	if (ct_tensors_read(s->path, &t, e) == 0)
		rc = unpack(j, &t, s, e);
	ct_tensors_free(&t);
	return rc;
}
