/* sr-chain.c: the published method, by way of projections: ct-sr starts the other commands as a
 * script would, in a folder that --keep leaves; see sr.h and ct-pipeline(7). */
#include "config.h"
#include "cli/chain.h"
#include "cli/files.h"
#include "core/inflate.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "formats/out-folder.h"
#include "formats/units.h"
#include "dicom/form.h"
#include "tools/lib/prior-opts.h"
#include "tools/sr.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* How many projections are made, and what is made of them, as published. */
enum { VIEWS = 100, STEPS = 50, ITERATIONS = 5000, GAUSSIANS = 50000 };

enum file { IN, OUT, PRIOR, LR, UP, UP_PROJ, LR_PROJ, SR_PROJ, RESIDUAL, RESULT, LOG, FILES };
static const char *const names[] = {"lr.nii", "up.nii", "up-proj.exr", "lr-proj.exr", "sr-proj.exr",
	"residual.ply", "sr.nii", "log.txt"}; /* from LR on */

struct chain {
	const struct sr *p;
	struct ct_chain c;
	char *file[FILES];  /* names; owned */
	const char *result; /* what ct-compose makes: OUT if that is no DICOM */
	char factor[96];    /* in words */
	int whole;          /* the same */
};

/* A name that no command takes for an option; NULL if no memory. */
static char *plain(const char *name)
{
	char *s = NULL;

	return asprintf(&s, "%s%s", name[0] == '-' && name[1] ? "./" : "", name) < 0 ? NULL : s;
}

/* The factor: of the caller, of the header, or 4; one whole number for all axes. */
static int find_factor(struct chain *s, struct ct_err *e)
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
	s->whole = x[0] >= 2 && x[0] <= 16 ? (int)x[0] : 0;
	return x[0] == x[1] && x[0] == x[2] && x[0] == s->whole
		       ? 0
		       : ct_fail(e, CT_EUSAGE,
				 "--factor %s: projections take one whole number from 2 to 16 for all "
				 "axes",
				 s->factor);
}

static int find_files(struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = s->p;
	char *keep = p->keep ? plain(p->keep) : NULL;
	int rc;

	s->file[IN] = plain(p->in);
	s->file[OUT] = plain(p->out);
	rc = !s->file[IN] || !s->file[OUT] || (p->keep && !keep)
		     ? ct_fail(e, CT_ENOMEM, "no memory")
		     : prior_file_find(&s->file[PRIOR], p->prior, PRIOR_PICTURES, e) ||
			       ct_chain_open(&s->c, keep, env->command->dry_run, e);
	free(keep);
	for (int i = LR; i < FILES && rc == 0; i++) {
		s->file[i] = ct_chain_path(&s->c, "%s", names[i - LR]);
		if (!s->file[i])
			return ct_fail(e, CT_ENOMEM, "no memory");
		if (ct_out_same(s->file[i], p->in, true) || ct_out_same(s->file[i], p->out, false))
			return ct_fail(
				e, CT_EOUTPUT, "%s: is written between IN and OUT", s->file[i]);
	}
	if (rc)
		return -1;
	s->c.source[0] = s->file[IN];
	s->c.source[1] = s->file[PRIOR];
	s->c.called = strcmp(p->in, "-") == 0 ? "standard input" : s->file[IN];
	s->result = s->file[ct_files_is_dicom(p->out) || ct_ends_match(p->out, CT_ENDS_HEADED_ONE)
				    ? RESULT
				    : OUT];
	return 0;
}

/* From what IN is to volumes, coarse and refined. */
static void add_volumes(struct chain *s, const struct ct_env *env)
{
	struct ct_chain *c = &s->c;
	const unsigned expand = ct_inflate_allowed();
	const enum ct_units units = (enum ct_units)ct_io_rule_of(env).units;

	ct_chain_add(c, false, s->file[LR], "ct-convert");
	ct_chain_words(c, s->file[IN], s->file[LR], NULL);
	if (expand != CT_INFLATE_TIMES)
		ct_chain_word(c, "--expand=%u", expand);
	if (units != CT_UNITS_AUTO)
		ct_chain_word(c, "--units=%s", CT_WORD(CT_UNITS_LIST, units));
	if (s->p->series)
		ct_chain_word(c, "--series=%s", s->p->series);
	ct_chain_add(c, false, s->file[UP], "ct-upsample");
	ct_chain_word(c, "-x%s", s->factor);
	ct_chain_words(c, "--method=cubic", s->file[LR], s->file[UP], NULL);
}

static void add_project(struct chain *s, enum file input, enum file output)
{
	struct ct_chain *c = &s->c;

	ct_chain_add(c, false, s->file[output], "ct-project");
	ct_chain_word(c, "--views=%d", s->p->views ? s->p->views : VIEWS);
	ct_chain_words(
		c, "--window=-512:3071", "--overshoot", s->file[input], s->file[output], NULL);
}

/* From the projections to the CT. */
static void add_fit(struct chain *s, const char *seed)
{
	/* the release gives one for each factor that it was made for */
	const double sigma_y = s->p->paper ? 0.0015 : s->whole <= 4 ? 0.001 : 0.0025;
	const struct sr *p = s->p;
	struct ct_chain *c = &s->c;

	ct_chain_add(c, true, s->file[SR_PROJ], "ct-ddnm");
	ct_chain_word(c, "--prior=%s", s->file[PRIOR]);
	ct_chain_words(c, seed, NULL);
	ct_chain_word(c, "-x%d", s->whole);
	ct_chain_word(c, "--steps=%d", STEPS);
	ct_chain_word(c, "--sigma-y=%g", sigma_y);
	ct_chain_words(c, s->file[LR_PROJ], s->file[SR_PROJ], NULL);
	ct_chain_add(c, true, s->file[RESIDUAL], "ct-nabgs");
	ct_chain_word(c, "--base=%s", s->file[UP]);
	ct_chain_word(c, "--base-projections=%s", s->file[UP_PROJ]);
	ct_chain_word(c, "--iterations=%d", p->iterations ? p->iterations : ITERATIONS);
	ct_chain_word(c, "--gaussians=%d", p->gaussians ? p->gaussians : GAUSSIANS);
	ct_chain_word(c, "--factor=%d", s->whole);
	ct_chain_words(c, p->paper ? "--paper" : "--expert=r2-compat=yes", seed, NULL);
	ct_chain_words(c, s->file[SR_PROJ], s->file[RESIDUAL], NULL);
	ct_chain_add(c, false, s->result, "ct-compose");
	ct_chain_words(c, s->file[UP], s->file[RESIDUAL], s->result, NULL);
}

/* As MetaImage, NRRD or DICOM, that of the study of IN. */
static void add_output(struct chain *s)
{
	const struct sr *p = s->p;
	struct ct_chain *c = &s->c;
	const bool of_study = dicom_form_of(p->in) != NOT_DICOM && ct_files_is_dicom(s->file[OUT]);

	ct_chain_add(c, false, s->file[OUT], "ct-convert");
	ct_chain_words(c, "--units=hu", NULL);
	if (of_study)
		ct_chain_word(c, "--template=%s", s->file[IN]);
	if (of_study && p->series)
		ct_chain_word(c, "--series=%s", p->series);
	if (p->deid)
		ct_chain_words(c, "--deid", NULL);
	ct_chain_words(c, s->result, s->file[OUT], NULL);
}

static int add_all(struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	struct ct_chain *c = &s->c;
	char seed[40];

	snprintf(seed, sizeof seed, "--seed=%llu", (unsigned long long)env->seed);
	add_volumes(s, env);
	add_project(s, UP, UP_PROJ);
	add_project(s, LR, LR_PROJ);
	add_fit(s, env->seed ? seed : NULL);
	if (s->result != s->file[OUT])
		add_output(s);
	if (s->p->report) {
		ct_chain_add(c, false, s->p->report, "ct-report");
		ct_chain_word(c, "--log=%s", s->file[LOG]);
		ct_chain_words(c, s->file[LR], s->result, s->p->report, NULL);
	}
	return c->no_memory ? ct_fail(e, CT_ENOMEM, "no memory for a command") : 0;
}

/* Of a run that goes on, what is there is its own. */
static int check_out(const struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = s->p;
	struct ct_io_rule rule = ct_io_rule_of(env);
	struct ct_env over = *env;

	over.files = &rule;
	rule.force |= ct_chain_owns(&s->c, s->file[OUT]);
	if (p->keep && p->report && !ct_chain_owns(&s->c, p->report) &&
		ct_out_check(p->report, env, e))
		return -1;
	if (ct_out_folder_named(p->out))
		return ct_out_folder_check(p->out, CT_DICOM_OWN, &over, e);
	return p->keep ? ct_out_check(p->out, &over, e) : 0;
}

/* The log of this process and of those that it starts. */
static int begin_log(const struct chain *s, struct ct_err *e)
{
	const int goes_on = s->p->keep ? 0 : O_TRUNC;
	const int fd =
		open(s->file[LOG], O_WRONLY | O_CREAT | O_NOCTTY | O_NOFOLLOW | goes_on, 0666);

	if (fd < 0 || close(fd) != 0 || setenv(CT_LOG_NAME, s->file[LOG], 1) != 0)
		return ct_fail_errno(e, CT_EOUTPUT, s->file[LOG]);
	return 0;
}

int sr_chain(const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	struct chain s = {.p = p, .c = {.lock = -1}};
	int rc = -1;

	if (strcmp(p->in, "-") != 0 && access(p->in, R_OK) != 0)
		return ct_fail_errno(e, CT_EINPUT, p->in);
	if (find_factor(&s, e) == 0 && find_files(&s, env, e) == 0 && add_all(&s, env, e) == 0) {
		if (env->command->dry_run)
			ct_chain_print(&s.c, "", stdout);
		rc = env->command->dry_run ? 0
		     : check_out(&s, env, e) || (p->report && begin_log(&s, e))
			     ? -1
			     : ct_chain_run(&s.c, env, e);
	}
	for (int i = 0; i < FILES; i++)
		free(s.file[i]);
	ct_chain_close(&s.c);
	return rc;
}
