/* sr-keep.c: the steps of the published method as they are kept, or handed on as files between them
 * would be; see sr.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "core/memory.h"
#include "core/stream.h"
#include "cli/keep.h"
#include "formats/format.h"
#include "formats/units.h"
#include "tools/sr.h"

#include <stdlib.h>
#include <string.h>

/* Of the words of step i, with what its inputs hold for their names; s->of_own. */
static int make_key(struct sr_steps *s, size_t i, struct ct_err *e)
{
	const struct sr_command *c = &s->w.step[i];
	char *text;
	size_t n;
	FILE *to;

	if (ct_stream_open(&to, &text, &n, e))
		return -1;
	s->of_own = false;
	for (size_t k = 0; k < c->n; k++) {
		const enum sr_file f = c->file[k];

		s->of_own |= f < SR_FILES && s->own[f];
		if (f != c->output)
			fprintf(to, "%s\n",
				f < SR_FILES && *s->content[f] ? s->content[f] : c->word[k]);
	}
	if (ct_stream_close(to, &text, e))
		return -1;
	ct_hash_hex(s->key, n, text);
	free(text);
	return 0;
}

int sr_steps_source(struct sr_steps *s, const struct ct_meta *in, struct ct_err *e)
{
	const char *input = ct_meta_get(in, CT_META_INPUT); /* NAME HASH */
	char *text;
	size_t n;
	FILE *f;

	if (ct_stream_open(&f, &text, &n, e))
		return -1;
	fputs(input ? strrchr(input, ' ') : "", f);
	for (size_t i = 0; i < in->n; i++)
		if (strcmp(in->pair[i].key, CT_META_INPUT) != 0)
			fprintf(f, "\n%s=%s", in->pair[i].key, in->pair[i].value);
	if (ct_stream_close(f, &text, e))
		return -1;
	ct_hash_hex(s->content[SR_IN], n, text);
	free(text);
	return ct_hash_file(s->content[SR_PRIOR], s->w.file[SR_PRIOR], s->env, e);
}

int sr_steps_begin(struct sr_steps *s, size_t i, struct ct_env *own, struct ct_err *e)
{
	const enum sr_file f = s->w.step[i].output;
	enum ct_kept_is is;

	if (ct_check_stop(s->env, e) || sr_words_history(&s->history[i], &s->w, i, e))
		return -1;
	own->history = s->history[i];
	s->files = ct_io_rule_of(s->env);
	s->files.units = CT_UNITS_AUTO;
	own->files = &s->files;
	s->began = ct_clock_wall();
	s->cpu = ct_clock_cpu();
	if (!s->kept.folder)
		return 0;
	s->own[f] = false;
	if (make_key(s, i, e) || ct_kept_look(&is, s->content[f], &s->kept, f, s->w.file[f], s->key,
					 s->of_own, s->env, e))
		return -1;
	s->begun = is == CT_KEPT_BEGUN;
	s->own[f] = is == CT_KEPT_OWN;
	if (is == CT_KEPT_MISSING || is == CT_KEPT_BEGUN)
		return ct_kept_note(&s->kept, f, s->w.file[f], s->key, "-", e);
	s->left_out++;
	return 1;
}

int sr_steps_end(struct sr_steps *s, size_t i, struct ct_err *e)
{
	const enum sr_file f = s->w.step[i].output;
	const char *made = i < CT_STEP_PAPER_STEPS ? CT_WORD(CT_STEP_PAPER_LIST, i)
			   : f == SR_PAGE          ? "the page"
						   : "the file";
	const double wall = ct_clock_wall() - s->began;
	struct ct_env own = *s->env;
	char *holds = s->content[f];

	own.stop = NULL; /* what is done is noted */
	ct_log(s->env, CT_INFO, "%s took %.1f s", made, wall);
	if (s->env->command->notes)
		fprintf(s->env->command->notes,
			"%s: %s took %.1f s, %.1f s of CPU time, %.0f MiB\n", s->env->tool, made,
			wall, ct_clock_cpu() - s->cpu, ct_memory_held() / 0x1p20);
	if (!s->kept.folder)
		return 0;
	return ct_err_any(ct_hash_file(holds, s->w.file[f], &own, e) ||
			  (*holds && ct_kept_note(&s->kept, f, s->w.file[f], s->key, holds, e)));
}

static void relay(const struct ct_env *env, enum ct_level level, const char *text)
{
	const struct sr_writer *of = env->ctx;

	of->env->log(of->env, level, text);
}

void sr_steps_writer(struct ct_env *own, struct sr_writer *of, const struct sr_steps *s, size_t i)
{
	*of = (struct sr_writer){s->env, ct_io_rule_of(s->env)};
	of->files.force = true;
	*own = *s->env;
	own->tool = s->w.step[i].word[0];
	own->history = s->history[i];
	own->files = &of->files;
	own->ctx = of;
	own->progress = NULL;
	own->log = own->log ? relay : NULL;
}

static bool is_stack(enum ct_step_paper_made k)
{
	return k == CT_STEP_PAPER_UP_PROJ || k == CT_STEP_PAPER_LR_PROJ ||
	       k == CT_STEP_PAPER_SR_PROJ;
}

static int prior(void *ctx, struct ct_tensors *w, struct ct_err *e)
{
	const struct sr_steps *s = ctx;

	return ct_tensors_read(s->w.file[SR_PRIOR], w, e);
}

static int before(void *ctx, enum ct_step_paper_made k, struct ct_env *env, struct ct_err *e)
{
	return sr_steps_begin(ctx, k, env, e);
}

static int fetch(void *ctx, enum ct_step_paper_made k, void *made, struct ct_err *e)
{
	const struct sr_steps *s = ctx;
	const char *path = sr_words_output(&s->w, k);
	const struct ct_io_rule rule = {.units = CT_UNITS_AUTO};
	struct ct_env own = *s->env;

	own.files = &rule;
	return is_stack(k)                   ? ct_stack_read(path, made, e)
	       : k == CT_STEP_PAPER_RESIDUAL ? ct_gauss_read(path, made, e)
					     : ct_vol_read_hu(path, made, &own, e);
}

static int write_made(struct sr_steps *s, enum ct_step_paper_made k, void *made, struct ct_err *e)
{
	const char *path = sr_words_output(&s->w, k);
	struct sr_writer of;
	struct ct_env own;

	sr_steps_writer(&own, &of, s, k);
	if (k == CT_STEP_PAPER_RESULT && s->w.result == SR_OUT)
		return ct_keep_vol(path, made, &own, e);
	if (!s->kept.folder)
		return 0;
	return is_stack(k)                   ? ct_stack_write(path, made, &own, e)
	       : k == CT_STEP_PAPER_RESIDUAL ? ct_gauss_write(path, made, &own, e)
					     : ct_vol_write(path, made, &own, e);
}

static int as_read(enum ct_step_paper_made k, const char *name, void *made, struct ct_err *e)
{
	return is_stack(k)                   ? ct_stack_as_read(made, name, e)
	       : k == CT_STEP_PAPER_RESIDUAL ? ct_gauss_as_read(made, name, e)
					     : ct_vol_as_read(made, name, e);
}

/* The state of a step is needed no more if that is noted as done; it gets all views that could not
 * be written. */
static void end_state(struct sr_steps *s, bool done)
{
	struct ct_err other;

	if (done)
		ct_resume_done(&s->resume);
	else if (s->views.done)
		ddnm_state_save(&s->views, true, &other);
	ddnm_state_close(&s->views);
	ct_resume_close(&s->resume);
}

static int after(void *ctx, enum ct_step_paper_made k, void *made, bool again, struct ct_err *e)
{
	struct sr_steps *s = ctx;
	int rc = 0;

	if (k == CT_STEP_PAPER_UP && ct_units_check(made, "--units", e))
		return ct_blame(e, s->w.p->in);
	if (!again) {
		rc = ct_err_any(write_made(s, k, made, e) || sr_steps_end(s, k, e));
		end_state(s, rc == 0);
	}
	if (k == CT_STEP_PAPER_RESULT && s->w.result == SR_OUT && !s->w.p->report)
		return rc ? -1 : 0; /* in its place, and read by nobody */
	return rc ? -1 : as_read(k, sr_words_output(&s->w, k), made, e);
}

/* The state of step k, from which it goes on if it had begun. */
static int open_state(struct sr_steps *s, enum ct_step_paper_made k, struct ct_err *e)
{
	static const struct ct_opt none[] = {CT_OPT_END};
	struct ct_io_rule rule = ct_io_rule_of(s->env);
	struct ct_env own = *s->env;

	rule.force = true;
	own.files = &rule;
	return ct_err_any(ct_resume_open(&s->resume, sr_words_output(&s->w, k), s->begun, none,
				  NULL, &own, e) ||
			  ct_resume_value(&s->resume, e, "step", "%s", s->key));
}

static int keep_views(
	void *ctx, struct ct_stack *out, struct ct_step_paper_views *v, struct ct_err *e)
{
	struct sr_steps *s = ctx;

	if (open_state(s, CT_STEP_PAPER_SR_PROJ, e) ||
		ddnm_state_open(&s->views, &s->resume, out, NULL, e))
		return -1;
	*v = (struct ct_step_paper_views){s->views.done, ddnm_state_save, &s->views};
	ct_log(s->env, CT_INFO, "%zu of %zu views are to be made", ddnm_state_left(&s->views),
		out->views);
	return 0;
}

static int pack(struct ct_tensors *t, const void *fit, struct ct_err *e)
{
	return ct_fit_state_pack(t, fit, e);
}

static int unpack(void *fit, const struct ct_tensors *t, struct ct_err *e)
{
	return ct_fit_state_unpack(fit, t, e);
}

static int save_fit(void *run, const struct ct_fit *f, struct ct_err *e)
{
	return ct_resume_save(run, pack, f, e);
}

static int keep_fit(void *ctx, struct ct_fit *f, struct ct_err *e)
{
	struct sr_steps *s = ctx;
	int rc;

	if (open_state(s, CT_STEP_PAPER_RESIDUAL, e))
		return -1;
	f->save = save_fit;
	f->ctx = &s->resume;
	rc = ct_resume_load(&s->resume, unpack, f, e);
	if (rc == 0)
		ct_log(s->env, CT_INFO, "%s: continuing after iteration %zu", s->resume.path,
			f->g.step);
	return rc < 0 ? -1 : 0;
}

struct ct_step_paper_keeper sr_steps_keeper(struct sr_steps *s)
{
	const bool kept = s->kept.folder != NULL;
	struct ct_step_paper_keeper keeper = {.ctx = s,
		.prior = prior,
		.before = before,
		.fetch = kept ? fetch : NULL,
		.after = after,
		.views = kept ? keep_views : NULL,
		.fit = kept ? keep_fit : NULL};

	for (size_t k = 0; k < CT_STEP_PAPER_STEPS && kept; k++)
		keeper.name[k] = sr_words_output(&s->w, k);
	return keeper;
}

void sr_steps_free(struct sr_steps *s)
{
	ddnm_state_close(&s->views);
	ct_resume_close(&s->resume);
	ct_kept_close(&s->kept);
	for (size_t i = 0; i < SR_STEPS; i++)
		free(s->history[i]);
	sr_words_free(&s->w);
}
