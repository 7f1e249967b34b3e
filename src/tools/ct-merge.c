/* ct-merge: parts of a volume, or of a stack, to the whole. */
#include "config.h"
#include "cli/cli.h"
#include "cli/keep.h"
#include "cli/memory.h"
#include "cli/part.h"
#include "core/room.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "resolution/crop.h"

#include <stdlib.h>
#include <string.h>

struct params {
	struct ct_list files; /* the last is OUT */
	const char *memory;
};

static const struct params defaults = {0};

static const struct ct_opt opts[] = {
	CT_MEMORY(struct params, memory),
	CT_ARG_OUT(struct params, files, CT_READS_WRITES, "FILE", CT_ENDS_VOLUME "|" CT_ENDS_STACK,
		"PART: what ct-upsample or ct-restore --brick, or ct-ddnm --views made, of one run, in any "
		"order; then OUT: the whole of it, NIfTI or EXR"),
	CT_OPT_END,
};

struct job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_any whole; /* its metadata is that of the first part */
	struct ct_part *part;
	struct ct_meta *said; /* of each part */
	char *run;
	struct ct_memory memory;
};

static float *values(const struct ct_any *a, size_t *n)
{
	*n = a->kind == CT_KIND_STACK ? ct_stack_count(&a->stack) : ct_vol_count(&a->vol);
	return a->kind == CT_KIND_STACK ? a->stack.data : a->vol.data;
}

/* Is it a part, as it was written, and of which? */
static int examine(struct ct_part *p, const struct ct_any *a, struct ct_err *e)
{
	const struct ct_meta *m = ct_any_meta(a);
	const bool stack = a->kind == CT_KIND_STACK;
	size_t n;
	float *x;
	int rc;

	if (!stack && a->kind != CT_KIND_VOLUME)
		return ct_fail(e, CT_EINPUT, "is neither a volume nor a stack");
	rc = ct_part_get(p, m, e);
	if (rc)
		return rc < 0 ? -1 : ct_fail(e, CT_EINPUT, "is no part: it does not say of what");
	x = values(a, &n);
	if (stack != (p->axis == CT_PART_VIEWS) ||
		p->to - p->from != (stack ? a->stack.views : a->vol.n[p->axis]))
		return ct_fail(e, CT_EINPUT, "is not of the size that %s says", CT_META_PART);
	return ct_part_check(m, x, n, e);
}

/* Where the first voxel of the whole lies. */
static void whole_affine(double to[3][4], const struct ct_vol *v, const struct ct_part *p)
{
	double start[3] = {0};

	memcpy(to, v->affine, sizeof v->affine);
	start[p->axis] = -(double)p->from;
	ct_crop_affine(to, start);
}

static int begin(struct job *j, const struct ct_any *a, const struct ct_part *p, struct ct_err *e)
{
	const struct ct_meta *m = ct_any_meta(a);
	const bool stack = a->kind == CT_KIND_STACK;
	const char *out = j->p->files.v[j->p->files.n - 1];
	struct ct_any *w = &j->whole;
	size_t n[3];

	w->kind = a->kind;
	if (ct_ends_match(out, stack ? CT_ENDS_VOLUME : CT_ENDS_STACK))
		return ct_fail(e, CT_EUSAGE, "is %s, which %s is not by its name",
			stack ? "a part of a stack" : "a slab of a volume", out);
	j->run = strdup(ct_meta_get(m, CT_META_PART_RUN));
	if (!j->run)
		return ct_fail(e, CT_ENOMEM, "no memory");
	if (stack) {
		const double view = (double)a->stack.h * (double)a->stack.w;

		if (ct_memory_settle(&j->memory, 4 * view * (double)(p->of + a->stack.views),
			    (const size_t[]){a->stack.w, a->stack.h, 1}, 4 * view * (double)p->of,
			    j->env, e) ||
			ct_stack_alloc(&w->stack, p->of, a->stack.h, a->stack.w, e))
			return -1;
		w->stack.beam = a->stack.beam;
		return ct_meta_copy(&w->stack.meta, m, e);
	}
	memcpy(n, a->vol.n, sizeof n);
	n[p->axis] = p->of;
	if (ct_memory_settle(&j->memory,
		    4 * ((double)n[0] * (double)n[1] * (double)n[2] +
				(double)ct_vol_count(&a->vol)),
		    n, 0, j->env, e) ||
		ct_vol_alloc(&w->vol, n, e))
		return -1;
	whole_affine(w->vol.affine, &a->vol, p);
	return ct_meta_copy(&w->vol.meta, m, e);
}

/* Is it of the same whole as those before? */
static int belongs(const struct job *j, const struct ct_any *a, size_t i, struct ct_err *e)
{
	const struct ct_part *p = &j->part[i], *first = &j->part[0];
	const struct ct_any *w = &j->whole;
	struct ct_vol frame = {0};

	if (a->kind != w->kind || p->axis != first->axis || p->of != first->of ||
		strcmp(ct_meta_get(ct_any_meta(a), CT_META_PART_RUN), j->run) != 0)
		return ct_fail(e, CT_EGEOM, "is of another run than %s", j->p->files.v[0]);
	for (size_t k = 0; k < i; k++)
		if (p->from < j->part[k].to && j->part[k].from < p->to)
			return ct_fail(e, CT_EGEOM, "holds %zu:%zu of what %s holds",
				p->from > j->part[k].from ? p->from : j->part[k].from,
				p->to < j->part[k].to ? p->to : j->part[k].to, j->p->files.v[k]);
	if (a->kind == CT_KIND_STACK)
		return a->stack.h == w->stack.h && a->stack.w == w->stack.w &&
				       a->stack.beam == w->stack.beam
			       ? 0
			       : ct_fail(e, CT_EGEOM, "is not of the size of %s", j->p->files.v[0]);
	memcpy(frame.n, a->vol.n, sizeof frame.n);
	frame.n[p->axis] = p->of;
	whole_affine(frame.affine, &a->vol, p);
	return ct_vol_same_grid(&frame, &w->vol, e);
}

static void enter(struct job *j, const struct ct_any *a, const struct ct_part *p)
{
	struct ct_any *w = &j->whole;

	if (a->kind == CT_KIND_STACK) {
		memcpy(w->stack.view + p->from, a->stack.view,
			a->stack.views * sizeof *a->stack.view);
		for (size_t k = 0; k < a->stack.views; k++) {
			memcpy(ct_stack_view(&w->stack, p->from + k), ct_stack_view(&a->stack, k),
				a->stack.h * a->stack.w * sizeof *a->stack.data);
			ct_room_trim();
		}
		return;
	}
	for (size_t k = 0; k < a->vol.n[2]; k++) {
		for (size_t y = 0; y < a->vol.n[1]; y++) {
			const size_t at[3] = {p->axis == 0 ? p->from : 0,
				y + (p->axis == 1 ? p->from : 0), k + (p->axis == 2 ? p->from : 0)};

			memcpy(w->vol.data + (at[2] * w->vol.n[1] + at[1]) * w->vol.n[0] + at[0],
				a->vol.data + (k * a->vol.n[1] + y) * a->vol.n[0],
				a->vol.n[0] * sizeof *a->vol.data);
		}
		ct_room_trim();
	}
}

static int add(struct job *j, size_t i, struct ct_err *e)
{
	struct ct_any a = {0};
	int rc = ct_any_read(j->p->files.v[i], &a, e);

	if (rc == 0) {
		rc = examine(&j->part[i], &a, e) || (i == 0 && begin(j, &a, &j->part[0], e)) ||
				     belongs(j, &a, i, e) ||
				     ct_meta_copy(&j->said[i], ct_any_meta(&a), e)
			     ? ct_blame(e, j->p->files.v[i])
			     : 0;
		if (rc == 0)
			enter(j, &a, &j->part[i]);
	}
	ct_any_free(&a);
	return rc;
}

/* All of the whole is in some part: they do not overlap, so that the next begins where one ends. */
static int check_all(const struct job *j, size_t n, struct ct_err *e)
{
	size_t at = 0;

	while (at < j->part[0].of) {
		size_t next = j->part[0].of, found = n;

		for (size_t i = 0; i < n; i++) {
			if (j->part[i].from == at)
				found = i;
			if (j->part[i].from > at && j->part[i].from < next)
				next = j->part[i].from;
		}
		if (found == n)
			return ct_fail(e, CT_EGEOM, "%s %zu:%zu of %zu are in none of the parts",
				j->whole.kind == CT_KIND_STACK ? "views" : "voxels", at, next,
				j->part[0].of);
		at = j->part[found].to;
	}
	return 0;
}

static int write_whole(struct job *j, size_t n, struct ct_err *e)
{
	const bool stack = j->whole.kind == CT_KIND_STACK;
	struct ct_meta *m = stack ? &j->whole.stack.meta : &j->whole.vol.meta;
	const struct ct_meta **from = calloc(n, sizeof *from);
	const char *out = j->p->files.v[n];
	int rc = -1;

	for (size_t i = 0; from && i < n; i++)
		from[i] = &j->said[i];
	ct_part_drop(m);
	ct_meta_drop(m, CT_META_HISTORY);
	if (!from)
		ct_fail(e, CT_ENOMEM, "no memory");
	else if (ct_check_stop(j->env, e) == 0 && ct_meta_step(m, j->env, n, from, e) == 0)
		rc = stack ? ct_keep_stack(out, &j->whole.stack, j->env, e)
			   : ct_keep_vol(out, &j->whole.vol, j->env, e);
	free(from);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = params, .env = env};
	const size_t n = j.p->files.n - 1;
	int rc = -1;

	if (j.p->files.n < 2)
		return ct_fail(e, CT_EUSAGE, "missing OUT");
	/* the whole, and one of its parts at a time */
	if (ct_memory_begin(&j.memory, j.p->memory, j.p->files.v[n], (double)n + 1, e))
		return -1;
	j.part = calloc(n, sizeof *j.part);
	j.said = calloc(n, sizeof *j.said);
	if (!j.part || !j.said) {
		ct_fail(e, CT_ENOMEM, "no memory");
		goto out;
	}
	for (size_t i = 0; i < n; i++) {
		ct_progress(env, "parts", i, n);
		if (ct_check_stop(env, e) || add(&j, i, e))
			goto out;
	}
	ct_progress(env, "parts", n, n);
	rc = check_all(&j, n, e) || write_whole(&j, n, e) ? -1 : 0;
out:
	for (size_t i = 0; j.said && i < n; i++)
		ct_meta_free(&j.said[i]);
	free(j.said);
	free(j.part);
	free(j.run);
	ct_any_free(&j.whole);
	ct_room_close();
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-merge",
	.brief = "Join the parts of a volume or of a stack of projections.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
