/* lowres.h: what is known of a low-resolution scan: the operator that made it, from its metadata,
 * from options, or measured on its edges; and its noise, from the same, or measured in what is
 * flat. A contradiction between the file and the options is an error. */
#ifndef CT_TOOLS_LIB_LOWRES_H
#define CT_TOOLS_LIB_LOWRES_H
#include "cli/cli.h"
#include "core/env.h"
#include "core/vol.h"
#include "resolution/degrade.h"
#include "resolution/upsample.h"

/* The voxels that are aimed at, instead of a factor. */
#define LOWRES_SPACING(S, f)                                                                              \
	CT_OPT(S, f.spacing, 0, "spacing", "MM|X,Y,Z", 0, 0,                                              \
		"refine to voxels of MM, or of X, Y, Z mm along the three axes, in place of -x; an axis " \
		"that is as fine stays as it is",                                                         \
		CT_WHEN(CT_UNLESS(S, f.factor)))

/* What the command line says, field for option. */
struct lowres {
	const char *in, *factor, *spacing, *sigma;
	int decimate;    /* enum ct_decimate, -1 if not said */
	bool estimate;   /* the operator, if nothing says it */
	bool skip_noise; /* do not measure it, where nothing says it */
	double noise;    /* NaN if not said */
};

struct lowres_is {
	struct ct_degrade by;
	bool known;                    /* the operator, not only its factor */
	double noise, alike[3];        /* HU; of neighbours, where it is measured (noise.h) */
	bool measured, noise_measured; /* on its edges, and in what is flat */
	bool said, noise_said;         /* by options, where IN does not say it too */
	bool noise_of_file;
};

/* What lowres_tell tells, for ct-sr. */
#define LOWRES_FACTOR "factor"
#define LOWRES_SIGMA "sigma"
#define LOWRES_SAMPLING "sampling"
#define LOWRES_FROM "from"
#define LOWRES_NOISE "noise"
#define LOWRES_NOISE_FROM "noise.from"
#define LOWRES_NOISE_ALIKE "noise.alike" /* there unless it is white */
#define LOWRES_METHOD "method"
#define LOWRES_WHY "why" /* that method: what the scan is */
#define LOWRES_ITERATIONS "iterations"
#define LOWRES_RESIDUAL "residual" /* RMS of D x - y, HU */
#define LOWRES_PRIOR "prior"       /* there if one was added: how often */

/* What was known of a scan, and what refined it. */
void lowres_tell(
	const struct lowres_is *is, const struct ct_upsample_report *did, const struct ct_env *env);

/* CT_EUSAGE for contradictions, for a factor that nothing says and for one of a file that was
 * refined already; CT_EINPUT for metadata that is wrong. */
int lowres_find(struct lowres_is *r, const struct lowres *p, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e);

#endif
