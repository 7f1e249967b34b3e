/* sr-plan.c: the chain of ct-sr as jobs that do not wait for each other where they need not: the
 * same steps, those divided that can be, each part by its own command and one more to join them. */
#include "config.h"
#include "cli/memory.h"
#include "core/mem.h"
#include "formats/io.h"
#include "tools/lib/brick.h"
#include "tools/lib/expect.h"
#include "tools/sr.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { JOBS = 4, PARTS_MOST = 256 };
#define PLAN "plan.json"
#define PLAN_RULES "plan.mk"

/* What a job takes; NaN: nobody can tell before its inputs are there. */
struct takes {
	double seconds, memory, disk;
};

struct plan {
	const struct ct_chain *c;
	struct ct_chain jobs; /* steps, parts and joins; in no folder */
	struct takes *takes;  /* of each */
	size_t cap;
	char **name; /* of parts, owned */
	size_t names, names_cap;
	/* Of the step that refines. */
	json_t *told;
	struct brick brick;
	size_t slabs;
	double most; /* bytes of memory that a job may take */
	const struct sr *p;
};

static double told(const struct plan *x, const char *key)
{
	return json_number_value(json_object_get(x->told, key));
}

/* What does not fit into memory is on disk until the job is done. */
static struct takes bounded(struct takes t, double most)
{
	if (t.memory > most) {
		t.disk += t.memory;
		t.memory = most;
	}
	return t;
}

/* Of slab n of m. */
static struct takes slab_takes(const struct plan *x, size_t n, size_t m)
{
	const double fixed = told(x, EXPECT_FIXED), need = told(x, EXPECT_NEED);
	struct brick b = x->brick;
	struct takes t;
	double share;

	brick_slab(&b, n, m);
	share = (double)(b.hi - b.lo) / (double)b.of;
	t.seconds = told(x, "seconds") * share;
	t.disk = told(x, "disk-bytes") * (double)(b.to - b.from) / (double)b.of;
	t.memory = fixed + (need - fixed) * share;
	return bounded(t, x->most);
}

/* Of the largest of m slabs. */
static double slab_memory(const struct plan *x, size_t m)
{
	double most = 0;

	for (size_t n = 1; n <= m; n++)
		most = fmax(most, slab_takes(x, n, m).memory);
	return most;
}

/* The slabs: as many as are asked for, or as few as make each fit. */
static void choose_slabs(struct plan *x, const struct ct_env *env)
{
	const double most = x->most;
	size_t wanted = x->p->jobs ? (size_t)x->p->jobs : JOBS, can;

	x->slabs = 1;
	if (told(x, EXPECT_AXIS) < 0) {
		if (wanted > 1)
			ct_log(env, CT_WARN,
				"one job refines: every voxel depends on all others, as the scan was "
				"sampled by sinc, or by a factor that is not whole, along all axes");
		return;
	}
	x->brick = (struct brick){.axis = (int)told(x, EXPECT_AXIS),
		.factor = (size_t)told(x, EXPECT_FACTOR),
		.of = (size_t)told(x, EXPECT_VOXELS)};
	can = brick_most(&x->brick);
	if (can > PARTS_MOST)
		can = PARTS_MOST;
	if (!x->p->jobs && x->p->memory) {
		x->most = INFINITY; /* all in memory */
		for (wanted = 1; wanted < can && slab_memory(x, wanted) > most;)
			wanted++;
		x->most = most;
	}
	x->slabs = wanted < can ? wanted : can;
	if (x->p->jobs && x->slabs < wanted)
		ct_log(env, CT_WARN, "%zu jobs refine: so many slabs there are, not %zu", can,
			wanted);
}

/* A name of a file between the steps, or NULL. */
static const char *name_part(struct plan *x, const char *stem, size_t n, struct ct_err *e)
{
	char file[64], **room;

	if (ct_grow(&x->name, &x->names_cap, x->names + 1, sizeof *x->name, e))
		return NULL;
	room = &x->name[x->names];
	snprintf(file, sizeof file, "%s-%zu.%s", stem, n, strcmp(stem, "slab") ? "exr" : "nii");
	*room = ct_chain_path(x->c, file);
	if (!*room) {
		ct_fail(e, CT_ENOMEM, "no memory for a file name");
		return NULL;
	}
	x->names++;
	return *room;
}

/* Begin a job like step s, of another output, or of that; words of the caller may follow. */
static int add_job(struct plan *x, const struct ct_step *s, const char *output, struct takes takes,
	struct ct_err *e)
{
	const bool part = output != s->output;

	if (ct_grow(&x->takes, &x->cap, x->jobs.n + 1, sizeof *x->takes, e))
		return -1;
	x->takes[x->jobs.n] = takes;
	if (ct_chain_add(&x->jobs, e, s->resumable, output, s->tool, NULL))
		return -1;
	for (size_t k = 1; k < s->argc; k++) {
		if (part && strncmp(s->argv[k], "--tolerance=", 12) == 0)
			continue; /* an end that all slabs come to together is --iterations */
		if (ct_chain_word(&x->jobs, e, "%s",
			    strcmp(s->argv[k], s->output) == 0 ? output : s->argv[k]))
			return -1;
	}
	return 0;
}

/* The parts from step `first` on to the output of s. */
static int add_merge(
	struct plan *x, const struct ct_step *s, size_t first, struct takes takes, struct ct_err *e)
{
	const size_t end = x->jobs.n;

	if (ct_grow(&x->takes, &x->cap, end + 1, sizeof *x->takes, e))
		return -1;
	x->takes[end] = takes;
	if (ct_chain_add(&x->jobs, e, false, s->output, "ct-merge", NULL))
		return -1;
	for (size_t i = first; i < end; i++)
		if (ct_chain_word(&x->jobs, e, "%s", x->jobs.step[i].output))
			return -1;
	return ct_chain_word(&x->jobs, e, "%s", s->output);
}

static int add_slabs(struct plan *x, const struct ct_step *s, struct ct_err *e)
{
	const size_t first = x->jobs.n, m = x->slabs;
	const double iterations = told(x, EXPECT_ITERATIONS), whole = told(x, "disk-bytes");
	const struct takes merge = {NAN, CT_MEMORY_BASE, whole}; /* it goes through planes */

	for (size_t n = 1; n <= m; n++) {
		const char *part = name_part(x, "slab", n, e);

		if (!part || add_job(x, s, part, slab_takes(x, n, m), e) ||
			(iterations > 0 &&
				ct_chain_word(&x->jobs, e, "--iterations=%.0f", iterations)) ||
			ct_chain_word(&x->jobs, e, "--brick=%zu/%zu", n, m))
			return -1;
	}
	return add_merge(x, s, first, merge, e);
}

static const struct takes unknown = {NAN, NAN, NAN};

static int add_views(
	struct plan *x, const struct ct_step *s, size_t views, size_t m, struct ct_err *e)
{
	const size_t first = x->jobs.n;

	for (size_t n = 1; n <= m; n++) {
		const char *part = name_part(x, "views", n, e);

		if (!part || add_job(x, s, part, unknown, e) ||
			ct_chain_word(
				&x->jobs, e, "--views=%zu:%zu", views * (n - 1) / m, views * n / m))
			return -1;
	}
	return add_merge(x, s, first, unknown, e);
}

/* All steps but the first, which is done. */
static int divide(struct plan *x, size_t views, struct ct_err *e)
{
	const size_t wanted = x->p->jobs ? (size_t)x->p->jobs : JOBS;
	const size_t parts = wanted < views ? wanted : views;
	const struct takes whole = bounded(
		(struct takes){told(x, "seconds"), told(x, EXPECT_NEED), told(x, "disk-bytes")},
		x->most);

	for (size_t i = 0; i < x->c->sources; i++)
		ct_chain_source(&x->jobs, x->c->source[i]);
	ct_chain_source(&x->jobs, x->c->step[0].output);
	for (size_t i = 1; i < x->c->n; i++) {
		const struct ct_step *s = &x->c->step[i];
		int rc;

		if (i == 1 && x->slabs > 1)
			rc = add_slabs(x, s, e);
		else if (strcmp(s->tool, "ct-ddnm") == 0 && parts > 1)
			rc = add_views(x, s, views, parts, e);
		else
			rc = add_job(x, s, s->output, i == 1 ? whole : unknown, e);
		if (rc)
			return -1;
	}
	return 0;
}

/* What an earlier plan of the folder left must not be taken for the results of this one. */
static void clear(const struct plan *x)
{
	for (size_t i = 0; i < x->jobs.n; i++) {
		const struct ct_step *s = &x->jobs.step[i];
		char *state = NULL;

		if (s->resumable && asprintf(&state, "%s.state", s->output) > 0)
			unlink(state);
		free(state);
		if (i + 1 < x->jobs.n)
			unlink(s->output);
	}
}

/* The words of job i as they are run; NULL if one is no UTF-8. */
static json_t *words_of(const struct plan *x, size_t i)
{
	const struct ct_step *s = &x->jobs.step[i];
	char *program = ct_chain_program(x->c, s->tool);
	json_t *a = json_array();
	int rc = json_array_append_new(a, json_string(program));

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

static json_t *inputs_of(const struct plan *x, size_t i)
{
	json_t *a = json_array();

	for (size_t k = 1; k < x->jobs.step[i].argc; k++) {
		const char *input = ct_chain_input(&x->jobs, i, k);

		if (input)
			json_array_append_new(a, json_string(input));
	}
	return a;
}

static json_t *number(double v)
{
	return isnan(v) ? json_null() : json_integer((json_int_t)ceil(v));
}

/* Named by the command and the number of those before. */
static json_t *name_of(const struct plan *x, size_t i)
{
	size_t n = 1;

	for (size_t k = 0; k < i; k++)
		n += strcmp(x->jobs.step[k].tool, x->jobs.step[i].tool) == 0;
	return json_sprintf("%s-%zu", x->jobs.step[i].tool, n);
}

/* What plan.json holds; NULL if it cannot. */
static json_t *describe(const struct plan *x)
{
	json_t *jobs = json_array();

	for (size_t i = 0; i < x->jobs.n; i++) {
		const struct takes t = x->takes[i];
		json_t *o = json_pack("{so so so s[s] sI so so so}", "name", name_of(x, i),
			"command", words_of(x, i), "inputs", inputs_of(x, i), "outputs",
			x->jobs.step[i].output, "threads", (json_int_t)atoll(x->c->threads),
			"seconds", number(t.seconds), "memory-bytes", number(t.memory),
			"disk-bytes", number(t.disk));

		if (!o || json_array_append_new(jobs, o)) {
			json_decref(jobs);
			return NULL;
		}
	}
	return json_pack("{ss ss so}", "made-by", "ct-sr " PACKAGE_VERSION, "output",
		x->jobs.step[x->jobs.n - 1].output, "jobs", jobs);
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

static int put_rules(FILE *f, const json_t *plan, struct ct_err *e)
{
	const json_t *job, *word;
	size_t i, k;

	fprintf(f,
		"# The jobs of plan.json: make -j4 -f this file\nequals := =\n.PHONY: all\nall: ");
	put_name(f, json_string_value(json_object_get(plan, "output")), false);
	json_array_foreach (json_object_get(plan, "jobs"), i, job) {
		fputs("\n\n", f);
		put_name(f, json_string_value(json_array_get(json_object_get(job, "outputs"), 0)),
			true);
		fputc(':', f);
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

static int put_json(FILE *f, const json_t *plan, struct ct_err *e)
{
	(void)e;
	json_dumpf(plan, f, JSON_INDENT(2)); /* ct_out_commit looks at f */
	fputc('\n', f);
	return 0;
}

static int write_one(const struct plan *x, const char *name,
	int (*put)(FILE *f, const json_t *plan, struct ct_err *e), const json_t *plan,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env own = *env;
	struct ct_out o = {0};
	char *path = ct_chain_path(x->c, name);
	int rc = -1;

	own.force = true;
	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_out_open(&o, path, &own, e) == 0 && put(o.f, plan, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(path);
	return rc;
}

/* plan.json last: where it is the plan is whole. */
static int write_plan(const struct plan *x, const struct ct_env *env, struct ct_err *e)
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
static int check(const struct plan *x, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_chain *c = x->c;
	char *path = ct_chain_path(c, PLAN);
	int rc = check_name(c->folder.path, e) || check_name(c->step[c->n - 1].output, e) ? -1 : 0;

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

static int open_plan(struct plan *x, const struct ct_env *env, struct ct_err *e)
{
	size_t bytes;

	x->most = INFINITY;
	if (x->p->memory) {
		if (ct_memory_bytes(&bytes, x->p->memory, e))
			return -1;
		x->most = (double)bytes;
	}
	return check(x, env, e);
}

int sr_plan(struct ct_chain *c, const struct sr *p, size_t views, const struct ct_env *env,
	struct ct_err *e)
{
	struct plan x = {.c = c, .p = p, .jobs = {.folder.lock = -1}};
	void *answer = NULL;
	int rc = -1;

	if (open_plan(&x, env, e) || ct_chain_start(c, 0, env, e) ||
		ct_chain_ask(&answer, c, 1, env, e))
		goto out;
	x.told = answer;
	choose_slabs(&x, env);
	if (divide(&x, views, e))
		goto out;
	clear(&x);
	rc = write_plan(&x, env, e);
	if (rc == 0)
		ct_log(env, CT_INFO, "%zu jobs: make -f %s/" PLAN_RULES, x.jobs.n, c->folder.path);
out:
	json_decref(x.told);
	for (size_t i = 0; i < x.names; i++)
		free(x.name[i]);
	free(x.name);
	free(x.takes);
	ct_chain_close(&x.jobs);
	return rc;
}
