/* sr-plan.c: the jobs of ct-sr written, for make and other programs; see sr.h. */
#include "config.h"
#include "cli/journal.h"
#include "cli/memory.h"
#include "core/clock.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tools/lib/expect.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { JOBS = 4 };
#define PLAN "plan.json"
#define PLAN_RULES "plan.mk"

/* The slabs: as many as are asked for, or as few as make each fit. */
static void choose_slabs(struct sr_jobs *x, const struct ct_env *env)
{
	const size_t can = sr_jobs_can(x);
	size_t wanted = x->p->jobs ? (size_t)x->p->jobs : JOBS;

	x->slabs = 1;
	if (can == 0) {
		if (wanted > 1)
			ct_log(env, CT_WARN,
				"one job refines: every voxel depends on all others, as the scan was "
				"sampled by sinc, or by a factor that is not whole, along all axes");
		return;
	}
	if (!x->p->jobs && x->p->memory) {
		wanted = sr_jobs_fewest(x, can);
		wanted = wanted ? wanted : can;
	}
	x->slabs = wanted < can ? wanted : can;
	if (x->p->jobs && x->slabs < wanted)
		ct_log(env, CT_WARN, "%zu jobs refine: so many slabs there are, not %zu", can,
			wanted);
}

/* What the plan is for: OUT, and what is asked for besides; NULL ends them. */
static void wanted(const char *to[4], const struct sr_jobs *x)
{
	size_t n = 0;

	to[n++] = x->f->out;
	if (x->f->confidence)
		to[n++] = x->f->confidence;
	if (x->f->report)
		to[n++] = x->f->report;
	to[n] = NULL;
}

static bool is_wanted(const struct sr_jobs *x, const char *path)
{
	const char *all[4];
	bool is = false;

	wanted(all, x);
	for (const char **w = all; *w; w++)
		is |= strcmp(*w, path) == 0;
	return is;
}

/* What an earlier plan of the folder left must not be taken for the results of this one. */
static void clear(const struct sr_jobs *x)
{
	for (size_t i = 0; i < x->jobs.n; i++) {
		const struct ct_step *s = &x->jobs.step[i];
		char *state = NULL;

		if (s->resumable && asprintf(&state, "%s.state", s->output) > 0)
			unlink(state);
		free(state);
		if (!is_wanted(x, s->output))
			unlink(s->output);
		if (s->beside && !is_wanted(x, s->beside))
			unlink(s->beside);
	}
}

/* The words of job i as they are run, which note in the log what the page is to tell; NULL if one
 * is no UTF-8. */
static json_t *words_of(const struct sr_jobs *x, size_t i)
{
	const struct ct_step *s = &x->jobs.step[i];
	char *program = ct_chain_program(x->c, s->tool);
	json_t *a = json_array();
	int rc = 0;

	if (x->f->report) {
		rc |= json_array_append_new(a, json_string("env"));
		rc |= json_array_append_new(a, json_sprintf(CT_JOURNAL_NAME "=%s", x->f->log));
	}
	rc |= json_array_append_new(a, json_string(program));

	for (size_t k = 1; k < s->argc; k++)
		rc |= json_array_append_new(a, json_string(s->argv[k]));
	rc |= json_array_append_new(a, json_string("--force"));
	rc |= json_array_append_new(a, json_sprintf("--threads=%s", x->c->threads));
	if (s->resumable)
		rc |= json_array_append_new(a, json_string("--resume"));
	free(program);
	if (rc) {
		json_decref(a);
		a = NULL;
	}
	return a;
}

static json_t *inputs_of(const struct sr_jobs *x, size_t i)
{
	json_t *a = json_array();

	for (size_t k = 1; k < x->jobs.step[i].argc; k++) {
		const char *input = ct_chain_input(&x->jobs, i, k);

		if (input)
			json_array_append_new(a, json_string(input));
	}
	return a;
}

static json_t *outputs_of(const struct sr_jobs *x, size_t i)
{
	const struct ct_step *s = &x->jobs.step[i];
	json_t *a = json_array();

	json_array_append_new(a, json_string(s->output));
	if (s->beside)
		json_array_append_new(a, json_string(s->beside));
	return a;
}

static json_t *number(double v)
{
	return isnan(v) ? json_null() : json_integer((json_int_t)ceil(v));
}

/* No less than a hundredth. */
static json_t *seconds(double v)
{
	return isnan(v) ? json_null() : json_real(ceil(fmax(v, 0.01) * 100) / 100);
}

/* Named by the command and the number of those before. */
static json_t *name_of(const struct sr_jobs *x, size_t i)
{
	size_t n = 1;

	for (size_t k = 0; k < i; k++)
		n += strcmp(x->jobs.step[k].tool, x->jobs.step[i].tool) == 0;
	return json_sprintf("%s-%zu", x->jobs.step[i].tool, n);
}

/* What plan.json holds; NULL if it cannot. */
static json_t *describe(const struct sr_jobs *x)
{
	json_t *jobs = json_array();

	for (size_t i = 0; i < x->jobs.n; i++) {
		const struct sr_takes t = x->takes[i];
		json_t *o = json_pack("{so so so so sI so so so}", "name", name_of(x, i), "command",
			words_of(x, i), "inputs", inputs_of(x, i), "outputs", outputs_of(x, i),
			"threads", (json_int_t)atoll(x->c->threads), "seconds", seconds(t.seconds),
			"memory-bytes", number(t.memory), "disk-bytes", number(t.disk));

		if (!o || json_array_append_new(jobs, o)) {
			json_decref(jobs);
			return NULL;
		}
	}
	return json_pack("{ss ss so}", "made-by", "ct-sr " PACKAGE_VERSION, "output", x->f->out,
		"jobs", jobs);
}

/* A name as make reads it in a rule, before the colon if it is a target; those are refused before
 * that it cannot. */
static void put_name(FILE *f, const char *name, bool target)
{
	for (; *name; name++)
		if (*name == '$')
			fputs("$$", f);
		else if (*name == '=')
			fputs("$(equals)", f);
		else
			fprintf(f, strchr(target ? " #:%" : " #:", *name) ? "\\%c" : "%c", *name);
}

/* A word as make hands it to a shell. */
static int put_word(FILE *f, const char *word)
{
	char *text = NULL;
	size_t n;
	FILE *m = open_memstream(&text, &n);

	if (!m)
		return -1;
	ct_chain_put_word(word, m);
	if (fclose(m) != 0)
		return -1;
	for (const char *c = text; *c; c++)
		fputs(*c == '$' ? "$$" : (char[2]){*c}, f);
	free(text);
	return 0;
}

static int put_rules(FILE *f, const struct sr_jobs *x, const json_t *plan, struct ct_err *e)
{
	const json_t *job, *word;
	const char *all[4];
	size_t i, k;

	fprintf(f,
		"# The jobs of plan.json: make -j4 -f this file\nequals := =\n.PHONY: all\nall: ");
	wanted(all, x);
	for (const char **w = all; *w; w++) {
		fputs(w > all ? " " : "", f);
		put_name(f, *w, false);
	}
	json_array_foreach (json_object_get(plan, "jobs"), i, job) {
		fputs("\n\n", f);
		json_array_foreach (json_object_get(job, "outputs"), k, word) {
			fputs(k ? " " : "", f);
			put_name(f, json_string_value(word), true);
		}
		fputs(k > 1 ? " &:" : ":", f); /* one command makes both */
		json_array_foreach (json_object_get(job, "inputs"), k, word) {
			fputc(' ', f);
			put_name(f, json_string_value(word), false);
		}
		fputs("\n\t", f);
		json_array_foreach (json_object_get(job, "command"), k, word) {
			if (k)
				fputc(' ', f);
			if (put_word(f, json_string_value(word)))
				return ct_fail(e, CT_ENOMEM, "no memory");
		}
	}
	fputc('\n', f);
	return 0;
}

static int put_json(FILE *f, const struct sr_jobs *x, const json_t *plan, struct ct_err *e)
{
	(void)x;
	(void)e;
	json_dumpf(plan, f, JSON_INDENT(2) | JSON_REAL_PRECISION(9)); /* ct_out_commit looks at f */
	fputc('\n', f);
	return 0;
}

static int write_one(const struct sr_jobs *x, const char *name,
	int (*put)(FILE *f, const struct sr_jobs *x, const json_t *plan, struct ct_err *e),
	const json_t *plan, const struct ct_env *env, struct ct_err *e)
{
	struct ct_env own = *env;
	struct ct_out o = {0};
	char *path = ct_chain_path(x->c, name);
	int rc = -1;

	own.force = true;
	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_out_open(&o, path, &own, e) == 0 && put(o.f, x, plan, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(path);
	return rc;
}

/* plan.json last: where it is the plan is whole. */
static int write_plan(const struct sr_jobs *x, const struct ct_env *env, struct ct_err *e)
{
	json_t *plan = describe(x);
	int rc = -1;

	if (!plan)
		ct_fail(e, CT_EUSAGE, "--plan: a name of a file is no UTF-8");
	else if (write_one(x, PLAN_RULES, put_rules, plan, env, e) == 0)
		rc = write_one(x, PLAN, put_json, plan, env, e);
	json_decref(plan);
	return rc;
}

static int check_name(const char *name, struct ct_err *e)
{
	return strpbrk(name, "\n;*?[\\")
		       ? ct_fail(e, CT_EUSAGE,
				 "--plan: make has no way to write the name of %s: it holds one of "
				 "; * ? [ \\ or an end of line",
				 name)
		       : 0;
}

/* An earlier plan, and names that make has no way to write. */
static int check(const struct sr_jobs *x, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_chain *c = x->c;
	char *path = ct_chain_path(c, PLAN);
	const char *all[4];
	int rc = check_name(c->folder.path, e);

	wanted(all, x);
	for (const char **w = all; rc == 0 && *w; w++)
		rc = check_name(*w, e);
	for (size_t i = 0; rc == 0 && i < c->sources; i++)
		rc = check_name(c->source[i], e);
	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (rc == 0 && access(path, F_OK) == 0 && !env->force)
		rc = ct_fail(e, CT_EOUTPUT, "%s: holds an earlier plan; --force makes a new one",
			c->folder.path);
	free(path);
	return rc;
}

static int open_plan(struct sr_jobs *x, const struct ct_env *env, struct ct_err *e)
{
	size_t bytes;

	if (x->p->memory && ct_memory_bytes(&bytes, x->p->memory, e))
		return -1;
	x->most = ct_memory_most(x->p->memory, 0);
	return check(x, env, e);
}

/* How long the scan takes to be read and written as the slabs and their whole are, a byte. */
static int measure(struct sr_jobs *x, const struct ct_env *env, struct ct_err *e)
{
	const char *out = x->c->step[1].output;
	const size_t n = strlen(out);
	const bool packed = n > 3 && strcmp(out + n - 3, ".gz") == 0;
	char *path = ct_chain_path(x->c, packed ? "pace.nii.gz" : "pace.nii");
	const double begin = ct_clock_cpu();
	struct ct_env own = *env;
	struct ct_vol v = {0};
	int rc = -1;

	own.force = true;
	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_vol_read(x->c->step[0].output, &v, e) == 0 && ct_vol_write(path, &v, &own, e) == 0) {
		x->pace = (ct_clock_cpu() - begin) / (sizeof(float) * (double)ct_vol_count(&v));
		rc = 0;
	}
	ct_vol_free(&v);
	unlink(path);
	free(path);
	return rc;
}

int sr_plan(struct ct_chain *c, struct sr *p, const struct sr_files *f, size_t views,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t wanted = p->jobs ? (size_t)p->jobs : JOBS;
	struct sr_jobs x = {
		.c = c, .p = p, .f = f, .folder = &c->folder, .jobs = {.folder.lock = -1}};
	void *answer = NULL;
	int rc = -1;

	if (open_plan(&x, env, e) || (f->report && ct_journal_begin(f->log, false, e)) ||
		ct_chain_start(c, 0, env, e) || sr_scale_settle(c, p, e) ||
		ct_chain_ask(&answer, c, 1, env, e))
		goto out;
	x.told = answer;
	choose_slabs(&x, env);
	if ((x.slabs > 1 && measure(&x, env, e)) ||
		sr_jobs_divide(&x, views, wanted < views ? wanted : views, e) ||
		sr_rehearse(x.takes, &x.jobs, x.behind, c, f->out, env, e))
		goto out;
	clear(&x);
	rc = write_plan(&x, env, e);
	if (rc == 0)
		ct_log(env, CT_INFO, "%zu jobs: make -f %s/" PLAN_RULES, x.jobs.n, c->folder.path);
out:
	sr_jobs_free(&x);
	return rc;
}
