/* sr-chain.c: the methods that go by way of projections: ct-sr starts the other commands as a
 * script would, in a folder that --keep leaves; see sr.h and ct-pipeline(7). */
#include "config.h"
#include "cli/chain.h"
#include "cli/files.h"
#include "cli/journal.h"
#include "core/inflate.h"
#include "diffusion/residual.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "formats/out-folder.h"
#include "formats/units.h"
#include "tools/convert.h"
#include "dicom/form.h"
#include "tools/prior-file.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* How projections are made and what is made of them. */
struct projections {
	int views, samples, iterations, gaussians;
	double sampling; /* detector pixels a voxel; 0 the published 1 */
	int factor;
};

/* doc/samplers.md has the studies. */
static const struct projections own = {64, 2, 1500, 50000, 1.375, 0};
static const struct projections published = {100, 1, 5000, 50000, 0, 0};

#define PAPER_WINDOW "-512:3071"
#define PAPER_SIGMA_Y 0.0015
#define PAPER_STEPS 50
/* The release gives one for each factor that it was made for. */
static double release_sigma_y(int factor)
{
	return factor <= 4 ? 0.001 : 0.0025;
}

enum file { LR, UP, UP_PROJ, LR_PROJ, SR_PROJ, RESIDUAL, RESULT, LOG, FILES };
static const char *const names[FILES] = {"lr.nii", "up.nii", "up-proj.exr", "lr-proj.exr",
	"sr-proj.exr", "residual.ply", "sr.nii", "log.txt"};

struct chain {
	const struct sr *p;
	struct projections q;
	struct ct_chain c;
	char *in, *out, *keep, *slices, *prior; /* slices, prior: NULL if not used */
	char *file[FILES];
	const char *result; /* what ct-compose makes: OUT if that is no DICOM */
	bool adds, follows; /* projections; the published method */
	const char *factor;
	char of_header[96];
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
	struct ct_vol head = {0};
	struct ct_degrade d;
	struct ct_err why;
	double x[3];
	FILE *f;

	s->factor = s->p->said.factor;
	snprintf(s->of_header, sizeof s->of_header, "%g", SR_FACTOR);
	if (!s->factor && dicom_form_of(s->p->in) == NOT_DICOM && strcmp(s->p->in, "-") != 0 &&
		ct_io_open(s->p->in, &f, &why) == 0) {
		struct ct_nifti_in in = {0};

		if (ct_nifti_open(&in, f, &head, &why) == 0 &&
			!ct_meta_get(&head.meta, CT_META_UPSAMPLE) &&
			ct_degrade_get(&head.meta, &d, &why) == 0)
			snprintf(s->of_header, sizeof s->of_header, "%.9g,%.9g,%.9g", d.factor[0],
				d.factor[1], d.factor[2]);
		ct_source_close(&in.source);
		ct_io_close(f);
		ct_vol_free(&head);
	}
	if (!s->factor)
		s->factor = s->of_header;
	if (ct_cli_numbers("factor", s->factor, ',', 3, true, x, e))
		return -1;
	s->q.factor = x[0] >= 2 && x[0] <= 16 ? (int)x[0] : 0;
	return x[0] == x[1] && x[0] == x[2] && x[0] == s->q.factor
		       ? 0
		       : ct_fail(e, CT_EUSAGE,
				 "--factor %s: projections take one whole number from 2 to 16 for all "
				 "axes",
				 s->factor);
}

/* 1: the prior of what projections lack is of another factor; there are none then. */
static int check_prior(const struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	struct ct_residual prior;
	struct ct_tensors w = {0};
	int rc = ct_tensors_read(s->prior, &w, e);

	if (rc == 0) {
		rc = ct_residual_get(&prior, &w.meta, e);
		if (rc > 0)
			ct_fail(e, CT_EUSAGE, "is not conditional, which --projections needs");
		if (rc)
			rc = ct_blame(e, s->prior);
	}
	ct_tensors_free(&w);
	if (rc || prior.factor == (size_t)s->q.factor)
		return rc;
	ct_log(env, CT_WARN,
		"%s was trained for %zu times coarser CTs, not %d: no projections are added",
		s->prior, prior.factor, s->q.factor);
	return 1;
}

static int find_priors(struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	int rc;

	if (s->follows) {
		s->adds = true;
		return prior_file_find(&s->prior, s->p->prior, PRIOR_PICTURES, e);
	}
	if (s->p->quality != DRAFT && prior_file_find(&s->slices, s->p->prior, PRIOR_SLICES, e))
		return -1;
	if (prior_file_find(&s->prior, NULL, PRIOR_RESIDUAL, e))
		return -1;
	rc = check_prior(s, env, e);
	s->adds = rc == 0;
	return rc < 0 ? -1 : 0;
}

static int find_files(struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = s->p;

	s->in = plain(p->in);
	s->out = plain(p->out);
	s->keep = p->keep ? plain(p->keep) : NULL;
	if (!s->in || !s->out || (p->keep && !s->keep))
		return ct_fail(e, CT_ENOMEM, "no memory");
	if (find_priors(s, env, e) || ct_chain_open(&s->c, s->keep, env->dry_run, e))
		return -1;
	for (int i = 0; i < FILES; i++) {
		s->file[i] = ct_chain_path(&s->c, names[i]);
		if (!s->file[i])
			return ct_fail(e, CT_ENOMEM, "no memory");
		if (ct_out_same(s->file[i], p->in, true) || ct_out_same(s->file[i], p->out, false))
			return ct_fail(
				e, CT_EOUTPUT, "%s: is written between IN and OUT", s->file[i]);
	}
	s->result = ct_files_is_dicom(s->out) || ct_ends_match(s->out, CT_ENDS_HEADED_ONE)
			    ? s->file[RESULT]
			    : s->out;
	return 0;
}

/* From what IN is to a volume. */
static int add_convert(struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = s->p;
	struct ct_chain *c = &s->c;
	const unsigned expand = ct_inflate_allowed();
	const enum ct_units units = (enum ct_units)env->units;

	if (ct_chain_add(c, e, false, s->file[LR], "ct-convert", s->in, s->file[LR], NULL) ||
		(expand != CT_INFLATE_TIMES && ct_chain_word(c, e, "--expand=%u", expand)) ||
		(units != CT_UNITS_AUTO &&
			ct_chain_word(c, e, "--units=%s", CT_WORD(CT_UNITS_LIST, units))) ||
		(p->series && ct_chain_word(c, e, "--series=%s", p->series)))
		return -1;
	return 0;
}

/* What is said of how IN was made; the rest is measured. */
static int add_operator(struct chain *s, struct ct_err *e)
{
	const struct said_opts *p = &s->p->said;
	struct ct_chain *c = &s->c;

	if ((p->sigma ? ct_chain_word(c, e, "--sigma=%s", p->sigma)
		      : ct_chain_word(c, e, "--estimate")) ||
		(p->decimate >= 0 && ct_chain_word(c, e, "--decimate=%s",
					     CT_WORD(CT_DECIMATE_LIST, p->decimate))) ||
		(p->profile && ct_chain_word(c, e, "--profile=%s", p->profile)) ||
		(!isnan(p->thickness) &&
			ct_chain_word(c, e, "--slice-thickness=%g", p->thickness)) ||
		(!isnan(p->noise) && ct_chain_word(c, e, "--noise=%g", p->noise)))
		return -1;
	return ct_chain_word(c, e, "--tolerance=%g", SR_TOLERANCE);
}

static int add_refine(struct chain *s, const char *output, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	if (ct_chain_add(c, e, false, output, "ct-upsample", NULL) ||
		(s->slices && (ct_chain_word(c, e, "--method=prior") ||
				      ct_chain_word(c, e, "--prior=%s", s->slices))) ||
		(s->slices && s->p->quality != BALANCED &&
			ct_chain_word(c, e, "--preset=%s", CT_WORD(QUALITIES, s->p->quality))) ||
		ct_chain_word(c, e, "-x%s", s->factor))
		return -1;
	if (s->follows ? ct_chain_word(c, e, "--method=cubic") : add_operator(s, e))
		return -1;
	return ct_chain_word(c, e, "%s", s->file[LR]) || ct_chain_word(c, e, "%s", output);
}

/* ct-project with what both stacks share. */
static int add_project(struct chain *s, enum file output, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	return ct_chain_add(c, e, false, s->file[output], "ct-project", NULL) ||
			       ct_chain_word(c, e, "--views=%d", s->q.views) ||
			       (s->q.sampling > 0 &&
				       ct_chain_word(c, e, "--sampling=%g", s->q.sampling)) ||
			       (s->follows && (ct_chain_word(c, e, "--window=" PAPER_WINDOW) ||
						      ct_chain_word(c, e, "--overshoot")))
		       ? -1
		       : 0;
}

static int add_projections(struct chain *s, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	if (add_project(s, UP_PROJ, e) || ct_chain_word(c, e, "%s", s->file[UP]) ||
		ct_chain_word(c, e, "%s", s->file[UP_PROJ]) || add_project(s, LR_PROJ, e) ||
		(!s->follows && (ct_chain_word(c, e, "--coarsen=%d", s->q.factor) ||
					ct_chain_word(c, e, "--pixel=sinc"))))
		return -1;
	return ct_chain_word(c, e, "%s", s->file[s->follows ? LR : UP]) ||
	       ct_chain_word(c, e, "%s", s->file[LR_PROJ]);
}

static int add_seed(struct chain *s, uint64_t seed, struct ct_err *e)
{
	return seed ? ct_chain_word(&s->c, e, "--seed=%llu", (unsigned long long)seed) : 0;
}

static int add_ddnm(struct chain *s, uint64_t seed, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	if (ct_chain_add(c, e, true, s->file[SR_PROJ], "ct-ddnm", NULL) ||
		ct_chain_word(c, e, "--prior=%s", s->prior) || add_seed(s, seed, e) ||
		(s->follows ? ct_chain_word(c, e, "-x%d", s->q.factor) ||
					ct_chain_word(c, e, "--steps=%d", PAPER_STEPS) ||
					ct_chain_word(c, e, "--sigma-y=%g",
						s->p->paper ? PAPER_SIGMA_Y
							    : release_sigma_y(s->q.factor))
			    : ct_chain_word(c, e, "--base-projections=%s", s->file[UP_PROJ]) ||
					ct_chain_word(c, e, "--samples=%d", s->q.samples)))
		return -1;
	return ct_chain_word(c, e, "%s", s->file[LR_PROJ]) ||
	       ct_chain_word(c, e, "%s", s->file[SR_PROJ]);
}

static int add_fit(struct chain *s, uint64_t seed, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	return ct_chain_add(c, e, true, s->file[RESIDUAL], "ct-nabgs", NULL) ||
			       ct_chain_word(c, e, "--base=%s", s->file[UP]) ||
			       ct_chain_word(c, e, "--base-projections=%s", s->file[UP_PROJ]) ||
			       ct_chain_word(c, e, "--iterations=%d", s->q.iterations) ||
			       ct_chain_word(c, e, "--gaussians=%d", s->q.gaussians) ||
			       (s->follows ? ct_chain_word(c, e, "--factor=%d", s->q.factor) ||
						       ct_chain_word(c, e,
							       s->p->paper
								       ? "--paper"
								       : "--expert=r2-compat=yes")
					   : ct_chain_word(
						     c, e, "--expert=rate=1,lambda-tv=0.2")) ||
			       add_seed(s, seed, e) ||
			       ct_chain_word(c, e, "%s", s->file[SR_PROJ]) ||
			       ct_chain_word(c, e, "%s", s->file[RESIDUAL])
		       ? -1
		       : 0;
}

static int add_compose(struct chain *s, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	return ct_chain_add(c, e, false, s->result, "ct-compose", NULL) ||
			       (!s->follows &&
				       ct_chain_word(c, e, "--consistent=%s", s->file[LR])) ||
			       ct_chain_word(c, e, "%s", s->file[UP]) ||
			       ct_chain_word(c, e, "%s", s->file[RESIDUAL]) ||
			       ct_chain_word(c, e, "%s", s->result)
		       ? -1
		       : 0;
}

/* As MetaImage, NRRD or DICOM, that of the study of IN; and the report. */
static int add_outputs(struct chain *s, struct ct_err *e)
{
	const struct sr *p = s->p;
	struct ct_chain *c = &s->c;
	const bool of_study = dicom_form_of(p->in) != NOT_DICOM && ct_files_is_dicom(s->out);

	if (s->result != s->out &&
		(ct_chain_add(c, e, false, s->out, "ct-convert", "--units=hu", NULL) ||
			(of_study && ct_chain_word(c, e, "--template=%s", s->in)) ||
			(of_study && p->series && ct_chain_word(c, e, "--series=%s", p->series)) ||
			(p->deid && ct_chain_word(c, e, "--deid")) ||
			ct_chain_word(c, e, "%s", s->result) || ct_chain_word(c, e, "%s", s->out)))
		return -1;
	if (!p->report)
		return 0;
	return ct_chain_add(c, e, false, p->report, "ct-report", NULL) ||
			       ct_chain_word(c, e, "--log=%s", s->file[LOG]) ||
			       ct_chain_word(c, e, "%s", s->file[LR]) ||
			       ct_chain_word(c, e, "%s", s->result) ||
			       ct_chain_word(c, e, "%s", p->report)
		       ? -1
		       : 0;
}

static int add_all(struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	struct ct_chain *c = &s->c;

	ct_chain_source(c, s->in);
	if (s->adds)
		ct_chain_source(c, s->prior);
	if (s->slices)
		ct_chain_source(c, s->slices);
	if (add_convert(s, env, e) || add_refine(s, s->adds ? s->file[UP] : s->result, e))
		return -1;
	if (s->adds && (add_projections(s, e) || add_ddnm(s, env->seed, e) ||
			       add_fit(s, env->seed, e) || add_compose(s, e)))
		return -1;
	return add_outputs(s, e);
}

/* Of a run that goes on, what is there is its own. */
static int check_out(const struct chain *s, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = s->p;
	const bool is_own = s->c.resume && ct_chain_owns(&s->c, s->out);
	struct ct_env over = *env;

	over.force |= is_own;
	if (s->c.resume && p->report && !ct_chain_owns(&s->c, p->report) &&
		ct_out_check(p->report, env, e))
		return -1;
	if (ct_out_folder_named(p->out))
		return ct_out_folder_check(p->out, CT_DICOM_OWN, &over, e);
	return !s->c.resume || is_own ? 0 : ct_out_check(p->out, env, e);
}

static void chain_free(struct chain *s)
{
	free(s->in);
	free(s->out);
	free(s->keep);
	free(s->slices);
	free(s->prior);
	for (int i = 0; i < FILES; i++)
		free(s->file[i]);
	ct_chain_close(&s->c);
}

int sr_chain(const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	struct chain s = {.p = p, .c = {.folder.lock = -1}, .follows = p->paper || p->release};
	int rc = -1;

	s.q = s.follows ? published : own;
	s.q.views = p->views ? p->views : s.q.views;
	s.q.iterations = p->iterations ? p->iterations : s.q.iterations;
	s.q.gaussians = p->gaussians ? p->gaussians : s.q.gaussians;
	if (strcmp(p->in, "-") != 0 && access(p->in, R_OK) != 0)
		return ct_fail_errno(e, CT_EINPUT, p->in);
	if (find_factor(&s, e) || find_files(&s, env, e) || add_all(&s, env, e))
		goto out;
	if (env->dry_run) {
		ct_chain_print(&s.c, stdout);
		rc = 0;
	} else if (check_out(&s, env, e) == 0 &&
		   (!p->report || ct_journal_begin(s.file[LOG], s.c.resume, e) == 0))
		rc = ct_chain_run(&s.c, env, e);
out:
	chain_free(&s);
	return rc;
}
