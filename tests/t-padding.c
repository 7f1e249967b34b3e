/* Padding is told from air, filled without a step, and changes neither what is measured of a CT nor
 * what is made of it. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "quality/data-residual.h"
#include "estimate/assumed.h"
#include "inverse/flat.h"
#include "refine/refine.h"
#include "operator/padding.h"
#include "operator/resample.h"
#include "estimate/profile.h"
#include "operator/mirror.h"
#include "inverse/tv.h"
#include "inverse/upsample.h"
#include "operator/cosine.h"
#include "tap.h"

#include <stdbool.h>
#include <string.h>

enum { SIDE = 96 };

static const struct ct_env quiet = {0};

/* Balls of many sizes and densities in air, with soft edges of half a voxel. */
static void make(struct ct_vol *v)
{
	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, (const size_t[3]){SIDE, SIDE, SIDE}, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = -1000;
	for (uint64_t b = 0; b < 80; b++) {
		const double r = 3 + 7 * ct_rng_uniform(1, b, 0);
		const double hu = 100 + 900 * ct_rng_uniform(1, b, 1);
		double c[3];

		for (int a = 0; a < 3; a++)
			c[a] = SIDE * ct_rng_uniform(1, b, 2 + (uint64_t)a);
		for (size_t i = 0; i < ct_vol_count(v); i++) {
			const double d = sqrt(pow((double)(i % SIDE) - c[0], 2) +
					      pow((double)(i / SIDE % SIDE) - c[1], 2) +
					      pow((double)(i / SIDE / SIDE) - c[2], 2));
			const double in = 0.5 * erfc((d - r) / (sqrt(2) * 0.5));

			v->data[i] = (float)((1 - in) * (double)v->data[i] + in * hu);
		}
	}
}

static void copy(struct ct_vol *to, const struct ct_vol *of)
{
	*to = (struct ct_vol){0};
	must(ct_vol_alloc(to, of->n, &err));
	memcpy(to->affine, of->affine, sizeof to->affine);
	memcpy(to->data, of->data, ct_vol_count(of) * sizeof *of->data);
}

static struct ct_vol reduced(const struct ct_vol *v, const struct ct_degrade *d, double noise)
{
	struct ct_vol lo = {0};

	must(ct_degrade_volume(&lo, v, d, noise, 3, NULL, &err));
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		lo.data[i] = rintf(lo.data[i]);
	ct_meta_free(&lo.meta);
	return lo;
}

/* Distance of a voxel from the axis of the field of view, as a share of the width. */
static double away(const struct ct_vol *v, size_t i)
{
	const double x = ((double)(i % v->n[0]) + 0.5) / (double)v->n[0] - 0.5;
	const double y = ((double)(i / v->n[0] % v->n[1]) + 0.5) / (double)v->n[1] - 0.5;

	return sqrt(x * x + y * y);
}

static size_t circle(struct ct_vol *v, double diameter, float hu)
{
	size_t n = 0;

	for (size_t i = 0; i < ct_vol_count(v); i++)
		if (away(v, i) > diameter / 2) {
			v->data[i] = hu;
			n++;
		}
	return n;
}

/* A face: of the voxels at y beyond a share all that are below a share of z. */
static size_t face(struct ct_vol *v, float hu)
{
	size_t n = 0;

	for (size_t i = 0; i < ct_vol_count(v); i++)
		if (10 * (i / v->n[0] % v->n[1]) >= 7 * v->n[1] &&
			10 * (i / v->n[0] / v->n[1]) < 7 * v->n[2]) {
			v->data[i] = hu;
			n++;
		}
	return n;
}

static size_t found(const struct ct_vol *v, double *hu)
{
	struct ct_padding p;
	size_t n;

	must(ct_padding_find(&p, v->data, v->n, &err));
	n = p.count;
	*hu = p.hu;
	ct_padding_free(&p);
	return n;
}

static void finds(const struct ct_vol *lo)
{
	static const float values[] = {-1024, -2000, 0};
	struct ct_vol t;
	double hu;

	OK(found(lo, &hu) == 0, "a CT with noise has no padding");
	for (int k = 0; k < 3; k++) {
		size_t n;

		copy(&t, lo);
		n = circle(&t, 0.8, values[k]);
		OK(found(&t, &hu) >= n && found(&t, &hu) < n + n / 1000 + 1 &&
				hu == (double)values[k],
			"a circle of %g HU: %zu for %zu", (double)values[k], found(&t, &hu), n);
		ct_vol_free(&t);
		copy(&t, lo);
		n = face(&t, values[k]);
		OK(found(&t, &hu) >= n && found(&t, &hu) < n + n / 1000 + 1,
			"a face of %g HU: %zu for %zu", (double)values[k], found(&t, &hu), n);
		ct_vol_free(&t);
	}
	copy(&t, lo);
	for (size_t i = 0; i < ct_vol_count(&t); i++)
		t.data[i] = fmaxf(t.data[i], -900);
	OK(found(&t, &hu) == 0, "air that was clipped is none");
	ct_vol_free(&t);
	t = (struct ct_vol){0};
	must(ct_vol_alloc(&t, (const size_t[3]){24, 24, 24}, &err));
	for (size_t i = 0; i < ct_vol_count(&t); i++)
		t.data[i] = away(&t, i) < 0.3 && i / 576 % 24 > 6 && i / 576 < 18 ? 40 : -1000;
	OK(found(&t, &hu) == 0, "a synthetic CT has none, though its edges are sharp");
	ct_vol_free(&t);
}

static void same(double got, double want, const char *what)
{
	OK(fabs(got - want) < 0.1 * want, "%s: spread %.3f for %.3f", what, got, want);
}

/* What is measured, with padding, a face, metal that was cut off at 3071 HU. */
static void measures(const struct ct_vol *v, const struct ct_degrade *d)
{
	struct ct_vol lo = reduced(v, d, 15), t;
	struct ct_profile plain[3], got[3];

	must(ct_profile_measure(plain, &lo, d->factor, NULL, &err));
	copy(&t, &lo);
	circle(&t, 0.7, -1024);
	must(ct_profile_measure(got, &t, d->factor, NULL, &err));
	same(got[0].spread, plain[0].spread, "a circle");
	ct_vol_free(&t);
	copy(&t, &lo);
	face(&t, -1024);
	must(ct_profile_measure(got, &t, d->factor, NULL, &err));
	same(got[2].spread, plain[2].spread, "a face");
	ct_vol_free(&t);
	ct_vol_free(&lo);
	copy(&t, v);
	for (size_t i = 0; i < ct_vol_count(&t); i++)
		if (t.data[i] > 800)
			t.data[i] = 20 * t.data[i];
	lo = reduced(&t, d, 15);
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		lo.data[i] = fminf(lo.data[i], 3071);
	must(ct_profile_measure(got, &lo, d->factor, NULL, &err));
	OK(fabs(got[0].spread - plain[0].spread) < 0.25 * plain[0].spread,
		"metal: spread %.3f for %.3f", got[0].spread, plain[0].spread);
	ct_vol_free(&t);
	ct_vol_free(&lo);
}

/* Every filled voxel lies between the values beside the padding, and none is left. */
static void fills(const struct ct_vol *lo)
{
	struct ct_padding p, coarse = {0};
	struct ct_vol t;
	bool between = true, kept = true;
	float *x;

	copy(&t, lo);
	for (size_t i = 0; i < ct_vol_count(&t); i++)
		t.data[i] = 100 + (float)(i % 7);
	circle(&t, 0.8, -1024);
	must(ct_padding_find(&p, t.data, t.n, &err));
	must(ct_padding_fill(t.data, &p, t.n, &err));
	for (size_t i = 0; i < ct_vol_count(&t); i++) {
		between = between && t.data[i] >= 100 && t.data[i] <= 106;
		kept = kept && (away(&t, i) > 0.4 || t.data[i] == 100 + (float)(i % 7));
	}
	OK(between && kept, "filled from beside it, and nothing else changed");
	x = normals(8 * ct_vol_count(&t), 1, 1, 10);
	ct_padding_put(x, (const size_t[3]){2 * t.n[0], 2 * t.n[1], 2 * t.n[2]}, &p, t.n,
		(const double[3]){2, 2, 2}, -5000);
	OK(x[0] == -5000 && x[1] == -5000 &&
			fabsf(x[4 * ct_vol_count(&t) + 2 * t.n[0] * t.n[1] + t.n[0]]) < 100,
		"the fine grid has it where the coarse one has");
	free(x);
	must(ct_padding_reduce(&coarse, &p, t.n, 2, 3, &err));
	OK(coarse.count == p.count / 3, "three slices make one: %zu of %zu", coarse.count, p.count);
	must(ct_padding_widen(&p, t.n, 2, &err));
	OK(p.is[t.n[0] / 2] && !p.is[t.n[0] * (t.n[1] / 2) + t.n[0] / 2], "widened");
	ct_padding_free(&p);
	ct_padding_free(&coarse);
	ct_vol_free(&t);
}

/* Returns the texture of lo that it used, HU. */
static double refine(
	struct ct_vol *out, double *residual, const struct ct_vol *lo, const struct ct_degrade *d)
{
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_refine r;

	rule.method = CT_UPSAMPLE_TV;
	rule.iterations = 60;
	rule.said.noise = 0;
	rule.said.decimate = (int)d->decimate;
	memcpy(rule.said.factor, d->factor, sizeof rule.said.factor);
	memcpy(rule.said.sigma, d->sigma, sizeof rule.said.sigma);
	*out = (struct ct_vol){0};
	must(ct_refine_plan(&r, &rule, lo, &quiet, &err));
	must(ct_refine_run(&r, out, NULL, lo, &quiet, &err));
	*residual = r.residual;
	return r.texture;
}

/* Inside the field of view less 3 voxels the result is what it is without the circle. */
static void refines(struct ct_vol *v, const struct ct_degrade *d)
{
	struct ct_vol lo, t, whole, part, map = {0};
	struct ct_data_residual c;
	double square = 0, error = 0, residual, texture, want;
	size_t n = 0;
	bool out = true;

	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] += 1040; /* tissue is cut, not air */
	lo = reduced(v, d, 3);
	copy(&t, &lo);
	circle(&t, 0.9, -1024);
	refine(&whole, &residual, &lo, d);
	texture = refine(&part, &residual, &t, d);
	must(ct_flat_texture(&want, &t, &err));
	OK(want > 0 && texture == want, "the texture of a padded scan is that of all of it: %g HU",
		texture);
	for (size_t i = 0; i < ct_vol_count(&part); i++)
		if (away(&part, i) < 0.45 - 3 / (double)lo.n[0]) {
			square += pow((double)part.data[i] - (double)whole.data[i], 2);
			error += pow((double)whole.data[i] - (double)v->data[i], 2);
			n++;
		} else if (away(&part, i) > 0.47)
			out = out && part.data[i] == -1024;
	OK(square < 0.3 * error && n > 0, "off by %.1f HU RMS, of an error of %.1f",
		sqrt(square / (double)n), sqrt(error / (double)n));
	OK(out && residual < 1, "padding stays; agrees within %.2g HU", residual);
	must(ct_data_residual(&c, &map, &t, &part, d, &quiet, &err));
	OK(c.voxels < ct_vol_count(&t) && c.rms < 5 && fabs((double)map.data[0]) < 1,
		"data residual without the rim: %.2g HU RMS of %zu voxels", c.rms, c.voxels);
	ct_vol_free(&map);
	ct_vol_free(&part);
	ct_vol_free(&whole);
	ct_vol_free(&t);
	ct_vol_free(&lo);
}

static void overshoots(void)
{
	const double line[CT_EDGE_LONG] = {-.4, -.4, -.4, -.4, -.6, -.5, .5, .7, .4, .4, .4, .4};
	const double dip[CT_EDGE_LONG] = {0, 0, 0, 0, -.5, -.5, .5, .5, .1, .1, .1, .1};
	struct ct_operator is = {.operator= {{2, 2, 2}, {0}, CT_DECIMATE_SINC, {0}},
		.from = CT_BY_MEASURE,
		.seen = {{.spread = .3}, {.spread = .3}, {.spread = .3}}};
	char words[CT_ASSUMED_WORDS];

	NEAR(ct_edge_lines_overshoot(line), 0.25, 1e-9, "the side that overshoots less counts");
	ct_assumed_words(words, &is, (const double[3]){1, 1, 1});
	OK(!strstr(words, "overshoot"), "no edges, no word");
	memcpy(is.seen[1].edge, line, sizeof line);
	ct_assumed_words(words, &is, (const double[3]){1, 1, 1});
	OK(strstr(words, "edges overshoot by 25 %") != NULL, "%s", words);
	OK(ct_edge_lines_is_edge(line) && !ct_edge_lines_is_edge(dip), "a dip is no edge");
	OK(ct_edge_lines_overshoot(dip) > 3, "%g", ct_edge_lines_overshoot(dip));
	memcpy(is.seen[1].edge, dip, sizeof dip);
	ct_assumed_words(words, &is, (const double[3]){1, 1, 1});
	OK(!strstr(words, "overshoot"), "what is no edge overshoots by nothing: %s", words);
}

/* What is said of an operator that nobody said, word by word. */
static void words_of_operator(void)
{
	const double mm[3] = {1, 1, 2}, none = (double)NAN;
	struct ct_operator is = {.operator= {{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}},
		.from = CT_BY_MEASURE,
		.sure = 0.75,
		.told = {{.spread = none}, {.spread = none}, {.spread = none}}};
	char words[CT_ASSUMED_WORDS];

	for (int a = 0; a < 3; a++)
		is.joint[a] = is.seen[a] = (struct ct_profile){.spread = 0.5, .deviation = 0.1};
	ct_assumed_words(words, &is, mm);
	OK(strcmp(words,
		   "profile 2.35 mm wide (2.35 standard deviations) along z, uncertain by 10 %, averaged over a "
		   "voxel (75 % sure); measured on edges") == 0,
		"what edges show is said with width, doubt and source: %s", words);
	is.told[2] = is.seen[2];
	ct_assumed_words(words, &is, mm);
	OK(strstr(words,
		   "sure); DICOM (unknown maker) expects 2.35 mm within 10 %, edges show 2.35 "
		   "within 10 %") != NULL,
		"what DICOM tells stands beside what edges show: %s", words);
	is.joint[2].spread = none;
	ct_assumed_words(words, &is, mm);
	OK(!*words, "of an operator without a width nothing is said: %s", words);
}

/* A result that is 3 HU above cubic interpolation, and 1000 at one voxel: what is left of the 3 is
 * the weight of the result. */
static void damps(void)
{
	enum { M = 24, N = 2 * M, AT = 25 };
	const double two[3] = {2, 2, 2};
	struct ct_vol in = {0}, out = {0}, cubic = {0};
	struct ct_separable by = {0};
	double w, last = -1, step = 0, far = 0;
	bool rises = true;
	struct ct_damped did;

	must(ct_vol_alloc(&in, (const size_t[3]){M, M, M}, &err));
	for (size_t i = 0; i < ct_vol_count(&in); i++)
		in.data[i] = (float)(45 + 10 * ct_rng_uniform(7, i, 0));
	in.data[0] = 0;
	in.data[ct_vol_count(&in) - 1] = 100;
	must(ct_vol_alloc(&out, (const size_t[3]){N, N, N}, &err));
	must(ct_vol_alloc(&cubic, out.n, &err));
	must(ct_resample_up_plan(&by, in.n, two, CT_CUBIC, NULL, &err));
	ct_separable_apply(&by, cubic.data, in.data, NULL);
	for (size_t i = 0; i < ct_vol_count(&out); i++)
		out.data[i] = cubic.data[i] + 3;
	out.data[(AT * N + AT) * N + AT] = 1000;
	must(ct_damp(&did, &out, &in, two, NULL, &err));
	OK(fabs(did.most - 900) < 2, "the range is left by %g HU", did.most);
	for (size_t i = AT; i < N; i++) {
		const size_t v = (AT * N + AT) * N + i;
		const double most = i == AT ? 1000 - (double)cubic.data[v] : 3;

		w = ((double)out.data[v] - (double)cubic.data[v]) / most;
		rises = rises && w >= last - 1e-4;
		step = last < 0 ? 0 : fmax(step, w - last);
		far = w < 0.999 ? (double)(i - AT) : far;
		last = w;
	}
	OK(rises && fabs(last - 1) < 1e-4, "the weight rises to 1 away from what is damped");
	OK(step < 0.2, "the weight changes by %.2g from voxel to voxel", step);
	OK(far > 10 && far < 12, "voxels %g away are blended, and none beyond", far);
	OK(did.share > pow(23. / N, 3) && did.share < pow(27. / N, 3), "a share of %g is blended",
		did.share);
	ct_separable_free(&by);
	ct_vol_free(&in);
	ct_vol_free(&out);
	ct_vol_free(&cubic);
}

static void words_of_damping(void)
{
	const struct ct_damped none = {0}, some = {.share = 0.01246, .most = 45.4};
	char words[200] = "";

	ct_damped_words(words, sizeof words, &none);
	OK(!*words, "a result in its range has no words of damping");
	ct_damped_words(words, sizeof words, &some);
	ct_damped_words(words, sizeof words, &some);
#define LEFT                                                                                       \
	"the result left the range of the scan by up to 45 HU: 1.2 % of the voxels are blended "   \
	"with cubic"
	OK(strcmp(words, LEFT "; " LEFT) == 0, "damped voxels are said in percent: %s", words);
}

/* A value is padding if 27 voxels lie amid others of it: a box of 5 x 5 x 5, and a line from it to
 * the border. */
static void test_least(void)
{
	enum { N = 24 };
	struct ct_padding p = {0};
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[3]){N, N, N}, &err));
	for (size_t i = 0; i < N * N * N; i++)
		v.data[i] = rintf((float)(20 * ct_rng_uniform(5, i, 0))) + (float)(i % 7);
	for (size_t k = 8; k < 13; k++)
		for (size_t j = 8; j < 13; j++)
			for (size_t i = 8; i < 13; i++)
				v.data[(k * N + j) * N + i] = -2000;
	for (size_t i = 0; i < 8; i++)
		v.data[(10 * N + 10) * N + i] = -2000;
	must(ct_padding_find(&p, v.data, v.n, &err));
	OK(p.count == 125 + 8, "27 voxels amid their own are padding (%zu)", p.count);
	ct_padding_free(&p);
	v.data[(8 * N + 8) * N + 8] = 5;
	must(ct_padding_find(&p, v.data, v.n, &err));
	OK(p.count == 0, "26 are none (%zu)", p.count);
	ct_padding_free(&p);
	ct_vol_free(&v);
}

/* A volume and the dual of its variation, mirrored; and the mean of solutions of a scan that is. */

static const size_t size[3] = {9, 6, 7};
enum { ALL = 9 * 6 * 7, EDGE = 32, ITERATIONS = 40, REST = 4000 };

static size_t mirrored(size_t i, const size_t n[3], unsigned axes)
{
	const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
	size_t of[3];

	for (int a = 0; a < 3; a++)
		of[a] = axes >> a & 1 ? n[a] - 1 - at[a] : at[a];
	return (of[2] * n[1] + of[1]) * n[0] + of[0];
}

/* Forward differences along the axes, 0 at the last voxels. */
static void differences(int16_t *d, const float *x)
{
	const size_t stride[3] = {1, size[0], size[0] * size[1]};

	for (int a = 0; a < 3; a++)
		for (size_t i = 0; i < ALL; i++)
			*d++ = i / stride[a] % size[a] + 1 < size[a]
				       ? (int16_t)(x[i + stride[a]] - x[i])
				       : 0;
}

static void test_volumes(void)
{
	float x[ALL], y[ALL];
	int16_t want[3 * ALL], got[3 * ALL];
	struct ct_par *par;
	bool volume = true, dual = true, twice = true;

	for (size_t i = 0; i < ALL; i++)
		x[i] = (float)ct_rng_below(1, 2, i, 2000);
	must(ct_par_alloc(&par, 3, &err));
	for (unsigned axes = 0; axes < 8; axes++) {
		memcpy(y, x, sizeof y);
		differences(got, x);
		ct_mirror_volume(y, size, axes, par);
		ct_mirror_dual(got, size, axes, par);
		for (size_t i = 0; i < ALL; i++)
			volume = volume && fabsf(y[i] - x[mirrored(i, size, axes)]) <= 0;
		differences(want, y);
		dual = dual && memcmp(want, got, sizeof got) == 0;
		ct_mirror_volume(y, size, axes, NULL);
		ct_mirror_dual(got, size, axes, NULL);
		differences(want, x);
		twice = twice && memcmp(x, y, sizeof y) == 0 && memcmp(want, got, sizeof got) == 0;
	}
	OK(volume, "a volume is mirrored along any axes");
	OK(dual, "and its differences become those of the mirrored one");
	OK(twice, "twice changes nothing");
	ct_par_free(par);
}

static void solve(struct ct_vol *hi, const struct ct_vol *lo, enum ct_upsample method,
	size_t iterations, bool mirrors)
{
	const struct ct_upsample_rule rule = {.method = method,
		.known = true,
		.by = {{4, 4, 4}, {1.4, 1.4, 1.4}, CT_DECIMATE_SINC, {0}},
		.iterations = iterations,
		.mirrors = mirrors};
	const struct ct_env env = {0};
	struct ct_upsample_report did;

	*hi = (struct ct_vol){0};
	must(ct_upsample(hi, lo, &rule, &did, &env, &err));
	OK(did.iterations == iterations && did.residual < 1e-3,
		"%zu iterations: it agrees with the scan", iterations);
}

/* As it is, and after few iterations nearly, the mean for the scan as it lies and mirrored. */
static void test_mirrors(void)
{
	static const unsigned turns[] = {0, 5, 3, 6};
	const size_t n[3] = {EDGE / 4, EDGE / 4, EDGE / 4}, all = EDGE * EDGE * EDGE;
	const size_t fine[3] = {EDGE, EDGE, EDGE};
	const struct ct_degrade by = {{4, 4, 4}, {1.4, 1.4, 1.4}, CT_DECIMATE_SINC, {0}};
	struct ct_vol lo = {0}, hi = {0}, one;
	float *mean = calloc(all, sizeof *mean);

	must(!mean || ct_vol_alloc(&hi, fine, &err));
	for (size_t i = 0; i < all; i++) {
		const double x = (double)(i % EDGE), y = (double)(i / EDGE % EDGE),
			     z = (double)(i / EDGE / EDGE);

		hi.data[i] = x + 0.6 * y < 22                       ? -1000
			     : hypot(y - 20, z - 14) + 0.3 * x < 18 ? 900
								    : 40;
	}
	for (int a = 0; a < 3; a++)
		hi.affine[a][a] = 1;
	must(ct_degrade_volume(&lo, &hi, &by, 0, 0, NULL, &err));
	ct_vol_free(&hi);
	for (int k = 0; k < 4; k++) {
		ct_mirror_volume(lo.data, n, turns[k], NULL);
		solve(&one, &lo, CT_UPSAMPLE_TV, REST, false);
		ct_mirror_volume(lo.data, n, turns[k], NULL);
		ct_mirror_volume(one.data, fine, turns[k], NULL);
		for (size_t i = 0; i < all; i++)
			mean[i] += one.data[i] / 4;
		if (k < 3)
			ct_vol_free(&one);
	}
	solve(&hi, &lo, CT_UPSAMPLE_TV, REST, true);
	OK(apart(all, hi.data, mean) < 0.05 * apart(all, one.data, mean),
		"the mean for the scan as it lies and mirrored (%.2g of %.2g)",
		apart(all, hi.data, mean), apart(all, one.data, mean));
	ct_vol_free(&hi);
	solve(&hi, &lo, CT_UPSAMPLE_TV, ITERATIONS, true);
	OK(apart(all, hi.data, mean) < 0.25, "each way begins with the dual of that before (%.2g)",
		apart(all, hi.data, mean));
	for (int k = 0; k < 2; k++) {
		ct_vol_free(k ? &one : &hi);
		solve(k ? &one : &hi, &lo, CT_UPSAMPLE_HTV, ITERATIONS, k);
	}
	OK(memcmp(hi.data, one.data, all * sizeof *hi.data) == 0, "only TV has ways");
	ct_vol_free(&hi);
	ct_vol_free(&one);
	ct_vol_free(&lo);
	free(mean);
}

static void t_mirror(void)
{
	test_volumes();
	test_mirrors();
}

/* Products with bases of even and odd functions, against sums in double: cosines, others that fold
 * alike, and some that hardly fold. */

enum { MOST = 96, W = 37 };

/* Function k at sample j, n samples. */
typedef double basis(size_t k, size_t j, size_t n);

static double cosines(size_t k, size_t j, size_t n)
{
	return sqrt((k ? 2.0 : 1.0) / (double)n) *
	       cos(M_PI * (double)k * ((double)j + 0.5) / (double)n);
}

/* Even and odd about all the middles that cosines have. */
static double steps(size_t k, size_t j, size_t n)
{
	const double c = cosines(k, j, n);

	return fabs(c) < 1e-9 ? 0 : c > 0 ? 0.3 : -0.3;
}

/* Only about the first. */
static double powers(size_t k, size_t j, size_t n)
{
	return pow(((double)j + 0.5) / (double)n * 2 - 1, (double)k);
}

static double most(double worst, double got, double want)
{
	return fmax(worst, fabs(got - want));
}

static void products(const char *name, basis *f, size_t m, size_t N)
{
	static double v[MOST * MOST];
	static float x[MOST * W], turned[W * MOST], c[MOST * W], out[MOST * W], back[W * MOST];
	struct ct_cosine b = {0};
	struct ct_err e = {0};
	float *scratch;
	double worst[4] = {0};

	for (size_t k = 0; k < m; k++)
		for (size_t j = 0; j < N; j++)
			v[k * N + j] = f(k, j, N);
	for (size_t j = 0; j < N; j++)
		for (size_t i = 0; i < W; i++)
			x[j * W + i] = turned[i * N + j] =
				(float)sin((double)(7 * j + i * i)) + (j == i);
	if (ct_cosine_alloc(&b, v, m, N, &e) ||
		!(scratch = calloc(ct_cosine_scratch(&b), sizeof *scratch)))
		exit(99);
	for (int way = 0; way < 2; way++) {
		CT_SIMD(ct_cosine_analyse)
		(&b, c, W, way ? turned : x, way ? N : W, W, way == 1, scratch);
		for (size_t k = 0; k < m; k++)
			for (size_t i = 0; i < W; i++) {
				double sum = 0;

				for (size_t j = 0; j < N; j++)
					sum += v[k * N + j] * (double)x[j * W + i];
				worst[way] = most(
					worst[way], (double)c[ct_cosine_place(&b, k) * W + i], sum);
			}
	}
	CT_SIMD(ct_cosine_synthesise)(&b, out, W, x, c, W, W, false, scratch);
	CT_SIMD(ct_cosine_synthesise)(&b, back, N, NULL, c, W, W, true, scratch);
	for (size_t j = 0; j < N; j++)
		for (size_t i = 0; i < W; i++) {
			double sum = 0;

			for (size_t k = 0; k < m; k++)
				sum += v[k * N + j] * (double)c[ct_cosine_place(&b, k) * W + i];
			worst[2] =
				most(worst[2], (double)out[j * W + i], sum + (double)x[j * W + i]);
			worst[3] = most(worst[3], (double)back[i * N + j], sum);
		}
	OK(worst[0] < 1e-4 && worst[1] < 1e-4, "%s, %zu of %zu: V x, turned too (%.1g, %.1g)", name,
		m, N, worst[0], worst[1]);
	OK(worst[2] < 3e-4 && worst[3] < 3e-4, "and V^T c (%.1g, %.1g)", worst[2], worst[3]);
	free(scratch);
	ct_cosine_free(&b);
}

static void t_cosine(void)
{
	static const size_t samples[][2] = {{16, 64}, {64, 64}, {24, 48}, {20, 40}, {7, 35},
		{11, 33}, {21, 63}, {48, 96}, {31, 62}, {9, 36}};

	for (size_t k = 0; k < sizeof samples / sizeof *samples; k++)
		products("cosines", cosines, samples[k][0], samples[k][1]);
	products("steps", steps, 16, 64);
	products("steps", steps, 13, 64);
	products("steps", steps, 15, 45);
	products("steps", steps, 30, 60);
	products("powers", powers, 8, 64);
	products("powers", powers, 7, 35);
}

int main(void)
{
	const struct ct_degrade two = {{2, 2, 2}, {0.85, 0.85, 0.85}, CT_DECIMATE_SINC, {0}};
	struct ct_vol v, lo;

	test_least();
	make(&v);
	lo = reduced(&v, &two, 15);
	finds(&lo);
	measures(&v, &two);
	fills(&lo);
	refines(&v, &two);
	words_of_operator();
	damps();
	words_of_damping();
	overshoots();
	ct_vol_free(&v);
	ct_vol_free(&lo);
	t_mirror();
	t_cosine();
	return tap_done();
}
