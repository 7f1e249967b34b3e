/* refine-say.c: what ct-sr and libctsr say of a scan that was refined; see refine.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/memory.h"
#include "core/stream.h"
#include "estimate/assumed.h"
#include "refine/refine.h"

#include <math.h>

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
		put_three(f, is->operator.sigma);
		fprintf(f, " voxels, %s%s (%s)", CT_WORD(CT_DECIMATE_LIST, is->operator.decimate),
			is->operator.profile.n ? ", with a slice profile" : "",
			CT_WORD(CT_SOURCE_LIST, is->from));
	} else
		fputs("; blur not known", f);
	if (ct_operator_is_quiet(is))
		fputs("; no certain noise (measured)", f);
	else
		fprintf(f, "; noise %.3g HU%s (%s)", is->noise,
			is->correlated ? ", correlated" : "",
			CT_WORD(CT_SOURCE_LIST, is->noise_from));
}

static void put_method(FILE *f, const struct ct_refine *r)
{
	fprintf(f, "; %s", ct_refine_name(r, true));
	if (r->did.iterations)
		fprintf(f, ", %zu iterations (%s)", r->did.iterations, ct_refine_why(r));
	if (r->adds)
		fprintf(f, ", then the prior%s", r->restore.passes == 2 ? " in two passes" : "");
	if (r->slabs > 1)
		fprintf(f, ", in %zu slabs", r->slabs);
	if (!isnan(r->residual))
		fprintf(f, "; data residual %.2g HU RMS", r->residual);
}

int ct_refine_words(char **words, const struct ct_refine *r, const struct ct_vol *in,
	double seconds, struct ct_err *e)
{
	double times[3];
	size_t n;
	FILE *f;

	if (ct_stream_open(&f, words, &n, e))
		return -1;
	fprintf(f, "%zux%zux%zu to %zux%zux%zu, ", in->n[0], in->n[1], in->n[2], r->n[0], r->n[1],
		r->n[2]);
	ct_refine_times(times, r);
	put_three(f, times);
	fputs(" times", f);
	put_operator(f, &r->scan);
	put_method(f, r);
	fprintf(f, "; %.*f s, %.0f MiB", seconds < 10, seconds, ceil(ct_memory_held() / 0x1p20));
	return ct_stream_close(f, words, e);
}

void ct_refine_say(const struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env)
{
	const struct ct_operator *is = &r->scan;
	char words[CT_ASSUMED_WORDS];
	double mm[3];

	ct_vol_spacing(in, mm);
	*words = '\0';
	ct_frame_words(words, sizeof words, &r->frame);
	if (*words)
		ct_log(env, CT_TOLD, "%s", words);
	ct_assumed_words(words, is, mm);
	if (*words)
		ct_log(env, CT_TOLD, "assumed: %s; %s", words,
			ct_slice_profile_is_alone(
				is->operator.factor, ct_slice_profile_axis(is->operator.factor, 2))
				? "--slice-thickness or --profile says it better"
				: "--sigma and --decimate say it better");
	else if (!is->known)
		ct_log(env, CT_TOLD,
			"assumed: nothing, as too few edges show the blur%s; --sigma says it",
			r->rule.said.decimate >= 0 || ct_slice_profile_is_said(&r->rule.said.slice)
				? ", without which the sampling or profile that is given does nothing"
				: "");
	if (r->careful)
		ct_log(env, CT_TOLD, "slices %s; --trust does not",
			ct_operator_is_estimated(is)
				? "may be soft by themselves: less blur is undone, without the network"
				: "are softer than they were made: undone without the network");
	if (is->noise_from == CT_BY_MEASURE && is->texture.common > 0) {
		ct_noise_words(words, &is->texture);
		ct_log(env, CT_TOLD, "noise: %s", words);
	}
	ct_rest_words(words, &r->rest);
	if (*words)
		ct_log(env, CT_TOLD, "%s", words);
	*words = '\0';
	ct_damped_words(words, sizeof words, &r->damped);
	if (*words)
		ct_log(env, CT_TOLD, "%s", words);
}
