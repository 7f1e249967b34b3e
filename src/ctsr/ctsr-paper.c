/* ctsr-paper.c: the published method, its steps in one call. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"
#include "ctsr/ctsr-impl.h"
#include "formats/format.h"
#include "formats/units.h"
#include "steps/step-paper.h"

#include <stdlib.h>

static int rule_of(struct ct_step_paper_rule *r, const ctsr_paper_options *o, struct ct_err *e)
{
	if (o->factor > 1024 || o->views > 10000 || o->iterations > 1000000 ||
		o->gaussians > 100000000)
		return ct_fail(e, CT_EUSAGE,
			"a factor of at most 1024, 10000 views, 1e6 iterations and 1e8 Gaussians are "
			"expected");
	*r = (struct ct_step_paper_rule){.in = "volume",
		.factor = {(double)o->factor, (double)o->factor, (double)o->factor},
		.views = (int)o->views,
		.iterations = (int)o->iterations,
		.gaussians = (int)o->gaussians,
		.release = o->release != 0};
	return 0;
}

static int read_prior(void *plan, struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_step_paper *p = plan;

	return ct_tensors_read(p->rule.prior, w, e);
}

/* What is read of a file is checked again. */
static int check(void *plan, enum ct_step_paper_made k, void *made, bool again, struct ct_err *e)
{
	(void)plan;
	(void)again;
	return k == CT_STEP_PAPER_UP ? ct_units_check(made, "quantity", e) : 0;
}

static int paper(
	struct ct_vol *out, const ctsr_volume *in, const ctsr_paper_options *o, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&in->v.meta};
	const char *history = ct_meta_get(&in->v.meta, CT_META_HISTORY);
	struct ct_step_paper_rule rule;
	struct ct_step_fit_report did;
	struct ct_step_paper plan;
	const struct ct_step_paper_keeper keeper = {
		.ctx = &plan, .prior = read_prior, .after = check};
	struct ct_err *e = &k->err;
	struct ct_vol lr = {0};
	char *prior = NULL;
	int rc = -1;

	if (rule_of(&rule, o, e) || ctsr_check_hu(in, rule.in, e) ||
		ct_installed_prior(&prior, o->prior_file, "prior.safetensors", e))
		goto out;
	rule.prior = prior;
	if (ct_step_paper_plan(&plan, &rule, &in->v.meta, e) == 0 &&
		ctsr_copy_volume(&lr, in, e) == 0 &&
		ct_step_paper_run(out, &did, &plan, &lr, &keeper, &k->env, e) == 0) {
		ct_meta_drop(&out->meta, CT_META_HISTORY); /* one step, not one each */
		rc = ct_err_any((history && ct_meta_set(&out->meta, CT_META_HISTORY, history, e)) ||
				ctsr_note_history(k, &out->meta, 1, from));
	}
out:
	ct_vol_free(&lr);
	free(prior);
	return rc;
}

int ctsr_paper(ctsr_volume **out, const ctsr_volume *in, const ctsr_paper_options *o,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	ctsr_paper_options mine = {0};
	const int rc = ctsr_make_volume(&k, out) || ctsr_call_begin(&k, in, c) ||
		       ctsr_take_options(&mine, sizeof mine, o, &k.err) ||
		       paper(&(*out)->v, in, &mine, &k);

	return ctsr_call_end(&k, rc, e);
}
