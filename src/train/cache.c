/* cache.c: see cache.h. */
#include "config.h"
#include "core/mem.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "train/cache.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

int train_cache_open(const char *folder, struct ct_err *e)
{
	if (mkdir(folder, 0700) && errno != EEXIST)
		return ct_fail_errno(e, CT_EOUTPUT, folder);
	return 0;
}

/* All that makes an example, but the name of its volume. */
static int name_of(char **key, char **path, const char *folder, const struct ct_vol *v,
	const double bytes[static 2], const struct ct_example_rule *r, uint64_t index,
	struct ct_err *e)
{
	const char axes[] = {
		r->soft[0] ? '-' : 'x', r->soft[1] ? '-' : 'y', r->soft[2] ? '-' : 'z', 0};
	const char *held = strrchr(ct_meta_get(&v->meta, CT_META_INPUT), ' ');
	uint64_t bits[2];

	*path = NULL;
	if (asprintf(key, "%s %s %g:%g %zu %zu %s %g:%g %g %g:%g %llu %llu%s%s", PACKAGE_VERSION,
		    held ? held + 1 : "", bytes[0], bytes[1], r->side, r->factor,
		    r->thick ? axes : "111", r->scale[0], r->scale[1], r->noise, r->clip[0],
		    r->clip[1], (unsigned long long)r->seed, (unsigned long long)index,
		    r->hash ? " " : "", r->hash ? r->hash : "") < 0) {
		*key = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	ct_hash_pieces(bits, 1, &(const struct ct_piece){*key, strlen(*key)});
	if (asprintf(path, "%s/%016llx%016llx.safetensors", folder, (unsigned long long)bits[0],
		    (unsigned long long)bits[1]) >= 0)
		return 0;
	*path = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory");
}

/* False if the file is not there, damaged, or of another key. */
static bool read_back(struct ct_example *p, const char *path, const char *key,
	const struct ct_example_rule *r, uint64_t index)
{
	struct ct_tensors w = {0};
	const struct ct_tensor *t;
	const char *said;
	struct ct_err e;
	size_t count;
	bool ok = false;

	if (ct_tensors_read(path, &w, &e))
		return false;
	t = ct_tensors_find(&w, "base,rest");
	said = ct_meta_get(&w.meta, CT_META_DATASET);
	if (!t || t->rank != 4 || t->dim[0] != 2 || !said || strcmp(said, key) != 0)
		goto out;
	count = t->dim[1] * t->dim[2] * t->dim[3];
	if (ct_alloc(&p->base, 2 * count, sizeof *p->base, &e))
		goto out;
	p->rest = p->base + count;
	memcpy(p->base, t->data, 2 * count * sizeof *p->base);
	for (int a = 0; a < 3; a++)
		p->n[a] = t->dim[3 - a];
	ct_example_regime(p, r, index);
	ct_example_weigh(p);
	ok = true;
out:
	ct_tensors_free(&w);
	return ok;
}

static int keep(const char *path, const char *key, const struct ct_example *p, struct ct_err *e)
{
	const size_t dim[4] = {2, p->n[2], p->n[1], p->n[0]};
	struct ct_tensors w = {0};
	const int rc = ct_meta_set(&w.meta, CT_META_DATASET, key, e) ||
				       ct_tensors_put(&w, "base,rest", 4, dim, p->base, e) ||
				       ct_tensors_write_private(path, &w, e)
			       ? -1
			       : 0;

	ct_tensors_free(&w);
	return rc;
}

static int make(struct ct_example *p, const char *folder, const struct ct_vol *v,
	const double bytes[static 2], const struct ct_example_rule *rule, uint64_t index,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_example_rule before = *rule;
	int rc;

	if (!rule->after)
		return ct_example_alloc(p, v, rule, index, env, e);
	before.after = NULL;
	before.hash = NULL;
	rc = train_cache_example(p, folder, v, bytes, &before, index, env, e);
	if (rc || ct_example_after(p, rule, index, env, e) == 0)
		return rc;
	ct_example_free(p);
	return -1;
}

int train_cache_example(struct ct_example *p, const char *folder, const struct ct_vol *v,
	const double bytes[static 2], const struct ct_example_rule *rule, uint64_t index,
	const struct ct_env *env, struct ct_err *e)
{
	char *key = NULL, *path = NULL;
	int rc = -1;

	if (!folder)
		return make(p, folder, v, bytes, rule, index, env, e);
	if (name_of(&key, &path, folder, v, bytes, rule, index, e))
		goto out;
	rc = 0;
	if (read_back(p, path, key, rule, index))
		goto out;
	rc = make(p, folder, v, bytes, rule, index, env, e);
	if (rc == 0 && keep(path, key, p, e)) {
		ct_example_free(p);
		rc = -1;
	}
out:
	free(key);
	free(path);
	return rc;
}
