/* refine/refine.h: one call refines a CT. Two calls at once give the same bytes as one; slabs are
 * the whole; the plan reports what it found.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/rng.h"
#include "operator/regrid.h"
#include "refine/rehearsal.h"
#include "refine/slabs.h"
#include "tests/tap.h"
#include "slice-make.h"

#include <pthread.h>
#include <string.h>

enum { THICK = 64, SIDE = 24, MIB = 1 << 20 };
static const struct ct_env quiet = {0};
static struct ct_slice_prior prior = {.n = 1};

/* A CT of a texture, of which slices of four were averaged, or none. */
static void make(struct ct_vol *lo, bool says)
{
	const struct ct_degrade by = {{1, 1, 4}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}};
	const size_t n[3] = {SIDE, SIDE, THICK};

	*lo = (struct ct_vol){0};
	must(ct_vol_alloc(lo, n, &err));
	texture(lo->data, n, 7);
	for (size_t i = 0; i < ct_vol_count(lo); i++)
		lo->data[i] /= 4; /* some 75 HU */
	for (int a = 0; a < 3; a++)
		lo->affine[a][a] = 1;
	if (says)
		must(ct_degrade_put(&lo->meta, &by, &err));
}

static struct ct_refine_rule rule_of(int method)
{
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;

	rule.method = method;
	rule.iterations = 60;
	rule.said.noise = 0;
	rule.prior = &prior;
	return rule;
}

struct call {
	const struct ct_vol *lo;
	struct ct_refine_rule rule;
	struct ct_vol out, error;
	struct ct_refine did;
	struct ct_err failed;
	int rc;
};

static void *call(void *arg)
{
	struct call *c = arg;

	c->rc = ct_refine_plan(&c->did, &c->rule, c->lo, &quiet, &c->failed) ||
				ct_refine_run(&c->did, &c->out, c->rule.error ? &c->error : NULL,
					c->lo, &quiet, &c->failed)
			? -1
			: 0;
	return NULL;
}

static bool same(const struct ct_vol *a, const struct ct_vol *b)
{
	return ct_vol_count(a) == ct_vol_count(b) &&
	       memcmp(a->data, b->data, ct_vol_count(a) * sizeof *a->data) == 0;
}

static void end(struct call *c)
{
	ct_vol_free(&c->out);
	ct_vol_free(&c->error);
}

/* Two threads at once: one method each, or the same. */
static void at_once(const struct ct_vol *lo)
{
	struct call alone = {.lo = lo, .rule = rule_of(CT_REFINE_PRIOR)}, two[2];
	pthread_t thread[2];

	alone.rule.error = true;
	two[0] = two[1] = alone;
	call(&alone);
	OK(alone.rc == 0 && alone.did.adds && alone.did.slabs == 1, "the prior adds (%s%s)",
		alone.failed.msg, alone.did.why_not);
	OK(ct_refine_inversion(&alone.did).first.mirrors, "to an inversion of mirror images, too");
	alone.did.adds = false;
	OK(!ct_refine_inversion(&alone.did).first.mirrors, "alone the scan itself is inverted");
	for (int k = 0; k < 2; k++)
		if (pthread_create(&thread[k], NULL, call, &two[k]))
			exit(99);
	for (int k = 0; k < 2; k++)
		pthread_join(thread[k], NULL);
	OK(two[0].rc == 0 && two[1].rc == 0 && same(&alone.out, &two[0].out) &&
			same(&alone.out, &two[1].out) && same(&alone.error, &two[0].error) &&
			same(&alone.error, &two[1].error),
		"two calls at once make the same bytes as one");
	end(&alone);
	end(&two[0]);
	end(&two[1]);
}

static void compare(const struct ct_vol *a, const struct ct_vol *b, const char *name, size_t slabs)
{
	double sum = 0, most = 0;

	for (size_t i = 0; i < ct_vol_count(a); i++) {
		const double d = fabs((double)a->data[i] - (double)b->data[i]);

		sum += d * d;
		most = fmax(most, d);
	}
	sum = sqrt(sum / (double)ct_vol_count(a));
	OK(sum < 0.1 && most < 1, "%s: %zu slabs are the whole (%.2g HU RMS, %.2g at most)", name,
		slabs, sum, most);
}

/* In slabs: within the largest bound that the whole does not fit into. */
static void slabs(const struct ct_vol *lo, double noise)
{
	static const int methods[] = {CT_UPSAMPLE_TV, CT_UPSAMPLE_HTV, CT_REFINE_PRIOR};

	/* a random network makes of noise what no slab knows of another */
	for (size_t k = 0; k < (noise > 0 ? 2 : sizeof methods / sizeof *methods); k++) {
		struct call whole = {.lo = lo, .rule = rule_of(methods[k])}, part;

		whole.rule.said.noise = noise;
		part = whole;
		call(&whole);
		part.rule.memory = 1.2 * whole.did.whole;
		do {
			part.rule.memory -= 0x1p14;
			part.rc = ct_refine_plan(&part.did, &part.rule, lo, &quiet, &part.failed);
		} while (part.rc == 0 && part.did.slabs < 2);
		if (part.rc == 0)
			part.rc =
				ct_refine_run(&part.did, &part.out, NULL, lo, &quiet, &part.failed);
		OK(whole.rc == 0 && part.rc == 0 && part.did.need <= part.rule.memory,
			"in %.1f MiB of %.1f", part.rule.memory / MIB, whole.did.whole / MIB);
		if (part.rc == 0)
			compare(&whole.out, &part.out, CT_WORD(CT_REFINE_LIST, methods[k]),
				part.did.slabs);
		end(&whole);
		end(&part);
	}
}

/* Slabs cover an axis, each voxel once. */
static void cuts(void)
{
	const struct ct_degrade by = {{1, 1, 4}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}};
	const struct ct_degrade sinc = {{2, 2, 2}, {0, 0, 0}, CT_DECIMATE_SINC, {0}};
	const size_t n[3] = {30, 40, 50};

	OK(ct_slab_axis(&by, n) == 2 && ct_slab_most(&by, n) == 13, "the longest axis is cut");
	for (size_t m = 1; m <= 13; m++) {
		size_t at = 0;

		for (size_t k = 0; k < m; k++) {
			const struct ct_slab s = ct_slab_at(&by, n, k, m);

			if (s.from != at || s.to <= s.from || s.lo > s.from || s.hi < s.to)
				break;
			at = s.to;
		}
		if (m == 1 || m == 4 || m == 13)
			OK(at == 50, "%zu slabs are all of it", m);
	}
	OK(ct_slab_axis(&sinc, n) == -1 && ct_slab_most(&sinc, n) == 0,
		"band-limited sampling along all axes is not cut");
}

/* What the plan says of what it found. */
static void reports(const struct ct_vol *lo, const struct ct_vol *mute)
{
	struct ct_refine_rule rule = rule_of(CT_UPSAMPLE_AUTO);
	struct ct_refine r;
	double cpu = -1;

	must(ct_refine_plan(&r, &rule, lo, &quiet, &err));
	OK(r.scan.known && r.scan.from == CT_BY_FILE && r.scan.noise_from == CT_BY_CALLER,
		"the file says the operator, the caller the noise");
	OK(r.method == CT_UPSAMPLE_HTV && r.textured && r.n[2] == 4 * THICK && !r.adds,
		"means of texture take htv");
	must(ct_refine_cost(&cpu, &r, lo, &quiet, &err));
	OK(cpu > 0, "it costs something (%.3g s)", cpu);
	rule.memory = MIB;
	OK(ct_refine_plan(&r, &rule, lo, &quiet, &err) == -1 && err.code == CT_ENOMEM &&
			strstr(err.msg, "1 MiB are given"),
		"a bound that nothing fits into: %s", err.msg);
	rule = rule_of(CT_UPSAMPLE_AUTO);
	rule.said.factor[0] = rule.said.factor[1] = rule.said.factor[2] = 2;
	OK(ct_refine_plan(&r, &rule, lo, &quiet, &err) == -1 && err.code == CT_EUSAGE,
		"a contradiction: %s", err.msg);
	must(ct_refine_plan(&r, &rule, mute, &quiet, &err));
	OK(!r.scan.known && r.scan.from == CT_BY_NOBODY && r.method == CT_UPSAMPLE_BSPLINE,
		"without an operator it interpolates: %s", ct_refine_why(&r));
	rule.memory = MIB;
	OK(ct_refine_plan(&r, &rule, mute, &quiet, &err) == -1 && err.code == CT_ENOMEM &&
			strstr(err.msg, "unknown blur"),
		"and is not cut: %s", err.msg);
	rule = rule_of(CT_REFINE_PRIOR);
	rule.said.factor[0] = rule.said.factor[1] = rule.said.factor[2] = 2;
	OK(ct_refine_plan(&r, &rule, mute, &quiet, &err) == -1 && err.code == CT_EUSAGE,
		"the prior needs one: %s", err.msg);
	for (int a = 0; a < 3; a++)
		rule.said.sigma[a] = a < 2 ? 0 : 0.5;
	rule.said.decimate = CT_DECIMATE_MEAN;
	must(ct_refine_plan(&r, &rule, mute, &quiet, &err));
	OK(r.scan.known && r.scan.from == CT_BY_CALLER && !r.adds &&
			strstr(r.why_not, "no network for factors 2,2,2"),
		"%s", r.why_not);
}

/* A volume of side 48: within `side` voxels of the middle 90 HU of noise, else a zigzag of 40 HU
 * along each axis (`textured`) or nothing. */
static void around(struct ct_vol *v, double side, bool textured)
{
	static const float zigzag[4] = {0, 20, 40, 20};

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, (const size_t[]){48, 48, 48}, &err));
	ct_rng_normals(ct_vol_count(v), v->data, 3, 5, 0);
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % 48, i / 48 % 48, i / 48 / 48};
		double far = 0;

		for (int a = 0; a < 3; a++)
			far = fmax(far, fabs((double)at[a] - 23.5));
		v->data[i] *= 90;
		if (far > side)
			v->data[i] =
				textured ? zigzag[at[0] % 4] + zigzag[at[1] % 4] + zigzag[at[2] % 4]
					 : 0;
	}
}

/* Texture counts whether it is noise or a small zigzag. What is flat does not. */
static void textures(void)
{
	static const double by[3] = {4, 4, 4}, thick[3] = {1, 1, 4};
	const double voxels = 3 * 48 * 48 * 48, near = 26. / 48;
	struct ct_vol v;

	around(&v, 24, true);
	NEAR(ct_refine_cells(&v, by, 3) / voxels, 1, .001, "noise is texture");
	NEAR(ct_refine_cells(&v, thick, 3) / voxels, 1. / 16, .001, "in cells of 4 x 4 of a slice");
	ct_vol_free(&v);
	around(&v, 12, true);
	NEAR(ct_refine_cells(&v, by, 3) / voxels, 1, .001, "so is a zigzag");
	ct_vol_free(&v);
	around(&v, 12, false);
	NEAR(ct_refine_cells(&v, by, 3) / voxels, near * near / 2, .002, "what is constant is not");
	ct_vol_free(&v);
}

/* What stays of what is made of a texture that `by` made, if the caller says `weight`. */
static double share(enum ct_decimate by, double weight)
{
	const double sigma = by == CT_DECIMATE_SINC ? 1.4 : 0;
	const struct ct_degrade d = {{4, 4, 4}, {sigma, sigma, sigma}, by, {0}};
	const size_t n[3] = {2 * SIDE, 2 * SIDE, 2 * SIDE};
	struct ct_slice_prior same = {.n = 1};
	struct ct_refine_rule rule = rule_of(CT_REFINE_PRIOR);
	struct ct_vol v = {0};
	struct ct_refine r;

	same.r[0] = (struct ct_slice_network){
		.shape = {4, 8, 1, 1, true}, .components = 9, .width = 21};
	random_network(&same.r[0]);
	must(ct_vol_alloc(&v, n, &err));
	texture(v.data, n, 7);
	must(ct_degrade_put(&v.meta, &d, &err));
	rule.prior = &same;
	rule.weight = weight;
	must(ct_refine_plan(&r, &rule, &v, &quiet, &err));
	OK(r.adds && r.textured, "a texture, to which the prior adds");
	must(ct_rehearsal_weigh(&r, &v, &quiet, &err));
	ct_vol_free(&v);
	ct_slice_prior_free(&same);
	return r.restore.weight * r.share;
}

static void shares(void)
{
	NEAR(share(CT_DECIMATE_SINC, 0.95), 0.95, 0,
		"the prior has the weight that the caller says");
	NEAR(share(CT_DECIMATE_SINC, (double)NAN), 0.5, 0,
		"of a band-limited texture throughout half of what is made stays");
	NEAR(share(CT_DECIMATE_MEAN, (double)NAN), 0.15, 0,
		"of an aliased texture throughout a seventh of what is made stays");
}

/* A thin wall that leans across slices of a third of their distance; -100 HU, the wall 900. */
static struct ct_vol wall(void)
{
	const size_t n[3] = {2 * SIDE, 8, 3 * SIDE};
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, n, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++) {
		const double x = (double)(i % n[0]), z = (double)(i / (n[0] * n[1]));

		v.data[i] = fabs(x - SIDE - 0.2 * (z - 36)) < 1.5 ? 900.F : -100.F;
	}
	return v;
}

/* Largest mean of the wall's error less the least, by place between two slices: a string of beads.
 */
static double beads(const struct ct_vol *x, const struct ct_vol *truth)
{
	double sum[6] = {0}, least = 1e9, most = -1e9;
	size_t count[6] = {0};

	for (size_t i = 0; i < ct_vol_count(x); i++)
		if (truth->data[i] > 0) {
			const size_t k = i / (x->n[0] * x->n[1]) % 6;

			sum[k] += (double)x->data[i] - (double)truth->data[i];
			count[k]++;
		}
	for (size_t k = 0; k < 6; k++) {
		least = fmin(least, sum[k] / (double)count[k]);
		most = fmax(most, sum[k] / (double)count[k]);
	}
	return most - least;
}

static void gaps(void)
{
	const struct ct_degrade by = {{1, 1, 6}, {0, 0, 0.6}, CT_DECIMATE_POINT, {0}};
	struct ct_vol truth = wall(), lo = {0};
	struct call htv = {.lo = &lo, .rule = rule_of(CT_UPSAMPLE_HTV)};
	struct call mine = {.lo = &lo, .rule = rule_of(CT_UPSAMPLE_AUTO)};

	must(ct_degrade_volume(&lo, &truth, &by, 0, 0, NULL, &err));
	must(ct_degrade_put(&lo.meta, &by, &err));
	OK(call(&htv) == NULL && htv.rc == 0 && call(&mine) == NULL && mine.rc == 0, "in gaps");
	OK(strcmp(ct_refine_why(&mine.did), "slices with gaps") == 0 && mine.did.second < 0.25,
		"wide gaps between slices get little of htv: %g", mine.did.second);
	OK(beads(&mine.out, &truth) < 0.5 * beads(&htv.out, &truth),
		"a thin wall is no string of beads: %g HU, %g by htv", beads(&mine.out, &truth),
		beads(&htv.out, &truth));
	mine.rule.said.noise = 15;
	must(ct_refine_plan(&mine.did, &mine.rule, &lo, &quiet, &err));
	OK(mine.did.gaps && mine.did.second > 0.5, "with noise they get more of it: %g",
		mine.did.second);
	end(&htv);
	end(&mine);
	ct_vol_free(&lo);
	ct_vol_free(&truth);
}

static double deviation(const struct ct_vol *a, const struct ct_vol *b)
{
	double sum = 0;

	for (size_t i = 0; i < ct_vol_count(a); i++)
		sum += pow((double)a->data[i] - (double)b->data[i], 2);
	return sqrt(sum / (double)ct_vol_count(a));
}

/* A CT of plateaus with a texture upon them, slices of three. */
static void make_mixed(struct ct_vol *lo)
{
	const struct ct_degrade by = {{1, 1, 3}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}};
	const size_t n[3] = {2 * SIDE, SIDE, 2 * THICK};

	*lo = (struct ct_vol){0};
	must(ct_vol_alloc(lo, n, &err));
	texture(lo->data, n, 7);
	for (size_t i = 0; i < ct_vol_count(lo); i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
		const double x = (double)at[0] - 24, y = (double)at[1] - 11;
		const double z = remainder((double)at[2], 24);

		lo->data[i] = lo->data[i] / 16 +
			      300 * (float)tanh(4 - 0.5 * sqrt(x * x / 4 + y * y + z * z));
	}
	for (int a = 0; a < 3; a++)
		lo->affine[a][a] = a == 2 ? 3 : 1;
	must(ct_degrade_put(&lo->meta, &by, &err));
}

/* The mean of TV and HTV: of a scan that is asked for it, alone and in slabs. */
static void means(void)
{
	const struct ct_env env = quiet;
	struct ct_upsample_report did;
	struct ct_vol lo, tv = {0}, htv = {0}, mean = {0};
	struct call auto_ = {.rule = rule_of(CT_UPSAMPLE_AUTO)}, part;
	struct ct_inversion v;
	double off = 0, one, two;

	make_mixed(&lo);
	auto_.lo = &lo;
	call(&auto_);
	OK(auto_.rc == 0 && auto_.did.second > 0.1 && auto_.did.second < 0.8 &&
			strcmp(ct_refine_name(&auto_.did, true), "tv+htv") == 0,
		"plateaus with texture take a mean, %.2f of it htv (%s)", auto_.did.second,
		ct_refine_name(&auto_.did, true));
	v = ct_refine_inversion(&auto_.did);
	v.first.iterations = 20;
	v.second = 0;
	must(ct_inversion_run(&tv, &lo, &v, NULL, &did, &env, &err));
	must(ct_inversion_bytes(&one, CT_UPSAMPLE_TV, &v, tv.n, &err));
	v.second = 0.25;
	must(ct_inversion_run(&mean, &lo, &v, NULL, &did, &env, &err));
	must(ct_inversion_bytes(&two, CT_UPSAMPLE_TV, &v, tv.n, &err));
	v.first = ct_inversion_second(&v);
	v.second = 0;
	must(ct_inversion_run(&htv, &lo, &v, NULL, &did, &env, &err));
	for (size_t i = 0; i < ct_vol_count(&mean); i++)
		off = fmax(off, fabs(0.75 * (double)tv.data[i] + 0.25 * (double)htv.data[i] -
					(double)mean.data[i]));
	OK(off < 1e-3 && deviation(&tv, &htv) > 1, "it is the mean of both (%.1g HU)", off);
	OK(two > one, "and takes the memory of a volume more");
	part = (struct call){.lo = &lo, .rule = auto_.rule};
	part.rule.memory = 1.2 * auto_.did.whole;
	do {
		part.rule.memory -= 0x1p18;
		part.rc = ct_refine_plan(&part.did, &part.rule, &lo, &quiet, &part.failed);
	} while (part.rc == 0 && part.did.slabs < 2);
	must(part.rc);
	must(ct_refine_run(&part.did, &part.out, NULL, &lo, &quiet, &err));
	compare(&auto_.out, &part.out, "a mean", part.did.slabs);
	end(&auto_);
	end(&part);
	ct_vol_free(&lo);
	ct_vol_free(&tv);
	ct_vol_free(&htv);
	ct_vol_free(&mean);
}

/* RMS of D x - y, HU, of the scan that the call refined. */
static double apart(const struct call *c)
{
	struct ct_vol x = {.n = {c->out.n[0], c->out.n[1], c->out.n[2]}, .data = c->out.data};
	double rms;

	memcpy(x.affine, c->out.affine, sizeof x.affine);
	must(ct_upsample_settle(
		&x, c->lo, &c->did.scan.operator,(double) INFINITY, &rms, &quiet, &err));
	return rms;
}

/* Noise stays unless it is to be taken off, whatever the method. */
static void noises(const struct ct_vol *lo, const struct ct_vol *noisy)
{
	static const int methods[] = {CT_UPSAMPLE_TV, CT_UPSAMPLE_HTV, CT_REFINE_PRIOR};

	for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
		struct call kept = {.lo = noisy, .rule = rule_of(methods[k])}, off, half, none;
		const char *name = CT_WORD(CT_REFINE_LIST, methods[k]);

		kept.rule.said.noise = 20;
		kept.rule.error = methods[k] == CT_REFINE_PRIOR;
		off = half = kept;
		off.rule.denoise = 1;
		half.rule.denoise = 0.5;
		none = (struct call){.lo = lo, .rule = rule_of(methods[k])};
		call(&kept);
		call(&off);
		call(&half);
		call(&none);
		OK(kept.rc == 0 && apart(&kept) < 1 && kept.did.residual < 1,
			"%s: by default the result agrees with a noisy scan (%.2g HU)", name,
			apart(&kept));
		OK(off.rc == 0 && apart(&off) > 8 && off.did.rest.back == 0 &&
				fabs(off.did.rest.off - apart(&off)) < 0.01,
			"%s: denoised it leaves out %.3g HU and says so", name, off.did.rest.off);
		NEAR(deviation(&kept.out, &half.out) / deviation(&kept.out, &off.out), 0.5, 1e-3,
			"a share of the noise is that share of the difference");
		OK(deviation(&kept.out, &off.out) < 1.1 * off.did.rest.off,
			"%s: what is put back is not amplified", name);
		OK(none.rc == 0 && none.did.rest.off == 0 && none.did.rest.back == 0 &&
				none.did.rest.passes == 0,
			"%s: of a scan without noise nothing is left out", name);
		if (kept.rule.error)
			OK(kept.error.data[0] > 15 && kept.error.data[0] > off.error.data[0],
				"the predicted error holds the noise that is kept");
		end(&kept);
		end(&off);
		end(&half);
		end(&none);
	}
}

/* The values of `of` times `by`, of no unit that is known, and so is their noise. */
static void make_other(struct ct_vol *to, const struct ct_vol *of, double by, double noise)
{
	*to = (struct ct_vol){0};
	must(ct_vol_like(to, of, &err) || ct_meta_copy(&to->meta, &of->meta, &err) ||
		ct_meta_set(&to->meta, CT_META_QUANTITY, CT_QUANTITY_OTHER, &err) ||
		ct_meta_setf(&to->meta, &err, CT_META_NOISE, "%.9g", by * noise));
	for (size_t i = 0; i < ct_vol_count(of); i++)
		to->data[i] = (float)by * of->data[i];
}

/* Is b what a is, times `by`? */
static bool is_times(const struct ct_vol *b, const struct ct_vol *a, float by)
{
	bool is = ct_vol_count(a) > 0 && ct_vol_count(a) == ct_vol_count(b);

	for (size_t i = 0; is && i < ct_vol_count(a); i++)
		is = b->data[i] == by * a->data[i];
	return is;
}

/* Of values of another unit the result is another by that unit, to the bit if it is a power of two.
 */
static void other_units(const struct ct_vol *noisy)
{
	static const int methods[] = {CT_UPSAMPLE_AUTO, CT_REFINE_PRIOR};
	const double by = 0x1p-10;
	double noise = 0;

	for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
		struct call hu = {.lo = noisy, .rule = rule_of(methods[k])}, one, other;
		const char *name = CT_WORD(CT_REFINE_LIST, methods[k]);
		struct ct_vol large, little;

		make_other(&large, noisy, 1, 20);
		make_other(&little, noisy, by, 20);
		hu.rule.said.noise = (double)NAN;
		hu.rule.error = methods[k] == CT_REFINE_PRIOR;
		one = other = hu;
		one.lo = &large;
		other.lo = &little;
		call(&hu);
		call(&one);
		call(&other);
		OK(hu.rc == 0 && !ct_frame_maps(&hu.did.frame), "%s: values in HU stay as they are",
			name);
		OK(one.rc == 0 && other.rc == 0 && is_times(&other.out, &one.out, (float)by),
			"%s: of values 1024 times as small the result is as many times smaller",
			name);
		OK(ct_meta_numbers(&other.out.meta, CT_META_NOISE, 1, &noise, &err) == 0 &&
				fabs(noise - by * 20) < 1e-9,
			"%s: the noise of the result is in the unit of its values", name);
		if (hu.rule.error)
			OK(is_times(&other.error, &one.error, (float)by),
				"the predicted error is in the unit of the values");
		ct_vol_free(&large);
		ct_vol_free(&little);
		end(&hu);
		end(&one);
		end(&other);
	}
}

/* Is b what a is, on the grid of a? */
static bool is_same(const struct ct_vol *a, const struct ct_vol *b)
{
	return same(a, b) && ct_vol_same_grid(a, b, &err) == 0;
}

/* A scan whose axes are stored in another order, and from the other end where `ends` has their bit;
 * and that turned back. */
struct storage {
	int axis[3], sign[3], back[3], sign_back[3];
};

static struct storage storage_of(const int axis[3], unsigned ends)
{
	struct storage s;

	for (int d = 0; d < 3; d++) {
		s.axis[d] = axis[d];
		s.sign[d] = ends >> d & 1 ? -1 : 1;
		s.back[axis[d]] = d;
		s.sign_back[axis[d]] = s.sign[d];
	}
	return s;
}

/* noisy by the prior with its error; or by TV, from its cubic interpolation. */
static struct call stored_call(const struct ct_vol *noisy, const struct storage *s, bool starts)
{
	struct call c = {.rule = rule_of(starts ? CT_UPSAMPLE_TV : CT_REFINE_PRIOR)};
	struct call first = {.rule = rule_of(CT_UPSAMPLE_CUBIC)};
	struct ct_vol turned = {0};
	double cpu = 0;

	must(ct_vol_like(&turned, noisy, &err) || ct_meta_copy(&turned.meta, &noisy->meta, &err));
	memcpy(turned.data, noisy->data, ct_vol_count(noisy) * sizeof *turned.data);
	must(ct_regrid_turn(&turned, s->axis, s->sign, &err));
	c.rule.said.noise = (double)NAN;
	c.rule.error = !starts;
	c.lo = first.lo = &turned;
	if (starts) {
		call(&first);
		must(first.rc);
		c.rule.start = &first.out;
	}
	call(&c);
	err = c.failed;
	must(c.rc || ct_refine_cost(&cpu, &c.did, &turned, &quiet, &err));
	for (int a = 0; a < 3; a++)
		must(c.did.n[a] != c.out.n[a] ||
			c.did.scan.operator.factor[a] !=(turned.n[a] == THICK ? 4 : 1));
	must(ct_regrid_turn(&c.out, s->back, s->sign_back, &err) ||
		(!starts && ct_regrid_turn(&c.error, s->back, s->sign_back, &err)));
	end(&first);
	ct_vol_free(&turned);
	return c;
}

static void stored(const struct ct_vol *noisy)
{
	static const int order[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	const struct storage none = storage_of(order[0], 0);
	struct call as_is = stored_call(noisy, &none, false),
		    from = stored_call(noisy, &none, true);
	bool results[2] = {true, true}, errors = true, starts = true;

	OK(!ct_frame_copies(&as_is.did.frame),
		"a scan stored as the world's axes run is worked on as it is");
	for (int p = 0; p < 6; p++)
		for (unsigned ends = 0; ends < 8; ends += p == 0 ? 1 : 5) {
			const struct storage s = storage_of(order[p], ends);
			struct call other;

			if (p == 0 && ends == 0)
				continue;
			other = stored_call(noisy, &s, false);
			results[p > 0] &= is_same(&other.out, &as_is.out);
			errors &= is_same(&other.error, &as_is.error);
			end(&other);
			other = stored_call(noisy, &s, true);
			starts &= is_same(&other.out, &from.out);
			end(&other);
		}
	OK(results[0], "whichever end slices, rows and columns begin at, the result is the same");
	OK(results[1], "in whichever order axes are stored, the result is the same");
	OK(errors, "however it is stored, so is the predicted error");
	OK(starts, "however it is stored, it begins with a volume that is stored alike");
	end(&as_is);
	end(&from);
}

int main(void)
{
	struct ct_vol lo, mute, noisy;

	prior.r[0] = (struct ct_slice_network){
		.shape = {4, 8, 1, 1, false}, .components = 9, .width = 21};
	random_network(&prior.r[0]);
	make(&lo, true);
	make(&mute, false);
	textures();
	shares();
	cuts();
	gaps();
	reports(&lo, &mute);
	means();
	at_once(&lo);
	slabs(&lo, 0);
	make(&noisy, true);
	ct_degrade_noise(noisy.data, ct_vol_count(&noisy), 20, 3, NULL);
	slabs(&noisy, 20);
	noises(&lo, &noisy);
	other_units(&noisy);
	stored(&noisy);
	ct_vol_free(&noisy);
	ct_vol_free(&lo);
	ct_vol_free(&mute);
	ct_slice_prior_free(&prior);
	return tap_done();
}
