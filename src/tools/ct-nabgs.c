/* ct-nabgs: fit signed Gaussians to projections, on top of a base volume. */
#include "config.h"
#include "cli/cli.h"
#include "core/mem.h"
#include "formats/format.h"
#include "formats/io.h"
#include "gs/fit.h"
#include "kern/degrade.h"
#include "kern/project.h"
#include "kern/window.h"
#include "tools/scan-opts.h"

#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>
#include <unistd.h>

struct params {
	const char *in, *out, *base, *projections, *window;
	int iterations, gaussians, most, every, activation, mode, scale, densify_until;
	double ssim, tv, init, tolerance;
	bool resume;
};

static const struct params defaults = {.iterations = 5000,
	.gaussians = 50000,
	.most = 500000,
	.every = 1000,
	.ssim = NAN,
	.tv = 0.05,
	.init = NAN};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, in, "IN", "projections to fit, EXR, or -"),
	CT_ARG(struct params, out, "OUT", "the Gaussians, PLY, or -"),
	CT_OPT(struct params, base, 'b', "base", "VOLUME", 0, 0,
		"the upsampled CT in HU, NIfTI, or -: what the residual is added to, and where "
		"Gaussians begin; required"),
	CT_OPT(struct params, projections, 0, "base-projections", "STACK", 0, 0,
		"projections of the base in the geometry of IN, EXR (computed if not given)"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"HU of density 0 and 1 (-1024:3071, or what IN says)"),
	CT_OPT(struct params, iterations, 'n', "iterations", "N", 1, 10000000, "one view each"),
	CT_OPT(struct params, tolerance, 0, "tolerance", "E", 0, 1,
		"end as soon as the error of a turn through all views is at most E of the error "
		"without Gaussians; 0 runs all iterations"),
	CT_OPT(struct params, gaussians, 'g', "gaussians", "N", 1, 16000000,
		"Gaussians to begin with"),
	CT_OPT(struct params, most, 0, "max-gaussians", "N", 1, 16000000, "never more than these"),
	CT_OPT(struct params, densify_until, 0, "densify-until", "N", 0, 10000000,
		"last iteration that clones, splits and prunes; 0 is the last of all"),
	CT_CHOICE(struct params, activation, 'a', "activation", "prelu|softplus|relu|sine",
		"from raw density to density; prelu and sine are signed"),
	CT_CHOICE(struct params, mode, 'm', "mode", "residual|full",
		"fit what IN has beyond the projections of the base, or all of it"),
	CT_OPT(struct params, scale, 'x', "scale", "S", 0, 1024,
		"factor of the super-resolution: from 8 on, the rates of scale and rotation are "
		"ten "
		"times lower; 0 is what the files say, else 4"),
	CT_OPT(struct params, ssim, 0, "lambda-ssim", "W", 0, 1e6,
		"weight of 1 - SSIM (0.5; in mode full 0.25)"),
	CT_OPT(struct params, tv, 0, "lambda-tv", "W", 0, 1e6, "weight of the total variation"),
	CT_OPT(struct params, init, 0, "init-density-scale", "X", 0, 1,
		"density to begin with, as a part of the base's (0.05 for a signed residual, else "
		"0.15)"),
	CT_OPT(struct params, every, 0, "checkpoint-every", "N", 0, 10000000,
		"iterations between states in OUT.state; 0 writes one only when stopped"),
	CT_OPT(struct params, resume, 0, "resume", NULL, 0, 0,
		"continue from OUT.state if it is there"),
	CT_OPT_END,
};

/* The three inputs, and what a state must agree with. */
struct job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_stack in, base_proj;
	struct ct_vol base;
	double window[2];
	char *state, *run;
};

static int check_quantity(
	const struct ct_meta *m, const char *want, const char *path, struct ct_err *e)
{
	const char *q = ct_meta_get(m, "quantity");

	return !q || strcasecmp(q, want) == 0
		       ? 0
		       : ct_fail(e, CT_EINPUT, "%s: quantity is %.40s, not %s", path, q, want);
}

/* HU to density in the window that the option and all files agree on. */
static int read_base(struct job *j, struct ct_err *e)
{
	const char *path = j->p->base, *said, *quantity;
	bool density;

	if (ct_vol_read(path, &j->base, e))
		return -1;
	if (ct_vol_check_finite(&j->base, e) || ct_vol_check_grid(&j->base, e))
		return ct_blame(e, path);
	quantity = ct_meta_get(&j->base.meta, "quantity");
	density = quantity && strcasecmp(quantity, "density") == 0;
	if (!density && check_quantity(&j->base.meta, "hu", path, e))
		return -1;
	said = ct_meta_get(&j->base.meta, "window");
	if (ct_window_choose(j->window, j->p->window, said ? &j->base.meta : &j->in.meta, e))
		return -1;
	if (said && ct_meta_get(&j->in.meta, "window") &&
		strcmp(said, ct_meta_get(&j->in.meta, "window")) != 0)
		return ct_fail(e, CT_EINPUT, "%s has the window %s, %s has %s", path, said,
			j->p->in, ct_meta_get(&j->in.meta, "window"));
	if (!density)
		ct_window_density(ct_vol_count(&j->base), j->base.data, j->base.data, j->window);
	return 0;
}

static int project_base(struct job *j, struct ct_err *e)
{
	struct ct_projector g;

	if (ct_stack_like(&j->base_proj, &j->in, 1, e))
		return -1;
	ct_meta_free(&j->base_proj.meta);
	if (ct_projector_init(&g, &j->base, &j->in, e))
		return ct_blame(e, j->p->base);
	if (ct_projector_reserve(&g, e))
		return -1;
	ct_projector_load(&g, j->base.data, j->env->par);
	for (size_t k = 0; k < j->in.views; k++) {
		ct_progress(j->env, "projections of the base", k, j->in.views);
		if (ct_check_stop(j->env, e)) {
			ct_projector_free(&g);
			return -1;
		}
		ct_project(&g, k, 1, ct_stack_view(&j->base_proj, k), NULL, j->env->par);
	}
	ct_projector_free(&g);
	return 0;
}

static int read_stack(struct ct_stack *s, const char *path, struct ct_err *e)
{
	if (ct_stack_read(path, s, e) || check_quantity(&s->meta, "lineIntegral", path, e))
		return -1;
	return ct_stack_check(s, e) || ct_stack_check_finite(s, e) ? ct_blame(e, path) : 0;
}

static int read_all(struct job *j, struct ct_err *e)
{
	const struct params *p = j->p;

	if (read_stack(&j->in, p->in, e) || read_base(j, e))
		return -1;
	if (p->mode == 1)
		return 0;
	if (!p->projections)
		return project_base(j, e);
	if (read_stack(&j->base_proj, p->projections, e))
		return -1;
	return ct_stack_same(&j->in, &j->base_proj, e) ? ct_blame(e, p->projections) : 0;
}

static int options(struct ct_fit_options *o, const struct job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	struct ct_degrade d = {{4, 4, 4}, {0}, CT_DECIMATE_SINC};
	size_t scale = (size_t)p->scale;

	if (scale == 0) {
		int known = ct_degrade_get(&j->base.meta, &d, e);

		if (known < 0)
			return ct_blame(e, p->base);
		if (known > 0 && ct_degrade_get(&j->in.meta, &d, e) < 0)
			return ct_blame(e, p->in);
		for (int a = 0; a < 3; a++)
			scale = d.factor[a] > (double)scale ? (size_t)lround(d.factor[a]) : scale;
	}
	ct_fit_defaults(o, scale, p->mode == 1, (enum ct_activation)p->activation);
	o->iterations = (size_t)p->iterations;
	o->gaussians = (size_t)p->gaussians;
	o->max_gaussians = (size_t)p->most;
	o->densify_until = (size_t)p->densify_until;
	o->tv = p->tv;
	o->checkpoint_every = (size_t)p->every;
	o->tolerance = p->tolerance;
	if (!isnan(p->ssim))
		o->ssim = p->ssim;
	if (!isnan(p->init))
		o->init_density = p->init;
	return 0;
}

static const char *input_of(const struct ct_meta *m)
{
	const char *s = ct_meta_get(m, "input");

	return s ? s : "-";
}

/* What a state belongs to: all that can change the result. */
static int name_run(struct job *j, const struct ct_fit_options *o, struct ct_err *e)
{
	if (asprintf(&j->run,
		    "%s %s %s; window %.17g:%.17g; seed %llu; %zu iterations, %zu to %zu "
		    "Gaussians until %zu, %s, %s, L1 %.17g, SSIM %.17g, TV %.17g, begin %.17g, "
		    "scaling %.17g, tolerance %.17g",
		    input_of(&j->in.meta), input_of(&j->base.meta), input_of(&j->base_proj.meta),
		    j->window[0], j->window[1], (unsigned long long)j->env->seed, o->iterations,
		    o->gaussians, o->max_gaussians, o->densify_until,
		    ct_activation_name(o->activation), o->full ? "full" : "residual",
		    o->l1 + o->res, o->ssim, o->tv, o->init_density, o->scaling.first,
		    o->tolerance) < 0) {
		j->run = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	return 0;
}

static int save(void *ctx, const struct ct_fit *f, struct ct_err *e)
{
	const struct job *j = ctx;
	struct ct_env env = *j->env;
	struct ct_tensors t = {0};
	int rc = -1;

	env.force = true; /* over the state before */
	if (ct_fit_pack(&t, f, j->run, e) == 0)
		rc = ct_tensors_write(j->state, &t, false, &env, e);
	ct_tensors_free(&t);
	return rc;
}

static int resume(struct ct_fit *f, const struct job *j, struct ct_err *e)
{
	struct ct_tensors t = {0};
	int rc = -1;

	if (access(j->state, F_OK) != 0 && errno == ENOENT)
		return 0;
	if (ct_tensors_read(j->state, &t, e) == 0) {
		rc = ct_fit_unpack(f, &t, j->run, e);
		if (rc)
			ct_blame(e, j->state);
		else
			ct_log(j->env, CT_INFO, "%s: continuing after iteration %zu", j->state,
				f->g.step);
	}
	ct_tensors_free(&t);
	return rc;
}

static double now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Time from a few iterations of the real thing. */
static int estimate(
	struct ct_fit *f, const struct ct_fit_data *d, const struct job *j, struct ct_err *e)
{
	enum { TRIAL = 5 };
	struct ct_env quiet = *j->env;
	size_t all = f->opt.iterations, n = f->g.n, most = f->opt.max_gaussians;
	double each = (double)(sizeof(struct ct_blob) + sizeof(struct ct_dab) + 56 * sizeof(float));
	double fixed = 4.0 * (double)(ct_vol_count(&j->base) + 2 * ct_stack_count(&j->in));
	double start = now(), time;

	quiet.progress = NULL;
	quiet.log = NULL;
	f->save = NULL;
	f->opt.iterations = all < TRIAL ? all : TRIAL;
	if (ct_fit_run(f, d, &quiet, e))
		return -1;
	time = (now() - start) / (double)f->opt.iterations * (double)(n ? all : 1);
	printf("time %.0f s with %zu Gaussians, %.0f s with %zu\n"
	       "memory %.0f MiB\ndisk %.1f MiB, states of %.1f MiB while it runs\n",
		time, n, n ? time * (double)most / (double)n : 0, most,
		(fixed + each * (double)most) / 1048576, 44.0 * (double)most / 1048576,
		144.0 * (double)most / 1048576);
	return 0;
}

static void print_report(const struct ct_fit *f, size_t pos, size_t neg)
{
	printf("gaussians %zu\npositive %zu\nnegative %zu\ngamma %.6g\nfirst-loss %.6g\n"
	       "last-loss %.6g\nerror %.6g\niterations %zu\nended-by %s\n",
		f->g.n, pos, neg, f->g.gamma, f->first_loss, f->last_loss, f->error, f->g.step,
		ct_fit_end_name(f->end));
	for (size_t i = 0; i < f->points; i++)
		printf("error-with %.0f %.6g\n", (double)f->point[i].gaussians,
			(double)f->point[i].error);
}

static int report(const struct ct_fit *f, const struct job *j, struct ct_err *e)
{
	size_t pos, neg;
	json_t *o, *curve = NULL;
	int bad = 0;

	ct_fit_signs(&f->g, &pos, &neg);
	if (!j->env->json) {
		if (strcmp(j->p->out, "-") != 0 && j->env->verbose >= 0)
			print_report(f, pos, neg);
		return 0;
	}
	o = json_pack("{sI sI sI sf sf sf sf sI ss so}", "gaussians", (json_int_t)f->g.n,
		"positive", (json_int_t)pos, "negative", (json_int_t)neg, "gamma", f->g.gamma,
		"first-loss", f->first_loss, "last-loss", f->last_loss, "error", f->error,
		"iterations", (json_int_t)f->g.step, "ended-by", ct_fit_end_name(f->end), "curve",
		curve = json_array());
	for (size_t i = 0; o && i < f->points; i++)
		bad |= json_array_append_new(curve,
			json_pack("{sI sf sI}", "gaussians", (json_int_t)f->point[i].gaussians,
				"error", (double)f->point[i].error, "iteration",
				(json_int_t)f->point[i].iteration));
	if (!o || bad) {
		json_decref(o);
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
	putchar('\n'); /* ct_cli_main checks standard output */
	json_decref(o);
	return 0;
}

static int write_set(struct ct_fit *f, const struct job *j, struct ct_err *e)
{
	const struct ct_meta *const in[] = {
		&j->in.meta, &j->base.meta, j->p->projections ? &j->base_proj.meta : NULL};
	struct ct_meta *m = &f->g.meta;

	if (ct_meta_copy(m, &j->in.meta, e) || ct_window_put(m, j->window, e) ||
		ct_meta_set(m, "quantity", f->opt.full ? "density" : "residual", e) ||
		ct_meta_set(m, "mode", f->opt.full ? "full" : "residual", e) ||
		ct_meta_setf(m, e, "seed", "%llu", (unsigned long long)j->env->seed) ||
		ct_meta_step(m, j->env, 3, in, e))
		return -1;
	return ct_gauss_write(j->p->out, &f->g, j->env, e);
}

static int fit(struct job *j, struct ct_err *e)
{
	const bool full = j->p->mode == 1;
	const struct ct_fit_data d = {&j->in, full ? NULL : &j->base_proj, &j->base};
	struct ct_fit_options o;
	struct ct_fit f = {0};
	int rc = -1;

	if (options(&o, j, e) || name_run(j, &o, e))
		return -1;
	if (ct_fit_init(&f, &o, &d, j->env, e)) {
		ct_blame(e, j->p->base);
		goto out;
	}
	if (j->env->dry_run) {
		rc = estimate(&f, &d, j, e);
		goto out;
	}
	if (j->state) {
		f.save = save;
		f.ctx = j;
		if (j->p->resume && resume(&f, j, e))
			goto out;
	}
	if (ct_fit_run(&f, &d, j->env, e) || write_set(&f, j, e))
		goto out;
	if (j->state)
		remove(j->state);
	rc = report(&f, j, e);
out:
	ct_fit_free(&f);
	return rc;
}

/* Before any work: options that contradict, and outputs that are in the way. */
static int check(struct job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	bool stream = strcmp(p->out, "-") == 0;

	if (!p->base)
		return ct_fail(e, CT_EUSAGE, "--base is missing");
	if (strcmp(p->in, "-") == 0 && strcmp(p->base, "-") == 0)
		return ct_fail(e, CT_EUSAGE, "IN and --base cannot both be standard input");
	if (p->most < p->gaussians)
		return ct_fail(e, CT_EUSAGE, "--max-gaussians %d is below --gaussians %d", p->most,
			p->gaussians);
	if (stream && (p->resume || j->env->json))
		return ct_fail(
			e, CT_EUSAGE, "--%s wants OUT to be a file", p->resume ? "resume" : "json");
	if (j->env->dry_run)
		return 0;
	if (ct_out_check(p->out, j->env, e))
		return -1;
	if (stream)
		return 0;
	if (asprintf(&j->state, "%s.state", p->out) < 0) {
		j->state = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	return p->resume ? 0 : ct_out_check(j->state, j->env, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = params, .env = env};
	int rc = -1;

	if (check(&j, e) == 0 && read_all(&j, e) == 0)
		rc = fit(&j, e);
	ct_stack_free(&j.in);
	ct_stack_free(&j.base_proj);
	ct_vol_free(&j.base);
	free(j.state);
	free(j.run);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-nabgs",
	.brief = "Fit signed 3-D Gaussians to projections, on top of a base volume.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_SEEDED | CT_REPORTS | CT_LONG,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
