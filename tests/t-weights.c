/* t-weights.c: how much each ray of a filtered back-projection counts, against what the weights are
 * for: both rays along a line count 1 together, whichever way the scan turns. The filter's cutoff,
 * and where a volume is in front of the source. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/backproject.h"
#include "recon/fdk.h"
#include "recon/ramp.h"
#include "xray/geometry.h"
#include "tap.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static struct ct_vol grid(size_t n, const double mm[3])
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[]){n, n, n}, &err));
	for (int a = 0; a < 3; a++) {
		v.affine[a][a] = mm[a];
		v.affine[a][3] = -mm[a] * ((double)n - 1) / 2;
	}
	return v;
}

/* Half the fan is atan(0.2), 11.3 degrees, at the outermost pixel's centre. */
static struct ct_geometry circle(enum ct_beam beam, size_t views, double arc)
{
	return (struct ct_geometry){.beam = beam,
		.views = views,
		.arc = arc,
		.start = 20,
		.dso = 300,
		.dsd = 500,
		.w = 41,
		.h = beam == CT_FAN ? 1 : 3,
		.pitch = {5, 5}};
}

/* share[views][w] in the middle row: what is left without pitch, cosine and arc of the view. */
static double *shares(struct ct_fdk_weights *o, const struct ct_geometry *scan, bool parker)
{
	struct ct_stack s = {0};
	double *share;
	float *weight;

	*o = (struct ct_fdk_weights){0};
	must(ct_geometry_fill(&s, scan, &err) || ct_fdk_weights_alloc(o, &s, 40, parker, &err));
	share = malloc(scan->views * scan->w * sizeof *share);
	weight = malloc(scan->h * scan->w * sizeof *weight);
	if (!share || !weight)
		exit(99);
	for (size_t k = 0; k < scan->views; k++) {
		ct_fdk_weights_of(o, k, true, weight);
		for (size_t c = 0; c < scan->w; c++) {
			double x = ((double)c - 20) * 5 + scan->offset[0];
			double cosine = scan->beam == CT_PARALLEL ? 1 : 500 / hypot(500, x);

			share[k * scan->w + c] = (double)weight[scan->h / 2 * scan->w + c] /
						 (cosine * o->view[k].step);
		}
	}
	free(weight);
	ct_stack_free(&s);
	return share;
}

/* Where on the circle, in views from the first, the other ray along the line of (view, column)
 * starts: the line's second meeting with the circle of the sources. */
static double partner(const struct ct_geometry *scan, double view, double col)
{
	double a = (scan->start + view * scan->arc / (double)scan->views) * M_PI / 180;
	double s[2] = {300 * cos(a), 300 * sin(a)}, x = (col - 20) * 5;
	double d[2] = {-500 * cos(a) - x * sin(a), -500 * sin(a) + x * cos(a)};
	double t = -2 * (s[0] * d[0] + s[1] * d[1]) / (d[0] * d[0] + d[1] * d[1]);
	double b = atan2(s[1] + t * d[1], s[0] + t * d[0]) * 180 / M_PI - scan->start;

	b *= scan->arc < 0 ? -1 : 1;
	return (b - 360 * floor(b / 360)) * (double)scan->views / fabs(scan->arc);
}

/* Parker's weights, forwards and backwards: a line that is seen twice counts 1, one seen once too.
 */
static void parker(enum ct_beam beam, double arc)
{
	struct ct_geometry scan = circle(beam, 288, arc);
	struct ct_fdk_weights o;
	double *share, worst = 0, once = 0, end = 0;
	size_t twice = 0, n = scan.views;

	share = shares(&o, &scan, true);
	for (size_t k = 0; k < n; k++)
		for (size_t c = 0; c < scan.w; c++) {
			double p = partner(&scan, (double)k, (double)c), all, f;
			double mine = share[k * scan.w + c];
			size_t i = (size_t)p;

			if (p > (double)n + 2) { /* beyond the scan */
				once = fmax(once, fabs(mine - 1));
				continue;
			}
			if (p < 2 || p > (double)n - 3)
				continue;
			f = p - (double)i; /* the line meets the mirrored column */
			all = mine + (1 - f) * share[i * scan.w + scan.w - 1 - c] +
			      f * share[(i + 1) * scan.w + scan.w - 1 - c];
			worst = fmax(worst, fabs(all - 1));
			twice++;
		}
	for (size_t c = 0; c < scan.w; c++)
		end = fmax(end, fabs(share[c] - share[(n - 1) * scan.w + scan.w - 1 - c]));
	OK(o.redundancy == CT_RAYS_PARKER && !o.closed, "%s over %g degrees is open",
		CT_WORD(CT_BEAM_LIST, beam), arc);
	if (!OK(worst < 0.01 && twice > 1000, "%zu rays of lines seen twice: 1 together", twice))
		printf("# %g off\n", worst);
	if (!OK(once < 0.01, "a line seen once counts 1"))
		printf("# %g off\n", once);
	if (!OK(end < 1e-5, "the scan ends as it begins"))
		printf("# %g\n", end);
	free(share);
	ct_fdk_weights_free(&o);
}

/* Views of which some stand twice count half as much each, and are weighed as before. */
static void repeated(void)
{
	enum { N = 60, TWICE = 20, W = 41, H = 3 };
	struct ct_geometry scan = circle(CT_CONE, N, 230);
	struct ct_fdk_weights once = {0}, more = {0};
	struct ct_stack s = {0}, all = {0};
	float a[H * W], b[H * W];
	double worst = 0;

	must(ct_geometry_fill(&s, &scan, &err));
	must(ct_stack_alloc(&all, N + TWICE, H, W, &err));
	all.beam = s.beam;
	for (size_t k = 0; k < N + TWICE; k++)
		all.view[k] = s.view[k < N ? k : k - TWICE];
	must(ct_fdk_weights_alloc(&once, &s, 40, true, &err) ||
		ct_fdk_weights_alloc(&more, &all, 40, true, &err));
	for (size_t k = 0; k < N; k++) {
		ct_fdk_weights_of(&once, k, true, a);
		ct_fdk_weights_of(&more, k, true, b);
		for (size_t i = 0; i < H * W; i++)
			worst = fmax(worst, fabs((double)a[i] / once.view[k].step -
						    (double)b[i] / more.view[k].step));
	}
	OK(worst < 1e-6, "Parker's weights of a view are those of its angle (%.2g)", worst);
	ct_fdk_weights_free(&once);
	ct_fdk_weights_free(&more);
	ct_stack_free(&s);
	ct_stack_free(&all);
}

/* Without Parker each ray counts the same, all views pi together. */
static void even(enum ct_beam beam, double arc, bool closed)
{
	struct ct_geometry scan = circle(beam, 90, arc);
	struct ct_fdk_weights o;
	double *share = shares(&o, &scan, false), sum = 0, worst = 0;

	for (size_t k = 0; k < scan.views; k++) {
		sum += share[k * scan.w + 20] * o.view[k].step;
		for (size_t c = 0; c < scan.w; c++)
			worst = fmax(worst, fabs(share[k * scan.w + c] - share[20]));
	}
	OK(o.closed == closed && o.redundancy == CT_RAYS_EVEN, "%s over %g degrees: %s",
		CT_WORD(CT_BEAM_LIST, beam), arc, closed ? "closed" : "open");
	NEAR(sum, M_PI, 1e-5, "half a turn together");
	NEAR(worst, 0, 1e-6, "whatever the ray");
	free(share);
	ct_fdk_weights_free(&o);
}

/* A detector to one side: where both sides see, they count 1 together, else 1. */
static void offset(double mm, double arc)
{
	struct ct_geometry scan = circle(CT_FAN, (size_t)arc / 2, arc);
	struct ct_fdk_weights o;
	double *share, worst = 0;
	size_t both = 0, alone = 0;

	scan.offset[0] = mm;
	share = shares(&o, &scan, false);
	for (size_t c = 0; c < scan.w; c++) {
		double x = ((double)c - 20) * 5 + mm, other = (-x - mm) / 5 + 20;
		size_t k = (size_t)fmax(0, other + 0.5);

		if (other > -1e-6 && other < (double)scan.w - 1 + 1e-6) {
			worst = fmax(worst, fabs(share[c] + share[k] - 1));
			both++;
		} else {
			worst = fmax(worst, fabs(share[c] - 1));
			alone++;
		}
	}
	OK(o.redundancy == CT_RAYS_OFFSET && both > 3 && alone > 3,
		"a detector off by %g mm over %g degrees: %zu columns see twice, %zu once", mm, arc,
		both, alone);
	NEAR(worst, 0, 1e-5, "1 together");
	OK(mm > 0 ? share[1] < share[8] : share[39] < share[32], "less at the near edge");
	free(share);
	ct_fdk_weights_free(&o);
}

static double cutoff(enum ct_beam beam, const double mm[3], double pitch)
{
	struct ct_vol v = grid(8, mm);
	struct ct_geometry scan = circle(beam, 90, 360);
	struct ct_stack s = {0};
	struct ct_fdk f = {0};
	double got;

	scan.pitch[0] = pitch;
	must(ct_geometry_fill(&s, &scan, &err) ||
		ct_fdk_alloc(&f, &v, &s, CT_RAMP_RAM_LAK, 0, false, NULL, &err));
	got = f.cutoff;
	ct_fdk_free(&f);
	ct_stack_free(&s);
	ct_vol_free(&v);
	return got;
}

/* What voxels can show: pixel at the centre / smallest voxel across the axis, z. */
static void cutoffs(void)
{
	const double cube[3] = {4, 4, 4}, flat[3] = {4, 6, 1}, tall[3] = {8, 6, 20};

	NEAR(cutoff(CT_CONE, cube, 5), 0.75, 1e-6, "pixels of 5 mm, 3 at the centre, voxels of 4");
	NEAR(cutoff(CT_CONE, flat, 5), 0.75, 1e-6, "voxels along the axis do not count");
	NEAR(cutoff(CT_CONE, tall, 5), 0.5, 1e-6, "nor if they are long");
	NEAR(cutoff(CT_CONE, cube, 10), 1, 1e-9, "no more than all there is");
	NEAR(cutoff(CT_PARALLEL, tall, 5), 5.0 / 6, 1e-6, "parallel pixels are not smaller");
}

/* Faces of voxels at -16 and 16 mm along the ray, -8 and 8 mm on the other axes. */
static void fronts(void)
{
	static const double dso[] = {15.9, 16.1};
	struct ct_vol v = grid(8, (const double[]){4, 2, 2});

	for (int side = 0; side < 6; side++)
		for (int k = 0; k < 2; k++) {
			struct ct_backprojector b = {0};
			struct ct_stack s = {0};
			int axis = side / 2, rc;
			double far = dso[k] / (axis ? 2 : 1), sign = side % 2 ? -1 : 1;

			must(ct_stack_alloc(&s, 1, 4, 4, &err));
			s.view[0].source[axis] = sign * far;
			s.view[0].centre[axis] = -sign * 100;
			s.view[0].u[(axis + 1) % 3] = 30;
			s.view[0].v[(axis + 2) % 3] = 30;
			rc = ct_backprojector_alloc(&b, &v, &s, (const double[]){0, 0, 0}, &err);
			OK(k ? rc == 0
			     : rc != 0 && err.code == CT_EGEOM && strstr(err.msg, "in front"),
				"a source at %g mm on axis %d is %s", sign * far, axis,
				k ? "outside" : "refused");
			ct_backprojector_free(&b);
			ct_stack_free(&s);
		}
	ct_vol_free(&v);
}

/* Lines of voxels along the detector's columns: axis 2, tilted by so many radians about x, of so
 * many mm. Depth and column must not drift, rows be no more than 14 apart. */
static void lines(enum ct_beam beam, double tilt, double mm, double pitch, bool line)
{
	struct ct_vol v = grid(8, (const double[]){4, 4, mm});
	struct ct_geometry scan = circle(beam, 8, 360);
	struct ct_backprojector b = {0};
	struct ct_stack s = {0};

	v.affine[1][2] = -sin(tilt) * mm;
	v.affine[2][2] = cos(tilt) * mm;
	v.affine[1][1] = cos(tilt) * 4;
	v.affine[2][1] = sin(tilt) * 4;
	scan.pitch[0] = pitch;
	scan.pitch[1] = 1;
	scan.start = 0;
	must(ct_geometry_fill(&s, &scan, &err) ||
		ct_backprojector_alloc(&b, &v, &s, (const double[]){0, 0, 0}, &err));
	OK(b.line == (line ? 2 : -1), "%s, tilted by %.3g, %g mm: %s", CT_WORD(CT_BEAM_LIST, beam),
		tilt, mm, line ? "lines" : "no lines");
	ct_backprojector_free(&b);
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* The rows of the voxels next to the source are the farthest apart, wherever it is. */
static void nearest(void)
{
	struct ct_vol v = grid(8, (const double[]){4, 4, 4});

	for (int side = 0; side < 6; side++)
		for (int k = 0; k < 2; k++) {
			struct ct_backprojector b = {0};
			struct ct_stack s = {0};
			int axis = side / 2, along = (axis + 2) % 3;
			double sign = side % 2 ? -1 : 1, pitch = k ? 0.7 : 0.58;

			must(ct_stack_alloc(&s, 1, 4, 4, &err));
			s.view[0].source[axis] = sign * 100;
			s.view[0].centre[axis] = -sign * 100;
			s.view[0].u[(axis + 1) % 3] = 4;
			s.view[0].v[along] = pitch;
			must(ct_backprojector_alloc(&b, &v, &s, (const double[]){0, 0, 0}, &err));
			OK(b.line == (k ? along : -1), "rows of %g mm, a source at %g on axis %d",
				pitch, sign * 100, axis);
			ct_backprojector_free(&b);
			ct_stack_free(&s);
		}
	ct_vol_free(&v);
}

/* A scan a thousandth of the size: the same weights, if it turns far enough for the grid alone. */
static void small(void)
{
	double *w[2], worst = 0;

	for (int k = 0; k < 2; k++) {
		const double size = k ? 1e-3 : 1;
		struct ct_vol v = grid(8, (const double[]){9 * size, 9 * size, 9 * size});
		struct ct_geometry scan = circle(CT_CONE, 40, 199.8);
		struct ct_stack s = {0};
		struct ct_fdk f = {0};
		float weight[3 * 41];

		scan.dso *= size;
		scan.dsd *= size;
		scan.pitch[0] = scan.pitch[1] = 5 * size;
		must(ct_geometry_fill(&s, &scan, &err) ||
			ct_fdk_alloc(&f, &v, &s, CT_RAMP_HANN, 0, true, NULL, &err));
		w[k] = malloc(40 * 41 * sizeof **w);
		if (!w[k])
			exit(99);
		for (size_t i = 0; i < 40; i++) {
			ct_fdk_weights_of(&f.orbit, i, true, weight);
			for (size_t c = 0; c < 41; c++)
				w[k][i * 41 + c] = (double)weight[41 + c];
		}
		ct_fdk_free(&f);
		ct_stack_free(&s);
		ct_vol_free(&v);
	}
	for (size_t i = 0; i < 40 * 41; i++)
		worst = fmax(worst, fabs(w[1][i] - w[0][i]));
	NEAR(worst, 0, 1e-6, "a small scan has the weights of a large one");
	free(w[0]);
	free(w[1]);
}

/* Offsets within a view are 32 bits; what is no grid or no view. */
static void refusals(void)
{
	struct ct_vol v = grid(8, (const double[]){4, 4, 4}), none = v;
	struct ct_geometry scan = circle(CT_CONE, 4, 360);
	struct ct_backprojector b = {0};
	const double origin[3] = {0};
	struct ct_stack s = {0};
	size_t most;

	must(ct_geometry_fill(&s, &scan, &err) || ct_backprojector_alloc(&b, &v, &s, origin, &err));
	most = (size_t)INT32_MAX / b.pitch - 3;
	ct_backprojector_free(&b);
	s.w = most;
	OK(ct_backprojector_alloc(&b, &v, &s, origin, &err) == 0, "%zu columns", most);
	OK(ct_backprojector_widen(&b, 0, 0, &err) == 0, "and none more");
	OK(ct_backprojector_widen(&b, 1, 0, &err) && err.code == CT_EINPUT, "one more: %s",
		err.msg);
	ct_backprojector_free(&b);
	s.w = most + 1;
	OK(ct_backprojector_alloc(&b, &v, &s, origin, &err) && err.code == CT_EINPUT,
		"nor with it to begin with");
	s.w = 4;
	s.h = INT32_MAX / 4 + 1;
	OK(ct_backprojector_alloc(&b, &v, &s, origin, &err) && err.code == CT_EINPUT, "rows: %s",
		err.msg);
	s.h = 3;
	none.affine[1][1] = 0;
	OK(ct_backprojector_alloc(&b, &none, &s, origin, &err) && err.code == CT_EGEOM, "%s",
		err.msg);
	s.view[2].u[0] = (double)NAN;
	OK(ct_backprojector_alloc(&b, &v, &s, origin, &err) && err.code == CT_EGEOM, "%s", err.msg);
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* Rows of the ramp filter against the sum that it is; nothing is written beyond them. */
static void filtered(size_t w, size_t rows)
{
	size_t at = w / 5, count = w - at - 3, pitch = rows + 2;
	float *in = malloc(rows * count * sizeof *in), *weight = malloc(rows * count * sizeof *in);
	float *out = malloc(w * pitch * sizeof *out);
	struct ct_ramp f = {0};
	double *scratch, worst = 0;
	bool beyond = false;

	must(ct_ramp_alloc(&f, CT_RAMP_RAM_LAK, 1, w, &err));
	scratch = aligned_alloc(64, ct_ramp_scratch(&f) * sizeof *scratch);
	for (size_t i = 0; i < rows * count; i++) {
		in[i] = (float)cos(1.0 + (double)(i * i % 1000));
		weight[i] = 0.5F + (float)(i % 7);
	}
	for (size_t i = 0; i < w * pitch; i++)
		out[i] = 77;
	CT_SIMD(ct_ramp_rows)(&f, rows, out, pitch, in, weight, at, count, scratch);
	for (size_t c = 0; c < w; c++) {
		for (size_t r = 0; r < rows; r++) {
			double sum = 0;

			for (size_t k = 0; k < count; k++) {
				double m = (double)c - (double)(at + k);
				double h = m == 0            ? 0.25
					   : fmod(m, 2) == 0 ? 0
							     : -1 / (M_PI * M_PI * m * m);

				sum += h * (double)in[r * count + k] *
				       (double)weight[r * count + k];
			}
			worst = fmax(worst, fabs(sum - (double)out[c * pitch + r]));
		}
		beyond |= out[c * pitch + rows] != 77 || out[c * pitch + rows + 1] != 77;
	}
	OK(worst < 1e-5 && !beyond, "%zu rows of %zu, filtered (%.2g)", rows, w, worst);
	ct_ramp_free(&f);
	free(scratch);
	free(in);
	free(weight);
	free(out);
}

int main(void)
{
	parker(CT_CONE, 230);
	parker(CT_FAN, -215);
	repeated();
	even(CT_CONE, 360, true);
	even(CT_CONE, 240, false);
	even(CT_FAN, 300, false);
	offset(60, 360);
	offset(-45, 360);
	offset(60, 354); /* a gap of 8 degrees */
	cutoffs();
	fronts();
	lines(CT_PARALLEL, 0.93e-5, 4, 3, true); /* 1e-4 pixels of 3 mm over 32 mm */
	lines(CT_PARALLEL, 0.95e-5, 4, 3, false);
	lines(CT_CONE, 0.85e-6, 4, 5, true); /* 1e-7 of 300 mm over 32 mm */
	lines(CT_CONE, 1.1e-6, 4, 5, false);
	lines(CT_PARALLEL, 0, 13.9, 5, true);
	lines(CT_PARALLEL, 0, 14.1, 5, false);
	nearest();
	small();
	refusals();
	filtered(20, 16);
	filtered(60, 7);
	filtered(150, 16);
	filtered(300, 3);
	filtered(600, 16);
	filtered(1100, 1);
	return tap_done();
}
