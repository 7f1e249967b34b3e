/* sr-words.c: the published method as commands: what --dry-run prints, --keep leaves as a script,
 * and the histories tell; see sr.h and ct-pipeline(7). */
#include "config.h"
#include "core/installed.h"
#include "cli/files.h"
#include "cli/keep.h"
#include "core/inflate.h"
#include "dicom/form.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "formats/units.h"
#include "tools/lib/prior-opts.h"
#include "tools/sr.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[] = {"lr.nii", "up.nii", "up-proj.exr", "lr-proj.exr", "sr-proj.exr",
	"residual.ply", "sr.nii", "log.txt"}; /* from SR_LR on */

/* A name that no command takes for an option; NULL if no memory. */
static char *plain(const char *name)
{
	char *s = NULL;

	return asprintf(&s, "%s%s", name[0] == '-' && name[1] ? "./" : "", name) < 0 ? NULL : s;
}

/* The factor: of the caller, of the header, or 4; one whole number for all axes. */
static int find_factor(struct sr_words *s, struct ct_err *e)
{
	const char *said = s->p->said.factor;
	struct ct_vol head = {0};
	struct ct_degrade d;
	struct ct_err why;
	double x[3];
	FILE *f;

	snprintf(s->factor, sizeof s->factor, "%s", said ? said : SR_FACTOR);
	if (!said && dicom_form_of(s->p->in) == NOT_DICOM && strcmp(s->p->in, "-") != 0 &&
		ct_io_open(s->p->in, &f, &why) == 0) {
		struct ct_nifti_in in = {0};

		if (ct_nifti_open(&in, f, &head, &why) == 0 &&
			!ct_meta_get(&head.meta, CT_META_UPSAMPLE) &&
			ct_degrade_get(&head.meta, &d, &why) == 0)
			snprintf(s->factor, sizeof s->factor, "%.9g,%.9g,%.9g", d.factor[0],
				d.factor[1], d.factor[2]);
		ct_source_close(&in.source);
		ct_io_close(f);
		ct_vol_free(&head);
	}
	if (ct_cli_numbers("factor", s->factor, ',', 3, true, x, e))
		return -1;
	s->rule.factor = x[0] >= 2 && x[0] <= 16 ? (int)x[0] : 0;
	return x[0] == x[1] && x[0] == x[2] && x[0] == s->rule.factor
		       ? 0
		       : ct_fail(e, CT_EUSAGE,
				 "--factor %s: projections take one whole number from 2 to 16 for all "
				 "axes",
				 s->factor);
}

static int find_files(struct sr_words *s, struct ct_err *e)
{
	const struct sr *p = s->p;
	char *keep = p->keep ? plain(p->keep) : NULL;

	s->file[SR_IN] = plain(p->in);
	s->file[SR_OUT] = plain(p->out);
	if (!p->keep && asprintf(&keep, "%s/ct-sr.ct-XXXXXX", ct_keep_folder()) < 0)
		keep = NULL;
	s->folder = keep;
	if (!s->file[SR_IN] || !s->file[SR_OUT] || !keep)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_installed_prior(&s->file[SR_PRIOR], p->prior, PRIOR_PICTURES, e))
		return -1;
	for (int i = SR_LR; i < SR_FILES; i++) {
		if (asprintf(&s->file[i], "%s/%s", keep, names[i - SR_LR]) < 0) {
			s->file[i] = NULL;
			return ct_fail(e, CT_ENOMEM, "no memory for a file name");
		}
		if (ct_out_same(s->file[i], p->in, true) || ct_out_same(s->file[i], p->out, false))
			return ct_fail(
				e, CT_EOUTPUT, "%s: is written between IN and OUT", s->file[i]);
	}
	s->converts = ct_files_is_dicom(p->out) || ct_ends_match(p->out, CT_ENDS_HEADED_ONE);
	s->of_study = dicom_form_of(p->in) != NOT_DICOM && ct_files_is_dicom(p->out);
	s->result = s->file[s->converts ? SR_SUM : SR_OUT];
	return 0;
}

/* From what IN is to volumes, coarse and refined. */
static void add_volumes(struct sr_words *s, const struct ct_env *env)
{
	struct ct_commands *c = &s->c;
	const unsigned expand = ct_inflate_allowed();
	const enum ct_units units = (enum ct_units)ct_io_rule_of(env).units;

	ct_commands_add(c, s->file[SR_LR], "ct-convert");
	ct_commands_words(c, s->file[SR_IN], s->file[SR_LR], NULL);
	if (expand != CT_INFLATE_TIMES)
		ct_commands_word(c, "--expand=%u", expand);
	if (units != CT_UNITS_AUTO)
		ct_commands_word(c, "--units=%s", CT_WORD(CT_UNITS_LIST, units));
	if (s->p->series)
		ct_commands_word(c, "--series=%s", s->p->series);
	ct_commands_add(c, s->file[SR_UP], "ct-upsample");
	ct_commands_word(c, "-x%s", s->factor);
	ct_commands_words(c, "--method=cubic", s->file[SR_LR], s->file[SR_UP], NULL);
}

static void add_project(struct sr_words *s, enum sr_file input, enum sr_file output)
{
	struct ct_commands *c = &s->c;

	ct_commands_add(c, s->file[output], "ct-project");
	ct_commands_word(c, "--views=%d", s->plan.rule.views);
	ct_commands_word(c, "--window=%g:%g", s->plan.window[0], s->plan.window[1]);
	ct_commands_words(c, "--overshoot", s->file[input], s->file[output], NULL);
}

/* From the projections to the CT. */
static void add_fit(struct sr_words *s, const char *seed)
{
	const struct ct_step_paper *plan = &s->plan;
	struct ct_commands *c = &s->c;

	ct_commands_add(c, s->file[SR_SR_PROJ], "ct-ddnm");
	ct_commands_word(c, "--prior=%s", s->file[SR_PRIOR]);
	ct_commands_words(c, seed, NULL);
	ct_commands_word(c, "-x%d", plan->rule.factor);
	ct_commands_word(c, "--steps=%d", plan->calls);
	ct_commands_word(c, "--sigma-y=%g", plan->sigma_y);
	ct_commands_words(c, s->file[SR_LR_PROJ], s->file[SR_SR_PROJ], NULL);
	ct_commands_add(c, s->file[SR_RESIDUAL], "ct-nabgs");
	ct_commands_word(c, "--base=%s", s->file[SR_UP]);
	ct_commands_word(c, "--base-projections=%s", s->file[SR_UP_PROJ]);
	ct_commands_word(c, "--iterations=%d", plan->rule.iterations);
	ct_commands_word(c, "--gaussians=%d", plan->rule.gaussians);
	ct_commands_word(c, "--factor=%d", plan->rule.factor);
	ct_commands_words(c, plan->rule.release ? "--expert=r2-compat=yes" : "--paper", seed, NULL);
	ct_commands_words(c, s->file[SR_SR_PROJ], s->file[SR_RESIDUAL], NULL);
	ct_commands_add(c, s->result, "ct-compose");
	ct_commands_words(c, s->file[SR_UP], s->file[SR_RESIDUAL], s->result, NULL);
}

/* As MetaImage, NRRD or DICOM, that of the study of IN. */
static void add_output(struct sr_words *s)
{
	const struct sr *p = s->p;
	struct ct_commands *c = &s->c;

	ct_commands_add(c, s->file[SR_OUT], "ct-convert");
	ct_commands_words(c, "--units=hu", NULL);
	if (s->of_study)
		ct_commands_word(c, "--template=%s", s->file[SR_IN]);
	if (s->of_study && p->series)
		ct_commands_word(c, "--series=%s", p->series);
	if (p->deid)
		ct_commands_words(c, "--deid", NULL);
	ct_commands_words(c, s->result, s->file[SR_OUT], NULL);
}

int sr_words_make(
	struct sr_words *s, const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	char seed[40];

	*s = (struct sr_words){.p = p,
		.rule = {.in = strcmp(p->in, "-") == 0 ? "standard input" : p->in,
			.of_factor = "--factor",
			.views = p->views,
			.iterations = p->iterations,
			.gaussians = p->gaussians,
			.release = p->release}};
	if (find_factor(s, e) || ct_step_paper_plan(&s->plan, &s->rule, e) || find_files(s, e))
		return -1;
	s->plan.rule.prior = s->file[SR_PRIOR];
	snprintf(seed, sizeof seed, "--seed=%llu", (unsigned long long)env->seed);
	add_volumes(s, env);
	add_project(s, SR_UP, SR_UP_PROJ);
	add_project(s, SR_LR, SR_LR_PROJ);
	add_fit(s, env->seed ? seed : NULL);
	if (s->converts)
		add_output(s);
	if (p->report) {
		ct_commands_add(&s->c, p->report, "ct-report");
		ct_commands_word(&s->c, "--log=%s", s->file[SR_LOG]);
		ct_commands_words(&s->c, s->file[SR_LR], s->result, p->report, NULL);
	}
	return s->c.no_memory ? ct_fail(e, CT_ENOMEM, "no memory for a command") : 0;
}

void sr_words_free(struct sr_words *s)
{
	ct_commands_free(&s->c);
	for (int i = 0; i < SR_FILES; i++)
		free(s->file[i]);
	free(s->folder);
}
