/* sr-say.c: what ct-sr found and did, in a line or two; see sr.h. */
#include "config.h"
#include "core/memory.h"
#include "refine/assumed.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>

/* Three numbers, or one if they are equal. */
static void put_three(FILE *f, const double x[3])
{
	const bool one = x[0] == x[1] && x[0] == x[2];

	for (int a = 0; a < (one ? 1 : 3); a++)
		fprintf(f, "%s%.4g", a ? "," : "", x[a]);
}

static void put_operator(FILE *f, const struct ct_operator *is)
{
	if (is->known) {
		fputs("; blur ", f);
		put_three(f, is->by.sigma);
		fprintf(f, " voxels, %s%s (%s)", CT_WORD(CT_DECIMATE_LIST, is->by.decimate),
			is->by.profile.n ? ", with a slice profile" : "",
			CT_WORD(CT_SOURCE_LIST, is->from));
	} else
		fputs("; blur not known", f);
	fprintf(f, "; noise %.3g HU%s (%s)", is->noise, is->correlated ? ", correlated" : "",
		CT_WORD(CT_SOURCE_LIST, is->noise_from));
}

static void put_method(FILE *f, const struct ct_refine *r)
{
	fprintf(f, "; %s", ct_upsample_name(r->did.method));
	if (r->did.iterations)
		fprintf(f, ", %zu iterations (%s)", r->did.iterations, ct_refine_why(r));
	if (r->adds)
		fprintf(f, ", then the prior%s", r->restore.passes == 2 ? " in two passes" : "");
	if (r->slabs > 1)
		fprintf(f, ", in %zu slabs", r->slabs);
	if (!isnan(r->residual))
		fprintf(f, "; data residual %.2g HU RMS", r->residual);
}

/* What was assumed of a scan that does not say how it was made, and what would change it. */
static void say_assumed(const struct ct_operator *is, const struct ct_vol *in, const char *tool)
{
	char words[CT_ASSUMED_WORDS];
	double mm[3];

	ct_vol_spacing(in, mm);
	ct_assumed_words(words, is, mm);
	if (*words)
		fprintf(stderr, "%s: assumed: %s; %s\n", tool, words,
			ct_slice_profile_is_alone(
				is->by.factor, ct_slice_profile_axis(is->by.factor))
				? "--slice-thickness or --profile says it better"
				: "--sigma and --decimate say it better");
	else if (!is->known)
		fprintf(stderr,
			"%s: assumed: nothing, as too few edges show the blur; --sigma says it\n",
			tool);
}

void sr_say(const struct ct_refine *r, const struct ct_vol *in, double seconds,
	const struct ct_env *env)
{
	if (env->verbose < 0)
		return;
	say_assumed(&r->is, in, env->tool);
	fprintf(stderr, "%s: %zux%zux%zu to %zux%zux%zu, ", env->tool, in->n[0], in->n[1], in->n[2],
		r->n[0], r->n[1], r->n[2]);
	put_three(stderr, r->is.by.factor);
	fputs(" times", stderr);
	put_operator(stderr, &r->is);
	put_method(stderr, r);
	fprintf(stderr, "; %.*f s, %.0f MiB\n", seconds < 10, seconds,
		ceil(ct_memory_held() / 0x1p20));
}
