/* sr-paper.c: the published method, by way of projections, in one process; see sr.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cost-report.h"
#include "cli/files.h"
#include "core/clock.h"
#include "core/memory.h"
#include "core/stream.h"
#include "dicom/form.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/out-folder.h"
#include "formats/units.h"
#include "tools/convert.h"
#include "tools/lib/ahead.h"
#include "tools/page-file.h"
#include "tools/scan-read.h"
#include "tools/sr.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define REPORTS 0.99 /* of a run: where the page begins */

struct paper {
	struct sr_steps s;
	struct ct_env env; /* with the log */
	struct ct_command command;
	struct ct_vol lr, out;
	char *said; /* what a log that is not kept holds */
	size_t length;
	struct ct_step_fit_report did;
	double began;
};

/* As the steps get it: HU. */
static int read_in(struct ct_vol *v, const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	const char *code;

	if (scan_read(v, p->in, p->series, NULL, NULL, env, e))
		return -1;
	code = ct_meta_get(&v->meta, CT_META_NIFTI_CODE);
	if (code && strcmp(code, "0") == 0)
		ct_log(env, CT_WARN,
			"%s: its header does not say where the voxels lie: that is not known",
			p->in);
	return ct_vol_check_finite(v, e) ? ct_blame(e, p->in) : 0;
}

/* v in one step more, in the units that somebody says. */
static int describe(
	struct ct_vol *v, enum ct_units units, const struct ct_env *env, struct ct_err *e)
{
	struct ct_meta was = {0};
	const int rc = ct_err_any(
		ct_meta_copy(&was, &v->meta, e) || ct_units_note(v, units, e) ||
		ct_meta_step(&v->meta, env, 1, (const struct ct_meta *const[]){&was}, e));

	ct_meta_free(&was);
	return rc;
}

/* Before long work: what the volumes take in memory, and the files on their disks. */
static int check_room(const struct paper *j, struct ct_err *e)
{
	const struct sr_words *w = &j->s.w;
	const double free = ct_memory_free(""), times = pow(w->plan.factor, 3);
	const double need = CT_MEMORY_BASE + ct_step_paper_bytes(&w->plan, j->lr.n);
	const double up = 4 * times * (double)ct_vol_count(&j->lr);
	const size_t f = (size_t)w->plan.factor, *lr = j->lr.n;
	const size_t n[3] = {f * lr[0], f * lr[1], f * lr[2]};

	if (ct_files_is_dicom(w->p->out) && ct_dicom_may_write(w->p->out, &j->lr, n, e))
		return -1;
	if (free > 0 && need > free)
		return ct_fail(e, CT_ENOMEM,
			"%s: takes at least %.0f MiB of memory, and %.0f MiB are free", w->p->in,
			ceil(need / 0x1p20), floor(free / 0x1p20));
	return ahead_room(w->p->out, ct_files_is_dicom(w->p->out) ? up / 2 : up,
		w->p->keep ? w->file[SR_UP] : NULL, up, e);
}

/* The scan as the steps get it, unless it is kept. */
static int make_lr(struct paper *j, const struct ct_step_paper_keeper *keeper, struct ct_err *e)
{
	struct ct_env own = j->env;
	int there;

	if (read_in(&j->lr, j->s.w.p, &j->env, e) ||
		(j->s.kept.folder && sr_steps_source(&j->s, &j->lr.meta, e)) ||
		(there = sr_steps_begin(&j->s, CT_STEP_PAPER_LR, &own, e)) < 0)
		return -1;
	if (there) {
		ct_vol_free(&j->lr);
		return 0;
	}
	return ct_err_any(check_room(j, e) ||
			  describe(&j->lr, (enum ct_units)ct_io_rule_of(&j->env).units, &own, e) ||
			  keeper->after(keeper->ctx, CT_STEP_PAPER_LR, &j->lr, false, e));
}

/* The result, where it is needed beyond its step. */
static int need_out(struct paper *j, struct ct_err *e)
{
	return j->out.data ? 0 : ct_vol_read(j->s.w.file[j->s.w.result], &j->out, e);
}

/* To DICOM, MetaImage or NRRD, as ct-convert writes it. */
static int write_out(struct paper *j, size_t i, struct ct_err *e)
{
	const struct sr_words *w = &j->s.w;
	const struct ct_dicom_out how = {.template = w->of_study ? w->p->in : NULL,
		.series = w->of_study ? w->p->series : NULL,
		.deid = w->p->deid};
	struct ct_env own = j->env;
	struct sr_writer of;
	const int there = sr_steps_begin(&j->s, i, &own, e);

	if (there || need_out(j, e))
		return there > 0 ? 0 : -1;
	sr_steps_writer(&own, &of, &j->s, i);
	if (describe(&j->out, CT_UNITS_HU, &own, e))
		return -1;
	if (ct_files_is_dicom(w->p->out)
			? ct_vol_check_grid(&j->out, e) ||
				  ct_dicom_write(w->file[SR_OUT], &j->out, &how, &own, e)
			: ct_vol_write(w->file[SR_OUT], &j->out, &own, e))
		return -1;
	return sr_steps_end(&j->s, i, e);
}

/* The log: kept over the runs of a folder, or text. */
static int begin_log(struct paper *j, struct ct_err *e)
{
	const struct sr_words *w = &j->s.w;
	int fd;

	if (!w->p->report)
		return 0;
	if (!w->p->keep)
		return ct_stream_open(&j->command.notes, &j->said, &j->length, e);
	fd = open(w->file[SR_LOG],
		O_WRONLY | O_CREAT | O_APPEND | O_NOCTTY | O_NOFOLLOW | O_CLOEXEC, 0666);
	j->command.notes = fd >= 0 ? fdopen(fd, "a") : NULL;
	return j->command.notes ? 0 : ct_fail_errno(e, CT_EOUTPUT, w->file[SR_LOG]);
}

static int write_page(struct paper *j, size_t i, struct ct_err *e)
{
	const struct sr_words *w = &j->s.w;
	struct ct_page page = {.lr.name = basename(w->p->in), .hr.name = basename(w->p->out)};
	struct ct_command command = j->command;
	struct ct_io_rule rule = ct_io_rule_of(&j->env);
	struct ct_env_part part = {.env = &j->env, .from = REPORTS, .to = 1};
	struct ct_env own;
	unsigned char *log = NULL;
	size_t n;
	int rc;

	ct_env_part(&own, &part);
	rc = sr_steps_begin(&j->s, i, &own, e);
	if (rc)
		return rc > 0 ? 0 : -1;
	command.notes = NULL; /* so that it stays as it is */
	own.command = &command;
	fprintf(j->command.notes, "%s: took %.1f s, %.1f s of CPU time, %.0f MiB\n", own.tool,
		ct_clock_wall() - j->began, ct_clock_cpu(), ct_memory_held() / 0x1p20);
	fflush(j->command.notes);
	if (need_out(j, e) || (!j->lr.data && ct_vol_read(w->file[SR_LR], &j->lr, e)) ||
		(w->p->keep && ct_slurp(w->file[SR_LOG], &log, &n, e)))
		return -1;
	ct_page_forget_folders(log ? (char *)log : j->said);
	page.log = log ? (char *)log : j->said;
	page.lr.vol = j->lr;
	page.hr.vol = j->out;
	j->lr = j->out = (struct ct_vol){0}; /* the page frees them */
	rule.force = true;
	own.files = &rule;
	rc = ct_err_any(
		ct_page_measure(&page, &own, e) || page_file_write(w->p->report, &page, &own, e));
	ct_page_free(&page);
	free(log);
	return rc ? -1 : sr_steps_end(&j->s, i, e);
}

/* The result as JSON. */
static int put_json(const struct paper *j, struct ct_err *e)
{
	const struct ct_step_fit_report *fit = &j->did;
	const struct sr_words *w = &j->s.w;
	json_t *o = json_pack("{ss sb sf si}", "method", w->plan.rule.release ? "release" : "paper",
		"resumed", j->s.left_out > 0, "factor", (double)w->plan.factor, "views",
		(int)w->plan.rule.views);

	if (fit->iterations &&
		json_object_update_new(
			o, json_pack("{sI sI sI sf}", "gaussians", (json_int_t)fit->gaussians,
				   "negative", (json_int_t)fit->negative, "iterations",
				   (json_int_t)fit->iterations, "error", fit->error))) {
		json_decref(o);
		o = NULL;
	}
	return sr_result_print(o, w->p, j->began, e);
}

static void say(const struct paper *j)
{
	const double seconds = ct_clock_wall() - j->began;
	const struct ct_step_fit_report *fit = &j->did;
	const struct sr_words *w = &j->s.w;

	if (j->s.left_out)
		ct_log(&j->env, CT_INFO, "%zu of %zu steps were done", j->s.left_out, w->n);
	if (j->env.verbose < 0)
		return;
	fprintf(stderr, "%s: %d times finer, by the published method (%s); ", j->env.tool,
		w->plan.factor, w->plan.rule.release ? "release" : "paper");
	if (fit->iterations)
		fprintf(stderr,
			"%d views, %zu Gaussians, %zu of them negative, after %zu iterations; error %.3g; ",
			w->plan.rule.views, fit->gaussians, fit->negative, fit->iterations,
			fit->error);
	fprintf(stderr, "%.*f s, %.0f MiB\n", seconds < 10, seconds,
		ceil(ct_memory_held() / 0x1p20));
}

static int work(struct paper *j, struct ct_err *e)
{
	const struct ct_step_paper_keeper keeper = sr_steps_keeper(&j->s);
	const struct sr_words *w = &j->s.w;
	struct ct_env_part part = {.env = &j->env, .to = w->p->report ? REPORTS : 1};
	size_t i = CT_STEP_PAPER_STEPS;
	struct ct_env own;

	ct_env_part(&own, &part);
	if (make_lr(j, &keeper, e) ||
		ct_step_paper_run(&j->out, &j->did, &w->plan, &j->lr, &keeper, &own, e))
		return -1;
	if (!w->p->report)
		ct_vol_free(&j->lr);
	if ((w->result != SR_OUT && write_out(j, i++, e)) || (w->p->report && write_page(j, i, e)))
		return -1;
	say(j);
	return j->env.command->json ? put_json(j, e) : 0;
}

/* What is there of a run that goes on is its own. */
static int check_out(const struct sr_steps *s, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = s->w.p;
	struct ct_io_rule rule = ct_io_rule_of(env);
	struct ct_env over = *env;

	over.files = &rule;
	rule.force |= p->keep && ct_kept_owns(&s->kept, SR_OUT, s->w.file[SR_OUT]);
	if (p->keep && p->report && !ct_kept_owns(&s->kept, SR_PAGE, p->report) &&
		ct_out_check(p->report, env, e))
		return -1;
	if (p->keep &&
		(ct_kept_unchanged(&s->kept, SR_OUT, s->w.file[SR_OUT], env, e) ||
			(p->report && ct_kept_unchanged(&s->kept, SR_PAGE, p->report, env, e))))
		return -1;
	if (ct_out_folder_named(p->out))
		return ct_out_folder_check(p->out, CT_DICOM_OWN, &over, e);
	return p->keep ? ct_out_check(p->out, &over, e) : 0;
}

static int write_script(struct sr_steps *s, const struct ct_env *env, struct ct_err *e)
{
	char *text;
	size_t n;
	FILE *f;
	int rc;

	if (ct_stream_open(&f, &text, &n, e))
		return -1;
	rc = sr_words_script(&s->w, f, e);
	rc = ct_stream_close(f, &text, e) || rc ? -1 : ct_kept_script(&s->kept, text, n, env, e);
	free(text);
	return rc;
}

/* The commands, and in a comment behind them about how long all of it takes; only that as JSON. Of
 * a scan that cannot be read, or is a stream, it is not known. */
static int ahead(struct paper *j, struct ct_err *e)
{
	const struct ct_step_paper_keeper keeper = sr_steps_keeper(&j->s);
	const struct sr_words *w = &j->s.w;
	struct ct_cost cost = {.work = "the published method"};
	struct ct_env own = j->env;
	struct ct_err why;

	if (!own.command->json && !w->p->keep)
		puts("mkdir -p " SR_FOLDER);
	if (!own.command->json)
		sr_words_print(w, "", stdout);
	own.log = NULL;
	if (strcmp(w->p->in, "-") == 0 || read_in(&j->lr, w->p, &own, &why))
		return own.command->json ? ct_fail(e, CT_EINPUT,
						   "%s: --json: a scan that can be read is "
						   "needed to estimate the time",
						   w->p->in)
					 : 0;
	cost.memory = ct_memory_now() + ct_step_paper_bytes(&w->plan, j->lr.n);
	cost.disk = 4 * pow(w->plan.factor, 3) * (double)ct_vol_count(&j->lr);
	if (describe(&j->lr, (enum ct_units)ct_io_rule_of(&j->env).units, &own, e) ||
		sr_paper_seconds(&cost.seconds, &w->plan, &j->lr, &keeper, &own, e))
		return -1;
	cost.seconds /= (double)ct_par_threads(own.par);
	cost.memory = fmax(cost.memory, ct_memory_held()); /* of each step, tried */
	if (own.command->json)
		return ct_cost_print(&cost, &j->env, e);
	printf("# about %.*f %s on %zu threads, %.0f MiB of memory at least\n",
		cost.seconds >= 7200,
		cost.seconds < 7200 ? ceil(cost.seconds) : cost.seconds / 3600,
		cost.seconds < 7200 ? "s" : "h", ct_par_threads(own.par),
		ceil(cost.memory / 0x1p20));
	return 0;
}

static int run(struct paper *j, const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	struct sr_steps *s = &j->s;

	if (sr_words_make(&s->w, p, env, e))
		return -1;
	if (env->command->dry_run)
		return ahead(j, e);
	if ((p->keep && ct_kept_open(&s->kept, s->w.folder, SR_LOG - SR_LR,
				(const char *const *)s->w.file + SR_LR, env, e)) ||
		check_out(s, env, e) || (p->keep && write_script(s, env, e)) || begin_log(j, e) ||
		work(j, e))
		return e->code == CT_ESTOP && p->keep
			       ? ct_fail(e, CT_ESTOP,
					 "stopped on request; the same command goes on")
			       : -1;
	return 0;
}

int sr_paper(const struct sr *p, const struct ct_env *env, struct ct_err *e)
{
	struct paper j = {.env = *env, .s = {.kept = {.lock = -1}}, .began = ct_clock_wall()};
	int rc;

	j.s.env = &j.env;
	j.command = *env->command;
	j.env.command = &j.command;
	if (strcmp(p->in, "-") != 0 && access(p->in, R_OK) != 0)
		return ct_fail_errno(e, CT_EINPUT, p->in);
	rc = run(&j, p, env, e);
	if (j.command.notes)
		fclose(j.command.notes);
	free(j.said);
	ct_vol_free(&j.lr);
	ct_vol_free(&j.out);
	sr_steps_free(&j.s);
	return rc;
}
