/* ddnm-state.c: see ddnm-state.h. */
#include "config.h"
#include "ddnm-state.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/tensors.h"
#include "formats/format.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { EVERY = 60 };

static const char *hash_of(const struct ct_meta *m)
{
	const char *s = ct_meta_get(m, "input"), *hash = s ? strrchr(s, ' ') : NULL;

	return hash ? hash + 1 : "none";
}

static int describe(struct ddnm_state *s, const struct ct_superres *p, const struct ct_stack *in,
	const struct ct_stack *init, const struct ct_meta *prior, struct ct_err *e)
{
	int n = asprintf(&s->run,
		"in %s init %s prior %s scale %zu steps %zu samples %zu start %d travel %zu %zu "
		"rule %d op %d sigma_det %.17g eta %.17g sigma_y %.17g norm %.17g first %d final %d "
		"seed %llu std %d",
		hash_of(&in->meta), hash_of(&init->meta), hash_of(prior), p->scale, p->steps,
		p->samples, p->start, p->travel_length, p->travel_repeat, (int)p->rule, (int)p->op,
		p->sigma_det, p->eta, p->sigma_y, p->norm, p->first, p->final_consistency,
		(unsigned long long)s->env->seed, s->std != NULL);

	if (n >= 0)
		return 0;
	s->run = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory");
}

static const struct ct_tensor *find(const struct ct_tensors *w, const char *name, size_t count)
{
	const struct ct_tensor *t = ct_tensors_find(w, name);

	return t && ct_tensor_count(t) == count ? t : NULL;
}

static int load(struct ddnm_state *s, struct ct_stack *out, struct ct_stack *std, struct ct_err *e)
{
	struct ct_tensors w = {0};
	const struct ct_tensor *done, *views, *dev;
	const char *run;
	size_t n = ct_stack_count(out);
	int rc = -1;

	if (ct_tensors_read(s->path, &w, e))
		return -1;
	run = ct_meta_get(&w.meta, "run");
	done = find(&w, "done", out->views);
	views = find(&w, "views", n);
	dev = std ? find(&w, "deviation", n) : views;
	if (!run || strcmp(run, s->run) != 0 || !done || !views || !dev) {
		ct_fail(e, CT_EINPUT, "%s: is of a run with other inputs or options", s->path);
		goto out;
	}
	memcpy(out->data, views->data, n * sizeof *out->data);
	if (std)
		memcpy(std->data, dev->data, n * sizeof *std->data);
	for (size_t k = 0; k < out->views; k++)
		s->done[k] = done->data[k] != 0;
	rc = 0;
out:
	ct_tensors_free(&w);
	return rc;
}

int ddnm_state_open(struct ddnm_state *s, const char *out_path, bool resume,
	const struct ct_superres *p, const struct ct_stack *in, const struct ct_stack *init,
	const struct ct_meta *prior, struct ct_stack *out, struct ct_stack *std,
	const struct ct_env *env, struct ct_err *e)
{
	*s = (struct ddnm_state){.out = out, .std = std, .env = env, .last = ct_clock_wall()};
	if (ct_alloc0(&s->done, out->views, sizeof *s->done, e) ||
		describe(s, p, in, init, prior, e))
		return -1;
	memset(out->data, 0, ct_stack_count(out) * sizeof *out->data);
	if (std)
		memset(std->data, 0, ct_stack_count(std) * sizeof *std->data);
	if (strcmp(out_path, "-") == 0)
		return resume ? ct_fail(e, CT_EUSAGE, "--resume needs a named OUT") : 0;
	if (asprintf(&s->path, "%s.part", out_path) < 0) {
		s->path = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	return resume && access(s->path, F_OK) == 0 ? load(s, out, std, e) : 0;
}

static int put(struct ct_tensors *w, const char *name, const struct ct_stack *s, struct ct_err *e)
{
	const size_t dim[3] = {s->views, s->h, s->w};
	struct ct_tensor *t;

	if (ct_tensors_add(w, name, 3, dim, &t, e))
		return -1;
	memcpy(t->data, s->data, ct_stack_count(s) * sizeof *t->data);
	return 0;
}

int ddnm_state_save(void *state, bool last, struct ct_err *e)
{
	struct ddnm_state *s = state;
	struct ct_env over = *s->env;
	struct ct_tensors w = {0};
	struct ct_tensor *t;
	int rc = -1;

	if (!s->path || (!last && ct_clock_wall() - s->last < EVERY))
		return 0;
	over.force = true;
	if (ct_tensors_add(&w, "done", 1, &s->out->views, &t, e))
		goto out;
	for (size_t k = 0; k < s->out->views; k++)
		t->data[k] = s->done[k] ? 1.0f : 0.0f;
	if (put(&w, "views", s->out, e) || (s->std && put(&w, "deviation", s->std, e)) ||
		ct_meta_set(&w.meta, "run", s->run, e))
		goto out;
	rc = ct_tensors_write(s->path, &w, false, &over, e);
	s->last = ct_clock_wall();
out:
	ct_tensors_free(&w);
	return rc;
}

void ddnm_state_remove(const struct ddnm_state *s)
{
	if (s->path)
		unlink(s->path);
}

void ddnm_state_close(struct ddnm_state *s)
{
	free(s->path);
	free(s->run);
	free(s->done);
	*s = (struct ddnm_state){0};
}
