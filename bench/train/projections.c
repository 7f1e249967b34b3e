/* projections VOLUME.nii OUT.raw SEED COUNT: projections to train the diffusion prior on.
 *
 * Stacks of VIEWS views each, until there are COUNT: all of the volume or a box of it, in a pose,
 * stretched, with a window, seen by a cone beam of which distances and pixels are drawn about the
 * defaults of ct-project, which also has this projector. Values are what ct-ddnm hands the prior:
 * divided by the largest of the stack after its pixels were coarsened 4 or 8 times, so that a few
 * are above 1.
 *
 * OUT.raw, little-endian: "ctpv", uint32 number of views, float32 CEILING; of every view uint32
 * rows, uint32 columns; then their pixels, uint16, 65535 being CEILING. It appears when it is
 * whole.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/simd.h"
#include "formats/nifti.h"
#include "xray/geometry.h"
#include "xray/project.h"
#include "xray/window.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CEILING 1.25F
enum { VIEWS = 8, LEAST = 96, MOST = 512, TRIES = 8 };

static struct ct_err err;

static void must(int rc, const char *what)
{
	if (rc == 0)
		return;
	fprintf(stderr, "project: %s: %s\n", what, err.msg);
	exit(1);
}

/* What is drawn of a stack. */
struct dice {
	uint64_t seed, stream, at;
};

static double uniform(struct dice *d, double lo, double hi)
{
	return lo + (hi - lo) * ct_rng_uniform(d->seed, d->stream, d->at++);
}

static size_t below(struct dice *d, size_t n)
{
	return (size_t)ct_rng_below(d->seed, d->stream, d->at++, n);
}

static void read_volume(struct ct_vol *v, const char *path)
{
	struct ct_nifti_in in = {0};
	FILE *f = fopen(path, "rb");

	if (!f) {
		fprintf(stderr, "project: %s: cannot be read; expected a CT in HU, NIfTI\n", path);
		exit(1);
	}
	must(ct_nifti_open(&in, f, v, &err) ||
			ct_source_volume(&in.source, &in.how, path, v, &err) ||
			ct_vol_check_finite(v, &err) || ct_vol_check_grid(v, &err),
		path);
	ct_source_close(&in.source);
	fclose(f);
}

/* What part of a box is no air, from some of its voxels. */
static double filled(const struct ct_vol *v, const size_t from[3], const size_t n[3])
{
	size_t all = 0, full = 0;

	for (size_t k = 0; k < n[2]; k += 5)
		for (size_t j = 0; j < n[1]; j += 5)
			for (size_t i = 0; i < n[0]; i += 5) {
				const size_t at = ((from[2] + k) * v->n[1] + from[1] + j) * v->n[0];

				full += v->data[at + from[0] + i] > -500;
				all++;
			}
	return (double)full / (double)all;
}

/* All of the volume, or a cube or a block of it, of some places the one with the most body. */
static void draw_box(struct dice *d, const struct ct_vol *v, size_t from[3], size_t n[3])
{
	const size_t kind = below(d, 5), cube = 64 + below(d, 129), tries = 1 + below(d, TRIES);
	double best = -1;

	memset(from, 0, 3 * sizeof *from);
	memcpy(n, v->n, 3 * sizeof *n);
	if (kind < 2)
		return;
	for (int a = 0; a < 3; a++) {
		const size_t side = kind < 4 ? cube : 64 + below(d, 129);

		n[a] = side < v->n[a] ? side : v->n[a];
	}
	for (size_t i = 0; i < tries; i++) {
		size_t at[3];
		double part;

		for (int a = 0; a < 3; a++)
			at[a] = below(d, v->n[a] - n[a] + 1);
		part = filled(v, at, n);
		if (part > best)
			memcpy(from, at, sizeof at);
		best = fmax(best, part);
	}
}

/* The density of a box in a pose. */
static void draw_body(struct dice *d, const struct ct_vol *v, struct ct_vol *body)
{
	static const double lower[] = {-1024, -512, -512, -200}, upper[] = {3071, 2000, 1000};
	double window[2] = {-1024, 3071}, deg[3] = {0}, start[3], most;
	size_t from[3], n[3], pose = below(d, 4), kind = below(d, 10);

	draw_box(d, v, from, n);
	must(ct_vol_alloc(body, n, &err), "a box");
	for (int a = 0; a < 3; a++)
		start[a] = (double)from[a];
	memcpy(body->affine, v->affine, sizeof body->affine);
	ct_vol_shift_affine(body->affine, start);
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			memcpy(body->data + (k * n[1] + j) * n[0],
				v->data + ((from[2] + k) * v->n[1] + from[1] + j) * v->n[0] +
					from[0],
				n[0] * sizeof *body->data);
	if (kind < 4) { /* that of ct-sr --paper */
		window[0] = -512;
	} else if (kind < 6) {
		window[0] = lower[below(d, 4)];
		window[1] = upper[below(d, 3)];
	}
	ct_window_density(ct_vol_count(body), body->data, body->data, window);
	for (int a = 0; a < 3; a++) {
		const double stretch = uniform(d, 0.85, 1.15);

		for (int r = 0; r < 3; r++)
			body->affine[r][a] *= stretch;
	}
	most = pose < 2 ? 0 : pose == 2 ? 25 : 180;
	for (int a = 0; a < 3; a++)
		deg[a] = most > 0 ? uniform(d, -most, most) : 0;
	ct_vol_rotate(body, deg);
}

static void draw_scan(struct dice *d, const struct ct_vol *body, struct ct_stack *scan)
{
	struct ct_geometry s;
	double side;
	size_t det;

	ct_geometry_default(&s, CT_CONE, body);
	side = s.pitch[0] * (double)s.w * s.dso / s.dsd;
	det = 16 * (size_t)nearbyint((double)s.w * uniform(d, 0.75, 1.5) / 16);
	s.w = s.h = det < LEAST ? LEAST : det > MOST ? MOST : det;
	s.dso *= uniform(d, 0.7, 1.3);
	s.dsd = fmax(s.dsd * uniform(d, 0.7, 1.3), 1.1 * s.dso);
	side *= s.dsd / s.dso * uniform(d, 0.75, 1.2);
	s.pitch[0] = s.pitch[1] = side / (double)s.w;
	for (int a = 0; a < 2; a++)
		s.offset[a] = below(d, 4) ? 0 : uniform(d, -0.12, 0.12) * side;
	s.views = VIEWS;
	s.arc = 360;
	s.start = uniform(d, 0, 360);
	must(ct_geometry_fill(scan, &s, &err), "a scan");
}

/* The largest mean of by x by pixels. */
static double largest(const struct ct_stack *s, size_t by)
{
	double most = 0;

	for (size_t k = 0; k < s->views; k++)
		for (size_t r = 0; r + by <= s->h; r += by)
			for (size_t c = 0; c + by <= s->w; c += by) {
				const float *at = ct_stack_view(s, k) + r * s->w + c;
				double sum = 0;

				for (size_t i = 0; i < by * by; i++)
					sum += (double)at[i / by * s->w + i % by];
				most = fmax(most, sum / (double)(by * by));
			}
	return most;
}

struct views {
	size_t n;
	uint32_t *size; /* [n][2] */
	uint16_t **pixel;
};

/* The first `count` views of a stack; none if it saw next to nothing. */
static void keep(struct views *out, const struct ct_stack *s, size_t count, double norm)
{
	const size_t pixels = s->h * s->w;

	for (size_t k = 0; k < count && norm > 0; k++) {
		const float *p = ct_stack_view(s, k);
		uint16_t *q;

		must(ct_alloc(&q, pixels, sizeof *q, &err), "a view");
		for (size_t i = 0; i < pixels; i++)
			q[i] = (uint16_t)lrint(
				65535 * fmin((double)p[i] / norm / (double)CEILING, 1));
		out->size[2 * out->n] = (uint32_t)s->h;
		out->size[2 * out->n + 1] = (uint32_t)s->w;
		out->pixel[out->n++] = q;
	}
}

static void make_stack(struct dice *d, const struct ct_vol *v, size_t count, struct views *out)
{
	struct ct_vol body = {0};
	struct ct_stack scan = {0};
	struct ct_projector g;

	draw_body(d, v, &body);
	draw_scan(d, &body, &scan);
	must(ct_projector_init(&g, &body, &scan, &err) || ct_projector_reserve(&g, &err),
		"the projector");
	ct_projector_load(&g, body.data, NULL);
	ct_project(&g, 0, scan.views, scan.data, NULL);
	keep(out, &scan, count, largest(&scan, below(d, 2) ? 4 : 8));
	ct_projector_free(&g);
	ct_stack_free(&scan);
	ct_vol_free(&body);
}

static void write_views(const char *path, const struct views *v)
{
	const uint32_t n = (uint32_t)v->n;
	const float ceiling = CEILING;
	char part[4096];
	bool whole;
	FILE *f;

	snprintf(part, sizeof part, "%.4000s.part", path);
	f = fopen(part, "wb");
	whole = f && fwrite("ctpv", 4, 1, f) == 1 && fwrite(&n, 4, 1, f) == 1 &&
		fwrite(&ceiling, 4, 1, f) == 1 && fwrite(v->size, 8, v->n, f) == v->n;
	for (size_t k = 0; whole && k < v->n; k++) {
		const size_t pixels = (size_t)v->size[2 * k] * v->size[2 * k + 1];

		whole = fwrite(v->pixel[k], 2, pixels, f) == pixels;
	}
	if (!f || fclose(f) != 0 || !whole || rename(part, path) != 0) {
		fprintf(stderr, "project: %s: cannot be written\n", path);
		exit(1);
	}
}

int main(int argc, char **argv)
{
	struct dice d = {0};
	struct views out = {0};
	struct ct_vol v = {0};
	size_t count = argc == 5 ? strtoul(argv[4], NULL, 10) : 0;

	if (count < 1 || count > 100000) {
		fprintf(stderr, "usage: projections VOLUME.nii OUT.raw SEED COUNT\n");
		return 2;
	}
	must(ct_simd_use(getenv("CTSR_CPU"), &err), "CTSR_CPU");
	d.seed = strtoull(argv[3], NULL, 10);
	read_volume(&v, argv[1]);
	must(ct_alloc(&out.size, 2 * count, sizeof *out.size, &err) ||
			ct_alloc(&out.pixel, count, sizeof *out.pixel, &err),
		"views");
	while (out.n < count && d.stream < count) {
		d.at = 0;
		make_stack(&d, &v, count - out.n < VIEWS ? count - out.n : VIEWS, &out);
		d.stream++;
	}
	write_views(argv[2], &out);
	for (size_t k = 0; k < out.n; k++)
		free(out.pixel[k]);
	free(out.pixel);
	free(out.size);
	ct_vol_free(&v);
	return 0;
}
