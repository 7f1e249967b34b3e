/* ct-sr: the whole chain: a low-resolution CT in, a super-resolved CT out. */
#include "config.h"
#include "cli/chain.h"
#include "cli/cli.h"
#include "formats/io.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a level of quality means for every step. */
struct preset {
	const char *name;
	int views, steps, t_start, samples, iterations, gaussians;
};

static const struct preset presets[] = {
	{"draft", 50, 10, 60, 1, 500, 20000},
	{"fast", 100, 10, 60, 1, 1500, 50000},
	{"balanced", 100, 15, 60, 2, 3000, 50000},
	{"best", 200, 20, 60, 4, 5000, 100000},
};

struct params {
	const char *in, *out, *keep, *prior, *window;
	int scale, quality, views, iterations, gaussians;
	bool paper, resume;
};

static const struct params defaults = {.scale = 4, .quality = 2};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, in, "IN", "low-resolution CT: NIfTI file, DICOM folder, or -"),
	CT_ARG(struct params, out, "OUT", "super-resolved CT, NIfTI, or -"),
	CT_OPT(struct params, scale, 'x', "scale", "S", 2, 16, "refine every axis S times"),
	CT_CHOICE(struct params, quality, 'Q', "quality", "draft|fast|balanced|best",
		"trade time for accuracy; see DESCRIPTION for what each sets"),
	CT_OPT(struct params, paper, 0, "paper", NULL, 0, 0,
		"the published method to the letter: LR projections on a coarser detector, sampling "
		"from pure noise, average pooling"),
	CT_OPT(struct params, keep, 'k', "keep", "DIR", 0, 0,
		"leave the intermediate files and commands.sh, the script that makes them, in DIR"),
	CT_OPT(struct params, resume, 0, "resume", NULL, 0, 0,
		"go on with the run that --keep DIR holds"),
	CT_OPT(struct params, prior, 0, "prior", "FILE", 0, 0,
		"diffusion prior; the one that is installed if not given"),
	CT_OPT(struct params, window, 0, "window", "LO:HI", 0, 0,
		"HU that map to density 0 and 1 (default -1024:3071)"),
	CT_OPT(struct params, views, 0, "views", "N", 0, 10000,
		"number of projections; 0 leaves it to --quality"),
	CT_OPT(struct params, iterations, 0, "iterations", "N", 0, 1000000,
		"iterations of the Gaussian fit; 0 leaves it to --quality"),
	CT_OPT(struct params, gaussians, 0, "gaussians", "N", 0, 100000000,
		"Gaussians at the start of the fit; 0 leaves it to --quality"),
	CT_OPT_END,
};
