/* ct-train: a prior, of pictures or of the slices of volumes. */
#include "config.h"
#include "cli/cli.h"
#include "core/mem.h"
#include "tools/train.h"

#include <math.h>
#include <stdlib.h>

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
	.components = 160,
	.width = 512,
	.noise = 30,
};

static const struct ct_opt opts[] = {
	CT_ARG_OUT(struct train_params, out, CT_REWRITES, "OUT", CT_ENDS_TENSORS,
		"the prior (safetensors), its state beside it in OUT.state"),
	CT_ARG(struct train_params, data, CT_READS, "DATA",
		"EXR stacks, pictures (PNG, TIFF), folders of them; with --slices CTs, NIfTI"),
	CT_OPT(struct train_params, slices, 0, "slices", NULL, 0, 0,
		"train a prior of the slices of CTs, for ct-restore, not one of pictures"),
	CT_OPT(struct train_params, factor, 'x', "factor", "S", 2, 8,
		"for scans whose coarse voxels are S fine ones",
		CT_WHEN(CT_IF(struct train_params, slices), CT_IF(struct train_params, base))),
	CT_INPUT(struct train_params, base, 0, "base", "FOLDER",
		"train a prior of what projections of refined CTs lack: DATA are projections of "
		"the truth, and beside each is one of the same name in FOLDER",
		CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, thick, 0, "thick", NULL, 0, 0,
		"for thick slices: coarse along one axis only, any in training",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, again, 0, "again", NULL, 0, 0,
		"for what the nets of --with have added to, not for what the solver makes",
		CT_WHEN(CT_IF(struct train_params, with))),
	CT_OPT(struct train_params, cubes, 0, "cubes", "N", 1, 100000,
		"examples made of every CT, each at a place, scale and phase of its own",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, cube, 0, "cube", "N", 24, 512,
		"of N voxels along an axis, at most", CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, noise, 0, "noise", "HU", 0, 1000,
		"half of them with noise in the low-resolution scan, of up to so much",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, bytes, 0, "bytes", "A:B", 0, 0,
		"volumes of bytes are no HU: 0 stands for A HU, 255 for B",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, window, 0, "window", "LO:HI", 0, 0,
		"clip half of the examples to LO to HI HU, as CTs of a window are",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_INPUT_IDLE(struct train_params, with, 0, "with", "FILE",
		"a prior of slices whose other nets, for other factors, OUT holds too",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT_IDLE(struct train_params, cache, 0, "cache", "DIR", 0, 0,
		"keep the examples in the folder DIR, for the next training with the same ones",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, depth, 0, "depth", "N", 1, 5,
		"slices of a patch, an odd number", CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, components, 0, "components", "N", 1, 4096,
		"principal components of a patch that are looked at",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, width, 0, "width", "N", 1, 8192, "neurons of a hidden layer",
		CT_WHEN(CT_IF(struct train_params, slices))),
	CT_OPT(struct train_params, arch, 'a', "arch", "KEY=VALUE,...", 0, 0,
		"shape of the network: model_channels=32, channel_mult=1:2:3:4, num_res_blocks=1, "
		"attention_resolutions=8 (downsampling factors), in_channels, out_channels and "
		"more",
		CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, patch, 'p', "patch", "N", 4, 4096,
		"train on pieces of N x N pixels, or patches of slices; by default 64, and three cells of slices"),
	CT_OPT(struct train_params, scales, 0, "scales", "A,B,...", 0, 0,
		"cut pieces from pictures reduced A, B, ... times, at random",
		CT_WHEN(CT_UNLESS(struct train_params, slices),
			CT_UNLESS(struct train_params, base))),
	CT_OPT(struct train_params, no_flip, 0, "no-flip", NULL, 0, 0,
		"do not mirror left-right at random",
		CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, flip_vertical, 0, "flip-vertical", NULL, 0, 0,
		"mirror top-bottom at random, too",
		CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, batch, 'b', "batch", "N", 1, 65536,
		"pieces a step; 16 by default, and 1024 patches with --slices"),
	CT_OPT_IDLE(
		struct train_params, steps, 'n', "steps", "N", 0, 2e9, "stop after N steps in all"),
	CT_OPT_IDLE(struct train_params, minutes, 'm', "minutes", "M", 0, 1e6,
		"stop after M minutes, with what there is; 0 does not"),
	CT_OPT(struct train_params, lr, 'l', "lr", "X", 0, 1,
		"learning rate; by default 1e-4, and 1e-3 with --slices"),
	CT_OPT(struct train_params, warmup, 0, "warmup", "N", 0, 1e9,
		"raise it from 0 over N steps", CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, cosine, 0, "cosine", NULL, 0, 0,
		"lower it to 0 at the last step along a half cosine",
		CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, decay, 0, "decay", "X", 0, 10,
		"weight decay of AdamW; by default 0, and .01 with --slices"),
	CT_OPT(struct train_params, clip, 0, "clip", "X", 0, 1e9,
		"limit the norm of the gradient; 0: any",
		CT_WHEN(CT_UNLESS(struct train_params, slices))),
	CT_OPT(struct train_params, ema, 'e', "ema", "X", 0, 0.9999999,
		"rate of the running average of the weights, which is the prior: the smaller of X "
		"and (1 + step)/(10 + step); by default .9999, and .999 with --slices"),
	CT_INPUT_IDLE(struct train_params, validate, 0, "validate", "DATA",
		"also tell the loss on pictures or volumes that are not trained on"),
	CT_OPT_IDLE(struct train_params, validate_every, 0, "validate-every", "N", 1, 2e9,
		"every N steps", CT_WHEN(CT_IF(struct train_params, validate))),
	CT_OPT_IDLE(struct train_params, validate_pieces, 0, "validate-pieces", "N", 1, 65536,
		"on N pieces", CT_WHEN(CT_IF(struct train_params, validate))),
	CT_OPT_IDLE(struct train_params, patience, 0, "patience", "N", 0, 1e6,
		"write the weights of the least loss there, and stop when N times in a row it was no "
		"less; 0: write the last, and do not",
		CT_WHEN(CT_IF(struct train_params, validate),
			CT_UNLESS(struct train_params, base))),
	CT_OPT_IDLE(struct train_params, resume, 'r', "resume", NULL, 0, 0,
		"go on from OUT.state, as if there had been no interruption"),
	CT_OPT_IDLE(struct train_params, checkpoint_every, 0, "checkpoint-every", "N", 1, 2e9,
		"write OUT and OUT.state every N steps",
		CT_WHEN(CT_IF_FILE(struct train_params, out))),
	CT_OPT_IDLE(struct train_params, log_every, 0, "log-every", "N", 1, 2e9,
		"tell the loss every N steps"),
	CT_OPT_IDLE(
		struct train_params, half, 0, "half", NULL, 0, 0, "write OUT in half precision"),
	CT_OPT_IDLE(struct train_params, licence, 0, "licence", "TEXT", 0, 0,
		"licence of the prior, for its metadata"),
	CT_OPT_END,
};

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct train_params *p = params;
	struct train_subject subject = {0};
	struct train_data data = {.n = p->data.n};
	struct ct_resume resume = {0};
	int rc = -1;

	if (ct_resume_open(&resume, p->out, p->resume, opts, p, env, e) ||
		ct_alloc0(&data.input, data.n, sizeof *data.input, e))
		goto out;
	if ((p->slices ? train_slices : train_pictures)(&subject, &data, p, env, e) == 0)
		rc = train_loop(&subject, &data, &resume, p, env, e);
out:
	if (subject.it)
		subject.free(subject.it);
	for (size_t i = 0; data.input && i < data.n; i++)
		ct_meta_free(&data.input[i]);
	free(data.input);
	ct_meta_free(&data.with);
	ct_meta_free(&data.held);
	ct_meta_free(&data.base);
	ct_resume_close(&resume);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-train",
	.brief =
		"Train a prior: a diffusion prior of projections or radiographs, or one of CT slices.",
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
