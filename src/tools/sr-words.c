/* sr-words.c: the published method as commands: what --dry-run prints, --keep leaves as a script,
 * and the histories tell; see sr.h and ct-pipeline(7). SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"
#include "cli/files.h"
#include "cli/table.h"
#include "core/inflate.h"
#include "core/stream.h"
#include "dicom/form.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "formats/units.h"
#include "tools/lib/prior-opts.h"
#include "tools/sr.h"

#include <stdarg.h>
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

/* What the step decides: by what the caller says, or the header of IN. */
static int make_plan(struct sr_words *s, struct ct_err *e)
{
	const char *said = s->p->said.factor;
	double *x = s->plan.rule.factor;
	struct ct_nifti_in in = {0};
	struct ct_vol head = {0};
	struct ct_err why;
	FILE *f = NULL;
	int rc;

	if (said && ct_cli_numbers("factor", said, ',', 3, true, s->rule.factor, e))
		return -1;
	if (dicom_form_of(s->p->in) == NOT_DICOM && strcmp(s->p->in, "-") != 0 &&
		ct_io_open(s->p->in, &f, &why) == 0 && ct_nifti_open(&in, f, &head, &why))
		ct_meta_free(&head.meta);
	rc = ct_step_paper_plan(&s->plan, &s->rule, &head.meta, e);
	if (said)
		snprintf(s->factor, sizeof s->factor, "%s", said);
	else if (ct_meta_get(&head.meta, CT_META_FACTOR))
		snprintf(s->factor, sizeof s->factor, "%.9g,%.9g,%.9g", x[0], x[1], x[2]);
	else
		snprintf(s->factor, sizeof s->factor, "%d", s->plan.factor);
	ct_source_close(&in.source);
	if (f)
		ct_io_close(f);
	ct_vol_free(&head);
	return rc;
}

static int no_memory(struct ct_err *e)
{
	return ct_fail(e, CT_ENOMEM, "no memory for a command");
}

static int find_files(struct sr_words *s, struct ct_err *e)
{
	const struct sr *p = s->p;
	const bool converts =
		ct_files_is_dicom(p->out) || ct_ends_match(p->out, CT_ENDS_HEADED_ONE);
	char *keep = plain(p->keep ? p->keep : SR_FOLDER);

	s->file[SR_IN] = plain(p->in);
	s->file[SR_OUT] = plain(p->out);
	s->file[SR_PAGE] = strdup(p->report ? p->report : "");
	s->file[SR_SERIES] = strdup(p->series ? p->series : "");
	s->folder = keep;
	if (!s->file[SR_IN] || !s->file[SR_OUT] || !s->file[SR_PAGE] || !s->file[SR_SERIES] ||
		!keep)
		return no_memory(e);
	if (ct_installed_prior(&s->file[SR_PRIOR], p->prior, PRIOR_PICTURES, e))
		return -1;
	for (int i = SR_LR; i <= SR_LOG; i++) {
		if (asprintf(&s->file[i], "%s/%s", keep, names[i - SR_LR]) < 0) {
			s->file[i] = NULL;
			return no_memory(e);
		}
		if (p->keep && (ct_out_same(s->file[i], p->in, true) ||
				       ct_out_same(s->file[i], p->out, false)))
			return ct_fail(
				e, CT_EOUTPUT, "%s: is written between IN and OUT", s->file[i]);
	}
	s->of_study = dicom_form_of(p->in) != NOT_DICOM && ct_files_is_dicom(p->out);
	s->result = converts ? SR_SUM : SR_OUT;
	return 0;
}

/* A command of these words; "@" and a letter stand for a file, or the series. */
static void add(struct sr_words *s, enum sr_file output, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
static void add(struct sr_words *s, enum sr_file output, const char *fmt, ...)
{
	static const char letters[] = "iopluULSrsgPn"; /* of enum sr_file */
	struct sr_command *c = &s->step[s->n++];
	char *text = NULL, *next = NULL;
	va_list ap;

	c->output = output;
	va_start(ap, fmt);
	if (vasprintf(&text, fmt, ap) < 0)
		text = NULL;
	va_end(ap);
	s->no_memory |= !text;
	for (char *w = text ? strtok_r(text, " ", &next) : NULL; w;
		w = strtok_r(NULL, " ", &next)) {
		const char *at = strchr(w, '@');
		enum sr_file f = at ? (enum sr_file)(strchr(letters, at[1]) - letters) : SR_FILES;
		char **word = &c->word[c->n];

		f = f == SR_SUM ? s->result : f;
		c->file[c->n++] = f;
		if (asprintf(word, "%.*s%s", at ? (int)(at - w) : (int)strlen(w), w,
			    at ? s->file[f] : "") < 0) {
			*word = NULL;
			s->no_memory = true;
		}
	}
	free(text);
}

static void add_steps(struct sr_words *s, const struct ct_env *env)
{
	const struct ct_step_paper *plan = &s->plan;
	const unsigned expand = ct_inflate_allowed();
	const enum ct_units units = (enum ct_units)ct_io_rule_of(env).units;
	const char *series = s->p->series ? " --series=@n" : "";
	const struct ct_step_paper_way *way = &plan->way;
	char allow[40] = "", as[40] = "", seed[40] = "", project[120], keys[80] = "";

	if (expand != CT_INFLATE_TIMES)
		snprintf(allow, sizeof allow, " --expand=%u", expand);
	if (units != CT_UNITS_AUTO)
		snprintf(as, sizeof as, " --units=%s", CT_WORD(CT_UNITS_LIST, units));
	if (env->seed)
		snprintf(seed, sizeof seed, "--seed=%llu", (unsigned long long)env->seed);
	snprintf(project, sizeof project, "ct-project --views=%d --window=%.10g:%.10g --overshoot",
		plan->rule.views, plan->window[0], plan->window[1]);
	add(s, SR_LR, "ct-convert @i @l%s%s%s", allow, as, series);
	if (way->range != CT_SUPERRES_STACK)
		snprintf(keys, sizeof keys, " --expert=range=%s%s",
			CT_WORD(CT_SUPERRES_RANGES, way->range),
			way->first ? ",channel-reduce=first" : "");
	add(s, SR_UP, "ct-upsample -x%s --method=%s @l @u", s->factor,
		way->zoom ? "linear --expert=zoom=yes" : "cubic");
	add(s, SR_UP_PROJ, "%s @u @U", project);
	add(s, SR_LR_PROJ, "%s%s @l @L", project, way->cells ? " --expert=cells=yes" : "");
	add(s, SR_SR_PROJ, "ct-ddnm --prior=@p %s -x%d --steps=%d --sigma-y=%g%s @L @S", seed,
		plan->factor, plan->calls, plan->sigma_y, keys);
	add(s, SR_RESIDUAL,
		"ct-nabgs --base=@u --base-projections=@U --iterations=%d --gaussians=%d "
		"--factor=%d %s %s @S @r",
		plan->rule.iterations, plan->rule.gaussians, plan->factor,
		way->fit ? "--release" : "--paper", seed);
	add(s, s->result, "ct-compose @u @r @s");
	if (s->result != SR_OUT) /* MetaImage, NRRD or DICOM, that of the study of IN */
		add(s, SR_OUT, "ct-convert --units=hu%s%s%s @s @o",
			s->of_study ? " --template=@i" : "", s->of_study ? series : "",
			s->p->deid ? " --deid" : "");
	if (s->p->report)
		add(s, SR_PAGE, "ct-report --log=@g @l @s @P");
}

int sr_words_make(
	struct sr_words *s, const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	*s = (struct sr_words){.p = p,
		.rule = {.in = strcmp(p->in, "-") == 0 ? "standard input" : p->in,
			.of_factor = "--factor",
			.views = p->views,
			.iterations = p->iterations,
			.gaussians = p->gaussians,
			.release = p->release}};
	if (make_plan(s, e) || find_files(s, e))
		return -1;
	s->plan.rule.prior = s->file[SR_PRIOR];
	add_steps(s, env);
	return s->no_memory ? no_memory(e) : 0;
}

const char *sr_words_output(const struct sr_words *s, size_t i)
{
	return s->file[s->step[i].output];
}

void sr_words_print(const struct sr_words *s, const char *last, FILE *f)
{
	for (size_t i = 0; i < s->n; i++) {
		for (size_t k = 0; k < s->step[i].n; k++) {
			if (k)
				fputc(' ', f);
			ct_table_put_word(f, "", 0, s->step[i].word[k]);
		}
		fprintf(f, "%s\n", last);
	}
}

/* From the folder of the script to the one that the names in it are told from: upwards if it lies
 * there, so that both can be moved together, else by its name. */
static int put_cd(const char *folder, FILE *f, struct ct_err *e)
{
	char *here = realpath(".", NULL), *there = realpath(folder, NULL);
	const size_t n = here ? strlen(here) : 0;
	int rc = 0;

	if (!here || !there)
		rc = ct_fail_errno(e, CT_EOUTPUT, folder);
	else if (strncmp(there, here, n) == 0 && there[n] == '/') {
		fputs("CDPATH= cd -P -- \"$(dirname -- \"$0\")", f);
		for (const char *c = there + n; *c; c++)
			fputs(*c == '/' ? "/.." : "", f);
		fputs("\"\n", f);
	} else {
		fputs("cd -- ", f);
		ct_table_put_word(f, "", 0, here);
		fputc('\n', f);
	}
	free(here);
	free(there);
	return rc;
}

int sr_words_script(const struct sr_words *s, FILE *f, struct ct_err *e)
{
	fputs("#!/bin/sh\nset -e\n", f);
	if (put_cd(s->folder, f, e))
		return -1;
	sr_words_print(s, " --force", f);
	return 0;
}

/* Is the word "--option=value" of one that is not told? */
static bool is_idle(const char *word)
{
	const size_t n = strcspn(word, "=");
	char name[32];

	if (strncmp(word, "--", 2) != 0 || n >= sizeof name)
		return false;
	snprintf(name, sizeof name, "%.*s", (int)n - 2, word + 2);
	return ct_cli_is_idle(name);
}

/* The name that a history with --deid has for a file, or a series. */
static const char *hidden(const void *words, const char *name)
{
	const struct sr_words *s = words;

	if (strcmp(name, s->file[SR_IN]) == 0 || strcmp(name, s->file[s->result]) == 0)
		return "IN";
	if (strcmp(name, s->file[SR_OUT]) == 0)
		return "OUT";
	return s->p->series && strchr(s->p->series, '.') && strcmp(name, s->p->series) == 0 ? "UID"
											    : NULL;
}

int sr_words_history(char **text, const struct sr_words *s, size_t i, struct ct_err *e)
{
	const bool hides = s->p->deid && i >= CT_STEP_PAPER_STEPS;
	const struct sr_command *c = &s->step[i];
	size_t n;
	FILE *f;

	if (ct_stream_open(&f, text, &n, e))
		return -1;
	fprintf(f, "%s %s", c->word[0], PACKAGE_VERSION);
	for (size_t k = 1; k < c->n; k++)
		if (!is_idle(c->word[k]))
			ct_cli_put_history(f, c->word[k], hides ? hidden : NULL, s);
	return ct_stream_close(f, text, e);
}

void sr_words_free(struct sr_words *s)
{
	for (size_t i = 0; i < s->n; i++)
		for (size_t k = 0; k < s->step[i].n; k++)
			free(s->step[i].word[k]);
	for (int i = 0; i < SR_FILES; i++)
		free(s->file[i]);
	free(s->folder);
}
