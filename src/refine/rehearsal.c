/* rehearsal.c: see rehearsal.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "refine/rehearsal.h"
#include "operator/crop.h"
#include "operator/padding.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = CT_REHEARSAL_BINS };
/* Voxels that believe what is missed by all, beside those of a bin. */
#define DOUBT 2000.0
/* Of a factor below 1, in its logarithm, so much is believed. */
#define BELIEF 0.75

/* Of the square of what is missed, at least so much is not noise of the part. */
#define NOT_NOISE 0.25

/* Sums over the voxels of the parts, HU^2: of squares, and of `added` times what the inversion
 * missed. */
struct sums {
	double added, right;
	double beyond, so; /* of all beyond DC, and of it times what DC missed */
	struct bin {
		double count, missed, expected;
	} bin[BINS]; /* of voxels with so much predicted error */
};

/* The one axis that is refined, or -1. */
static int refined_axis(const struct ct_degrade *by)
{
	int axis = -1;

	for (int a = 0; a < 3; a++)
		if (by->factor[a] > 1) {
			if (axis >= 0)
				return -1;
			axis = a;
		}
	return axis;
}

/* The operator of axis a along axis b. */
static struct ct_degrade turned(const struct ct_degrade *by, int a, int b)
{
	struct ct_degrade own = {
		.factor = {1, 1, 1}, .decimate = by->decimate, .profile = by->profile};

	own.factor[b] = by->factor[a];
	own.sigma[b] = by->sigma[a];
	own.profile.axis = b;
	return own;
}

/* Along two axes or three, and no other factor. */
static bool is_twice(const struct ct_degrade *by)
{
	int axes = 0;

	for (int a = 0; a < 3; a++) {
		if (by->factor[a] != 1 && by->factor[a] != 2)
			return false;
		axes += by->factor[a] == 2;
	}
	return axes > 1;
}

bool ct_rehearsal_part(size_t n[3], struct ct_degrade *own, const struct ct_refine *r,
	const struct ct_vol *in, int k)
{
	const struct ct_degrade *by = &r->scan.operator;
	const int a = refined_axis(by);

	if (!r->adds || k >= (a < 0 ? 1 : 2) || (a < 0 && !is_twice(by)))
		return false;
	*own = a < 0 ? *by : turned(by, a, (a + 1 + k) % 3);
	for (int i = 0; i < 3; i++) {
		n[i] = in->n[i] < CT_REHEARSAL_MOST ? in->n[i] : CT_REHEARSAL_MOST;
		if (own->factor[i] == 1)
			continue;
		if (n[i] < CT_REHEARSAL_LEAST || (double)n[i] < own->factor[i])
			return false;
		n[i] = ct_degrade_cover(ct_degrade_size(n[i], own->factor[i]), own->factor[i]);
	}
	return true;
}

/* Half octaves above 1 HU. */
static double place(double hu)
{
	return 2 * log2(fmax(hu, 1));
}

/* base: of the inversion; made: with what the prior added. */
static void add(struct sums *s, const struct ct_vol *part, const float *base, const float *made,
	const float *error, double noise)
{
	struct bin its[BINS] = {0};

	for (size_t i = 0; i < ct_vol_count(part); i++) {
		const double h = (double)(made[i] - base[i]);
		const double lacks = (double)(part->data[i] - base[i]);
		struct bin *b = &its[(size_t)fmin(place((double)error[i]), BINS - 1)];

		s->added += h * h;
		s->right += h * lacks;
		b->count++;
		b->expected += (double)error[i] * (double)error[i];
		b->missed += (lacks - h) * (lacks - h);
	}
	for (int b = 0; b < BINS; b++) {
		s->bin[b].count += its[b].count;
		s->bin[b].expected += its[b].expected;
		s->bin[b].missed += fmax(
			its[b].missed - its[b].count * noise * noise, NOT_NOISE * its[b].missed);
	}
}

/* plain: of DC. */
static void add_beyond(
	struct sums *s, const struct ct_vol *part, const float *plain, const float *made)
{
	for (size_t i = 0; i < ct_vol_count(part); i++) {
		const double h = (double)(made[i] - plain[i]);

		s->beyond += h * h;
		s->so += h * (double)(part->data[i] - plain[i]);
	}
}

/* The middle n voxels, their padding filled as that of a scan is (run.c). */
static int cut(struct ct_vol *part, const struct ct_vol *in, const size_t n[3], struct ct_err *e)
{
	struct ct_padding p = {0};
	ptrdiff_t start[3];
	int rc;

	ct_crop_place(start, in->n, n, CT_CROP_PLACES / 2);
	rc = ct_crop(part, in, n, start, 0, e) || ct_padding_find(&p, part->data, n, e) ||
	     (p.is && ct_padding_fill(part->data, &p, n, e));
	ct_padding_free(&p);
	return rc ? -1 : 0;
}

/* A part, made coarser and refined again. */
static int try(struct sums *s, const struct ct_refine *r, const struct ct_vol *in,
	const size_t n[3], const struct ct_degrade *own, const struct ct_env *env, struct ct_err *e)
{
	const int a = refined_axis(&r->scan.operator), b = refined_axis(own);
	const size_t voxels = n[0] * n[1] * n[2];
	struct ct_inversion inversion = ct_refine_inversion(r);
	struct ct_restore_rule rule = r->restore;
	struct ct_vol part = {0}, coarse = {0}, made = {0}, plain = {0};
	float *base = NULL, *error = NULL;
	struct ct_upsample_report up;
	struct ct_restore_report did;
	struct ct_env_part share = {.env = env, .to = CT_REFINE_INVERTS};
	struct ct_env its;
	int rc = -1;

	ct_env_part(&its, &share);
	inversion.first.by = rule.by = *own;
	inversion.first.alike = NULL; /* the noise that is added is white */
	inversion.first.start = NULL;
	inversion.first.spread = 0;
	if (a >= 0) {
		rule.axes[a] = r->restore.axes[b];
		rule.axes[b] = r->restore.axes[a];
	}
	if (cut(&part, in, n, e) ||
		ct_degrade_volume(&coarse, &part, own, r->scan.noise, env->seed, env->par, e) ||
		ct_inversion_run(&made, &coarse, &inversion, NULL, &up, &its, e) ||
		ct_alloc(&base, voxels, sizeof *base, e) ||
		ct_alloc(&error, voxels, sizeof *error, e))
		goto out;
	memcpy(base, made.data, voxels * sizeof *base);
	share = (struct ct_env_part){.env = env, .from = share.to, .to = 1};
	if (ct_restore(&made, error, &coarse, r->rule.prior, &rule, &did, &its, e))
		goto out;
	add(s, &part, base, made.data, error, r->scan.noise);
	inversion.first.method = CT_UPSAMPLE_DC;
	if (r->busy && ct_upsample(&plain, &coarse, &inversion.first, &up, &its, e))
		goto out;
	if (r->busy)
		add_beyond(s, &part, plain.data, made.data);
	rc = 0;
out:
	ct_vol_free(&part);
	ct_vol_free(&coarse);
	ct_vol_free(&made);
	ct_vol_free(&plain);
	free(base);
	free(error);
	return rc;
}

double ct_rehearsal_error(const struct ct_rehearsal *t, double hu)
{
	const double at = fmin(fmax(place(hu) - 0.5, 0), BINS - 1);
	const size_t b = (size_t)fmin(at, BINS - 2);

	return hu * (t->believed[b] + (at - (double)b) * (t->believed[b + 1] - t->believed[b]));
}

/* Not more than twice, and of less BELIEF of its logarithm. One axis: what slices average is softer
 * within them too, so that the part has less of what is missed most: of an error beyond twice that
 * of all nothing is taken off. */
static void believe(struct ct_rehearsal *t, const struct sums *s, bool one_axis)
{
	struct bin all = {0};

	for (int b = 0; b < BINS; b++) {
		all.count += s->bin[b].count;
		all.missed += s->bin[b].missed;
		all.expected += s->bin[b].expected;
	}
	if (!(all.expected > 0 && all.missed > 0))
		return;
	t->error = sqrt(all.missed / all.expected);
	for (int b = 0; b < BINS; b++) {
		const double hu = pow(2, (b + 0.5) / 2), doubt = DOUBT * hu * hu;
		const double beyond = log2(hu / sqrt(all.expected / all.count));
		const double times = sqrt((s->bin[b].missed + doubt * t->error * t->error) /
					  (s->bin[b].expected + doubt));

		t->believed[b] =
			times > 1 ? fmin(times, 2)
				  : pow(times, one_axis ? BELIEF * fmin(fmax(1 - beyond, 0), 1)
							: BELIEF);
	}
}

int ct_rehearsal_run(struct ct_rehearsal *t, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env_part part = {.env = env};
	struct ct_degrade own;
	struct sums s = {0};
	struct ct_env quiet;
	size_t n[3], parts = 0;

	*t = (struct ct_rehearsal){.weight = 1, .error = 1, .share = 1};
	for (int b = 0; b < BINS; b++)
		t->believed[b] = 1;
	while (ct_rehearsal_part(n, &own, r, in, (int)parts))
		parts++;
	ct_env_part(&quiet, &part);
	quiet.log = NULL; /* it is not what was asked for */
	for (size_t k = 0; ct_rehearsal_part(n, &own, r, in, (int)k); k++) {
		part = (struct ct_env_part){.env = env,
			.from = (double)k / (double)parts,
			.to = (k + 1.) / (double)parts};
		if (try(&s, r, in, n, &own, &quiet, e))
			return -1;
	}
	t->parts = parts;
	if (s.added > 0)
		t->weight = s.right / s.added;
	if (s.beyond > 0)
		t->share = s.so / s.beyond;
	believe(t, &s, refined_axis(&r->scan.operator) >= 0);
	return 0;
}

/* Texture, band-limited along several axes: the prior is added in full where total variation loses
 * at most so many dB times the factor, and beyond that in part. Elsewhere the loss does not tell.
 * doc/prior.md, "Texture". */
#define TEXTURE_LOSS 0.05
/* Twice: a scan twice as coarse has more to add than the scan, and no more than MOST_WEIGHT is
 * believed. doc/prior.md, "What the scan itself tells". */
#define COARSER_MORE 0.3
#define MOST_WEIGHT 1.6

static int axes_of(const struct ct_refine *r)
{
	const double *x = r->scan.operator.factor;

	return (x[0] > 1) + (x[1] > 1) + (x[2] > 1);
}

/* No weight was said, and the scan was asked what it is. */
static bool is_open(const struct ct_refine *r)
{
	return r->adds && (r->busy || !isnan(r->loss)) && isnan(r->rule.weight);
}

static bool loss_tells(const struct ct_refine *r)
{
	return r->textured && axes_of(r) > 1 && r->scan.operator.decimate == CT_DECIMATE_SINC;
}

bool ct_rehearsal_weighs(const struct ct_refine *r)
{
	const bool said = r->scan.from == CT_BY_FILE || r->scan.from == CT_BY_CALLER;

	if (r->busy)
		return is_open(r) && axes_of(r) == 1;
	return is_open(r) && (r->textured ? !loss_tells(r) : axes_of(r) > 1 && said);
}

int ct_rehearsal_weigh(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const double *x = r->scan.operator.factor, most = fmax(x[0], fmax(x[1], x[2]));
	struct ct_rehearsal its = {0};
	double less;

	if (!is_open(r))
		return 0;
	r->restore.weight = 1;
	if (ct_rehearsal_weighs(r) && ct_rehearsal_run(&its, r, in, env, e))
		return -1;
	if (r->busy && its.parts > 0)
		r->share = fmin(fmax(its.share, 0), 1);
	if (r->busy) {
		ct_log(env, CT_INFO, "texture: of what is made beyond dc %.2f stays", r->share);
		return 0;
	}
	less = its.weight - (axes_of(r) > 1 ? COARSER_MORE : 0);
	if (loss_tells(r))
		r->restore.weight = fmin(1, TEXTURE_LOSS * most / r->loss);
	else if (its.parts > 0)
		r->restore.weight =
			r->textured ? fmin(fmax(less, 0), 1) : fmin(fmax(less, 1), MOST_WEIGHT);
	if (r->restore.weight != 1)
		ct_log(env, CT_INFO, "%s: what the prior adds is multiplied by %.2f",
			r->textured ? "texture" : "rehearsal", r->restore.weight);
	return 0;
}
