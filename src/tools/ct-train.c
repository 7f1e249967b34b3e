/* ct-train: trains a prior of pictures, or of the slices or volumes of CTs, or a network that makes
 * projections finer. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "core/mem.h"
#include "tools/lib/prior-opts.h"
#include "tools/train-loop.h"
#include "train/data.h"
#include "xray/window.h"

#include <libgen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct train_params defaults = {
	.scales = "1",
	.steps = 10000,
	.validate_every = 500,
	.validate_pieces = 64,
	.checkpoint_every = 1000,
	.log_every = 50,
	.lr = (double)NAN,
	.decay = (double)NAN,
	.ema = (double)NAN,
	.factor = 4,
	.cubes = 8,
	.cube = 96,
	.depth = 3,
	.width = 512,
	.hidden = 2,
	.slices = 1,
	.noise = 30,
};

#define CT_PARAMS struct train_params
#define WITH(kinds) CT_WHEN(CT_IF_WORD(kind, kinds))
#define SLICES WITH(CT_BIT(TRAIN_SLICES))
#define CTS WITH(CT_BIT(TRAIN_SLICES) | CT_BIT(TRAIN_VOLUMES))
#define IMAGES WITH(CT_BIT(TRAIN_PICTURES) | CT_BIT(TRAIN_SUPERRES))
#define NETWORK WITH(CT_BIT(TRAIN_PICTURES) | CT_BIT(TRAIN_SUPERRES) | CT_BIT(TRAIN_VOLUMES))

static const struct ct_opt opts[] = {
	CT_ARG_OUT(out, CT_REWRITES, "OUT", CT_ENDS_TENSORS,
		"the prior (safetensors); its training state is OUT.state"),
	CT_ARG(data, CT_READS, "DATA",
		"EXR projections, pictures, CTs (slices, volumes), or folders of them"),
	CT_CHOICE(kind, 'k', "kind", CT_WORDS(TRAIN_KIND_LIST),
		"what the prior is of: pictures or projections, CT slices or volumes; superres: a "
		"network that makes projections finer in one step"),
	CT_OPT(factor, 'x', "factor", "S", 2, 8,
		"train for low-resolution voxels or pixels that are S long",
		WITH(CT_BIT(TRAIN_SLICES) | CT_BIT(TRAIN_SUPERRES))),
	CT_TEXT(arch, 'a', "arch", "KEY=VALUE,...",
		"set the network: model_channels=32, channel_mult=1:2:3:4, num_res_blocks=1, "
		"attention_resolutions=8, in_channels, out_channels and more; of superres net=rdn "
		"or omni, blocks, layers, features, growth, window, num_heads; of volumes features, "
		"blocks, layers, growth, out, width",
		NETWORK),
	CT_OPT(patch, 'p', "patch", "N", 4, 4096,
		"train on pieces of N x N pixels (default: 64; for slices three times the factor; "
		"for superres 32 times; for volumes 10: cubes of low-resolution voxels)"),
	CT_EXPERT(batch, "batch", "N", 1, 65536,
		"use N pieces in a step (default: 16; for slices 1024, for volumes 15)"),
	CT_OPT(steps, 'n', "steps", "N", 0, 2e9, "stop after N steps in all", CT_IDLE),
	CT_OPT(minutes, 'm', "minutes", "M", 0, 1e6, "stop after M minutes; 0 sets no limit",
		CT_IDLE),
	CT_EXPERT(lr, "lr", "X", 0, 1,
		"learning rate (default: 1e-4; of net=omni 5e-4; for slices 1e-3)"),
	CT_EXPERT(ema, "ema", "X", 0, 0.999999,
		"rate of the running average of the weights, which is the prior (default: 0.9999; "
		"for slices and volumes 0.999)"),
	CT_INPUT_IDLE(
		validate, 0, "validate", "DATA", "report the loss on data that are not trained on"),
	CT_OPT(patience, 0, "patience", "N", 0, 1e6,
		"write the best weights; stop after N validations without a gain (0: never)",
		CT_WHEN(CT_IF(validate)), CT_IDLE),
	CT_FLAG(resume, 'r', "resume",
		"continue from OUT.state, with the same bytes as without the interruption",
		CT_IDLE),
	CT_OPT(checkpoint_every, 0, "checkpoint-every", "N", 1, 2e9,
		"write OUT and OUT.state every N steps", CT_WHEN(CT_IF_FILE(out)), CT_IDLE),
	CT_FLAG(half, 0, "half", "write OUT in half precision", CT_IDLE),
	CT_TEXT(licence, 0, "licence", "TEXT", "write the licence of the prior into its metadata",
		CT_IDLE),
	CT_TEXT(bytes, 0, "bytes", "A:B", "map volumes of bytes to HU: 0 is A HU, 255 is B HU",
		CTS),
	CT_INPUT_IDLE(with, 0, "with", "FILE",
		"also write the networks of this slice prior, for other factors, to OUT", SLICES),
	CT_TEXT(cache, 0, "cache", "DIR",
		"keep the training examples in the folder DIR, for the next training", SLICES,
		CT_IDLE),
	CT_EXPERT(thick, "thick", "yes", 0, 0, "thick slices: low resolution along one axis only",
		SLICES),
	CT_EXPERT(again, "again", "yes", 0, 0,
		"train for the second pass, after the networks of --with", CT_WHEN(CT_IF(with))),
	CT_EXPERT(cubes, "cubes", "N", 1, 100000, "make N examples of each CT", SLICES),
	CT_EXPERT(cube, "cube", "N", 24, 512, "examples have at most N voxels a side", SLICES),
	CT_EXPERT(noise, "noise", "HU", 0, 1000, "add noise of up to HU to half of the examples",
		SLICES),
	CT_EXPERT(window, "window", "LO:HI", 0, 0,
		"clip half of the examples to LO:HI HU; for volumes all (default: -1024:3071)",
		CTS),
	CT_EXPERT(depth, "depth", "N", 1, 8,
		"slices of a patch: so many as of a cell, and an even number more", SLICES),
	CT_EXPERT(slices, "slices", "N", 1, 4, "slices of a cell", SLICES),
	CT_EXPERT(components, "components", "N", 1, 4096,
		"principal components of a patch (default: at most 160)", SLICES),
	CT_EXPERT(width, "width", "N", 1, 8192, "neurons of a hidden layer", SLICES),
	CT_EXPERT(hidden, "hidden", "N", 2, 2 + CT_SLICE_NETWORK_MORE, "hidden layers", SLICES),
	CT_EXPERT(scales, "scales", "A,B,...", 0, 0,
		"cut pieces from pictures reduced A, B, ... times, at random", IMAGES),
	CT_EXPERT(warmup, "warmup", "N", 0, 1e9, "raise the learning rate from 0 over N steps",
		IMAGES),
	CT_EXPERT(cosine, "cosine", "yes", 0, 0, "lower the learning rate to 0 along a half cosine",
		NETWORK),
	CT_EXPERT(
		decay, "decay", "X", 0, 10, "weight decay of AdamW (default: 0; for slices 0.01)"),
	CT_EXPERT(
		clip, "clip", "X", 0, 1e9, "limit the norm of the gradient (0: no limit)", IMAGES),
	CT_EXPERT(validate_every, "validate-every", "N", 1, 2e9, "validate every N steps",
		CT_WHEN(CT_IF(validate)), CT_IDLE),
	CT_EXPERT(validate_pieces, "validate-pieces", "N", 1, 65536, "validate on N pieces",
		CT_WHEN(CT_IF(validate)), CT_IDLE),
	CT_EXPERT(log_every, "log-every", "N", 1, 2e9, "report the loss every N steps", CT_IDLE),
	CT_OPT_END,
};

/* A network of super-resolution is of the kind superres, an RDN unless said. */
static int parse_net(struct ct_unet_arch *a, const struct train_params *p, const struct ct_meta *m,
	struct ct_err *e)
{
	const bool superres = p->kind == TRAIN_SUPERRES;
	const char *net = ct_meta_get(m, CT_META_NET);

	if (ct_meta_get(m, CT_META_FACTOR))
		return ct_fail(e, CT_EUSAGE, "--arch factor: the option --factor states it");
	if (ct_unet_arch_set(a, CT_META_NET, net ? net : superres ? "rdn" : "unet", e))
		return -1;
	if ((a->net != CT_NET_UNET) != superres)
		return ct_fail(e, CT_EUSAGE, "--arch net=%s: not with --kind %s", net,
			CT_WORD(TRAIN_KIND_LIST, p->kind));
	if (superres)
		a->factor = (size_t)p->factor;
	return prior_arch_set(a, m, e);
}

static int parse_arch(struct ct_unet_arch *a, const struct train_params *p, struct ct_err *e)
{
	struct ct_meta m = {0};
	int rc = ct_err_any(prior_arch_parse(&m, p->arch, e) || parse_net(a, p, &m, e));

	ct_meta_free(&m);
	if (rc == 0 && a->num_classes)
		return ct_fail(e, CT_EUSAGE,
			"--arch num_classes: the training has no classes: leave it out");
	return rc;
}

static int parse_scales(struct ct_patches *p, const char *text, struct ct_err *e)
{
	p->scales = 0;
	while (p->scales < 8) {
		const char *end;
		const double v = ct_number_begin(text, &end);

		if (!(v >= 1 && v <= 64) || v != floor(v))
			break;
		p->scale[p->scales++] = (size_t)v;
		if (!*end)
			return 0;
		if (*end != ',')
			break;
		text = end + 1;
	}
	return ct_fail(e, CT_EUSAGE,
		"--expert scales: expected up to 8 whole numbers from 1 to 64, with commas");
}

static struct train_files files_of(const struct train_params *p)
{
	return (struct train_files){p->data.n, p->data.v, p->validate};
}

static int begin_pictures(struct train_subject *s, struct train_data *data,
	struct train_pictures_rule *r, const struct train_params *p, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_train_opts *o = &r->opts;

	*r = (struct train_pictures_rule){
		.files = files_of(p), .pieces = (size_t)p->validate_pieces, .half = p->half};
	ct_unet_arch_default(&r->arch);
	r->arch.image_size = p->patch ? (size_t)p->patch : 64;
	ct_train_default(o);
	if (parse_arch(&r->arch, p, e) || parse_scales(&o->patches, p->scales, e))
		return -1;
	o->patches.size = r->arch.image_size;
	if (p->kind == TRAIN_SUPERRES)
		o->patches.size = p->patch ? (size_t)p->patch : 32 * r->arch.factor;
	o->patches.channels = r->arch.in_channels;
	o->adam.lr = !isnan(p->lr) ? p->lr : r->arch.net == CT_NET_OMNI ? 5e-4 : 1e-4;
	o->adam.decay = isnan(p->decay) ? 0 : p->decay;
	o->batch = p->batch ? (size_t)p->batch : 16;
	o->steps = (uint64_t)p->steps;
	o->warmup = (uint64_t)p->warmup;
	o->cosine = p->cosine;
	o->ema = isnan(p->ema) ? 0.9999 : p->ema;
	o->clip = p->clip;
	o->seed = env->seed;
	return train_pictures(s, data, r, env, e);
}

static int begin_slices(struct train_subject *s, struct train_data *data,
	struct train_slices_rule *r, const struct train_params *p, const struct ct_env *env,
	struct ct_err *e)
{
	*r = (struct train_slices_rule){.files = files_of(p),
		.with = p->with,
		.cache = p->cache,
		.again = p->again,
		.half = p->half,
		.cubes = (size_t)p->cubes,
		.bytes = {(double)NAN},
		.examples = {.side = (size_t)p->cube,
			.factor = (size_t)p->factor,
			.thick = p->thick,
			.scale = {1.1, 2.3},
			.noise = p->noise,
			.clip = {(double)NAN, (double)NAN},
			.seed = env->seed},
		.network = {.shape = {(size_t)p->factor,
				    p->patch ? (size_t)p->patch : 3 * (size_t)p->factor,
				    (size_t)p->depth, (size_t)p->slices, !p->thick},
			.components = (size_t)p->components,
			.width = (size_t)p->width,
			.more = (size_t)p->hidden - 2},
		.learn = {.seed = env->seed,
			.steps = (uint64_t)p->steps,
			.batch = p->batch ? (size_t)p->batch : 4 * CT_LEARN_PIECE,
			.rate = isnan(p->lr) ? 1e-3 : p->lr,
			.decay = isnan(p->decay) ? 1e-2 : p->decay,
			.average = isnan(p->ema) ? 0.999 : p->ema}};
	if (p->components == 0) {
		const size_t all = ct_patch_count(&r->network.shape);

		r->network.components = all < 160 ? all : 160;
	}
	if ((p->bytes && ct_cli_numbers("bytes", p->bytes, ':', 2, false, r->bytes, e)) ||
		(p->window && ct_cli_range("expert window", p->window, r->examples.clip, e)))
		return -1;
	if (r->learn.batch % CT_LEARN_PIECE)
		return ct_fail(
			e, CT_EUSAGE, "--expert batch: expected a multiple of %d", CT_LEARN_PIECE);
	return train_slices(s, data, r, env, e);
}

static int parse_shape(struct ct_arssr_shape *s, const char *text, struct ct_err *e)
{
	struct ct_meta m = {0};
	int rc = prior_arch_parse(&m, text, e);

	for (size_t i = 0; i < m.n && rc == 0; i++) {
		rc = ct_arssr_shape_set(s, m.pair[i].key, m.pair[i].value, e);
		if (rc > 0)
			ct_fail(e, CT_EUSAGE, "there is no \"%s\"", m.pair[i].key);
		if (rc)
			ct_blame(e, "--arch");
	}
	ct_meta_free(&m);
	return rc ? -1 : 0;
}

static int begin_volumes(struct train_subject *s, struct train_data *data,
	struct train_volumes_rule *r, const struct train_params *p, const struct ct_env *env,
	struct ct_err *e)
{
	*r = (struct train_volumes_rule){.files = files_of(p),
		.pieces = (size_t)p->validate_pieces,
		.half = p->half,
		.bytes = {(double)NAN},
		.network = {.shape = CT_ARSSR_PUBLISHED, .window = {-1024, 3071}},
		.train = {.piece = {.seed = env->seed,
				  .side = p->patch ? (size_t)p->patch : CT_ARSSR_PIECE_SIDE,
				  .factor = CT_ARSSR_PIECE_FACTORS},
			.steps = (uint64_t)p->steps,
			.batch = p->batch ? (size_t)p->batch : CT_ARSSR_TRAIN_BATCH,
			.rate = isnan(p->lr) ? 1e-4 : p->lr,
			.decay = isnan(p->decay) ? 0 : p->decay,
			.average = isnan(p->ema) ? 0.999 : p->ema,
			.cosine = p->cosine}};
	if (parse_shape(&r->network.shape, p->arch, e) ||
		(p->bytes && ct_cli_numbers("bytes", p->bytes, ':', 2, false, r->bytes, e)) ||
		(p->window && ct_cli_range("expert window", p->window, r->network.window, e)))
		return -1;
	if (!ct_window_is(r->network.window))
		return ct_fail(
			e, CT_EUSAGE, "--expert window: float32 does not hold %s", p->window);
	return train_volumes(s, data, r, env, e);
}

/* Is nothing written among the data, which are folders? */
static int apart(const struct train_params *p, const struct train_files *files, struct ct_err *e)
{
	char *out = strdup(p->out);
	int rc = 0;

	if (!out)
		rc = ct_fail(e, CT_ENOMEM, "no memory for a file name");
	else if (strcmp(p->out, "-") != 0)
		rc = train_files_apart(files, dirname(out), e);

	free(out);
	return rc || !p->cache ? rc : train_files_apart(files, p->cache, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct train_params *p = params;
	struct train_pictures_rule pictures;
	struct train_slices_rule slices;
	struct train_volumes_rule volumes;
	struct train_subject subject = {0};
	struct train_data data = {.n = p->data.n};
	struct ct_resume resume = {0};
	const struct train_files files = files_of(p);
	int rc = -1;

	if (train_files_check(&files, env, e) || apart(p, &files, e) ||
		ct_resume_open(&resume, p->out, p->resume, opts, p, env, e) ||
		ct_alloc0(&data.input, data.n, sizeof *data.input, e))
		goto out;
	if (p->kind == TRAIN_SLICES        ? begin_slices(&subject, &data, &slices, p, env, e)
		: p->kind == TRAIN_VOLUMES ? begin_volumes(&subject, &data, &volumes, p, env, e)
					   : begin_pictures(&subject, &data, &pictures, p, env, e))
		goto out;
	rc = train_loop(&subject, &data, &resume, p, env, e);
out:
	if (subject.it)
		subject.free(subject.it);
	for (size_t i = 0; data.input && i < data.n; i++)
		ct_meta_free(&data.input[i]);
	free(data.input);
	ct_meta_free(&data.with);
	ct_meta_free(&data.held);
	ct_resume_close(&resume);
	return rc;
}

CT_CLI_MAIN("ct-train",
	"Train a prior of projections or radiographs, of CT slices or volumes, or a network that makes projections finer.",
	CT_SEEDED | CT_LONG)
