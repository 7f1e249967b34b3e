/* ct-field: a neural field fitted to one CT, or to projections: for comparison. */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/cost-report.h"
#include "cli/json.h"
#include "cli/modes.h"
#include "cli/resume.h"
#include "core/memory.h"
#include "field/field-fit.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "estimate/operator.h"
#include "steps/step-reconstruct.h"
#include "tools/lib/evidence-files.h"
#include "tools/lib/geometry-opts.h"
#include "xray/window.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct field_files {
	const char *in, *grid, *factor, *window;
};

struct field_input {
	struct ct_vol lr;      /* density */
	struct ct_stack rays;  /* or, if views > 0, these */
	struct ct_operator is; /* of lr */
	struct ct_vol fine;    /* grid without data: of lr refined, or of the scan */
	struct ct_vol out;     /* grid without data, in the end with them */
	struct ct_vol like;    /* of --grid, for its metadata */
	double window[2];
};

#define SKIPS(X) X(SKIP_APPLY, "apply") X(SKIP_CONCATENATE, "concatenate")
enum { SKIPS(CT_WORD_VALUE) };

struct params {
	struct field_files files;
	const char *out, *network, *loss, *budget;
	int like, samples, encoding, skip, every, batch, count, fine, levels;
	double rate;
	bool resume;
};

static const struct params defaults = {.every = 1000, .rate = NAN};

#define AUTO(X) X(CHOICE_AUTO, "auto")
enum { AUTO(CT_WORD_VALUE) };
#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(files.in, CT_READS, "IN",
		"low-resolution CT in HU: NIfTI, MetaImage or NRRD file, or -; or projections, EXR"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the CT on the finer grid, NIfTI, or -"),
	CT_CHOICE(like, 0, "like", CT_WORDS(CT_FIELD_LIKE_LIST),
		"the published method whose settings are used; auto is ours for a CT, and naf for "
		"projections. Other options override it"),
	CT_CHOICE(samples, 0, "samples", CT_WORDS_TWO(AUTO, CT_SAMPLES_LIST),
		"what a voxel of IN is to the field: its value at a point, rendered from a line or "
		"a cube, or the average by the slice profile and blur of the scanner; rays: IN is "
		"projections. auto is as --like"),
	CT_CHOICE(encoding, 0, "encoding", CT_WORDS_TWO(AUTO, CT_ENCODING_LIST),
		"what the network sees of a position: sines, or features of dense grids or hashed "
		"ones. auto is as --like"),
	CT_TEXT(network, 0, "network", "DxW",
		"hidden layers of the network, and their width (as --like; auto is 2x32)"),
	CT_TEXT(loss, 0, "loss", "l2|adaptive|tv:W",
		"squared error, that of CuNeRF, or with W times the total variation (as --like; "
		"auto is tv:0.005)"),
	CT_TEXT(budget, 'b', "budget", "N|Ns",
		"iterations, or with an s seconds of processor time (as --like; auto is 600)"),
	CT_TEXT(files.factor, 'x', "factor", "S|X,Y,Z",
		"refine every axis S times, or the axes X, Y, Z times; default: the factor that IN "
		"was reduced by",
		CT_WHEN(CT_UNLESS(files.grid))),
	CT_INPUT(files.grid, 0, "grid", "FILE|N",
		"instead the grid of this volume; for projections also N voxels along the longest "
		"side"),
	CT_TEXT(files.window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (what IN says, or -1024:3071)"),
	CT_FLAG(resume, 0, "resume", "continue from OUT.state if it is there", CT_IDLE),
	CT_EXPERT(every, "every", "N", 0, 10000000,
		"iterations between states in OUT.state; 0 writes one only when stopped", CT_IDLE),
	CT_EXPERT(batch, "batch", "N", 0, 1000000,
		"voxels or rays of an iteration, or of profile the voxels of IN along an edge of a "
		"block; 0 is as --like"),
	CT_EXPERT(count, "count", "N", 0, CT_SAMPLES_MOST,
		"samples of a line, a cube or a ray; 0 is as --like"),
	CT_EXPERT(fine, "fine", "N", 0, CT_SAMPLES_MOST,
		"samples that are added where the first ones say; 0 is as --like"),
	CT_EXPERT(levels, "levels", "N", 0, CT_ENCODING_LEVELS, "grids; 0 is as --like"),
	CT_EXPERT(rate, "rate", "X", 0, 1, "rate of learning at first (as --like)"),
	CT_EXPERT_CHOICE(skip, "at-skip", CT_WORDS(SKIPS),
		"of cunerf: concatenate leaves out the layer there, as the authors' program"),
	CT_OPT_END,
};

/* Is IN a stack? By its content; a stream is what `rays` says. */
static int is_stack(bool *stack, const char *in, bool rays, struct ct_err *e)
{
	static const unsigned char exr[4] = {0x76, 0x2f, 0x31, 0x01};
	unsigned char is[4] = {0};
	FILE *f;

	*stack = rays;
	if (strcmp(in, "-") == 0)
		return 0;
	if (ct_io_open(in, &f, e))
		return -1;
	*stack = fread(is, 1, sizeof is, f) == sizeof is && memcmp(is, exr, sizeof is) == 0;
	ct_io_close(f);
	return 0;
}

static int read_stack(struct field_input *i, const struct field_files *f, struct ct_err *e)
{
	struct ct_vol like = {0};
	int voxels, rc;

	if (f->factor)
		return ct_fail(
			e, CT_EUSAGE, "--factor: %s is a stack, whose grid --grid says", f->in);
	rc = ct_evidence_files_stack(&i->rays, f->in, CT_QUANTITY_LINE_INTEGRAL, e) ||
	     ct_geometry_opts_window(i->window, f->window, &i->rays.meta, e) ||
	     ct_geometry_opts_grid(&voxels, &like, f->grid, e) ||
	     ct_step_reconstruct_grid(
		     &i->fine, like.data ? &like : NULL, f->grid, (size_t)voxels, &i->rays, e);
	ct_vol_free(&like);
	i->out = i->fine;
	return rc ? -1 : 0;
}

/* Do the boxes along the world's axes meet? A field says nothing of what lies beyond IN. */
static int meet(const struct ct_vol *a, const struct ct_vol *b, struct ct_err *e)
{
	for (int c = 0; c < 3; c++) {
		double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY}, x[3];

		for (unsigned k = 0; k < 16; k++) {
			ct_vol_corner(k < 8 ? a : b, k % 8, x);
			lo[k / 8] = fmin(lo[k / 8], x[c]);
			hi[k / 8] = fmax(hi[k / 8], x[c]);
		}
		if (!(lo[0] < hi[1] && lo[1] < hi[0]))
			return ct_fail(e, CT_EGEOM,
				"lies beside IN along axis %d: from %g to %g mm, IN from %g to %g mm",
				c, lo[0], hi[0], lo[1], hi[1]);
	}
	return 0;
}

static int find_grids(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_said said = CT_SAID_NOTHING;

	if (f->factor &&
		ct_cli_within("factor", f->factor, 3, true, 1, CT_SAID_TIMES, said.factor, e))
		return -1;
	if (ct_operator_find(&i->is, &said, false, &i->lr, env, e))
		return ct_blame(e, f->in);
	for (int a = 0; a < 3; a++)
		i->fine.n[a] = ct_degrade_cover(i->lr.n[a], i->is.by.factor[a]);
	ct_degrade_refine(
		i->fine.affine, (const double(*)[4])i->lr.affine, i->lr.n, i->is.by.factor);
	i->out = i->fine;
	if (!f->grid)
		return 0;
	if (ct_vol_read(f->grid, &i->like, e))
		return -1;
	memcpy(i->out.n, i->like.n, sizeof i->out.n);
	memcpy(i->out.affine, i->like.affine, sizeof i->out.affine);
	return ct_vol_check_grid(&i->out, e) || meet(&i->out, &i->lr, e) ? ct_blame(e, f->grid) : 0;
}

static int read_volume(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_vol *v = &i->lr;

	if (ct_evidence_files_base(v, f->in, env, e) ||
		ct_geometry_opts_window(i->window, f->window, &v->meta, e) ||
		find_grids(i, f, env, e))
		return -1;
	ct_window_density_open(ct_vol_count(v), v->data, v->data, i->window);
	return 0;
}

static int read_input(struct field_input *i, const struct field_files *f, bool stack,
	const struct ct_env *env, struct ct_err *e)
{
	return stack ? read_stack(i, f, e) : read_volume(i, f, env, e);
}

static void input_free(struct field_input *i)
{
	ct_vol_free(&i->lr);
	ct_stack_free(&i->rays);
	ct_vol_free(&i->fine);
	ct_vol_free(&i->out);
	ct_vol_free(&i->like);
}

/* The densities of OUT become HU, with metadata. */
static int finish(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	const bool rays = i->rays.views > 0;
	const struct ct_meta *const in[] = {
		rays ? &i->rays.meta : &i->lr.meta, i->like.data ? &i->like.meta : NULL};
	struct ct_vol *out = &i->out;
	const size_t n = ct_vol_count(out);

	for (size_t k = 0; k < n; k++)
		out->data[k] = out->data[k] < 0 ? 0 : out->data[k] > 1 ? 1 : out->data[k];
	if (rays ? ct_geometry_opts_volume(out, &i->rays, f->window, false, e)
		 : ct_meta_copy(&out->meta, &i->lr.meta, e) ||
				ct_window_put(&out->meta, i->window, e) ||
				ct_window_volume(out, false, i->window, e) ||
				(i->is.known && ct_degrade_put(&out->meta, &i->is.by, e)) ||
				ct_meta_set(&out->meta, CT_META_UPSAMPLE, "field", e))
		return -1;
	return ct_meta_step(&out->meta, env, 2, in, e);
}

struct field_job {
	const struct params *p;
	const struct ct_env *env;
	struct field_input in;
	struct ct_field_rule rule;
	struct ct_field_data data;
	struct ct_resume resume;
};

static int take_loss(struct ct_field_rule *r, const char *loss, struct ct_err *e)
{
	if (!loss)
		return 0;
	r->adaptive = strcmp(loss, "adaptive") == 0;
	r->tv = 0;
	if (r->adaptive || strcmp(loss, "l2") == 0)
		return 0;
	if (strncmp(loss, "tv:", 3) == 0) {
		if (ct_number_read(&r->tv, loss + 3) && r->tv >= 0 && r->tv <= 1e6)
			return 0;
	}
	return ct_fail(e, CT_EUSAGE, "--loss: %.40s is none of l2, adaptive, tv:W", loss);
}

static int take_budget(struct ct_field_rule *r, const char *budget, struct ct_err *e)
{
	const double most = 1e9;
	const char *end;
	double n;

	if (!budget)
		return 0;
	n = ct_number_begin(budget, &end);
	if (end != budget && n > 0 && n <= most && strcmp(end, "s") == 0) {
		r->seconds = n;
		r->iterations = 0;
		return 0;
	}
	if (end == budget || *end || !(n >= 1 && n <= most) || n != floor(n))
		return ct_fail(e, CT_EUSAGE,
			"--budget: %.40s is neither a number of iterations nor seconds, as 100s",
			budget);
	r->iterations = (size_t)n;
	return 0;
}

static void take_expert(struct ct_field_rule *r, const struct params *p, size_t side)
{
	struct ct_network *net = &r->shape.network;

	r->every = (size_t)p->every;

	if (p->batch)
		r->batch = (size_t)p->batch;
	if (p->count)
		r->samples.n = (size_t)p->count;
	if (p->fine && r->samples.fine)
		r->samples.fine = (size_t)p->fine;
	if (p->levels == 0)
		ct_field_rule_levels(r, side);
	else if (r->shape.encoding.kind != CT_ENCODING_FREQUENCIES)
		r->shape.encoding.levels = (size_t)p->levels;
	if (!isnan(p->rate)) {
		r->rate[1] *= p->rate / r->rate[0];
		r->rate[0] = p->rate;
	}
	if (p->skip == SKIP_CONCATENATE && net->depth > 1)
		net->depth--;
}

/* Voxels across what is fitted: of the scan, or of the grid that its operator begins from. */
static size_t side_of(const struct field_job *j)
{
	const bool fine = j->rule.samples.kind == CT_SAMPLES_PROFILE ||
			  j->rule.samples.kind == CT_SAMPLES_RAYS;
	const size_t *n = fine ? j->in.fine.n : j->in.lr.n;
	size_t most = n[0];

	for (int a = 1; a < 3; a++)
		most = n[a] > most ? n[a] : most;
	return most;
}

static int take_rule(struct field_job *j, bool stack, struct ct_err *e)
{
	const struct params *p = j->p;
	struct ct_field_rule *r = &j->rule;
	size_t net[2];

	ct_field_rule_like(
		r, (enum ct_field_like)p->like, stack ? j->in.rays.views + !j->in.rays.views : 0);
	if (p->samples)
		ct_field_rule_samples(r, (enum ct_samples_kind)(p->samples - 1));
	if (p->encoding)
		ct_field_rule_encoding(r, (enum ct_encoding_kind)(p->encoding - 1));
	if (p->network) {
		if (ct_cli_dims("network", p->network, 2, net, e))
			return -1;
		ct_field_rule_network(r, net[0], net[1]);
	}
	if (take_loss(r, p->loss, e) || take_budget(r, p->budget, e))
		return -1;
	take_expert(r, p, side_of(j));
	return ct_field_rule_check(r, e);
}

/* What IN has to be: its reader would only say that it is something else. */
static int check_kind(const struct field_job *j, bool stack, struct ct_err *e)
{
	const char *kind = CT_WORD(CT_SAMPLES_LIST, j->rule.samples.kind);
	const bool rays = j->rule.samples.kind == CT_SAMPLES_RAYS;

	if (stack && !rays)
		return ct_fail(e, CT_EINPUT,
			"%s: a stack of projections, but samples '%s' need a CT", j->p->files.in,
			kind);
	if (!stack && rays)
		return ct_fail(e, CT_EINPUT,
			"%s: not a stack of projections (EXR), which samples 'rays' need",
			j->p->files.in);
	return 0;
}

static int read_all(struct field_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	const bool asks = p->samples ? p->samples - 1 == CT_SAMPLES_RAYS
				     : p->like == CT_FIELD_LIKE_NAF || p->like == CT_FIELD_LIKE_SAX;
	struct ct_field_data *d = &j->data;
	bool stack;

	if (is_stack(&stack, p->files.in, asks, e) || take_rule(j, stack, e) ||
		check_kind(j, stack, e) || read_input(&j->in, &p->files, stack, j->env, e) ||
		take_rule(j, stack, e))
		return -1;
	d->lr = stack ? NULL : &j->in.lr;
	d->rays = stack ? &j->in.rays : NULL;
	d->fine = &j->in.fine;
	d->by = &j->in.is.by;
	ct_field_data_box(d, &j->in.fine);
	if (j->rule.samples.kind == CT_SAMPLES_PROFILE && !j->in.is.known)
		return ct_fail(e, CT_EINPUT,
			"%s: does not say how it was made (key \"sigma\" of ct-degrade): use "
			"--samples points",
			p->files.in);
	return 0;
}

/* Before the work: will there be enough memory? */
static int check_memory(struct field_job *j, struct ct_cost *cost, struct ct_err *e)
{
	const double mib = 1048576, voxels = (double)j->in.out.n[0] * (double)j->in.out.n[1] *
					     (double)j->in.out.n[2];
	const double free = ct_memory_free("");
	double need;

	if (ct_field_fit_bytes(
		    &need, &cost->state, &j->rule, &j->data, ct_par_threads(j->env->par), e))
		return ct_blame(e, j->p->files.in);
	need += 4 * voxels + cost->state; /* which is packed before it is written */
	cost->memory = ct_memory_held() + need;
	cost->disk = 4 * voxels;
	if (free > 0 && need > free)
		return ct_fail(e, CT_ENOMEM, "%s: takes %.0f MiB of memory, and %.0f MiB are free",
			j->p->files.in, ceil(need / mib), floor(free / mib));
	return 0;
}

static int pack(struct ct_tensors *t, const void *fit, struct ct_err *e)
{
	return ct_field_fit_pack(t, fit, e);
}

static int save_state(void *run, const struct ct_field_fit *f, struct ct_err *e)
{
	return ct_resume_save(run, pack, f, e);
}

static int unpack(void *fit, const struct ct_tensors *t, struct ct_err *e)
{
	return ct_field_fit_unpack(fit, t, e);
}

static int report(const struct ct_field_fit *f, bool json, struct ct_err *e)
{
	const size_t weights = f->pass[0].field->count * ct_samples_passes(&f->rule.samples);

	return ct_json_report(
		json_pack("{sI sI sf sf}", "weights", (json_int_t)weights, "iterations",
			(json_int_t)f->step, "first-loss", f->first, "last-loss", f->last),
		json, e);
}

static int evaluate(struct field_job *j, struct ct_field_fit *f, struct ct_err *e)
{
	struct ct_vol *out = &j->in.out;
	const struct ct_vol grid = *out;

	return ct_vol_like(out, &grid, e) || ct_field_fit_volume(out, f, &j->data, j->env, e) ||
			       finish(&j->in, &j->p->files, j->env, e)
		       ? -1
		       : 0;
}

static int fit(struct field_job *j, struct ct_field_fit *f, struct ct_err *e)
{
	const bool kept = j->resume.path != NULL;
	int rc;

	if (kept) {
		f->save = save_state;
		f->ctx = &j->resume;
		rc = ct_resume_load(&j->resume, unpack, f, e);
		if (rc < 0)
			return -1;
		if (rc == 0)
			ct_log(j->env, CT_INFO, "%s: continuing after iteration %zu",
				j->resume.path, f->step);
	}
	if (ct_field_fit_run(f, &j->data, j->env, e))
		return -1;
	if (evaluate(j, f, e)) {
		struct ct_err other;

		return e->code == CT_ESTOP && ct_resume_save(&j->resume, pack, f, &other)
			       ? (*e = other, -1)
			       : -1;
	}
	if (ct_vol_write(j->p->out, &j->in.out, j->env, e))
		return ct_resume_rescue(&j->resume, pack, f, e);
	ct_resume_done(&j->resume);
	return j->env->command->json || (kept && j->env->verbose >= 0)
		       ? report(f, j->env->command->json, e)
		       : 0;
}

static int work(struct field_job *j, struct ct_err *e)
{
	struct ct_field_fit f = {0};
	struct ct_cost cost = {0};
	int rc = -1;

	if (check_memory(j, &cost, e))
		return -1;
	if (ct_resume_input(&j->resume, "IN", j->data.lr ? &j->in.lr.meta : &j->in.rays.meta, e) ||
		ct_resume_input(&j->resume, "--grid", &j->in.like.meta, e))
		return -1;
	if (ct_field_fit_init(&f, &j->rule, &j->data, j->env, e)) {
		ct_blame(e, j->p->files.in);
		goto out;
	}
	if (!j->env->command->dry_run)
		rc = fit(j, &f, e);
	else if (ct_field_fit_cost(&cost, &f, &j->data, &j->in.out, j->env, e) == 0)
		rc = ct_cost_print(&cost, j->env, e);
out:
	ct_field_fit_free(&f);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct field_job j = {.p = p, .env = env};
	int rc = -1;

	if (ct_resume_open(&j.resume, p->out, p->resume, opts, p, env, e) == 0 &&
		read_all(&j, e) == 0)
		rc = work(&j, e);
	input_free(&j.in);
	ct_resume_close(&j.resume);
	return rc;
}

CT_CLI_MAIN("ct-field", "Fit a neural field to a CT or to projections, for comparison.",
	CT_SEEDED | CT_REPORTS | CT_LONG | CT_IN_HU)
