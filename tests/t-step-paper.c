/* The published method in memory: what is decided, what is refused, what a keeper is asked, and the
 * same result by each way. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/format.h"
#include "operator/degrade.h"
#include "scratch.h"
#include "steps/step-paper.h"
#include "xray/window.h"

static struct ct_err e;

static void test_plan(void)
{
	struct ct_step_paper_rule rule = {.in = "a", .prior = "p", .factor = {4, 4, 4}};
	struct ct_meta clipped = {0};
	struct ct_step_paper p;

	OK(ct_step_paper_plan(&p, &rule, NULL, &e) == 0 && p.rule.views == 100 && p.calls == 50 &&
			p.rule.iterations == 5000 && p.rule.gaussians == 50000 &&
			p.sigma_y == 0.0015 && p.window[0] == -512 && p.window[1] == 3071,
		"the paper has its constants");
	OK(!p.way.zoom && !p.way.cells && !p.way.first && !p.way.fit &&
			p.way.range == CT_SUPERRES_STACK,
		"the paper has none of the release's ways");
	rule.release = true;
	OK(ct_step_paper_plan(&p, &rule, NULL, &e) == 0 && p.sigma_y == 0.001 &&
			p.rule.views == 300 && p.window[0] == -512 && p.window[1] == 3071,
		"the release has another sigma_y and more views up to 4 times");
	OK(p.way.zoom && p.way.cells && p.way.first && p.way.fit &&
			p.way.range == CT_SUPERRES_BYTES,
		"the release has its own interpolation, place, pictures and fit");
	must(ct_meta_set(&clipped, CT_META_CLIP, "-512:1893.5", &err));
	OK(ct_step_paper_plan(&p, &rule, &clipped, &e) == 0 && p.window[1] == 1893.5,
		"the window of the release is the range that the CT was clipped to");
	rule.release = false;
	OK(ct_step_paper_plan(&p, &rule, &clipped, &e) == 0 && p.window[1] == 3071,
		"that of the paper is not");
	rule.release = true;
	ct_meta_free(&clipped);
	rule.factor[0] = rule.factor[1] = rule.factor[2] = 5;
	OK(ct_step_paper_plan(&p, &rule, NULL, &e) == 0 && p.sigma_y == 0.0025 &&
			p.rule.views == 100,
		"the release has another sigma_y above 4 times");
	rule.factor[0] = rule.factor[1] = rule.factor[2] = 1;
	OK(ct_step_paper_plan(&p, &rule, NULL, &e) == -1 && e.code == CT_EUSAGE,
		"a factor of 1 is refused");
	rule.factor[0] = rule.factor[1] = rule.factor[2] = 17;
	OK(ct_step_paper_plan(&p, &rule, NULL, &e) == -1 && e.code == CT_EUSAGE,
		"a factor of 17 is refused");
	rule.factor[0] = rule.factor[1] = rule.factor[2] = 2;
	rule.gaussians = 500001;
	OK(ct_step_paper_plan(&p, &rule, NULL, &e) == -1 && e.code == CT_EUSAGE,
		"more Gaussians than a fit may have are refused");
	rule.gaussians = 0;
	rule.release = false;
	must(ct_step_paper_plan(&p, &rule, NULL, &err));
	OK(ct_step_paper_bytes(&p, (const size_t[3]){100, 100, 100}) == 4e6 * (1 + 2 * 8 + 4),
		"two large volumes and the views are the least that is needed");
}

/* What keepers see. */
static struct seen {
	size_t before, after, again, fetched, stop_at;
	enum ct_step_paper_made last;
	bool in_order, rises;
	double done;
} seen;
static struct kept {
	struct ct_vol up, result;
	struct ct_stack stack[3];
	struct ct_gauss g;
} kept;
static volatile sig_atomic_t stop;

static int prior(void *ctx, struct ct_tensors *w, struct ct_err *why)
{
	(void)ctx;
	return ct_tensors_read(getenv("CT_T_PRIOR"), w, why);
}

static int before(void *ctx, enum ct_step_paper_made k, struct ct_env *env, struct ct_err *why)
{
	(void)ctx;
	(void)env;
	(void)why;
	seen.in_order &= seen.before == 0 ? k == CT_STEP_PAPER_UP : k == seen.last + 1;
	seen.last = k;
	seen.before++;
	stop = seen.stop_at && seen.before == seen.stop_at;
	return 0;
}

static int after(void *ctx, enum ct_step_paper_made k, void *made, bool again, struct ct_err *why)
{
	(void)ctx;
	seen.after++;
	seen.again += again;
	if (k == CT_STEP_PAPER_UP && !kept.up.data)
		must(ct_vol_like(&kept.up, made, why) ||
			ct_meta_copy(&kept.up.meta, &((struct ct_vol *)made)->meta, why));
	if (k == CT_STEP_PAPER_UP)
		memcpy(kept.up.data, ((struct ct_vol *)made)->data,
			ct_vol_count(made) * sizeof(float));
	return 0;
}

static int fetch(void *ctx, enum ct_step_paper_made k, void *made, struct ct_err *why)
{
	struct ct_vol *v = made;

	(void)ctx;
	seen.fetched++;
	if (k != CT_STEP_PAPER_UP)
		return ct_fail(why, CT_EFAIL, "nothing but the volume that was let go is fetched");
	must(ct_vol_like(v, &kept.up, why));
	memcpy(v->data, kept.up.data, ct_vol_count(v) * sizeof *v->data);
	return ct_meta_copy(&v->meta, &kept.up.meta, why);
}

static void progress(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	(void)env;
	(void)likely;
	seen.rises &= strcmp(what, CT_PROGRESS_WHOLE) == 0 && total == CT_PROGRESS_PARTS &&
		      (double)done >= seen.done && done <= total;
	seen.done = (double)done;
}

/* A CT of 8 voxels a side, in the window, that a finer one was reduced to. */
static void make_scan(struct ct_vol *v)
{
	const struct ct_degrade by = {.factor = {2, 2, 2}, .sigma = {0.8, 0.8, 0.8}};

	*v = (struct ct_vol){.n = {0}};
	must(ct_vol_alloc(v, (const size_t[3]){8, 8, 8}, &err));
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 8;
	for (size_t i = 0; i < 512; i++)
		v->data[i] = (float)(i * i % 997) - 400;
	must(ct_degrade_put(&v->meta, &by, &err));
	must(ct_meta_set(&v->meta, CT_META_CLIP, "-512:3071", &err));
}

static struct ct_step_fit_report did; /* of the last run */

static int run(struct ct_vol *out, const struct ct_step_paper_keeper *keeper, size_t threads)
{
	const struct ct_step_paper_rule rule = {.in = "scan.nii",
		.prior = "prior",
		.factor = {2, 2, 2},
		.views = 2,
		.iterations = 3,
		.gaussians = 10};
	struct ct_env env = {.progress = progress, .stop = &stop};
	const size_t at = seen.stop_at;
	struct ct_step_paper p;
	struct ct_vol lr;
	int rc;

	seen = (struct seen){.in_order = true, .rises = true, .stop_at = at};
	stop = 0;
	memset(&did, 0x7f, sizeof did);
	e = (struct ct_err){0};
	*out = (struct ct_vol){.n = {0}};
	make_scan(&lr);
	must(ct_par_alloc(&env.par, threads, &err));
	must(ct_step_paper_plan(&p, &rule, NULL, &err));
	rc = ct_step_paper_run(out, &did, &p, &lr, keeper, &env, &e);
	if (rc == 0)
		OK(did.iterations == 3 && did.gaussians == 10, "the report is that of the fit");
	ct_par_free(env.par);
	ct_vol_free(&lr);
	return rc;
}

static bool same(const struct ct_vol *a, const struct ct_vol *b)
{
	return a->data && b->data && memcmp(a->n, b->n, sizeof a->n) == 0 &&
	       memcmp(a->data, b->data, ct_vol_count(a) * sizeof *a->data) == 0;
}

static void test_runs(void)
{
	const struct ct_step_paper_keeper alone = {.prior = prior},
					  sees = {.prior = prior, .before = before, .after = after},
					  keeps = {.prior = prior,
						  .before = before,
						  .after = after,
						  .fetch = fetch};
	struct ct_vol want, got;

	OK(run(&want, &alone, 1) == 0 && want.n[0] == 16,
		"the paper runs with nothing but a prior: %s", e.msg);
	OK(seen.rises && seen.done == CT_PROGRESS_PARTS,
		"progress is one part of the whole, and never falls");
	OK(run(&got, &alone, 3) == 0 && same(&want, &got), "three threads make the same bytes");
	ct_vol_free(&got);
	OK(run(&got, &sees, 1) == 0 && same(&want, &got) && seen.in_order && seen.before == 6,
		"a keeper is asked before each step, in order");
	OK(seen.after == 8 && seen.again == 2, "the large volume is made anew where it is needed");
	ct_vol_free(&got);
	OK(run(&got, &keeps, 1) == 0 && same(&want, &got) && seen.again == 0 && seen.fetched == 2,
		"it is fetched where it is kept: %s", e.msg);
	ct_vol_free(&got);
	for (seen.stop_at = 1; seen.stop_at <= 5; seen.stop_at++)
		OK(run(&got, &sees, 1) == -1 && e.code == CT_ESTOP && !got.data,
			"a stop within step %zu ends the run", seen.stop_at);
	ct_vol_free(&want);
	ct_vol_free(&kept.up);
}

static int no_prior(void *ctx, struct ct_tensors *w, struct ct_err *why)
{
	(void)ctx;
	(void)w;
	return ct_fail(why, CT_EINPUT, "prior: is not there");
}

static void test_errors(void)
{
	const struct ct_step_paper_keeper keeper = {.prior = no_prior};
	struct ct_vol got;

	seen.stop_at = 0;
	OK(run(&got, &keeper, 1) == -1 && e.code == CT_EINPUT &&
			strcmp(e.msg, "prior: is not there") == 0,
		"an error of the prior does not name the scan");
	OK(did.iterations == 0 && did.gaussians == 0,
		"a run that ends before its fit reports none");
}

int main(void)
{
	char path[4000];

	snprintf(path, sizeof path, "%s/prior.safetensors",
		getenv("builddir") ? getenv("builddir") : ".");
	setenv("CT_T_PRIOR", path, 1);
	scratch_begin();
	test_plan();
	test_runs();
	test_errors();
	return tap_done();
}
