/* ct-project: X-ray projections of a volume: exact line integrals of its density. */
#include "config.h"
#include "cli/cost-report.h"
#include "cli/keep.h"
#include "core/clock.h"
#include "core/mem.h"
#include "diffusion/measurement.h"
#include "formats/exr.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "xray/photons.h"
#include "xray/project.h"
#include "xray/window.h"
#include "recon/scan-grid.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct params {
	const char *in, *out, *window, *rotate;
	struct ct_geometry_opts scan;
	int quantity, method, coarsen, pixel;
	double photons, electronic, water;
	bool overshoot;
};

#define QUANTITIES(X)                                                                              \
	X(BY_FILE, "file")                                                                         \
	X(HU, CT_QUANTITY_HU)                                                                      \
	X(DENSITY, CT_QUANTITY_DENSITY)
enum quantity { QUANTITIES(CT_WORD_VALUE) };

static const struct params defaults = {.scan = CT_GEOMETRY_DEFAULTS, .coarsen = 1, .water = 0.02};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", "volume in HU, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_STACK, "projections, EXR, or -"),
	CT_GEOMETRY_OPTS(scan),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"HU that become density 0 and 1, the rest clipped (-1024:3071, or what IN says)"),
	CT_FLAG(overshoot, 0, "overshoot",
		"do not clip a volume that was clipped to the window before its resolution was "
		"reduced, and says so (metadata clip): what it has beyond is overshoot"),
	CT_EXPERT(rotate, "rotate", "X,Y,Z", 0, 0,
		"turn the volume about its centre before projecting: degrees about the world's x, "
		"then y, then z axis"),
	CT_CHOICE(quantity, 0, "quantity", CT_WORDS(QUANTITIES),
		"what the values of IN are: as its metadata say and else HU, or this; density "
		"is projected as it is"),
	CT_CHOICE(method, 'm', "method", CT_WORDS(CT_METHOD_LIST),
		"how rays are integrated: exact lengths in boxes of constant density, or linear "
		"interpolation in the slices that a ray crosses"),
	CT_OPT(coarsen, 0, "coarsen", "S", 1, 4096,
		"make the pixels S times larger and S times fewer along u and v"),
	CT_CHOICE(pixel, 0, "pixel", CT_WORDS(CT_PIXEL_LIST),
		"what a large pixel is: one ray through its centre, the mean of the small ones, or "
		"the small ones cut at its Nyquist frequency",
		CT_WHEN(CT_IF(coarsen))),
	CT_OPT(photons, 0, "photons", "I0", 0, 1e15,
		"noise of a detector that counts, I0 photons a pixel being sent; 0: no noise"),
	CT_EXPERT(electronic, "electronic", "SD", 0, 1e12,
		"standard deviation of the electronics, in photons", CT_WHEN(CT_IF(photons))),
	CT_EXPERT(water, "mu-water", "PER-MM", 1e-6, 10, "attenuation of water",
		CT_WHEN(CT_IF(photons))),
	CT_OPT_END,
};

struct project_job {
	const char *name;            /* of the volume, for messages */
	const struct ct_vol *v;      /* density */
	const float *mu;             /* its attenuation, 1/mm; NULL without noise */
	const struct ct_stack *rays; /* rays that are followed; their data are not used */
	struct ct_stack *out;        /* rays, or pixels of `coarsen` squared of them */
	enum ct_method method;
	enum ct_measurement_kind kind; /* of coarse pixels */
	size_t coarsen;
	struct ct_photons photons;
	double unit; /* attenuation of a mm of density 1 */
};

/* What a pass over the views needs. */
struct pass {
	const struct project_job *j;
	struct ct_projector g;
	struct ct_measurement op;
	float *fine, *noise;
	double *scratch;
	bool direct;
};

static void close_pass(struct pass *p)
{
	ct_projector_free(&p->g);
	ct_measurement_free(&p->op);
	free(p->fine);
	free(p->noise);
	free(p->scratch);
}

/* A fan's one row stands for all rows of a coarse pixel. */
static size_t rows_of(const struct project_job *j)
{
	return j->out->h * j->coarsen;
}

static int open_pass(struct pass *p, const struct project_job *j, struct ct_err *e)
{
	const struct ct_stack *out = j->out;

	*p = (struct pass){.j = j, .direct = j->rays == out};
	if (ct_projector_init(&p->g, j->v, j->rays, e))
		return ct_blame(e, j->name);
	p->g.method = j->method;
	if (ct_projector_reserve(&p->g, e) ||
		(j->mu && ct_alloc(&p->noise, out->h * out->w, sizeof *p->noise, e)) ||
		(!p->direct &&
			(ct_measurement_alloc(&p->op, j->kind, out->h, out->w, j->coarsen, 0, e) ||
				ct_alloc(&p->fine, rows_of(j) * j->rays->w, sizeof *p->fine, e) ||
				ct_alloc(&p->scratch, ct_measurement_scratch(&p->op),
					sizeof *p->scratch, e)))) {
		close_pass(p);
		return -1;
	}
	return 0;
}

/* View k of the volume loaded. */
static void view(struct pass *p, size_t k, float *out, struct ct_par *par)
{
	const struct ct_stack *rays = p->j->rays;

	if (p->direct) {
		ct_project(&p->g, k, 1, out, par);
		return;
	}
	ct_project(&p->g, k, 1, p->fine, par);
	for (size_t r = rays->h; r < rows_of(p->j); r++)
		memcpy(p->fine + r * rays->w, p->fine, rays->w * sizeof *p->fine);
	ct_measurement_forward(&p->op, out, p->fine, p->scratch);
}

/* All views into j->out. */
static int make_views(const struct project_job *j, const struct ct_env *env, struct ct_err *e)
{
	size_t n = j->out->views, pixels = j->out->h * j->out->w, total = j->mu ? 2 * n : n;
	struct pass p;
	int rc = -1;

	if (open_pass(&p, j, e))
		return -1;
	for (size_t i = 0; i < total; i++) {
		size_t k = i % n;

		ct_progress(env, "views", i, total);
		if (ct_check_stop(env, e))
			goto out;
		if (k == 0)
			ct_projector_load(&p.g, i == 0 ? j->v->data : j->mu, env->par);
		view(&p, k, i < n ? ct_stack_view(j->out, k) : p.noise, env->par);
		if (i >= n)
			ct_photons_add(pixels, ct_stack_view(j->out, k), p.noise, j->unit,
				&j->photons, k * pixels);
	}
	ct_progress(env, "views", total, total);
	rc = 0;
out:
	close_pass(&p);
	return rc;
}

/* A view as its file will hold it. */
static int pack(const float *view, size_t bytes, struct ct_err *e)
{
	unsigned char *to = NULL, *scratch = NULL;
	int rc = -1;

	if (ct_alloc(&to, ct_exr_zip_room(bytes), 1, e) == 0 &&
		ct_alloc(&scratch, bytes, 1, e) == 0)
		rc = ct_exr_zip(to, (const unsigned char *)view, bytes, scratch)
			     ? 0
			     : ct_fail(e, CT_ENOMEM, "no memory");
	free(to);
	free(scratch);
	return rc;
}

static int estimate(const struct project_job *j, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *out = j->out;
	const double before = ct_clock_cpu(), threads = (double)ct_par_threads(env->par);
	const size_t pixels = out->h * out->w;
	double start, load, once, held, volume = 4.0 * (double)ct_vol_count(j->v);
	struct ct_cost cost = {.disk = 4.0 * (double)ct_stack_count(out)};
	size_t tries = out->views > 1 ? 2 : 1, passes = j->mu ? 2 : 1;
	struct pass p;

	if (open_pass(&p, j, e))
		return -1;
	start = ct_clock_cpu();
	ct_projector_load(&p.g, j->v->data, env->par);
	load = ct_clock_cpu() - start;
	start = ct_clock_cpu();
	for (size_t i = 0; i < tries; i++) { /* slanting, and far from each other */
		size_t k = out->views * (1 + 4 * i) / 8;

		view(&p, k, ct_stack_view(out, k), env->par);
	}
	once = (ct_clock_cpu() - start) / (double)tries * (double)passes;
	start = ct_clock_cpu();
	if (pack(ct_stack_view(out, out->views / 8), pixels * sizeof *out->data, e)) {
		close_pass(&p);
		return -1;
	}
	once += ct_clock_cpu() - start;
	cost.seconds = (before + (double)out->views * once + load * (double)passes) / threads;
	held = (j->rays == out ? 0 : 4.0 * (double)ct_stack_count(j->rays)) +
	       (double)ct_projector_bytes(&p.g); /* gone when the bytes of the file come */
	cost.memory = volume * (double)passes + cost.disk + fmax(held, cost.disk);
	close_pass(&p);
	snprintf(cost.work, sizeof cost.work, "%zu views of %zux%zu pixels, %.3f s each",
		out->views, out->w, out->h, once / threads);
	return ct_cost_print(&cost, env, e);
}

/* A volume in HU whose overshoots are to be projected becomes density, and says so. */
static int take_overshoot(struct ct_vol *v, bool *density, const double window[2],
	const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	const char *clip = ct_meta_get(&v->meta, CT_META_CLIP);
	double to[2];

	if (*density)
		return ct_fail(e, CT_EUSAGE, "--overshoot is for HU, and %s is density", p->in);
	if (clip && ct_cli_range("clip", clip, to, e)) {
		e->code = CT_EINPUT;
		return ct_blame(e, p->in);
	}
	if (!clip || to[0] != window[0] || to[1] != window[1]) {
		ct_log(env, CT_WARN,
			"%s does not say that it was clipped to %g:%g before its resolution was "
			"reduced: it is clipped now",
			p->in, window[0], window[1]);
		return 0;
	}
	ct_window_density_open(ct_vol_count(v), v->data, v->data, window);
	*density = true;
	return ct_window_put(&v->meta, window, e) ||
			       ct_meta_set(&v->meta, CT_META_OVERSHOOT, "yes", e)
		       ? -1
		       : 0;
}

/* HU in place to density, unless they are density already; with --photons the attenuation of every
 * voxel, and that of a mm of density 1. */
static int to_density(struct ct_vol *v, float **mu, double *unit, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = ct_vol_count(v);
	const char *had = ct_meta_get(&v->meta, CT_META_QUANTITY);
	const bool says = had && strcmp(had, CT_QUANTITY_DENSITY) == 0;
	bool density = had && p->quantity == BY_FILE ? says : p->quantity == DENSITY;
	double window[2];

	if (had && !says && strcasecmp(had, CT_QUANTITY_HU) != 0)
		return ct_fail(
			e, CT_EINPUT, "%s: quantity is %.40s, not hu or density", p->in, had);
	if (had && density != says)
		return ct_fail(e, CT_EUSAGE, "--quantity contradicts %s: its quantity is %.40s",
			p->in, had);
	if (ct_geometry_opts_window(window, p->window, &v->meta, e))
		return -1;
	if (p->overshoot && take_overshoot(v, &density, window, p, env, e))
		return -1;
	if (p->photons > 0) {
		if (ct_alloc(mu, n, sizeof **mu, e))
			return -1;
		*unit = p->water * (window[1] - window[0]) / 1000;
		if (density)
			ct_window_hu(n, *mu, v->data, window);
		ct_photons_mu(n, *mu, density ? *mu : v->data, p->water);
	}
	if (!density) {
		ct_geometry_opts_warn_above(v, p->in, window, env);
		ct_window_density(n, v->data, v->data, window);
	}
	if (!density || p->window)
		return ct_window_put(&v->meta, window, e);
	return 0;
}

/* What the volume says of itself, the scan, and the grid that was projected. */
static int describe(struct ct_stack *s, const struct ct_vol *v, const struct params *p,
	uint64_t seed, struct ct_err *e)
{
	struct ct_meta *m = &s->meta;

	if (ct_meta_add(m, &v->meta, e))
		return -1;
	if (p->coarsen > 1 &&
		(ct_meta_setf(m, e, CT_META_COARSEN, "%d", p->coarsen) ||
			ct_meta_set(m, CT_META_PIXEL, CT_WORD(CT_PIXEL_LIST, p->pixel), e)))
		return -1;
	if (p->photons > 0 &&
		(ct_meta_setf(m, e, CT_META_PHOTONS, "%.17g", p->photons) ||
			ct_meta_setf(m, e, CT_META_ELECTRONIC, "%.17g", p->electronic) ||
			ct_meta_setf(m, e, CT_META_MU_WATER, "%.17g", p->water) ||
			ct_meta_setf(m, e, CT_META_SEED, "%llu", (unsigned long long)seed)))
		return -1;
	if (ct_meta_set(m, CT_META_METHOD, CT_WORD(CT_METHOD_LIST, p->method), e))
		return -1;
	return ct_meta_set(m, CT_META_QUANTITY, CT_QUANTITY_LINE_INTEGRAL, e) ||
			       ct_scan_grid_put(m, v, e)
		       ? -1
		       : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol in = {0};
	struct ct_stack fine = {0}, coarse = {0}, *out = p->coarsen > 1 ? &coarse : &fine;
	struct project_job j = {.name = p->in,
		.v = &in,
		.out = out,
		.rays = p->pixel == CT_PIXEL_POINT ? out : &fine,
		.method = (enum ct_method)p->method,
		.kind = ct_pixel_measures((enum ct_pixel)p->pixel),
		.coarsen = (size_t)p->coarsen,
		.photons = {p->photons, p->electronic, p->water, env->seed}};
	struct ct_err beside;
	double deg[3];
	float *mu = NULL;
	int rc = -1;

	if (env->seed && !(p->photons > 0))
		return ct_fail(e, CT_EUSAGE, "--seed: needs --photons");
	if (ct_vol_read(p->in, &in, e))
		goto out;
	if (ct_vol_check_finite(&in, e) || ct_vol_check_grid(&in, e) ||
		(p->quantity == BY_FILE && ct_units_check(&in, "--quantity", e))) {
		ct_blame(e, p->in);
		goto out;
	}
	if (p->rotate && ct_cli_numbers("expert rotate", p->rotate, ',', 3, false, deg, e))
		goto out;
	if (p->rotate)
		ct_vol_rotate(&in, deg);
	if (ct_geometry_opts_make(&fine, &p->scan, &in, e))
		goto out;
	if (ct_geometry_seen(&fine, &in, &beside))
		ct_log(env, CT_WARN, "%s: %s", p->in, beside.msg);
	if ((p->coarsen > 1 && ct_stack_coarsen(&coarse, &fine, (size_t)p->coarsen, e)) ||
		to_density(&in, &mu, &j.unit, p, env, e))
		goto out;
	j.mu = mu;
	if (env->dry_run) {
		rc = estimate(&j, env, e);
		goto out;
	}
	ct_log(env, CT_INFO, "%zu views of %zux%zu, %s beam", out->views, out->w, out->h,
		CT_WORD(CT_BEAM_LIST, out->beam));
	if (make_views(&j, env, e) || describe(out, &in, p, env->seed, e) ||
		ct_meta_step(&out->meta, env, 1, (const struct ct_meta *const[]){&in.meta}, e))
		goto out;
	rc = ct_keep_stack(p->out, out, env, e);
out:
	free(mu);
	ct_vol_free(&in);
	ct_stack_free(&fine);
	ct_stack_free(&coarse);
	return rc;
}

CT_CLI_MAIN("ct-project", "Project a volume: line integrals of its density, in a scan.",
	CT_SEEDED | CT_LONG)
