/* ct-merge: parts of a volume, or of a stack, to the whole.
 *
 * Slabs are looked at, all of them, and then copied plane by plane: neither they nor the whole are
 * ever in memory. */
#include "config.h"
#include "cli/cli.h"
#include "cli/keep.h"
#include "cli/part.h"
#include "core/mem.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "resolution/crop.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct params {
	struct ct_list files; /* the last is OUT */
	int type;
};

static const struct params defaults = {0};

static const struct ct_opt opts[] = {
	CT_CHOICE(struct params, type, 0, "type", CT_WORDS(CT_NIFTI_LIST),
		"voxels of a volume: i16 rounds to whole HU, half the size; auto: as in the parts"),
	CT_ARG_OUT(struct params, files, CT_READS_WRITES, "FILE", CT_ENDS_VOLUME "|" CT_ENDS_STACK,
		"PART: what ct-upsample or ct-restore --brick, or ct-ddnm --views made, of one run, in any "
		"order; then OUT: the whole of it, NIfTI or EXR"),
	CT_OPT_END,
};

struct job {
	const struct params *p;
	const struct ct_env *env;
	size_t n; /* parts */
	bool stack, i16;
	struct ct_stack all; /* of views */
	struct ct_vol head;  /* of slabs: grid and metadata of the whole, no voxels */
	struct ct_part *part;
	struct ct_meta *said; /* of each part */
	char *run;
};

static const char *path_of(const struct job *j, size_t i)
{
	return j->p->files.v[i];
}

/* Which part it is, of `size` voxels of an axis or views that it has. */
static int examine(struct ct_part *p, const struct ct_meta *m, bool stack, struct ct_err *e)
{
	const int rc = ct_part_get(p, m, e);

	if (rc)
		return rc < 0 ? -1 : ct_fail(e, CT_EINPUT, "is no part: it does not say of what");
	return stack == (p->axis == CT_PART_VIEWS)
		       ? 0
		       : ct_fail(e, CT_EINPUT, "is not of the kind that %s says", CT_META_PART);
}

static int check_size(const struct ct_part *p, size_t size, struct ct_err *e)
{
	return p->to - p->from == size
		       ? 0
		       : ct_fail(e, CT_EINPUT, "is not of the size that %s says", CT_META_PART);
}

/* The first part says what run all are of. */
static int begin(struct job *j, const struct ct_meta *m, struct ct_meta *whole, struct ct_err *e)
{
	if (ct_ends_match(path_of(j, j->n), j->stack ? CT_ENDS_VOLUME : CT_ENDS_STACK))
		return ct_fail(e, CT_EUSAGE, "is %s, which %s is not by its name",
			j->stack ? "a part of a stack" : "a slab of a volume", path_of(j, j->n));
	j->run = strdup(ct_meta_get(m, CT_META_PART_RUN));
	return j->run ? ct_meta_copy(whole, m, e) : ct_fail(e, CT_ENOMEM, "no memory");
}

static int another_run(const struct job *j, struct ct_err *e)
{
	return ct_fail(e, CT_EGEOM, "is of another run than %s", path_of(j, 0));
}

/* Is part i of the same run as the first, and holds it nothing that one before holds? */
static int belongs(const struct job *j, const struct ct_meta *m, size_t i, struct ct_err *e)
{
	const struct ct_part *p = &j->part[i], *first = &j->part[0];

	if (p->axis != first->axis || p->of != first->of ||
		strcmp(ct_meta_get(m, CT_META_PART_RUN), j->run) != 0)
		return another_run(j, e);
	for (size_t k = 0; k < i; k++)
		if (p->from < j->part[k].to && j->part[k].from < p->to)
			return ct_fail(e, CT_EGEOM, "holds %zu:%zu of what %s holds",
				p->from > j->part[k].from ? p->from : j->part[k].from,
				p->to < j->part[k].to ? p->to : j->part[k].to, path_of(j, k));
	return 0;
}

/* Sizes and affine of the whole that a slab is part of. */
static void whole_grid(struct ct_vol *to, const struct ct_vol *slab, const struct ct_part *p)
{
	double start[3] = {0};

	memcpy(to->n, slab->n, sizeof to->n);
	memcpy(to->affine, slab->affine, sizeof to->affine);
	to->n[p->axis] = p->of;
	start[p->axis] = -(double)p->from;
	ct_crop_affine(to->affine, start);
}

static int take_slab(struct job *j, size_t i, const struct ct_vol *slab, struct ct_err *e)
{
	struct ct_vol grid = {0};

	whole_grid(&grid, slab, &j->part[i]);
	if (i == 0) {
		if (begin(j, &slab->meta, &j->head.meta, e))
			return -1;
		memcpy(j->head.n, grid.n, sizeof grid.n);
		memcpy(j->head.affine, grid.affine, sizeof grid.affine);
	}
	return belongs(j, &slab->meta, i, e) || ct_vol_same_grid(&grid, &j->head, e) ? -1 : 0;
}

static int look_into(struct job *j, size_t i, FILE *f, struct ct_vol *slab, struct ct_err *e)
{
	struct ct_nifti_in in = {0};
	struct ct_part *p = &j->part[i];
	struct ct_hash *values = NULL;
	int rc = ct_nifti_open(&in, f, slab, e) || examine(p, &slab->meta, false, e) ||
				 check_size(p, slab->n[p->axis], e) || ct_hash_alloc(&values, e) ||
				 ct_source_pass(
					 &in.source, &in.how, path_of(j, i), slab, values, e) ||
				 ct_part_check(&slab->meta, values, e)
			 ? -1
			 : 0;

	j->i16 &= in.how.type == CT_V_I16 && in.how.slope == 1 && in.how.inter == 0;
	ct_source_close(&in.source);
	free(values);
	return rc;
}

/* Is slab i as it was written, and of the whole that those before are of? */
static int look(struct job *j, size_t i, struct ct_err *e)
{
	struct ct_vol slab = {0};
	bool stack;
	FILE *f;
	int rc;

	if (ct_any_is_stack(path_of(j, i), &stack, e))
		return -1;
	if (stack)
		return another_run(j, e), ct_blame(e, path_of(j, i));
	if (ct_io_open(path_of(j, i), &f, e))
		return -1;
	rc = look_into(j, i, f, &slab, e) || take_slab(j, i, &slab, e) ? ct_blame(e, path_of(j, i))
								       : 0;
	ct_io_close(f);
	j->said[i] = slab.meta;
	return rc;
}

/* A slab that is being copied. */
struct slab {
	FILE *f;
	struct ct_nifti_in in;
};

static void slab_close(struct slab *s)
{
	ct_source_close(&s->in.source);
	if (s->f)
		ct_io_close(s->f);
	*s = (struct slab){0};
}

static int slab_open(struct slab *s, const char *path, size_t axis, size_t size, struct ct_err *e)
{
	struct ct_vol head = {0};
	int rc = -1;

	if (ct_io_open(path, &s->f, e))
		return -1;
	if (ct_nifti_open(&s->in, s->f, &head, e) == 0)
		rc = head.n[axis] == size ? 0 : ct_fail(e, CT_EINPUT, "has become another file");
	ct_meta_free(&head.meta);
	return rc ? ct_blame(e, path) : 0;
}

/* What slab i has of plane k of the whole, by way of `piece`. It is open from its first plane to
 * its last. */
static int copy(const struct job *j, size_t i, struct slab *s, size_t k, float *plane, float *piece,
	struct ct_err *e)
{
	const struct ct_part *p = &j->part[i];
	const bool across = p->axis == 2;
	const size_t first = across ? p->from : 0, end = across ? p->to : j->head.n[2];
	const size_t width = j->head.n[0], size = p->to - p->from;
	const size_t n[2] = {p->axis == 0 ? size : width, p->axis == 1 ? size : j->head.n[1]};
	float *to = plane + (p->axis == 0 ? p->from : p->axis == 1 ? p->from * width : 0);

	if (k < first || k >= end)
		return 0;
	if (k == first && slab_open(s, path_of(j, i), (size_t)p->axis, size, e))
		return -1;
	if (ct_source_floats(&s->in.source, &s->in.how, n[0] * n[1], piece, e))
		return ct_blame(e, path_of(j, i));
	for (size_t y = 0; y < n[1]; y++)
		memcpy(to + y * width, piece + y * n[0], n[0] * sizeof *to);
	if (k + 1 == end)
		slab_close(s);
	return 0;
}

static int copy_all(const struct job *j, struct ct_nifti_planes *out, struct slab *s, float *plane,
	float *piece, struct ct_err *e)
{
	const size_t count = j->head.n[0] * j->head.n[1];

	for (size_t k = 0; k < j->head.n[2]; k++) {
		ct_progress(j->env, "planes", k, j->head.n[2]);
		for (size_t i = 0; i < j->n; i++)
			if (copy(j, i, &s[i], k, plane, piece, e))
				return -1;
		if (ct_check_stop(j->env, e) || ct_nifti_put(out, count, plane, e))
			return -1;
	}
	ct_progress(j->env, "planes", j->head.n[2], j->head.n[2]);
	return 0;
}

static int write_slabs(const struct job *j, struct ct_err *e)
{
	const size_t count = j->head.n[0] * j->head.n[1];
	float *plane = NULL, *piece = NULL;
	struct slab *s = NULL;
	struct ct_nifti_planes *out;
	int rc = -1;

	if (ct_alloc(&plane, count, sizeof *plane, e) == 0 &&
		ct_alloc(&piece, count, sizeof *piece, e) == 0 &&
		ct_alloc0(&s, j->n, sizeof *s, e) == 0 &&
		ct_nifti_create(&out, path_of(j, j->n), &j->head,
			j->i16 ? CT_NIFTI_I16 : CT_NIFTI_F32, false, j->env, e) == 0)
		rc = ct_nifti_close(out, &j->head, copy_all(j, out, s, plane, piece, e), j->env, e);
	for (size_t i = 0; s && i < j->n; i++)
		slab_close(&s[i]);
	free(s);
	free(piece);
	free(plane);
	return rc;
}

static int check_views(const struct ct_stack *s, const struct ct_meta *m, struct ct_err *e)
{
	struct ct_hash *values;
	int rc;

	if (ct_hash_alloc(&values, e))
		return -1;
	CT_SIMD(ct_hash_add)(values, s->data, ct_stack_count(s) * sizeof *s->data);
	rc = ct_part_check(m, values, e);
	free(values);
	return rc;
}

/* Views of the stack. */
static int enter(struct job *j, size_t i, const struct ct_stack *s, struct ct_err *e)
{
	const struct ct_part *p = &j->part[i];
	struct ct_stack *all = &j->all;

	if (check_size(p, s->views, e) || check_views(s, &s->meta, e))
		return -1;
	if (i == 0) {
		if (begin(j, &s->meta, &all->meta, e) || ct_stack_alloc(all, p->of, s->h, s->w, e))
			return -1;
		all->beam = s->beam;
	}
	if (belongs(j, &s->meta, i, e))
		return -1;
	if (s->h != all->h || s->w != all->w || s->beam != all->beam)
		return ct_fail(e, CT_EGEOM, "is not of the size of %s", path_of(j, 0));
	memcpy(all->view + p->from, s->view, s->views * sizeof *s->view);
	memcpy(ct_stack_view(all, p->from), s->data, ct_stack_count(s) * sizeof *s->data);
	return ct_meta_copy(&j->said[i], &s->meta, e);
}

static int add_views(struct job *j, size_t i, struct ct_err *e)
{
	struct ct_any a = {0};
	int rc = ct_any_read(path_of(j, i), &a, e);

	if (rc == 0) {
		rc = a.kind != CT_KIND_STACK && i > 0 ? another_run(j, e)
		     : a.kind != CT_KIND_STACK
			     ? ct_fail(e, CT_EINPUT,
				       "is no stack, and of a slab has to be a regular file")
			     : examine(&j->part[i], &a.stack.meta, true, e) ||
				       enter(j, i, &a.stack, e);
		if (rc)
			ct_blame(e, path_of(j, i));
	}
	ct_any_free(&a);
	return rc ? -1 : 0;
}

/* All of the whole is in some part: they do not overlap, so that the next begins where one ends. */
static int check_all(const struct job *j, struct ct_err *e)
{
	size_t at = 0;

	while (at < j->part[0].of) {
		size_t next = j->part[0].of, found = j->n;

		for (size_t i = 0; i < j->n; i++) {
			if (j->part[i].from == at)
				found = i;
			if (j->part[i].from > at && j->part[i].from < next)
				next = j->part[i].from;
		}
		if (found == j->n)
			return ct_fail(e, CT_EGEOM, "%s %zu:%zu of %zu are in none of the parts",
				j->stack ? "views" : "voxels", at, next, j->part[0].of);
		at = j->part[found].to;
	}
	return 0;
}

static int write_whole(struct job *j, struct ct_err *e)
{
	struct ct_meta *m = j->stack ? &j->all.meta : &j->head.meta;
	const struct ct_meta **from = calloc(j->n, sizeof *from);
	int rc = -1;

	for (size_t i = 0; from && i < j->n; i++)
		from[i] = &j->said[i];
	ct_part_drop(m);
	ct_meta_drop(m, CT_META_HISTORY);
	if (!from)
		ct_fail(e, CT_ENOMEM, "no memory");
	else if (ct_check_stop(j->env, e) == 0 && ct_meta_step(m, j->env, j->n, from, e) == 0)
		rc = j->stack ? ct_keep_stack(path_of(j, j->n), &j->all, j->env, e)
			      : write_slabs(j, e);
	free(from);
	return rc;
}

/* A part is read more than once; views may come from standard input. */
static int check_file(const char *path, struct ct_err *e)
{
	struct stat st;

	return stat(path, &st) == 0 && !S_ISREG(st.st_mode) && strcmp(path, "-") != 0
		       ? ct_fail(e, CT_EINPUT, "%s: is no regular file, as a part has to be", path)
		       : 0;
}

static int work(struct job *j, struct ct_err *e)
{
	for (size_t i = 0; i < j->n; i++)
		if (check_file(path_of(j, i), e))
			return -1;
	if (ct_any_is_stack(path_of(j, 0), &j->stack, e))
		return -1;
	if (j->stack && j->p->type != CT_NIFTI_AUTO)
		return ct_fail(e, CT_EUSAGE, "--type: %s is no slab of a volume", path_of(j, 0));
	j->i16 = true;
	for (size_t i = 0; i < j->n; i++) {
		ct_progress(j->env, "parts", i, j->n);
		if (ct_check_stop(j->env, e) || (j->stack ? add_views : look)(j, i, e))
			return -1;
	}
	ct_progress(j->env, "parts", j->n, j->n);
	if (j->p->type != CT_NIFTI_AUTO)
		j->i16 = j->p->type == CT_NIFTI_I16;
	return check_all(j, e) || write_whole(j, e) ? -1 : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = params, .env = env};
	int rc = -1;

	if (j.p->files.n < 2)
		return ct_fail(e, CT_EUSAGE, "missing OUT");
	j.n = j.p->files.n - 1;
	j.part = calloc(j.n, sizeof *j.part);
	j.said = calloc(j.n, sizeof *j.said);
	if (j.part && j.said)
		rc = work(&j, e);
	else
		ct_fail(e, CT_ENOMEM, "no memory");
	for (size_t i = 0; j.said && i < j.n; i++)
		ct_meta_free(&j.said[i]);
	free(j.said);
	free(j.part);
	free(j.run);
	ct_stack_free(&j.all);
	ct_vol_free(&j.head);
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
