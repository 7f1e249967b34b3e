/* train-loop.c: see train-loop.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cost-report.h"
#include "cli/stop.h"
#include "train/data.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/stream.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tools/train-loop.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BEST "best" /* the tensor in a state */

/* The best weights so far, by the loss on held-out data. */
struct train_best {
	float *v; /* the values of the tensors of the result, in their order; owned; NULL: none yet
		   */
	size_t n;
	double loss;
	uint64_t step, seen; /* of these weights; of the last that was judged */
	uint64_t worse;      /* judged since, none of them better */
};

static void train_best_free(struct train_best *b)
{
	free(b->v);
	*b = (struct train_best){0};
}

static size_t values(const struct ct_tensors *w)
{
	size_t n = 0;

	for (size_t i = 0; i < w->n; i++)
		n += ct_tensor_count(&w->t[i]);
	return n;
}

/* The loss of the result w after a step: the best if it is smaller than that of all before. */
static int train_best_judge(struct train_best *b, double loss, uint64_t step,
	const struct ct_tensors *w, struct ct_err *e)
{
	b->seen = step;
	if (b->v && !(loss < b->loss)) {
		b->worse++;
		return 0;
	}
	if (!b->v) {
		b->n = values(w);
		if (ct_alloc(&b->v, b->n, sizeof *b->v, e))
			return -1;
	}
	for (size_t i = 0, at = 0; i < w->n; at += ct_tensor_count(&w->t[i++]))
		memcpy(b->v + at, w->t[i].data, ct_tensor_count(&w->t[i]) * sizeof *b->v);
	b->loss = loss;
	b->step = step;
	b->worse = 0;
	return 0;
}

/* The best in the place of w, a result of the same training; nothing if there is none yet. */
static int train_best_take(const struct train_best *b, struct ct_tensors *w, struct ct_err *e)
{
	if (!b->v)
		return 0;
	if (b->n != values(w))
		return ct_fail(
			e, CT_EINPUT, "not the state of this training: %zu best weights", b->n);
	for (size_t i = 0, at = 0; i < w->n; at += ct_tensor_count(&w->t[i++]))
		memcpy(w->t[i].data, b->v + at, ct_tensor_count(&w->t[i]) * sizeof *b->v);
	return ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)b->step);
}

/* To a state. */
static int train_best_put(const struct train_best *b, struct ct_tensors *state, struct ct_err *e)
{
	if (!b->v)
		return 0;
	if (ct_tensors_put(state, BEST, 1, &b->n, b->v, e))
		return -1;
	return ct_meta_setf(&state->meta, e, CT_META_BEST, "%.17g,%llu,%llu,%llu", b->loss,
		(unsigned long long)b->step, (unsigned long long)b->seen,
		(unsigned long long)b->worse);
}

/* And back; a state without is one in which nothing was judged. */
static int train_best_get(struct train_best *b, const struct ct_tensors *state, struct ct_err *e)
{
	const struct ct_tensor *t = ct_tensors_find(state, BEST);
	double v[4];
	int rc = ct_meta_numbers(&state->meta, CT_META_BEST, 4, v, e);

	if (rc > 0 && !t)
		return 0;
	if (rc || !t || t->rank != 1)
		return rc < 0 ? -1
			      : ct_fail(e, CT_EINPUT,
					"not the state of a training: \"" CT_META_BEST "\"");
	for (int i = 1; i < 4; i++)
		if (!(v[i] >= 0 && v[i] < 0x1p53))
			return ct_fail(e, CT_EINPUT, "\"" CT_META_BEST "\": %g", v[i]);
	if (!ct_tensors_vector(state, BEST, t->dim[0], e))
		return -1;
	*b = (struct train_best){.n = t->dim[0],
		.loss = v[0],
		.step = (uint64_t)v[1],
		.seen = (uint64_t)v[2],
		.worse = (uint64_t)v[3]};
	if (ct_alloc(&b->v, b->n, sizeof *b->v, e))
		return -1;
	memcpy(b->v, t->data, b->n * sizeof *b->v);
	return 0;
}

struct train_loop_job {
	struct train_subject *s;
	const struct train_data *data;
	const struct train_params *p;
	struct ct_resume *resume;
	struct ct_env env;
	struct train_best best; /* where it is judged */
	double start, told;     /* seconds */
	double loss;            /* summed since the last word */
	size_t losses;
};

/* "NAME hash; NAME hash" of all DATA and of --with. */
static int dataset(char **out, const struct train_data *d, struct ct_err *e)
{
	const char *with = ct_meta_get(&d->with, CT_META_DATASET);
	size_t bytes;
	FILE *f;

	if (ct_stream_open(&f, out, &bytes, e))
		return -1;
	for (size_t i = 0; i < d->n; i++)
		fprintf(f, "%s%s", i ? "; " : "", ct_meta_get(&d->input[i], CT_META_INPUT));
	fflush(f);
	if (with && strcmp(with, *out) != 0)
		fprintf(f, "; %s", with);
	return ct_stream_close(f, out, e);
}

/* Are all steps done, or is the patience used up? */
static bool ended(const struct train_loop_job *j)
{
	return j->s->steps >= (uint64_t)j->p->steps ||
	       (j->p->patience && j->best.worse >= (uint64_t)j->p->patience);
}

/* The tensors of OUT. */
static int prior(const struct train_loop_job *j, struct ct_tensors *w, struct ct_err *e)
{
	if (j->s->result(j->s->it, w, e) || train_best_take(&j->best, w, e))
		return -1;
	return j->s->seal ? j->s->seal(j->s->it, w, ended(j), e) : 0;
}

static int write_prior(const struct train_loop_job *j, struct ct_err *e)
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
	if (prior(j, &w, e) || ct_meta_set(&w.meta, CT_META_DATASET, text, e) ||
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

static int pack(struct ct_tensors *state, const void *work, struct ct_err *e)
{
	const struct train_loop_job *j = work;

	return ct_err_any(
		j->s->save(j->s->training, state, e) || train_best_put(&j->best, state, e));
}

static int checkpoint(struct train_loop_job *j, struct ct_err *e)
{
	int rc;

	ct_stop_defer(true);
	rc = ct_err_any(ct_resume_save(j->resume, pack, j, e) || write_prior(j, e));
	ct_stop_defer(false);
	return rc;
}

/* The last checkpoint. If one of the two files cannot be written, the other is. */
static int finish(struct train_loop_job *j, struct ct_err *e)
{
	int rc;

	ct_stop_defer(true);
	rc = write_prior(j, e);
	if (rc)
		ct_resume_rescue(j->resume, pack, j, e);
	else
		rc = ct_resume_save(j->resume, pack, j, e);
	ct_stop_defer(false);
	return ct_err_any(rc);
}

/* Tells the state what the training depends on besides the options. The number of steps matters if
 * the learning rate falls to the last step, and the held-out data if they choose the weights. */
static int name_run(struct train_loop_job *j, struct ct_err *e)
{
	for (size_t i = 0; i < j->data->n; i++) {
		char name[40];

		snprintf(name, sizeof name, "DATA %zu", i + 1);
		if (ct_resume_input(j->resume, name, &j->data->input[i], e))
			return -1;
	}
	if (j->p->patience && (ct_resume_input(j->resume, "--validate", &j->data->held, e) ||
				      ct_resume_value(j->resume, e, "--expert validate-every", "%d",
					      j->p->validate_every) ||
				      ct_resume_value(j->resume, e, "--expert validate-pieces",
					      "%d", j->p->validate_pieces)))
		return -1;
	return j->p->cosine || j->p->kind == TRAIN_SLICES
		       ? ct_resume_value(j->resume, e, "--steps", "%d", j->p->steps)
		       : 0;
}

static int unpack(void *work, const struct ct_tensors *state, struct ct_err *e)
{
	struct train_loop_job *j = work;
	double step = 0;

	if (j->s->restore(j->s->training, state, e) || train_best_get(&j->best, state, e) ||
		ct_meta_numbers(&state->meta, CT_META_STEP, 1, &step, e))
		return -1;
	j->s->steps = (uint64_t)step;
	return 0;
}

/* Is there an OUT, and did it learn from other data than this training? */
static bool others(const struct train_loop_job *j)
{
	struct ct_meta m = {0};
	struct ct_err any = {0};
	bool other = access(j->p->out, F_OK) == 0;

	if (other && ct_tensors_read_meta(j->p->out, &m, &any) == 0) {
		const char *learnt = ct_meta_get(&m, CT_META_DATASET);

		other = !learnt;
		for (size_t i = 0; i < j->data->n && !other; i++) {
			const char *input = ct_meta_get(&j->data->input[i], CT_META_INPUT);
			const char *hash = input ? strrchr(input, ' ') : NULL;

			other = !hash || !strstr(learnt, hash);
		}
	}
	ct_meta_free(&m);
	return other;
}

static int load_state(struct train_loop_job *j, const struct ct_env *asked, struct ct_err *e)
{
	int rc = ct_resume_load(j->resume, unpack, j, e);

	if (rc < 0 || !j->p->resume || asked->command->dry_run)
		return rc < 0 ? -1 : 0;
	if (rc > 0)
		return ct_out_check(j->p->out, asked, e);
	if (ct_io_rule_of(asked).force || !others(j))
		return 0;
	return ct_fail(e, CT_EOUTPUT,
		"%s: is not of the training that is resumed; --force overwrites it", j->p->out);
}

/* Reports the loss on held-out data, when it is time. */
static int judge(struct train_loop_job *j, struct ct_err *e)
{
	const uint64_t step = j->s->steps;
	struct ct_tensors w = {0};
	double held;
	int rc;

	if (!j->s->held || step == 0 || step == j->best.seen ||
		(step % (unsigned)j->p->validate_every && step != (uint64_t)j->p->steps))
		return 0;
	ct_stop_test();
	if (j->s->held(j->s->it, &held, e))
		return -1;
	ct_log(&j->env, CT_INFO, "step %llu: held-out loss %.5f", (unsigned long long)step, held);
	j->told = ct_clock_wall();
	if (!j->p->patience)
		return 0;
	rc = ct_err_any(
		j->s->result(j->s->it, &w, e) || train_best_judge(&j->best, held, step, &w, e));
	ct_tensors_free(&w);
	return rc;
}

/* Reports the loss, when it is time. */
static void tell(struct train_loop_job *j, double loss)
{
	const unsigned long long step = j->s->steps;
	const bool last = step == (unsigned long long)j->p->steps;

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
}

/* One step and its reports. */
static int step(struct train_loop_job *j, struct ct_err *e)
{
	double loss;

	if (j->s->step(j->s->training, &loss, e))
		return -1;
	j->s->steps++;
	tell(j, loss);
	return judge(j, e);
}

static int train(struct train_loop_job *j, struct ct_err *e)
{
	const uint64_t every = (uint64_t)j->p->checkpoint_every, all = (uint64_t)j->p->steps;
	struct ct_env_part part = {.env = &j->env, .from = TRAIN_DATA_READS, .to = 1};
	struct ct_env own;

	ct_env_part(&own, &part);
	if (j->s->steps > 0)
		ct_progress(&own, "training", 0, 0);
	if (j->p->patience && judge(j, e) && e->code != CT_ESTOP) /* a signal may come first */
		return -1;
	while (!ended(j) && !ct_stopping(&j->env)) {
		if (j->p->minutes > 0 && ct_clock_wall() - j->start > 60 * j->p->minutes)
			break;
		if (step(j, e)) {
			if (e->code != CT_ESTOP)
				return -1;
			break; /* one that is given up has changed nothing */
		}
		ct_progress_until(&own, "training", j->s->steps, all,
			j->p->patience || j->p->minutes > 0 ? all : 0);
		if (j->resume->path && j->s->steps % every == 0 && checkpoint(j, e))
			return -1;
	}
	if (j->best.v)
		ct_log(&j->env, CT_INFO, "step %llu: the best, held-out loss %.5f",
			(unsigned long long)j->best.step, j->best.loss);
	if (finish(j, e))
		return -1;
	return ct_check_stop(&j->env, e);
}

/* Prints the cost. Two steps give the time. */
static int estimate(struct train_loop_job *j, struct ct_err *e)
{
	struct ct_cost cost = {0};
	double loss, t;

	if (j->s->step(j->s->training, &loss, e))
		return -1;
	t = ct_clock_wall();
	if (j->s->step(j->s->training, &loss, e))
		return -1;
	t = ct_clock_wall() - t;
	cost.seconds = t * j->p->steps;
	if (j->s->cost(j->s->it, t, &cost, e))
		return -1;
	if (j->p->patience) { /* the best beside the last */
		cost.memory += cost.state / 4;
		cost.state += cost.state / 4;
	}
	cost.memory += cost.state; /* a copy of it is written */
	return ct_cost_print(&cost, &j->env, e);
}

int train_loop(struct train_subject *s, const struct train_data *data, struct ct_resume *resume,
	const struct train_params *p, const struct ct_env *asked, struct ct_err *e)
{
	struct train_loop_job j = {.s = s, .data = data, .p = p, .resume = resume, .env = *asked};
	struct ct_io_rule rule = ct_io_rule_of(asked);
	int rc;

	j.env.verbose++;   /* the losses are news even without -v */
	rule.force = true; /* its own files, from now on */
	j.env.files = &rule;
	j.start = j.told = ct_clock_wall();
	rc = name_run(&j, e) || load_state(&j, asked, e) ? -1
	     : asked->command->dry_run                   ? estimate(&j, e)
							 : train(&j, e);
	train_best_free(&j.best);
	return rc;
}
