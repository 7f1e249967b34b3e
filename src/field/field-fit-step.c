/* field-fit-step.c: one step of a fit: gradients of a batch, and Adam (field-fit.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/field-fit-step.h"
#include "core/vec3.h"
#include "field/render.h"
#include "solve/adam.h"

#include <math.h>
#include <string.h>

enum { CHUNK = 1 << 16 }; /* weights that Adam moves in one task */

struct step_job {
	struct ct_field_fit *f;
	const struct ct_field_data *d;
	struct ct_field_block block;
	double grid[3][4]; /* of the block's voxels */
	size_t items;      /* of this step */
	/* what is done with items [first, first + count) of a group */
	int (*each)(struct step_job *j, size_t g, struct ct_field_scratch *s, size_t first,
		size_t count);
	double rate;
	struct group {
		double loss;
		struct ct_err e;
	} group[CT_FIELD_GROUPS];
};

/* d loss / d value of an item; its loss is added. */
static double loss_of(double *loss, const struct ct_field_fit *f, const struct ct_field_item *it,
	double value, size_t pass, size_t items)
{
	const double e = (value - it->value) / f->unit, k = it->weight / (double)items;
	const double a = f->rule.adaptive && pass == 0 ? sqrt(fabs(e)) : 1;

	*loss += k * a * e * e;
	return 2 * k * a * e / f->unit;
}

/* From the outputs y of its samples to the gradient dy. */
static void item_back(struct ct_field_scratch *s, const struct ct_field_fit *f,
	const struct ct_field_item *it, size_t pass, size_t at, size_t items, double *loss)
{
	const enum ct_samples_kind kind = f->rule.samples.kind;
	const size_t n = ct_samples_count(&f->rule.samples, pass);
	float *y = s->y + at * n * f->rule.shape.network.outputs;
	float *dy = s->dy + at * n * f->rule.shape.network.outputs;
	float *t = s->t[pass] + at * n, *w = s->w[pass] + at * n;
	const bool cube = kind == CT_SAMPLES_CUBES;
	double value = 0, slope, step = 1;

	if (f->rule.samples.fine) {
		value = ct_render(n, w, t, ct_samples_end(kind), cube, y);
		slope = loss_of(loss, f, it, value, pass, items);
		ct_render_back(n, dy, w, t, ct_samples_end(kind), cube, y, slope);
		return;
	}
	if (kind == CT_SAMPLES_RAYS)
		step = (it->span[1] - it->span[0]) / (double)n;
	for (size_t i = 0; i < n; i++)
		value += (double)y[i];
	slope = loss_of(loss, f, it, value * step, pass, items) * step;
	for (size_t i = 0; i < n; i++)
		dy[i] = (float)slope;
}

void ct_field_item_place(float *x, struct ct_field_scratch *s, const struct ct_samples *how,
	const struct ct_field_item *it, size_t pass, size_t at, const float *x1,
	const struct ct_samples_draw *draw)
{
	float *t = s->t[pass] + at * ct_samples_count(how, pass);

	if (how->kind == CT_SAMPLES_RAYS)
		ct_samples_ray(how, x, it->centre, it->edge[0], it->span, draw);
	else if (pass == 0)
		ct_samples_voxel(how, x, t, it->centre, it->edge, draw);
	else
		ct_samples_second(how, x, t, x1, s->t[0] + at * how->n, s->w[0] + at * how->n,
			it->centre, it->edge, draw);
}

/* Items [first, first + count) of a batch: all passes, forward and back. */
static int piece(
	struct step_job *j, size_t g, struct ct_field_scratch *s, size_t first, size_t count)
{
	struct ct_field_fit *f = j->f;
	struct group *r = &j->group[g];

	for (size_t k = 0; k < count; k++)
		ct_field_item_of(&s->item[k], f, j->d, first + k);
	for (size_t p = 0; p < ct_samples_passes(&f->rule.samples); p++) {
		struct ct_field_pass *in = &f->pass[p];
		const size_t n = ct_samples_count(&f->rule.samples, p);
		float *x = in->x + 3 * first * n;

		for (size_t k = 0; k < count; k++) {
			const struct ct_samples_draw draw = {
				f->seed, f->step, (uint32_t)(first + k)};

			ct_field_item_place(x + 3 * k * n, s, &f->rule.samples, &s->item[k], p, k,
				f->pass[0].x + 3 * (first + k) * f->rule.samples.n, &draw);
		}
		if (ct_field_forward(in->field, s->work[p], count * n, x, s->y, &r->e))
			return -1;
		for (size_t k = 0; k < count; k++)
			item_back(s, f, &s->item[k], p, k, j->items, &r->loss);
		if (ct_field_backward(in->field, s->work[p], count * n, s->dy,
			    in->net + g * in->field->net, in->dcode ? in->dcode + first * n : NULL,
			    f->items * n, &r->e))
			return -1;
	}
	return 0;
}

/* The same of points of a block, whose gradient is known. */
static int points(
	struct step_job *j, size_t g, struct ct_field_scratch *s, size_t first, size_t count)
{
	struct ct_field_pass *in = &j->f->pass[0];
	struct ct_err *e = &j->group[g].e;

	if (ct_field_forward(in->field, s->work[0], count, in->x + 3 * first, s->y, e))
		return -1;
	return ct_field_backward(in->field, s->work[0], count, j->f->hr[1] + first,
		in->net + g * in->field->net, in->dcode ? in->dcode + first : NULL, j->f->items, e);
}

/* The field at the voxels of a block. */
static int voxels(
	struct step_job *j, size_t g, struct ct_field_scratch *s, size_t first, size_t count)
{
	struct ct_field_fit *f = j->f;
	float *x = f->pass[0].x + 3 * first;

	for (size_t k = 0; k < count; k++) {
		struct ct_field_item it;

		ct_field_item_voxel(&it, j->grid, j->block.n, first + k);
		for (int a = 0; a < 3; a++)
			x[3 * k + (size_t)a] = (float)fmin(fmax(it.centre[a], 0), 1);
	}
	return ct_field_forward(
		f->pass[0].field, s->work[0], count, x, f->hr[0] + first, &j->group[g].e);
}

/* A group, piece by piece. */
static void group(void *arg, size_t g, size_t worker)
{
	struct step_job *j = arg;
	const size_t end = j->items * (g + 1) / CT_FIELD_GROUPS;
	const size_t most = ct_field_step_piece(&j->f->rule);

	for (size_t i = j->items * g / CT_FIELD_GROUPS; i < end && !j->group[g].e.code; i += most)
		(void)j->each(j, g, &j->f->own[worker], i, end - i < most ? end - i : most);
}

static int failed(const struct step_job *j, struct ct_err *e)
{
	return ct_err_first(e, CT_FIELD_GROUPS, &j->group->e, sizeof *j->group);
}

/* D of the block against the scan, and TV: gradient at its voxels. */
static double block_loss(struct step_job *j, struct ct_par *par)
{
	struct ct_field_fit *f = j->f;
	const struct ct_vol *lr = j->d->lr;
	const struct ct_field_block *b = &j->block;
	const double count = (double)b->m[0] * (double)b->m[1] * (double)b->m[2];
	double sum = 0, mm[3], weight[3], all = (double)j->items;

	ct_separable_apply(&b->forward, f->lo, f->hr[0], par);
	for (size_t r = 0; r < b->m[1] * b->m[2]; r++) {
		const size_t y = b->lo[1] + r % b->m[1], z = b->lo[2] + r / b->m[1];
		const float *want = lr->data + (z * lr->n[1] + y) * lr->n[0] + b->lo[0];
		float *got = f->lo + r * b->m[0];
		double row = 0;

		for (size_t i = 0; i < b->m[0]; i++) {
			const double x = (double)got[i] - (double)want[i];

			row += x * x;
			got[i] = (float)(2 * x / count);
		}
		sum += row;
	}
	ct_separable_apply(&b->adjoint, f->hr[1], f->lo, par);
	if (!(f->rule.tv > 0))
		return sum / count;
	ct_vol_spacing(j->d->fine, mm);
	for (int a = 0; a < 3; a++)
		weight[a] = fmin(mm[0], fmin(mm[1], mm[2])) / mm[a];
	return sum / count +
	       f->rule.tv / all *
		       ct_field_block_tv(f->hr[1], f->hr[0], b->n, weight, f->rule.tv / all);
}

static int block_forward(
	struct step_job *j, double *loss, const struct ct_env *env, struct ct_err *e)
{
	struct ct_field_fit *f = j->f;
	struct ct_field_block *b = &j->block;
	size_t lo[3], m[3];

	for (int a = 0; a < 3; a++)
		m[a] = f->rule.batch < j->d->lr->n[a] ? f->rule.batch : j->d->lr->n[a];
	ct_field_item_block(lo, f, m);
	if (ct_field_block_plan(b, &f->op, lo, m, env->par, e))
		return -1;
	ct_vec3_after(j->grid, j->d->box, j->d->fine->affine);
	for (int a = 0; a < 3; a++)
		for (int c = 0; c < 3; c++)
			j->grid[a][3] += j->grid[a][c] * (double)b->first[c];
	j->items = b->n[0] * b->n[1] * b->n[2];
	j->each = voxels;
	ct_par_for(env->par, CT_FIELD_GROUPS, group, j);
	if (failed(j, e))
		return -1;
	*loss = block_loss(j, env->par);
	return 0;
}

/* Task i: a level of one encoding. */
static void levels(void *arg, size_t i, size_t worker)
{
	struct step_job *j = arg;
	const struct ct_encoding *c = &j->f->rule.shape.encoding;
	const size_t n = ct_encoding_levels(c), level = n - 1 - i % n, p = i / n;
	const size_t per = ct_samples_count(&j->f->rule.samples, p);
	struct ct_field_pass *in = &j->f->pass[p];

	(void)worker;
	ct_encoding_back(c, level, j->items * per, in->x, in->dcode, j->f->items * per,
		in->grad + ct_encoding_offset(c, level));
}

static void adam(void *arg, size_t i, size_t worker)
{
	struct step_job *j = arg;
	const size_t n = j->f->pass[0].field->count, chunks = (n + CHUNK - 1) / CHUNK;
	struct ct_field_pass *in = &j->f->pass[i / chunks];
	const size_t at = i % chunks * CHUNK, count = n - at < CHUNK ? n - at : CHUNK;
	struct ct_adamw a = ct_adamw_default();

	(void)worker;
	a.lr = j->rate;
	CT_SIMD(ct_adamw_step)
	(&a, j->f->step + 1, count, in->field->weights + at, in->m + at, in->v + at, in->grad + at);
}

static void zero(struct ct_field_fit *f)
{
	for (size_t p = 0; p < ct_samples_passes(&f->rule.samples); p++) {
		struct ct_field_pass *in = &f->pass[p];

		memset(in->grad, 0, in->field->count * sizeof *in->grad);
		memset(in->net, 0, CT_FIELD_GROUPS * in->field->net * sizeof *in->net);
	}
}

int ct_field_fit_step(struct ct_field_fit *f, const struct ct_field_data *d, double rate, bool dry,
	double *loss, const struct ct_env *env, struct ct_err *e)
{
	const size_t passes = ct_samples_passes(&f->rule.samples);
	struct step_job j = {.f = f, .d = d, .items = f->items, .rate = rate};
	int rc = -1;

	*loss = 0;
	zero(f);
	if (f->rule.samples.kind == CT_SAMPLES_PROFILE && block_forward(&j, loss, env, e))
		goto out;
	j.each = f->rule.samples.kind == CT_SAMPLES_PROFILE ? points : piece;
	ct_par_for(env->par, CT_FIELD_GROUPS, group, &j);
	if (failed(&j, e))
		goto out;
	for (size_t g = 0; g < CT_FIELD_GROUPS; g++)
		*loss += j.group[g].loss;
	ct_par_for(env->par, passes * ct_encoding_levels(&f->rule.shape.encoding), levels, &j);
	for (size_t p = 0; p < passes; p++) {
		struct ct_field_pass *in = &f->pass[p];
		const size_t n = in->field->net;

		CT_SIMD(ct_adam_gradient)(n, in->net, CT_FIELD_GROUPS, n, 1);
		memcpy(in->grad + in->field->encoded, in->net, n * sizeof *in->net);
	}
	if (!isfinite(*loss)) {
		ct_fail(e, CT_ENUMERIC, "the loss is not finite at iteration %zu", f->step + 1);
		goto out;
	}
	if (!dry) {
		const size_t n = f->pass[0].field->count;

		ct_par_for(env->par, passes * ((n + CHUNK - 1) / CHUNK), adam, &j);
	}
	rc = 0;
out:
	ct_field_block_free(&j.block);
	return rc;
}
