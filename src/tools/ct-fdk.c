/* ct-fdk: a volume from projections: filtered back-projection, or iteration. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/io.h"
#include "kern/fdk.h"
#include "kern/window.h"
#include "core/mem.h"
#include "tools/fdk-grid.h"
#include "tools/scan-opts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct params {
	const char *in, *out, *grid, *window;
	int method, filter, quantity, iterations;
	bool parker;
};

enum method { AUTO, FDK, FBP };
enum quantity { HU, DENSITY };

static const struct params defaults = {0};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, in, "IN", "projections, EXR, or -"),
	CT_ARG(struct params, out, "OUT", "the volume, NIfTI, or -"),
	CT_CHOICE(struct params, method, 'm', "method", "auto|fdk|fbp",
		"how: fdk for a cone or a fan, fbp for parallel rays, either by auto"),
	CT_OPT(struct params, grid, 0, "grid", "N|FILE", 0, 0,
		"N voxels along the longest side of the region, or the grid of this volume (that "
		"of the projected volume, or the cube that all views see)"),
	CT_CHOICE(struct params, filter, 0, "filter",
		"ram-lak|shepp-logan|cosine|hamming|hann|none", "window of the ramp filter; none "
		"leaves the ramp out too, and needs --quantity density"),
	CT_OPT(struct params, parker, 0, "parker", NULL, 0, 0,
		"weigh the rays of a short scan so that those seen twice count once"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"HU of density 0 and 1 (what IN says, or -1024:3071)"),
	CT_CHOICE(struct params, quantity, 0, "quantity", "hu|density", "what OUT holds"),
	CT_OPT_END,
};

static double now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int check_options(const struct params *p, const struct ct_stack *in, struct ct_err *e)
{
	const char *had = ct_meta_get(&in->meta, "quantity");
	bool parallel = in->beam == CT_PARALLEL;

	if (had && strcmp(had, "lineIntegral") != 0 && strcmp(had, "residual") != 0)
		return ct_fail(e, CT_EINPUT, "%s: quantity is %.40s, not lineIntegral", p->in, had);
	if (p->method != AUTO && parallel != (p->method == FBP))
		return ct_fail(e, CT_EUSAGE, "-m %s, but %s has a %s beam",
			p->method == FBP ? "fbp" : "fdk", p->in, ct_beam_name(in->beam));
	if (p->filter == CT_FILTER_NONE && p->quantity == HU)
		return ct_fail(e, CT_EUSAGE,
			"--filter none gives no density, so no HU: add --quantity density");
	return 0;
}

static int back_project(struct ct_vol *out, const struct ct_stack *in, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_fdk f = {0};
	size_t cut;
	int rc = -1;

	if (ct_fdk_alloc(&f, out, in, (enum ct_filter_kind)p->filter, p->parker, env->par, e))
		return ct_blame(e, p->in);
	if (!f.orbit.closed && f.orbit.redundancy == CT_RAYS_EVEN)
		ct_log(env, CT_WARN,
			"a short scan of %.4g degrees: rays seen twice count twice; --parker weighs them",
			f.orbit.arc * 180 / M_PI);
	cut = ct_fdk_truncated(&f);
	if (cut)
		ct_log(env, CT_INFO, "%zu of %zu views do not see the whole grid", cut, in->views);
	for (size_t k = 0; k < in->views; k += f.block) {
		size_t left = in->views - k;

		ct_progress(env, "views", k, in->views);
		if (ct_check_stop(env, e))
			goto out;
		ct_fdk_views(&f, k, left < f.block ? left : f.block, out->data, env->par);
	}
	ct_progress(env, "views", in->views, in->views);
	rc = 0;
out:
	ct_fdk_free(&f);
	return rc;
}

/* Density to what OUT holds; a residual has no offset. */
static int finish(struct ct_vol *out, const struct ct_stack *in, const struct params *p,
	struct ct_err *e)
{
	static const char *const gone[] = {"scan.dso", "scan.dsd", "scan.arc", "scan.start",
		"scan.iso", "volume.size", "volume.affine", "coarsen", "pixel", "quantity"};
	const char *had = ct_meta_get(&in->meta, "quantity");
	bool residual = had && strcmp(had, "residual") == 0;
	double window[2];

	if (ct_window_choose(window, p->window, &in->meta, e) ||
		ct_meta_copy(&out->meta, &in->meta, e))
		return -1;
	for (size_t i = 0; i < sizeof gone / sizeof *gone; i++)
		ct_meta_drop(&out->meta, gone[i]);
	if (ct_window_put(&out->meta, window, e))
		return -1;
	if (p->quantity == DENSITY)
		return ct_meta_set(&out->meta, "quantity", "density", e);
	if (residual) {
		window[1] -= window[0];
		window[0] = 0;
	}
	ct_window_hu(ct_vol_count(out), out->data, out->data, window);
	return residual ? ct_meta_set(&out->meta, "quantity", "residual", e) : 0;
}

/* Time a few views on a part of the grid. */
static int estimate(const struct ct_vol *grid, const struct ct_stack *in, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol part = *grid;
	struct ct_fdk f = {0};
	size_t most = 64, count;
	double start, share, bytes;
	int rc = -1;

	part.data = NULL;
	for (int a = 0; a < 3; a++) { /* its middle */
		size_t n = grid->n[a] < most ? grid->n[a] : most;

		for (int r = 0; r < 3; r++)
			part.affine[r][3] += (double)((grid->n[a] - n) / 2) * part.affine[r][a];
		part.n[a] = n;
	}
	if (ct_fdk_alloc(&f, &part, in, (enum ct_filter_kind)p->filter, p->parker, env->par, e))
		return ct_blame(e, p->in);
	if (ct_alloc0(&part.data, ct_vol_count(&part), sizeof *part.data, e))
		goto out;
	count = f.block < 8 ? f.block : 8;
	ct_fdk_views(&f, 0, 1, part.data, env->par); /* the first is slower */
	start = now();
	ct_fdk_views(&f, 0, count, part.data, env->par);
	share = (double)ct_vol_count(grid) / (double)ct_vol_count(&part);
	bytes = 4 * ((double)ct_vol_count(grid) + (double)ct_stack_count(in)) +
		(double)ct_fdk_bytes(&f, ct_par_threads(env->par));
	printf("volume    %zux%zux%zu, %zu views of %zux%zu\n", grid->n[0], grid->n[1], grid->n[2],
		in->views, in->w, in->h);
	printf("time      %.0f s at most on %zu threads\n",
		ceil((now() - start) * share * (double)in->views / (double)count),
		ct_par_threads(env->par));
	printf("memory    %.0f MiB\n", bytes / 0x1p20);
	printf("disk      %.0f MiB at most\n", 4 * (double)ct_vol_count(grid) / 0x1p20);
	rc = 0;
out:
	free(part.data);
	ct_fdk_free(&f);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_stack in = {0};
	struct ct_vol grid = {0}, out = {0};
	int rc = -1;

	if ((!env->dry_run && ct_out_check(p->out, env, e)) || ct_stack_read(p->in, &in, e))
		goto out;
	if (ct_stack_check_finite(&in, e) || ct_stack_check(&in, e)) {
		ct_blame(e, p->in);
		goto out;
	}
	if (check_options(p, &in, e) || ct_fdk_grid(&grid, p->grid, &in, e))
		goto out;
	if (env->dry_run) {
		rc = estimate(&grid, &in, p, env, e);
		goto out;
	}
	if (ct_vol_alloc(&out, grid.n, e))
		goto out;
	memcpy(out.affine, grid.affine, sizeof out.affine);
	memset(out.data, 0, ct_vol_count(&out) * sizeof *out.data);
	if (back_project(&out, &in, p, env, e) || finish(&out, &in, p, e) ||
		ct_meta_step(&out.meta, env, 1, (const struct ct_meta *const[]){&in.meta}, e))
		goto out;
	ct_stack_free(&in);
	rc = ct_vol_write(p->out, &out, env, e);
out:
	ct_stack_free(&in);
	ct_vol_free(&out);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-fdk",
	.brief = "Reconstruct a volume from projections.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_LONG,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
