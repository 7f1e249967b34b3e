/* ct-train: a diffusion prior from projections or radiographs. */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost.h"
#include "cli/resume.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "core/mem.h"
#include "formats/format.h"
#include "formats/io.h"
#include "diffusion/prior.h"
#include "diffusion/train.h"
#include "tools/train-data.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct params {
	const char *out;
	struct ct_list data;
	const char *arch, *scales, *validate, *licence;
	int patch, batch, steps, warmup, validate_every, validate_pieces, checkpoint_every,
		log_every;
	double lr, decay, ema, clip, minutes;
	bool cosine, no_flip, flip_vertical, resume, half;
};

static const struct params defaults = {
	.scales = "1",
	.patch = 64,
	.batch = 16,
	.steps = 10000,
	.validate_every = 500,
	.validate_pieces = 64,
	.checkpoint_every = 1000,
	.log_every = 50,
	.lr = 1e-4,
	.ema = 0.9999,
};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, out, CT_REWRITES, "OUT",
		"the prior (safetensors), its state beside it in OUT.state"),
	CT_ARG(struct params, data, CT_READS, "DATA",
		"EXR stacks, pictures (PNG, TIFF), folders of them"),
	CT_OPT(struct params, arch, 'a', "arch", "KEY=VALUE,...", 0, 0,
		"shape of the network: model_channels=32, channel_mult=1:2:3:4, num_res_blocks=1, "
		"attention_resolutions=8 (downsampling factors), in_channels, out_channels and "
		"more"),
	CT_OPT(struct params, patch, 'p', "patch", "N", 4, 4096, "train on pieces of N x N pixels"),
	CT_OPT(struct params, scales, 0, "scales", "A,B,...", 0, 0,
		"cut pieces from pictures reduced A, B, ... times, at random"),
	CT_OPT(struct params, no_flip, 0, "no-flip", NULL, 0, 0,
		"do not mirror left-right at random"),
	CT_OPT(struct params, flip_vertical, 0, "flip-vertical", NULL, 0, 0,
		"mirror top-bottom at random, too"),
	CT_OPT(struct params, batch, 'b', "batch", "N", 1, 65536, "pieces a step"),
	CT_OPT_IDLE(struct params, steps, 'n', "steps", "N", 0, 2e9, "stop after N steps in all"),
	CT_OPT_IDLE(struct params, minutes, 'm', "minutes", "M", 0, 1e6,
		"stop after M minutes, with what there is; 0 does not"),
	CT_OPT(struct params, lr, 'l', "lr", "X", 0, 1, "learning rate"),
	CT_OPT(struct params, warmup, 0, "warmup", "N", 0, 1e9, "raise it from 0 over N steps"),
	CT_OPT(struct params, cosine, 0, "cosine", NULL, 0, 0,
		"lower it to 0 at the last step along a half cosine"),
	CT_OPT(struct params, decay, 0, "decay", "X", 0, 10, "weight decay of AdamW"),
	CT_OPT(struct params, clip, 0, "clip", "X", 0, 1e9,
		"limit the norm of the gradient; 0: any"),
	CT_OPT(struct params, ema, 'e', "ema", "X", 0, 0.9999999,
		"rate of the running average of the weights, which is the prior: the smaller of X "
		"and "
		"(1 + step)/(10 + step)"),
	CT_INPUT_IDLE(struct params, validate, 0, "validate", "DATA",
		"also tell the loss on pictures that are not trained on"),
	CT_OPT_IDLE(struct params, validate_every, 0, "validate-every", "N", 1, 2e9,
		"every N steps", CT_WHEN(CT_IF(struct params, validate))),
	CT_OPT_IDLE(struct params, validate_pieces, 0, "validate-pieces", "N", 1, 65536,
		"on N pieces", CT_WHEN(CT_IF(struct params, validate))),
	CT_OPT_IDLE(struct params, resume, 'r', "resume", NULL, 0, 0,
		"go on from OUT.state, as if there had been no interruption"),
	CT_OPT_IDLE(struct params, checkpoint_every, 0, "checkpoint-every", "N", 1, 2e9,
		"write OUT and OUT.state every N steps", CT_WHEN(CT_IF_FILE(struct params, out))),
	CT_OPT_IDLE(struct params, log_every, 0, "log-every", "N", 1, 2e9,
		"tell the loss every N steps"),
	CT_OPT_IDLE(struct params, half, 0, "half", NULL, 0, 0, "write OUT in half precision"),
	CT_OPT_IDLE(struct params, licence, 0, "licence", "TEXT", 0, 0,
		"licence of the prior, for its metadata"),
	CT_OPT_END,
};

/* A run of the command: what is trained, on what, and where it goes. */
struct job {
	const struct params *p;
	struct ct_env env;
	struct ct_unet_arch arch;
	struct ct_train_opts opts;
	struct ct_pictures data, held;
	struct ct_meta *input; /* one a DATA */
	char *dataset;         /* names and hashes */
	struct ct_resume resume;
	struct ct_train *train;
	double start, told; /* seconds */
	double loss;        /* summed since the last word */
	size_t losses;
};

static int parse_arch(struct ct_unet_arch *a, const char *text, struct ct_err *e)
{
	while (text && *text) {
		size_t len = strcspn(text, ",");
		char item[200], *value;
		int rc;

		if (len >= sizeof item)
			return ct_fail(e, CT_EUSAGE, "--arch: an item is too long");
		memcpy(item, text, len);
		item[len] = '\0';
		text += len + (text[len] == ',');
		value = strchr(item, '=');
		if (!value)
			return ct_fail(e, CT_EUSAGE, "--arch: \"%s\" is not KEY=VALUE", item);
		*value++ = '\0';
		rc = ct_unet_arch_set(a, item, value, e);
		if (rc > 0)
			return ct_fail(e, CT_EUSAGE, "--arch: there is no \"%s\"", item);
		if (rc)
			return -1;
	}
	return ct_unet_arch_check(a, e);
}

static int parse_scales(struct ct_patches *p, const char *text, struct ct_err *e)
{
	p->scales = 0;
	while (p->scales < 8) {
		char *end;
		unsigned long v = strtoul(text, &end, 10);

		if (end == text || v < 1 || v > 64)
			break;
		p->scale[p->scales++] = v;
		if (!*end)
			return 0;
		if (*end != ',')
			break;
		text = end + 1;
	}
	return ct_fail(e, CT_EUSAGE, "--scales: up to 8 whole numbers from 1 to 64, with commas");
}

static int settle(struct job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	struct ct_train_opts *o = &j->opts;

	ct_unet_arch_default(&j->arch);
	j->arch.image_size = (size_t)p->patch;
	ct_train_default(o);
	if (parse_arch(&j->arch, p->arch, e) || parse_scales(&o->patches, p->scales, e))
		return -1;
	o->patches.size = (size_t)p->patch;
	o->patches.channels = j->arch.in_channels;
	o->patches.flip_h = !p->no_flip;
	o->patches.flip_v = p->flip_vertical;
	o->adam.lr = p->lr;
	o->adam.decay = p->decay;
	o->batch = (size_t)p->batch;
	o->steps = (uint64_t)p->steps;
	o->warmup = (uint64_t)p->warmup;
	o->cosine = p->cosine;
	o->ema = p->ema;
	o->clip = p->clip;
	o->seed = j->env.seed;
	return 0;
}

/* The pictures, and "NAME hash; NAME hash" of them. */
static int read_data(struct job *j, struct ct_err *e)
{
	const struct ct_list *d = &j->p->data;
	struct ct_meta held = {0};
	size_t size = 0, used = 0;
	int rc;

	if (ct_alloc0(&j->input, d->n, sizeof *j->input, e))
		return -1;
	for (size_t i = 0; i < d->n; i++) {
		if (train_data_read(&j->data, d->v[i], &j->input[i], e))
			return -1;
		size += strlen(ct_meta_get(&j->input[i], CT_META_INPUT)) + 2;
	}
	if (ct_alloc0(&j->dataset, size + 1, 1, e))
		return -1;
	for (size_t i = 0; i < d->n; i++)
		used += (size_t)snprintf(j->dataset + used, size + 1 - used, "%s%s", i ? "; " : "",
			ct_meta_get(&j->input[i], CT_META_INPUT));
	if (!j->p->validate)
		return 0;
	rc = train_data_read(&j->held, j->p->validate, &held, e);
	ct_meta_free(&held);
	return rc ? rc : ct_patches_check(&j->opts.patches, &j->held, j->p->validate, e);
}

static int write_prior(const struct job *j, struct ct_err *e)
{
	const size_t n = j->p->data.n;
	const struct ct_meta **in = NULL;
	struct ct_tensors w = {0};
	int rc = -1;

	if (ct_alloc(&in, n, sizeof(struct ct_meta *), e))
		return -1;
	for (size_t i = 0; i < n; i++)
		in[i] = &j->input[i];
	if (ct_train_result(j->train, &w, e) ||
		ct_meta_set(&w.meta, CT_META_INTENSITY_MAP, CT_PRIOR_MAP, e) ||
		ct_meta_set(&w.meta, CT_META_DATASET, j->dataset, e) ||
		(j->p->licence && ct_meta_set(&w.meta, CT_META_LICENCE, j->p->licence, e)) ||
		ct_meta_step(&w.meta, &j->env, n, in, e))
		goto out;
	rc = ct_tensors_write(j->p->out, &w, j->p->half, &j->env, e);
out:
	ct_tensors_free(&w);
	free(in);
	return rc;
}

static int pack(struct ct_tensors *w, const void *training, struct ct_err *e)
{
	return ct_train_save(training, w, e);
}

static int checkpoint(struct job *j, struct ct_err *e)
{
	int rc;

	ct_stop_defer(true);
	rc = ct_resume_save(&j->resume, pack, j->train, e) || write_prior(j, e) ? -1 : 0;
	ct_stop_defer(false);
	return rc;
}

/* The last checkpoint: where one of the two files cannot be written, the other one is. */
static int finish(struct job *j, struct ct_err *e)
{
	struct ct_err why;
	int kept, rc;

	ct_stop_defer(true);
	kept = ct_resume_save(&j->resume, pack, j->train, &why);
	rc = write_prior(j, e);
	if (rc)
		ct_resume_rescue(&j->resume, pack, j->train, e);
	else if (kept)
		*e = why;
	ct_stop_defer(false);
	return rc || kept ? -1 : 0;
}

/* What the course of the training depends on besides the options; how far it goes changes the rate
 * of learning only if that falls to the end. */
static int name_run(struct job *j, struct ct_err *e)
{
	for (size_t i = 0; i < j->p->data.n; i++) {
		char name[40];

		snprintf(name, sizeof name, "DATA %zu", i + 1);
		if (ct_resume_input(&j->resume, name, &j->input[i], e))
			return -1;
	}
	return j->p->cosine ? ct_resume_value(&j->resume, e, "--steps", "%d", j->p->steps) : 0;
}

static int load_state(struct job *j, const struct ct_env *asked, struct ct_err *e)
{
	struct ct_tensors w = {0};
	int rc = ct_resume_load(&j->resume, &w, e);

	if (rc > 0 && j->p->resume && !asked->dry_run &&
		ct_out_check(j->p->out, asked, e)) /* OUT is another's */
		rc = -1;
	if (rc == 0 && ct_train_restore(j->train, &w, e))
		rc = ct_blame(e, j->resume.path);
	ct_tensors_free(&w);
	return rc < 0 ? -1 : 0;
}

/* The words after a step: the loss, and the one on held-out pictures, when it is time. */
static int tell(struct job *j, double loss, struct ct_err *e)
{
	const unsigned long long step = ct_train_steps(j->train);
	const bool last = step == j->opts.steps;
	double held;

	j->loss += loss;
	j->losses++;
	if (step % (unsigned)j->p->log_every == 0 || last) {
		ct_log(&j->env, CT_INFO, "step %llu: loss %.5f, %.2f s a step", step,
			j->loss / (double)j->losses,
			(ct_clock_wall() - j->told) / (double)j->losses);
		j->loss = 0;
		j->losses = 0;
		j->told = ct_clock_wall();
	}
	if (j->held.n && (step % (unsigned)j->p->validate_every == 0 || last)) {
		if (ct_train_validate(j->train, &j->held, (size_t)j->p->validate_pieces, &held, e))
			return -1;
		ct_log(&j->env, CT_INFO, "step %llu: held-out loss %.5f", step, held);
		j->told = ct_clock_wall();
	}
	return 0;
}

static int train(struct job *j, struct ct_err *e)
{
	const uint64_t every = (uint64_t)j->p->checkpoint_every;
	double loss;

	while (ct_train_steps(j->train) < j->opts.steps && !ct_stopping(&j->env)) {
		if (j->p->minutes > 0 && ct_clock_wall() - j->start > 60 * j->p->minutes)
			break;
		if (ct_train_step(j->train, &loss, e) || tell(j, loss, e)) {
			if (e->code != CT_ESTOP)
				return -1;
			break; /* one that is given up has changed nothing */
		}
		ct_progress(&j->env, "training", ct_train_steps(j->train), j->opts.steps);
		if (j->resume.path && ct_train_steps(j->train) % every == 0 && checkpoint(j, e))
			return -1;
	}
	if (finish(j, e))
		return -1;
	return ct_check_stop(&j->env, e);
}

/* What it would take; the time from two steps. */
static int estimate(struct job *j, struct ct_err *e)
{
	struct ct_cost cost = {0};
	double flops, loss, t;
	size_t n;

	if (ct_unet_param_count(&j->arch, &n, e) ||
		ct_unet_flops(&j->arch, j->opts.patches.size, j->opts.patches.size, &flops, e) ||
		ct_train_step(j->train, &loss, e))
		return -1;
	t = ct_clock_wall();
	if (ct_train_step(j->train, &loss, e))
		return -1;
	t = ct_clock_wall() - t;
	cost.seconds = t * j->p->steps;
	cost.memory = ct_train_bytes(j->train);
	cost.disk = (double)n * (j->p->half ? 2 : 4);
	cost.state = (double)n * 16;
	snprintf(cost.work, sizeof cost.work,
		"%d steps of %.2f s and %.1f GFLOP on %zu pictures, %zu parameters", j->p->steps, t,
		3e-9 * flops * (double)j->opts.batch, j->data.n, n);
	return ct_cost_print(&cost, &j->env, e);
}

static int prepare(struct job *j, const struct ct_env *asked, struct ct_err *e)
{
	const struct params *p = j->p;

	if (ct_resume_open(&j->resume, p->out, p->resume, opts, p, &j->env, e))
		return -1;
	j->env.force = true; /* its own files, from now on */
	if (settle(j, e) || read_data(j, e) ||
		ct_train_alloc(&j->train, &j->arch, &j->opts, &j->data, &j->env, e))
		return -1;
	return name_run(j, e) || load_state(j, asked, e) ? -1 : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = params, .env = *env, .start = ct_clock_wall()};
	int rc;

	j.env.verbose++; /* the losses are news even without -v */
	rc = prepare(&j, env, e);
	j.told = ct_clock_wall();
	if (!rc)
		rc = env->dry_run ? estimate(&j, e) : train(&j, e);
	ct_train_free(j.train);
	ct_pictures_free(&j.data);
	ct_pictures_free(&j.held);
	for (size_t i = 0; j.input && i < j.p->data.n; i++)
		ct_meta_free(&j.input[i]);
	free(j.input);
	free(j.dataset);
	ct_resume_close(&j.resume);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-train",
	.brief = "Train a diffusion prior on projections or radiographs.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_SEEDED | CT_LONG,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
