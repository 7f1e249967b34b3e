/* train-loop.c: see train.h. */
#include "config.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "core/mem.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tools/train.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct job {
	struct train_subject *s;
	const struct train_data *data;
	const struct train_params *p;
	struct ct_resume *resume;
	struct ct_env env;
	double start, told; /* seconds */
	double loss;        /* summed since the last word */
	size_t losses;
};

/* "NAME hash; NAME hash" of all DATA, and those of the prior that OUT holds too. */
static int dataset(char **out, const struct train_data *d, struct ct_err *e)
{
	const char *with = ct_meta_get(&d->with, CT_META_DATASET);
	size_t size = 1 + (with ? strlen(with) + 2 : 0), used = 0;

	for (size_t i = 0; i < d->n; i++)
		size += strlen(ct_meta_get(&d->input[i], CT_META_INPUT)) + 2;
	if (ct_alloc0(out, size, 1, e))
		return -1;
	for (size_t i = 0; i < d->n; i++)
		used += (size_t)snprintf(*out + used, size - used, "%s%s", i ? "; " : "",
			ct_meta_get(&d->input[i], CT_META_INPUT));
	if (with && strcmp(with, *out) != 0)
		snprintf(*out + used, size - used, "; %s", with);
	return 0;
}

static int write_prior(const struct job *j, struct ct_err *e)
{
	const size_t n = j->data->n;
	const struct ct_meta **in = NULL;
	struct ct_tensors w = {0};
	char *text = NULL;
	int rc = -1;

	if (ct_alloc(&in, n + 1, sizeof(struct ct_meta *), e) || dataset(&text, j->data, e))
		goto out;
	for (size_t i = 0; i < n; i++)
		in[i] = &j->data->input[i];
	in[n] = &j->data->with;
	if (j->s->result(j->s->it, &w, e) || ct_meta_set(&w.meta, CT_META_DATASET, text, e) ||
		(j->p->licence && ct_meta_set(&w.meta, CT_META_LICENCE, j->p->licence, e)) ||
		ct_meta_step(&w.meta, &j->env, n + 1, in, e))
		goto out;
	rc = ct_tensors_write(j->p->out, &w, j->p->half, &j->env, e);
out:
	ct_tensors_free(&w);
	free(text);
	free(in);
	return rc;
}

static int checkpoint(struct job *j, struct ct_err *e)
{
	int rc;

	ct_stop_defer(true);
	rc = ct_resume_save(j->resume, j->s->save, j->s->it, e) || write_prior(j, e) ? -1 : 0;
	ct_stop_defer(false);
	return rc;
}

/* The last checkpoint: where one of the two files cannot be written, the other one is. */
static int finish(struct job *j, struct ct_err *e)
{
	struct ct_err why;
	int kept, rc;

	ct_stop_defer(true);
	kept = ct_resume_save(j->resume, j->s->save, j->s->it, &why);
	rc = write_prior(j, e);
	if (rc)
		ct_resume_rescue(j->resume, j->s->save, j->s->it, e);
	else if (kept)
		*e = why;
	ct_stop_defer(false);
	return rc || kept ? -1 : 0;
}

/* What the course of the training depends on besides the options; how far it goes changes the rate
 * of learning only if that falls to the end. */
static int name_run(struct job *j, struct ct_err *e)
{
	for (size_t i = 0; i < j->data->n; i++) {
		char name[40];

		snprintf(name, sizeof name, "DATA %zu", i + 1);
		if (ct_resume_input(j->resume, name, &j->data->input[i], e))
			return -1;
	}
	if (ct_resume_input(j->resume, "--base", j->p->base ? &j->data->base : NULL, e))
		return -1;
	return j->p->cosine || j->p->slices
		       ? ct_resume_value(j->resume, e, "--steps", "%d", j->p->steps)
		       : 0;
}

static int load_state(struct job *j, const struct ct_env *asked, struct ct_err *e)
{
	struct ct_tensors w = {0};
	int rc = ct_resume_load(j->resume, &w, e);

	if (rc > 0 && j->p->resume && !asked->dry_run &&
		ct_out_check(j->p->out, asked, e)) /* OUT is another's */
		rc = -1;
	if (rc == 0 && j->s->restore(j->s->it, &w, e))
		rc = ct_blame(e, j->resume->path);
	ct_tensors_free(&w);
	return rc < 0 ? -1 : 0;
}

/* The words after a step: the loss, and the one on held-out data, when it is time. */
static int tell(struct job *j, double loss, struct ct_err *e)
{
	const unsigned long long step = j->s->steps(j->s->it);
	const bool last = step == (unsigned long long)j->p->steps;
	double held;

	j->loss += loss;
	j->losses++;
	if (step % (unsigned)j->p->log_every == 0 || last) {
		ct_log(&j->env, CT_INFO, "step %llu: loss %.5f, %.2f s a step", step,
			j->loss / (double)j->losses,
			(ct_clock_wall() - j->told) / (double)j->losses);
		j->loss = 0;
		j->losses = 0;
		j->told = ct_clock_wall();
	}
	if (j->s->held && (step % (unsigned)j->p->validate_every == 0 || last)) {
		if (j->s->held(j->s->it, &held, e))
			return -1;
		ct_log(&j->env, CT_INFO, "step %llu: held-out loss %.5f", step, held);
		j->told = ct_clock_wall();
	}
	return 0;
}

static int train(struct job *j, struct ct_err *e)
{
	const uint64_t every = (uint64_t)j->p->checkpoint_every, all = (uint64_t)j->p->steps;
	double loss;

	while (j->s->steps(j->s->it) < all && !ct_stopping(&j->env)) {
		if (j->p->minutes > 0 && ct_clock_wall() - j->start > 60 * j->p->minutes)
			break;
		if (j->s->step(j->s->it, &loss, e) || tell(j, loss, e)) {
			if (e->code != CT_ESTOP)
				return -1;
			break; /* one that is given up has changed nothing */
		}
		ct_progress(&j->env, "training", j->s->steps(j->s->it), all);
		if (j->resume->path && j->s->steps(j->s->it) % every == 0 && checkpoint(j, e))
			return -1;
	}
	if (finish(j, e))
		return -1;
	return ct_check_stop(&j->env, e);
}

/* What it would take; the time from two steps. */
static int estimate(struct job *j, struct ct_err *e)
{
	struct ct_cost cost = {0};
	double loss, t;

	if (j->s->step(j->s->it, &loss, e))
		return -1;
	t = ct_clock_wall();
	if (j->s->step(j->s->it, &loss, e))
		return -1;
	t = ct_clock_wall() - t;
	cost.seconds = t * j->p->steps;
	if (j->s->cost(j->s->it, t, &cost, e))
		return -1;
	return ct_cost_print(&cost, &j->env, e);
}

int train_loop(struct train_subject *s, const struct train_data *data, struct ct_resume *resume,
	const struct train_params *p, const struct ct_env *asked, struct ct_err *e)
{
	struct job j = {.s = s, .data = data, .p = p, .resume = resume, .env = *asked};

	j.env.verbose++;    /* the losses are news even without -v */
	j.env.force = true; /* its own files, from now on */
	j.start = j.told = ct_clock_wall();
	if (name_run(&j, e) || load_state(&j, asked, e))
		return -1;
	return asked->dry_run ? estimate(&j, e) : train(&j, e);
}
