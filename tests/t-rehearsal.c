/* refine/rehearsal.h: the prior tried on the scan itself: how much of it is right, and the scale of
 * the predicted error. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/rehearsal.h"
#include "tests/tap.h"
#include "slice-make.h"

#include <math.h>
#include <string.h>

enum { SIDE = 48 };
static const struct ct_env quiet = {0};
static struct ct_slice_prior prior = {.n = 1};

/* A prior that thinks the square of its error so many times larger. */
static void network(float times)
{
	prior.r[0] = (struct ct_slice_network){
		.shape = {4, 8, 1, 1, false}, .components = 9, .width = 21};
	random_network(&prior.r[0]);
	for (int k = 0; k < 3; k++)
		prior.r[0].spread[k] *= times;
}

static const struct ct_degrade thick = {{1, 1, 4}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}};

/* A texture of n voxels that says it was made by `by`; with axis a in the place of the third. */
static void make(struct ct_vol *v, const struct ct_degrade *by, const size_t n[3], int a)
{
	const size_t step[3] = {1, n[0], n[0] * n[1]};
	const size_t to[3] = {a == 0 ? 2 : 0, a == 1 ? 2 : 1, a};
	const size_t m[3] = {n[to[0]], n[to[1]], n[to[2]]};
	float *x = malloc(n[0] * n[1] * n[2] * sizeof *x);

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, m, &err));
	texture(x, n, 7);
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = x[i % m[0] * step[to[0]] + i / m[0] % m[1] * step[to[1]] +
				     i / m[0] / m[1] * step[to[2]]] /
			     4;
	for (int k = 0; k < 3; k++)
		v->affine[k][k] = 1;
	if (by)
		must(ct_degrade_put(&v->meta, by, &err));
	free(x);
}

static bool fast; /* slices across one axis */
static void plan(
	struct ct_refine *r, const struct ct_vol *lo, double noise, double weight, bool error)
{
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;

	rule.method = CT_REFINE_PRIOR;
	rule.iterations = 60;
	rule.said.noise = noise;
	rule.prior = &prior;
	rule.weight = weight;
	rule.one_axis = fast;
	rule.error = error;
	must(ct_refine_plan(r, &rule, lo, &quiet, &err));
	must(ct_rehearsal_weigh(r, lo, &quiet, &err));
}

static bool is_part(
	const struct ct_degrade *by, const size_t n[3], int k, const size_t part[3], int axis)
{
	struct ct_refine r = {.adds = true, .scan.operator= * by };
	struct ct_vol v = {.n = {n[0], n[1], n[2]}};
	struct ct_degrade own;
	size_t m[3];

	if (!ct_rehearsal_part(m, &own, &r, &v, k))
		return axis < 0;
	for (int a = 0; a < 3; a++)
		if (axis < 0 ||
			own.factor[a] !=
				(a == axis ? fmax(by->factor[0], fmax(by->factor[1], by->factor[2]))
					   : 1))
			return false;
	r.adds = false;
	return memcmp(m, part, sizeof m) == 0 && !ct_rehearsal_part(m, &own, &r, &v, k);
}

static void parts(void)
{
	const struct ct_degrade cube = {{4, 4, 4}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}};
	const struct ct_degrade odd = {{1, 2.5, 1}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}};

	OK(is_part(&thick, (size_t[]){200, 31, 9}, 0, (size_t[]){96, 31, 9}, 0), "along x");
	OK(is_part(&thick, (size_t[]){200, 31, 9}, 1, (size_t[]){96, 28, 9}, 1), "and along y");
	OK(is_part(&thick, (size_t[]){200, 31, 9}, 2, NULL, -1), "and no other");
	OK(is_part(&odd, (size_t[]){50, 9, 29}, 0, (size_t[]){50, 9, 28}, 2), "of no whole factor");
	OK(is_part(&thick, (size_t[]){15, 64, 64}, 0, NULL, -1), "not if it is too small");
	OK(is_part(&thick, (size_t[]){16, 64, 64}, 0, (size_t[]){16, 64, 64}, 0),
		"a side of 16 voxels is just large enough");
	OK(is_part(&cube, (size_t[]){64, 64, 64}, 0, NULL, -1), "nor of several axes");
}

enum { FROM = 16 }; /* HU, where a bin of the predicted error begins, */

/* The same, with the refined axis always the third. *bin: of that bin. */
static void twin(
	double *error, double *bin, double *weight, const struct ct_refine *of, double noise)
{
	const size_t n[3] = {SIDE, SIDE, SIDE};
	double added = 0, right = 0, missed[2] = {0}, expected[2] = {0}, count = 0, beyond;

	for (int a = 0; a < 2; a++) {
		struct ct_vol hi, lo = {0}, base = {0};
		struct ct_restore_report added_to;
		struct ct_upsample_report did;
		struct ct_upsample_rule rule;
		struct ct_refine r;
		float *x, *its;

		make(&hi, NULL, n, a);
		must(ct_degrade_volume(&lo, &hi, &thick, noise, 0, NULL, &err));
		plan(&r, &lo, noise, (double)NAN, true);
		r.restore.weight = 1;
		r.textured = of->textured;
		rule = ct_refine_inversion(&r).first;
		must(ct_upsample(&base, &lo, &rule, &did, &quiet, &err));
		x = malloc(ct_vol_count(&base) * sizeof *x);
		its = malloc(ct_vol_count(&base) * sizeof *its);
		memcpy(x, base.data, ct_vol_count(&base) * sizeof *x);
		must(ct_restore(&base, its, &lo, &prior, &r.restore, &added_to, &quiet, &err));
		for (size_t i = 0; i < ct_vol_count(&base); i++) {
			const double h = (double)(base.data[i] - x[i]);
			const double d = (double)(hi.data[i] - base.data[i]);

			added += h * h;
			right += h * (d + h);
			missed[0] += d * d - noise * noise;
			expected[0] += (double)its[i] * (double)its[i];
			if (its[i] < FROM || (double)its[i] >= FROM * M_SQRT2)
				continue;
			count++;
			missed[1] += d * d - noise * noise;
			expected[1] += (double)its[i] * (double)its[i];
		}
		ct_vol_free(&hi);
		ct_vol_free(&lo);
		ct_vol_free(&base);
		free(x);
		free(its);
	}
	*error = sqrt(missed[0] / expected[0]);
	OK(count > 10000, "many voxels have a predicted error of %d to %.1f HU", FROM,
		FROM * M_SQRT2);
	*bin = sqrt((missed[1] + 2000 * 19.03 * 19.03 * *error * *error) /
		    (expected[1] + 2000 * 19.03 * 19.03));
	beyond = log2(19.03 / sqrt(expected[0] / (2. * SIDE * SIDE * SIDE)));
	*bin = *bin > 1 ? fmin(*bin, 2) : pow(*bin, .75 * fmin(fmax(1 - beyond, 0), 1));
	*weight = fmax(right / added, 0);
}

/* The volume that is asked: no operator but the one of the header. */
static void tries(double noise)
{
	const size_t n[3] = {SIDE, SIDE, SIDE};
	struct ct_rehearsal t;
	double error, bin, weight;
	struct ct_refine r;
	struct ct_vol v;

	make(&v, &thick, n, 2);
	plan(&r, &v, noise, (double)NAN, false);
	r.restore.weight = 1;
	must(ct_rehearsal_run(&t, &r, &v, &quiet, &err));
	twin(&error, &bin, &weight, &r, noise);
	NEAR(t.error, error, .02 * error, "what is missed over what is expected");
	NEAR(t.believed[8], bin, .01, "and of voxels with so much of it");
	NEAR(t.weight, weight, .02, "and how much of what is added is right");
	ct_vol_free(&v);
}

/* Root of the mean square. */
static double size_of(const struct ct_vol *v)
{
	double sum = 0;

	for (size_t i = 0; i < ct_vol_count(v); i++)
		sum += (double)v->data[i] * (double)v->data[i];
	return sqrt(sum / (double)ct_vol_count(v));
}

/* What the prior expects that thinks its error so many times larger. */
static double expects(const struct ct_vol *v, float times, struct ct_rehearsal *t)
{
	struct ct_vol out = {0}, error = {0};
	struct ct_refine r;
	double its;

	ct_slice_prior_free(&prior);
	prior.n = 1;
	network(times);
	plan(&r, v, 0, 1, true);
	must(ct_rehearsal_run(t, &r, v, &quiet, &err));
	must(ct_refine_run(&r, &out, &error, v, &quiet, &err));
	its = size_of(&error);
	ct_vol_free(&out);
	ct_vol_free(&error);
	return its;
}

static void scales(void)
{
	const size_t n[3] = {SIDE, SIDE, 16};
	static const float times[4] = {1, 1.2f, 100, 1e-2f};
	struct ct_rehearsal t[4];
	struct ct_vol v;
	double its[4];

	make(&v, &thick, n, 2);
	for (int k = 0; k < 4; k++)
		its[k] = expects(&v, times[k], &t[k]);
	OK(t[0].error > 1.1 && t[0].error < 2, "more is missed than expected");
	NEAR(its[1], its[0], .03 * its[0], "another calibration says nearly the same");
	NEAR(ct_rehearsal_error(&t[2], pow(2, 1.25)), pow(2, 1.25) * pow(t[2].error, .75), 1e-2,
		"of less three quarters are believed where no voxel tells");
	NEAR(ct_rehearsal_error(&t[2], 5000), 5000, 1e-6,
		"of the largest errors of slices nothing is taken off");
	NEAR(ct_rehearsal_error(&t[3], 1000), 2000, 1e-6, "not more than twice");
	NEAR(ct_rehearsal_error(&t[0], 0), 0, 0, "no error stays none");
	ct_vol_free(&v);
}

static volatile sig_atomic_t stop;

/* Somebody who looks on ends what is rehearsed. */
static void end(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	(void)env, (void)done, (void)total, (void)likely;
	stop = stop || strcmp(what, CT_PROGRESS_WHOLE) == 0;
}

/* A texture to which the prior adds what is not there. */
static void weighs(void)
{
	const struct ct_env env = {.progress = end, .stop = &stop};
	const size_t n[3] = {SIDE, SIDE, SIDE};
	struct ct_err failed;
	struct ct_rehearsal t;
	struct ct_refine r;
	struct ct_vol v;
	double its;

	make(&v, &thick, n, 2);
	plan(&r, &v, 0, 1, false);
	OK(r.adds && r.textured && r.restore.weight == 1, "a texture, and a weight that is said");
	plan(&r, &v, 3.9, 1, false);
	OK(r.textured, "with little noise, too");
	plan(&r, &v, 4.1, 1, false);
	OK(r.textured, "and with more");
	plan(&r, &v, 0, (double)NAN, false);
	its = r.share;
	must(ct_rehearsal_run(&t, &r, &v, &quiet, &err));
	OK(t.weight < 0.2, "little of it is right (%.3g)", t.weight);
	NEAR(its, fmin(fmax(t.share, 0), 1), 0,
		"a texture throughout keeps the share it rehearsed");
	OK(its < 0.5, "which is less than half (%.3g)", its);
	OK(ct_rehearsal_weigh(&r, &v, &env, &failed) && failed.code == CT_ESTOP && stop,
		"its progress is told, and it is stopped");
	ct_vol_free(&v);
}

/* The prior adds so many times more. */
static void louder(double times)
{
	struct ct_slice_network *net = &prior.r[0];
	const size_t out = net->out - 1; /* the last is the error */

	for (size_t i = 0; i < out * net->inputs; i++)
		net->all[net->at[CT_PART_LINEAR] + i] *= (float)times;
	for (size_t i = 0; i < out * net->width; i++)
		net->all[net->at[CT_PART_3] + i] *= (float)times;
	for (size_t i = 0; i < out; i++) {
		net->all[net->at[CT_PART_LINEAR_BIAS] + i] *= (float)times;
		net->all[net->at[CT_PART_3_BIAS] + i] *= (float)times;
	}
}

/* Refined twice: weight of the prior, beside what the rehearsal says of it. */
static double twice(double *right, const struct ct_vol *v)
{
	struct ct_rehearsal t;
	struct ct_refine r;
	double its;

	plan(&r, v, 0, (double)NAN, false);
	its = r.restore.weight;
	r.restore.weight = 1;
	must(ct_rehearsal_run(&t, &r, v, &quiet, &err));
	OK(r.adds && !r.textured && t.parts == 1, "it is tried once");
	*right = t.weight;
	return its;
}

/* Edges, and not texture, to which the prior adds too much, less, and too little. */
static void twices(void)
{
	const struct ct_degrade by = {{2, 2, 2}, {.85, .85, .85}, CT_DECIMATE_SINC, {0}};
	const size_t n[3] = {SIDE, SIDE, SIDE};
	struct ct_vol v;
	double right, its;

	ct_slice_prior_free(&prior);
	prior.n = 1;
	prior.r[0] = (struct ct_slice_network){
		.shape = {2, 8, 1, 1, true}, .components = 9, .width = 21};
	random_network(&prior.r[0]);
	make(&v, &by, n, 2);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = sin((double)(i % SIDE) / 5) * sin((double)(i / SIDE % SIDE) / 6) *
						    sin((double)(i / SIDE / SIDE) / 4) >
					    0.2
				    ? 500
				    : 0;
	its = twice(&right, &v);
	OK(its == 1 && right < 1, "not less than all is added (%.3g)", right);
	louder(0.047);
	its = twice(&right, &v);
	OK(right > 1.31 && right < 1.89, "more is added, not all that is right (%.3g)", right);
	NEAR(its, right - 0.3, 1e-9, "but .3 less");
	louder(0.5);
	its = twice(&right, &v);
	OK(its == 1.6 && right > 2, "at most 1.6 times (%.3g)", right);
	ct_vol_free(&v);
}

/* Fewer slices than the factor. */
static void few(void)
{
	const size_t n[3] = {SIDE, SIDE, 3};
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_refine r;
	struct ct_vol v;

	rule.method = CT_REFINE_PRIOR;
	rule.said.noise = 0;
	rule.prior = &prior;
	make(&v, &thick, n, 2);
	OK(ct_refine_plan(&r, &rule, &v, &quiet, &err) == 0 && r.adds,
		"three slices, refined 4 times");
	ct_vol_free(&v);
}

/* What the value of padding changes. */
static void padding(void)
{
	const size_t n[3] = {SIDE, SIDE, 16};
	struct ct_rehearsal t[2];
	struct ct_refine r;
	struct ct_vol v;

	make(&v, &thick, n, 2);
	plan(&r, &v, 0, 1, false);
	for (int k = 0; k < 2; k++) {
		for (size_t i = 0; i < ct_vol_count(&v); i++)
			if (i % SIDE < SIDE / 3)
				v.data[i] = k ? -3024 : -1024;
		must(ct_rehearsal_run(&t[k], &r, &v, &quiet, &err));
	}
	NEAR(t[1].error, t[0].error, 0, "padding is not missed");
	NEAR(t[1].weight, t[0].weight, 0, "whatever its value");
	ct_vol_free(&v);
}

int main(void)
{
	network(1);
	parts();
	tries(0);
	tries(20);
	fast = true;
	tries(0);
	fast = false;
	weighs();
	few();
	padding();
	scales();
	twices();
	ct_slice_prior_free(&prior);
	return tap_done();
}
