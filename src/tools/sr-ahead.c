/* sr-ahead.c: about how long the published method takes; see sr.h.
 *
 * All steps run once with VIEWS projections, CALLS calls of the network a view and ITERATIONS of
 * the fit, at full size. What they took is scaled; what the fit takes before it begins is not.
 * Processor time, so that other work on the machine does not count.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "tools/sr.h"

enum { VIEWS = 2, CALLS = 2, ITERATIONS = 20 };

struct trial {
	const struct ct_step_paper_keeper *keeper; /* of the run that is asked for */
	double begin, before;                      /* CPU seconds: of a step; of its fit */
	double took[CT_STEP_PAPER_STEPS];
};

static int prior(void *ctx, struct ct_tensors *w, struct ct_err *e)
{
	const struct trial *t = ctx;

	return t->keeper->prior(t->keeper->ctx, w, e);
}

static int before(void *ctx, enum ct_step_paper_made k, struct ct_env *env, struct ct_err *e)
{
	struct trial *t = ctx;

	(void)k;
	(void)env;
	(void)e;
	t->begin = ct_clock_cpu();
	return 0;
}

static int fit(void *ctx, struct ct_fit *f, struct ct_err *e)
{
	struct trial *t = ctx;

	(void)f;
	(void)e;
	t->before = ct_clock_cpu() - t->begin;
	return 0;
}

static int after(void *ctx, enum ct_step_paper_made k, void *made, bool again, struct ct_err *e)
{
	struct trial *t = ctx;

	(void)made;
	(void)e;
	if (!again)
		t->took[k] = ct_clock_cpu() - t->begin;
	return 0;
}

int sr_paper_seconds(double *cpu, const struct ct_step_paper *plan, struct ct_vol *lr,
	const struct ct_step_paper_keeper *keeper, const struct ct_env *env, struct ct_err *e)
{
	struct trial t = {.keeper = keeper};
	const struct ct_step_paper_keeper tried = {
		.ctx = &t, .prior = prior, .before = before, .after = after, .fit = fit};
	struct ct_step_paper few = *plan;
	struct ct_step_fit_report did;
	struct ct_env quiet = *env;
	struct ct_vol out = {0};
	double views, calls, iterations;
	int rc;

	few.rule.views = plan->rule.views < VIEWS ? plan->rule.views : VIEWS;
	few.rule.iterations =
		plan->rule.iterations < ITERATIONS ? plan->rule.iterations : ITERATIONS;
	few.calls = plan->calls < CALLS ? plan->calls : CALLS;
	quiet.log = NULL;
	quiet.progress = NULL;
	rc = ct_step_paper_run(&out, &did, &few, lr, &tried, &quiet, e);
	ct_vol_free(&out);
	views = (double)plan->rule.views / (double)few.rule.views;
	calls = (double)plan->calls / (double)few.calls;
	iterations = (double)plan->rule.iterations / (double)few.rule.iterations;
	*cpu = t.took[CT_STEP_PAPER_UP] +
	       views * (t.took[CT_STEP_PAPER_UP_PROJ] + t.took[CT_STEP_PAPER_LR_PROJ] +
			       calls * t.took[CT_STEP_PAPER_SR_PROJ]) +
	       t.before + iterations * (t.took[CT_STEP_PAPER_RESIDUAL] - t.before) +
	       t.took[CT_STEP_PAPER_RESULT];
	return rc;
}
