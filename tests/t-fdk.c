/* t-fdk.c: ramp filter, orbit, back-projection, iterations, against sums done another way and
 * against the densities that closed-form projections stand for.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "recon/fdk.h"
#include "recon/iterative.h"
#include "xray/phantom.h"
#include "xray/project.h"
#include "xray/geometry.h"
#include "numbers.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* A zero grid about the origin. */
static struct ct_vol grid(size_t a, size_t b, size_t c, double mm)
{
	const size_t n[3] = {a, b, c};
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, n, &err));
	memset(v.affine, 0, sizeof v.affine);
	for (int i = 0; i < 3; i++) {
		v.affine[i][i] = mm;
		v.affine[i][3] = -mm * ((double)n[i] - 1) / 2;
	}
	memset(v.data, 0, ct_vol_count(&v) * sizeof *v.data);
	return v;
}

static struct ct_stack fill(const struct ct_geometry *scan)
{
	struct ct_stack s = {0};

	must(ct_geometry_fill(&s, scan, &err));
	return s;
}

/* Rows against the sum over samples of the ramp. */
static void t_ramp(void)
{
	enum { W = 37, ROWS = 13, AT = 5, COUNT = 29 };
	struct ct_ramp f = {0};
	float in[ROWS * COUNT], weight[ROWS * COUNT], out[W * ROWS];
	double *scratch, worst = 0, dc;

	must(ct_ramp_alloc(&f, CT_RAMP_RAM_LAK, 1, W, &err));
	scratch = aligned_alloc(64, ct_ramp_scratch(&f) * sizeof *scratch);
	for (size_t i = 0; i < ROWS * COUNT; i++) {
		in[i] = (float)ct_rng_uniform(3, 1, i);
		weight[i] = (float)ct_rng_uniform(3, 2, i) + 0.5F;
	}
	CT_SIMD(ct_ramp_rows)(&f, ROWS, out, ROWS, in, weight, AT, COUNT, scratch);
	for (int r = 0; r < ROWS; r++)
		for (int c = 0; c < W; c++) {
			double want = 0;

			for (int k = 0; k < COUNT; k++) {
				int m = c - k - AT;
				double h = m == 0 ? 0.25 : m % 2 ? -1 / (M_PI * M_PI * m * m) : 0;

				want += h * (double)in[r * COUNT + k] *
					(double)weight[r * COUNT + k];
			}
			worst = fmax(worst, fabs(want - (double)out[c * ROWS + r]));
		}
	NEAR(worst, 0, 1e-7, "ramp: the sum over its samples, nothing wraps around");
	dc = f.response[0] * (double)f.n;
	OK(dc > 0 && dc < 1.0 / (double)f.n, "small, but not zero, at frequency zero");
	free(scratch);
	ct_ramp_free(&f);
}

/* Response of a window at half the Nyquist frequency and at it, relative to the ramp's. */
static void t_windows(void)
{
	static const struct {
		enum ct_ramp_kind kind;
		double half, full;
		const char *name;
	} want[] = {{CT_RAMP_SHEPP_LOGAN, 0.90031632, 0.63661977, "shepp-logan"},
		{CT_RAMP_COSINE, 0.70710678, 0, "cosine"}, {CT_RAMP_HAMMING, 0.54, 0.08, "hamming"},
		{CT_RAMP_HANN, 0.5, 0, "hann"}};
	struct ct_ramp ramp = {0};

	must(ct_ramp_alloc(&ramp, CT_RAMP_RAM_LAK, 1, 64, &err));
	for (size_t i = 0; i < sizeof want / sizeof *want; i++) {
		struct ct_ramp f = {0};
		double r[2];

		must(ct_ramp_alloc(&f, want[i].kind, 1, 64, &err));
		r[0] = f.response[f.n / 4] / ramp.response[f.n / 4];
		r[1] = f.response[f.n / 2] / ramp.response[f.n / 2];
		OK(fabs(r[0] - want[i].half) < 1e-8 && fabs(r[1] - want[i].full) < 1e-8,
			"%s: %.5f at half the Nyquist frequency, %.5f at it", want[i].name, r[0],
			r[1]);
		ct_ramp_free(&f);
		must(ct_ramp_alloc(&f, want[i].kind, 0.5, 64, &err));
		OK(fabs(f.response[f.n / 8] / ramp.response[f.n / 8] - want[i].half) < 1e-8 &&
				f.response[f.n / 2] == 0 && f.response[3 * f.n / 8] == 0,
			"%s: and so at a quarter if cut off at half", want[i].name);
		ct_ramp_free(&f);
	}
	ct_ramp_free(&ramp);
}

/* Turn a grid by the unit quaternion (w,x,y,z). */
static void turn(struct ct_vol *v, double w, double x, double y, double z)
{
	const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
		{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
		{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
	double m[3][4] = {{0}};

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			for (int k = 0; k < 3; k++)
				m[i][j] += r[i][k] * v->affine[k][j];
	memcpy(v->affine, m, sizeof m);
}

/* Cyclic change of the order of the axes, `by` steps; the grid stays where it is. */
static void permute(struct ct_vol *v, int by)
{
	struct ct_vol w = *v;

	for (int a = 0; a < 3; a++) {
		v->n[a] = w.n[(a + by) % 3];
		for (int r = 0; r < 3; r++)
			v->affine[r][a] = w.affine[r][(a + by) % 3];
	}
}

/* Bilinear in a view at world point x, zero half a pixel outside; times 1/depth^2. */
static double sample(const struct ct_stack *s, size_t view, const double x[3])
{
	const struct ct_view *v = &s->view[view];
	double n[3], along[3], t, num = 0, den = 0, full = 0, at[2], uu = 0, vv = 0;
	ptrdiff_t c, r, w = (ptrdiff_t)s->w, h = (ptrdiff_t)s->h;
	double y = 0;

	for (int i = 0; i < 3; i++) {
		int j = (i + 1) % 3, k = (i + 2) % 3;

		n[i] = v->u[j] * v->v[k] - v->u[k] * v->v[j];
		along[i] =
			s->beam == CT_PARALLEL ? v->centre[i] - v->source[i] : x[i] - v->source[i];
		num += n[i] * (v->centre[i] - (s->beam == CT_PARALLEL ? x[i] : v->source[i]));
		full += n[i] * (0 - v->source[i]);
		uu += v->u[i] * v->u[i];
		vv += v->v[i] * v->v[i];
	}
	for (int i = 0; i < 3; i++)
		den += n[i] * along[i];
	t = num / den;
	at[0] = ((double)s->w - 1) / 2;
	at[1] = ((double)s->h - 1) / 2;
	for (int i = 0; i < 3; i++) {
		double hit = (s->beam == CT_PARALLEL ? x[i] : v->source[i]) + t * along[i] -
			     v->centre[i];

		at[0] += hit * v->u[i] / uu;
		at[1] += hit * v->v[i] / vv;
	}
	if (at[0] < -0.5 || at[0] > (double)w - 0.5 || at[1] < -0.5 || at[1] > (double)h - 0.5)
		return 0;
	c = (ptrdiff_t)floor(at[0]);
	r = (ptrdiff_t)floor(at[1]);
	for (int k = 0; k < 4; k++) {
		ptrdiff_t cc = c + k % 2, rr = r + k / 2;
		double weight = (k % 2 ? at[0] - (double)c : 1 - at[0] + (double)c) *
				(k / 2 ? at[1] - (double)r : 1 - at[1] + (double)r);

		cc = cc < 0 ? 0 : cc >= w ? w - 1 : cc;
		rr = rr < 0 ? 0 : rr >= h ? h - 1 : rr;
		y += weight * (double)ct_stack_view(s, view)[rr * w + cc];
	}
	return s->beam == CT_PARALLEL ? y : y * full * full / (den * den);
}

/* Store the views as the back-projector wants them. */
static float *stored(const struct ct_backprojector *b, const struct ct_stack *s)
{
	size_t size = ct_backprojector_size(b);
	float *out = aligned_alloc(64, s->views * size * sizeof *out);

	memset(out, 0, s->views * size * sizeof *out);

	for (size_t k = 0; k < s->views; k++) {
		for (size_t r = 0; r < s->h; r++)
			for (size_t c = 0; c < s->w; c++)
				out[k * size + (c + 1) * b->pitch + CT_BP_PAD + r] =
					ct_stack_view(s, k)[r * s->w + c];
		ct_backproject_frame(b, out + k * size);
	}
	return out;
}

static double back_error(struct ct_vol *v, const struct ct_stack *s, int line, const char *name)
{
	struct ct_backprojector b = {0};
	double worst = 0, most = 0;
	float *views;

	memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
	must(ct_backprojector_alloc(&b, v, s, (const double[3]){0, 0, 0}, &err));
	OK(b.line == line, "%s: lines along axis %d", name, line);
	views = stored(&b, s);
	ct_backproject(&b, 0, s->views, v->data, views, NULL);
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double ijk[3] = {(double)(i % v->n[0]), (double)(i / v->n[0] % v->n[1]),
			(double)(i / v->n[0] / v->n[1])};
		double x[3], want = 0;

		ct_vol_world(v, ijk, x);
		for (size_t k = 0; k < s->views; k++)
			want += sample(s, k, x);
		worst = fmax(worst, fabs(want - (double)v->data[i]));
		most = fmax(most, want);
	}
	free(views);
	ct_backprojector_free(&b);
	return worst / most;
}

static void t_back(void)
{
	struct ct_vol v = grid(35, 21, 150, 1);

	for (int beam = 0; beam < 2; beam++)
		for (int c = 0; c < 8;
			c++) { /* spacing of the rows, order of the axes, or turned */
			static const double pitch[] = {2.3, 0.9, 0.35, 0.15, 1.1, 1.1, 1.1, 1.1};
			struct ct_vol g = v;
			struct ct_geometry scan;
			struct ct_stack s;
			char name[60];

			ct_geometry_default(&scan, (enum ct_beam)beam, &v);
			scan.views = 5;
			scan.arc = 360;
			scan.w = 27;
			scan.h = c == 3 ? 1200 : 61;
			scan.pitch[0] = beam ? 1.3 : 2;
			scan.pitch[1] = pitch[c];
			scan.offset[0] = 2.6;
			s = fill(&scan);
			for (size_t i = 0; i < ct_stack_count(&s); i++)
				s.data[i] = (float)ct_rng_uniform(7, 8, i);
			if (c == 4 || c == 5)
				permute(&g, c - 3);
			if (c == 6)
				turn(&g, 0.6, 0, 0, 0.8);
			if (c == 7)
				turn(&g, 0.8, 0.36, -0.48, 0);
			snprintf(name, sizeof name, "%s, case %d", beam ? "parallel" : "cone", c);
			NEAR(back_error(&g, &s,
				     c == 7   ? -1
				     : c == 4 ? 1
				     : c == 5 ? 0
					      : 2,
				     name),
				0, 1e-5, "as bilinear sums in double");
			ct_stack_free(&s);
		}
	ct_vol_free(&v);
}

/* Mean density within `part` of the cylinder's radius in the middle slices, and its deviation. */
static double inside(const struct ct_vol *v, double radius, double *sd)
{
	double sum = 0, square = 0, n = 0;

	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double ijk[3] = {(double)(i % v->n[0]), (double)(i / v->n[0] % v->n[1]),
			(double)(i / v->n[0] / v->n[1])};
		double x[3], y = (double)v->data[i];

		ct_vol_world(v, ijk, x);
		if (hypot(x[0], x[1]) > radius || fabs(x[2]) > radius / 2)
			continue;
		sum += y;
		square += y * y;
		n++;
	}
	*sd = sqrt(fmax(square / n - sum * sum / (n * n), 0));
	return sum / n;
}

struct fdk_case {
	enum ct_beam beam;
	size_t views;
	double arc;
	bool parker;
	double offset;
	size_t w;
	const char *name;
};

/* Uniform cylinder of density 0.5, radius 16 mm, through closed-form projections. */
static void t_density(void)
{
	static const struct fdk_case cases[] = {
		{CT_CONE, 120, 360, false, 0, 64, "cone, full turn"},
		{CT_CONE, 120, -360, false, 0, 64, "cone, the other way round"},
		{CT_CONE, 240, 720, false, 0, 64, "cone, two turns"},
		{CT_CONE, 270, 540, false, 0, 64, "cone, a turn and a half, some angles twice"},
		{CT_CONE, 120, 220, true, 0, 64, "cone, short scan with Parker weights"},
		{CT_CONE, 140, -280, true, 0, 64, "cone, longer, the other way round"},
		{CT_CONE, 120, 360, false, 40, 46, "cone, offset detector"},
		{CT_CONE, 120, 360, false, -40, 46, "cone, offset to the other side"},
		{CT_FAN, 120, 360, false, 0, 64, "fan, full turn"},
		{CT_FAN, 120, 215, true, 0, 64, "fan, short scan"},
		{CT_PARALLEL, 90, 180, false, 0, 64, "parallel, half a turn"},
		{CT_PARALLEL, 125, 250, false, 0, 64, "parallel, more than half a turn"},
		{CT_PARALLEL, 120, 360, false, -15, 36, "parallel, offset detector"},
	};
	const double extent[3] = {64, 64, 64};
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	size_t shapes = ct_phantom_make(CT_PH_CYLINDER, extent, 0.5, 0, shape);

	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const struct fdk_case *c = &cases[i];
		struct ct_vol v = grid(64, 64, c->beam == CT_FAN ? 1 : 32, 1);
		struct ct_fdk f = {0};
		struct ct_geometry scan;
		struct ct_stack s;
		double mean, sd;

		ct_geometry_default(&scan, c->beam, &v);
		scan.views = c->views;
		scan.arc = c->arc;
		scan.w = c->w;
		scan.h = c->beam == CT_FAN ? 1 : 64;
		scan.pitch[0] = scan.pitch[1] = c->beam == CT_PARALLEL ? 1.45 : 2;
		scan.offset[0] = c->offset;
		s = fill(&scan);
		ct_phantom_project(&s, 0, s.views, s.data, shapes, shape, NULL);
		must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_RAM_LAK, 0, c->parker, NULL, &err));
		f.block = 7;
		must(ct_fdk_all(&f, v.data, &(const struct ct_env){0}, &err));
		mean = inside(&v, 11, &sd);
		OK(fabs(mean / 0.5 - 1) < 0.01 && sd < 0.005, "%s: %.5f +- %.5f of 0.5", c->name,
			mean, sd);
		ct_fdk_free(&f);
		ct_stack_free(&s);
		ct_vol_free(&v);
	}
}

static void refused(const struct ct_stack *s, const struct ct_vol *v, bool parker,
	const char *words, const char *name)
{
	struct ct_fdk f = {0};
	int rc = ct_fdk_alloc(&f, v, s, CT_RAMP_RAM_LAK, 0, parker, NULL, &err);

	OK(rc == -1 && err.code == CT_EGEOM && strstr(err.msg, words), "refused: %s", name);
	if (rc == 0)
		ct_fdk_free(&f);
	else
		printf("# %s\n", err.msg);
}

static void t_refusals(void)
{
	struct ct_vol v = grid(16, 16, 16, 1);
	struct ct_geometry scan;
	struct ct_stack s;
	struct ct_fdk f = {0};

	ct_geometry_default(&scan, CT_CONE, &v);
	scan.views = 1;
	s = fill(&scan);
	refused(&s, &v, false, "circle", "one view");
	ct_stack_free(&s);
	scan.views = 40;
	scan.arc = 120;
	s = fill(&scan);
	refused(&s, &v, false, "span 120 degrees", "120 degrees");
	ct_stack_free(&s);
	scan.arc = 185;
	s = fill(&scan);
	refused(&s, &v, true, "Parker weights need", "Parker weights for 185 degrees");
	ct_stack_free(&s);
	scan.arc = 360;
	s = fill(&scan);
	for (size_t k = 0; k < 40; k++) {
		s.view[k].source[2] += (double)k;
		s.view[k].centre[2] += (double)k;
	}
	refused(&s, &v, false, "helix", "a helix");
	ct_stack_free(&s);
	s = fill(&scan);
	for (int a = 0; a < 3; a++)
		s.view[7].source[a] *= 1.1;
	refused(&s, &v, false, "circle", "a source off the circle");
	ct_stack_free(&s);
	s = fill(&scan);
	for (int a = 0; a < 3; a++)
		s.view[7].u[a] += 0.1 * (s.view[7].centre[a] - s.view[7].source[a]) / scan.dsd;
	must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_RAM_LAK, 0, false, NULL, &err));
	OK(f.upright.views == 40, "one slanted detector is laid level");
	ct_fdk_free(&f);
	ct_stack_free(&s);
	scan.w = 1;
	s = fill(&scan);
	refused(&s, &v, false, "one pixel", "rows of one pixel");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* Of a fan: more rows than one, and grids that leave its plane. */
static void t_fan_refusals(void)
{
	struct ct_vol thick = grid(16, 16, 4, 1), thin = grid(16, 16, 1, 1);
	struct ct_geometry scan;
	struct ct_fdk f = {0};
	struct ct_stack s;

	ct_geometry_default(&scan, CT_FAN, &thick);
	scan.arc = 360;
	s = fill(&scan);
	must(ct_fdk_alloc(&f, &thin, &s, CT_RAMP_RAM_LAK, 0, false, NULL, &err));
	ct_fdk_free(&f);
	refused(&s, &thick, false, "fan sees one plane", "a fan and a thick grid");
	thin.affine[2][3] = 1;
	refused(&s, &thin, false, "fan sees one plane", "a slice beside the plane");
	ct_stack_free(&s);
	scan.beam = CT_CONE;
	scan.h = 4;
	s = fill(&scan);
	must(ct_fdk_alloc(&f, &thick, &s, CT_RAMP_RAM_LAK, 0, false, NULL, &err));
	ct_fdk_free(&f);
	s.beam = CT_FAN;
	refused(&s, &thick, false, "one detector row, not 4", "a fan of four rows");
	ct_stack_free(&s);
	ct_vol_free(&thick);
	ct_vol_free(&thin);
}

/* Angles at random, and in any order: the weights are those of the arcs. */
static void t_order(void)
{
	struct ct_vol v = grid(48, 48, 8, 1);
	const double extent[3] = {48, 48, 48};
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	size_t shapes = ct_phantom_make(CT_PH_CYLINDER, extent, 0.5, 0, shape);
	struct ct_stack s = {0};
	struct ct_fdk_weights o = {0};
	double sum = 0, mean, sd;
	struct ct_fdk f = {0};
	struct ct_geometry scan;

	ct_geometry_default(&scan, CT_CONE, &v);
	scan.views = 200;
	scan.arc = 360;
	scan.h = 16;
	s = fill(&scan);
	for (size_t k = 0; k < 200; k++) { /* every seventh, a little off its place */
		struct ct_stack one = {0};

		scan.views = 1;
		scan.start = (double)(k * 7 % 200) * 1.8 + 0.9 * ct_rng_uniform(5, 5, k);
		must(ct_geometry_fill(&one, &scan, &err));
		s.view[k] = one.view[0];
		ct_stack_free(&one);
	}
	must(ct_fdk_weights_alloc(&o, &s, HUGE_VAL, false, &err));
	for (size_t k = 0; k < 200; k++)
		sum += o.view[k].step;
	NEAR(sum, 2 * M_PI, 1e-12, "uneven angles in any order: their arcs make a full turn");
	NEAR(o.radius, scan.dso, 1e-9 * scan.dso, "radius of the orbit");
	NEAR(hypot(o.centre[0], o.centre[1]), 0, 1e-9, "and its centre");
	ct_fdk_weights_free(&o);
	ct_phantom_project(&s, 0, s.views, s.data, shapes, shape, NULL);
	must(ct_fdk_alloc(&f, &v, &s, CT_RAMP_RAM_LAK, 0, false, NULL, &err));
	ct_fdk_views(&f, 0, 200, v.data, NULL);
	mean = inside(&v, 8, &sd);
	OK(fabs(mean / 0.5 - 1) < 0.01 && sd < 0.01, "and the density: %.5f +- %.5f", mean, sd);
	ct_fdk_free(&f);
	ct_stack_free(&s);
	ct_vol_free(&v);
}

static struct ct_iterative_report solve(struct ct_vol *v, const struct ct_stack *s,
	const struct ct_iterative_rule *rule, const struct ct_env *env)
{
	struct ct_iterative_report report;
	struct ct_projector g;
	struct ct_linear a;

	must(ct_projector_init(&g, v, s, &err));
	must(ct_projector_reserve(&g, &err));
	a = ct_project_linear(&g);
	memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
	must(ct_iterative_solve(v->data, v->n, &a, s->data, rule, &report, env, &err));
	ct_projector_free(&g);
	return report;
}

static void t_iterate(void)
{
	struct ct_vol truth = grid(48, 48, 48, 2), v = grid(48, 48, 48, 2), w = grid(48, 48, 48, 2);
	const double extent[3] = {96, 96, 96};
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	size_t shapes = ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 0, 1, shape);
	struct ct_iterative_rule rule = {.solver = CT_CGLS, .iterations = 30};
	struct ct_iterative_report r, q;
	struct ct_env env = {0}, four = {0};
	double far, least = HUGE_VAL;
	struct ct_geometry scan;
	struct ct_stack s;

	must(ct_par_alloc(&four.par, 4, &err));
	ct_phantom_voxels(&truth, shapes, shape, 4, NULL);
	ct_geometry_default(&scan, CT_CONE, &v);
	scan.views = 40;
	s = fill(&scan);
	ct_phantom_project(&s, 0, s.views, s.data, shapes, shape, NULL);
	far = rms(ct_vol_count(&v), v.data, truth.data);
	r = solve(&v, &s, &rule, &env);
	OK(r.iterations == 30 && r.residual < 0.005,
		"CGLS on closed-form projections: residual %.5f after %zu iterations", r.residual,
		r.iterations);
	solve(&w, &s, &rule, &four);
	OK(memcmp(v.data, w.data, ct_vol_count(&v) * sizeof *v.data) == 0,
		"four threads, the same bytes");
	OK(rms(ct_vol_count(&v), v.data, truth.data) < far / 2, "and near the object: %.4f of %.4f",
		rms(ct_vol_count(&v), v.data, truth.data), far);
	rule.tolerance = 0.02;
	r = solve(&v, &s, &rule, &env);
	OK(r.residual < 0.02 && r.iterations < 30, "stops at a residual of 2 %%: %zu iterations",
		r.iterations);
	rule = (struct ct_iterative_rule){.solver = CT_SIRT, .iterations = 5};
	q = solve(&v, &s, &rule, &env);
	rule.iterations = 20;
	rule.nonnegative = true;
	r = solve(&v, &s, &rule, &env);
	OK(r.residual < 0.5 * q.residual, "SIRT: residual %.4f after 5 iterations, %.4f after 20",
		q.residual, r.residual);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		least = fmin(least, (double)v.data[i]);
	OK(least >= 0, "and nothing below zero");
	for (size_t i = 0; i < ct_stack_count(&s); i++) /* noise, few views */
		s.data[i] += 0.3F * (float)ct_rng_normal(1, 1, i);
	rule = (struct ct_iterative_rule){.solver = CT_CGLS, .iterations = 20};
	solve(&w, &s, &rule, &env);
	rule = (struct ct_iterative_rule){.solver = CT_TV, .iterations = 40, .mu = 0.004};
	solve(&v, &s, &rule, &env);
	OK(rms(ct_vol_count(&v), v.data, truth.data) <
			0.7 * rms(ct_vol_count(&w), w.data, truth.data),
		"noise: total variation is nearer (%.4f) than least squares (%.4f)",
		rms(ct_vol_count(&v), v.data, truth.data),
		rms(ct_vol_count(&w), w.data, truth.data));
	ct_stack_free(&s);
	ct_vol_free(&truth);
	ct_vol_free(&v);
	ct_vol_free(&w);
	ct_par_free(four.par);
}

static void t_threads(void)
{
	struct ct_vol a = grid(40, 36, 70, 1), b = grid(40, 36, 70, 1);
	struct ct_geometry scan;
	struct ct_stack s;
	struct ct_par *par;

	must(ct_par_alloc(&par, 3, &err));
	ct_geometry_default(&scan, CT_CONE, &a);
	scan.arc = 360;
	scan.views = 30;
	s = fill(&scan);
	for (size_t i = 0; i < ct_stack_count(&s); i++)
		s.data[i] = (float)ct_rng_uniform(7, 8, i);
	for (int turned = 0; turned < 2; turned++) {
		struct ct_fdk f = {0}, g = {0};

		memset(a.data, 0, ct_vol_count(&a) * sizeof *a.data);
		memset(b.data, 0, ct_vol_count(&b) * sizeof *b.data);
		must(ct_fdk_alloc(&f, &a, &s, CT_RAMP_HANN, 0, false, NULL, &err));
		must(ct_fdk_alloc(&g, &b, &s, CT_RAMP_HANN, 0, false, par, &err));
		ct_fdk_views(&f, 0, 30, a.data, NULL);
		ct_fdk_views(&g, 0, 30, b.data, par);
		OK(memcmp(a.data, b.data, ct_vol_count(&a) * sizeof *a.data) == 0,
			"three threads, the same bytes");
		ct_fdk_free(&f);
		ct_fdk_free(&g);
		turn(&a, 0.8, 0.36, -0.48, 0);
		turn(&b, 0.8, 0.36, -0.48, 0);
	}
	ct_par_free(par);
	ct_stack_free(&s);
	ct_vol_free(&a);
	ct_vol_free(&b);
}

int main(void)
{
	t_ramp();
	t_windows();
	t_back();
	t_density();
	t_refusals();
	t_fan_refusals();
	t_order();
	t_iterate();
	t_threads();
	return tap_done();
}
