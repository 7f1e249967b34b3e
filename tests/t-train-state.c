/* A training stopped and resumed, its state and what it holds, and what cannot be trained.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "training.h"

#include <string.h>

static bool same_state(const struct ct_tensors *a, const struct ct_tensors *b)
{
	static const char *const names[] = {"weights", "average", "adam.m", "adam.v"};

	for (int i = 0; i < 4; i++) {
		const struct ct_tensor *x = vector(a, names[i]), *y = vector(b, names[i]);
		size_t n = ct_tensor_count(x);

		if (n != ct_tensor_count(y) || memcmp(x->data, y->data, n * sizeof *x->data) != 0)
			return false;
	}
	return strcmp(ct_meta_get(&a->meta, CT_META_STEP), ct_meta_get(&b->meta, CT_META_STEP)) ==
	       0;
}

/* What a training holds, summed up. */
static void bytes(const struct ct_train *t, const struct ct_unet_arch *a, size_t threads)
{
	struct ct_unet *net = NULL;
	struct ct_unet_plan *plan = NULL;
	double want;

	must(ct_unet_init(&net, a, 1, &err));
	must(ct_unet_plan_alloc(&plan, net, SIZE, SIZE, true, &err));
	want = (double)threads * ((double)ct_unet_plan_bytes(plan) + 4.0 * 4 * SIZE * SIZE);
	/* weights, three times in an order of their own; average, twice; two moments; three groups
	 */
	want += 4.0 * (double)net->graph.count * (3 + 2 + 2 + 3);
	NEAR(ct_train_bytes(t) / want, 1, 1e-9, "the bytes it holds");
	ct_unet_plan_free(plan);
	ct_unet_free(net);
}

/* A training goes on from its state as if it had not been interrupted, and its average is the
 * state's. */
static void resumed(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL, *u = NULL;
	struct ct_tensors state = {0}, one = {0}, two = {0};
	struct ct_pictures s = {0};
	double loss, want, got, was;

	options(&o, &a);
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	must(ct_train_alloc(&u, &a, &o, &s, env, &err));
	bytes(t, &a, ct_par_threads(env->par));
	must(ct_train_validate(u, &s, 2, &was, &err));
	for (int k = 0; k < 3; k++)
		must(ct_train_step(t, &loss, &err));
	must(ct_train_validate(t, &s, 2, &want, &err));
	must(ct_train_save(t, &state, &err));
	must(ct_train_restore(u, &state, &err));
	OK(ct_train_steps(u) == 3, "three steps are done");
	must(ct_train_save(u, &one, &err));
	OK(same_state(&state, &one), "the state of what was restored is the same");
	must(ct_train_validate(u, &s, 2, &got, &err));
	OK(want == got && got < was, "so is the loss of its average: %g, %g before", got, was);
	must(ct_train_step(u, &loss, &err));
	must(ct_train_validate(u, &s, 2, &was, &err));
	OK(was != got, "which a step changes");
	must(ct_train_step(t, &loss, &err));
	ct_tensors_free(&one);
	must(ct_train_save(u, &one, &err));
	must(ct_train_save(t, &two, &err));
	OK(same_state(&one, &two) && !same_state(&one, &state), "and so is the next step");
	must(ct_train_validate(t, &s, 2, &want, &err));
	must(ct_train_restore(u, &two, &err));
	must(ct_train_validate(u, &s, 2, &got, &err));
	OK(want == got, "whose average is the one that is validated");
	ct_tensors_free(&state);
	ct_tensors_free(&one);
	ct_tensors_free(&two);
	ct_train_free(t);
	ct_train_free(u);
	ct_pictures_free(&s);
}

static void no_state(struct ct_train *t, const struct ct_tensors *w, enum ct_code code,
	const char *word, const char *what)
{
	struct ct_tensors before = {0}, after = {0};
	int rc;

	must(ct_train_save(t, &before, &err));
	rc = ct_train_restore(t, w, &err);
	must(ct_train_save(t, &after, &err));
	OK(rc == -1 && err.code == code && strstr(err.msg, word) && same_state(&before, &after),
		"no state: %s: %s", what, err.msg);
	ct_tensors_free(&before);
	ct_tensors_free(&after);
}

static void bad_states(const struct ct_env *env)
{
	static const char *const names[] = {"weights", "average", "adam.m", "adam.v"};
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors w = {0};
	struct ct_pictures s = {0};

	options(&o, &a);
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	must(ct_train_save(t, &w, &err));
	for (int i = 0; i < 4; i++) {
		struct ct_tensor *x = ct_tensors_find(&w, names[i]);
		size_t n = x->dim[0];
		char was = x->name[0];

		for (size_t k = 0; k < n; k += n - 1) {
			x->data[k] = k ? HUGE_VALF : NAN;
			no_state(t, &w, CT_ENUMERIC, k ? " is inf" : "value 0 is", names[i]);
			x->data[k] = 0;
		}
		x->dim[0]--;
		no_state(t, &w, CT_EINPUT, names[i], "a value less");
		x->dim[0]++;
		x->rank = 2;
		x->dim[1] = 1;
		no_state(t, &w, CT_EINPUT, names[i], "a matrix");
		x->rank = 1;
		x->name[0] = 'x';
		no_state(t, &w, CT_EINPUT, names[i], "another name");
		x->name[0] = was;
	}
	must(ct_meta_set(&w.meta, CT_META_STEP, "-1", &err));
	no_state(t, &w, CT_EINPUT, "step", "before the first step");
	must(ct_meta_set(&w.meta, CT_META_STEP, "9007199254740992", &err));
	no_state(t, &w, CT_EINPUT, "step", "step 2^53");
	ct_meta_drop(&w.meta, CT_META_STEP);
	no_state(t, &w, CT_EINPUT, "step", "no step");
	must(ct_meta_set(&w.meta, CT_META_STEP, "9007199254740991", &err));
	OK(ct_train_restore(t, &w, &err) == 0 && ct_train_steps(t) == ((uint64_t)1 << 53) - 1,
		"the last step that there is");
	ct_tensors_free(&w);
	ct_train_free(t);
	ct_pictures_free(&s);
}

/* Weights of the last convolution so large that the loss is a number, but no gradient is; and the
 * user's wish to stop: the weights stay as they were. */
static void failed_steps(const struct ct_env *quiet)
{
	volatile sig_atomic_t stop = 0;
	struct ct_env env = *quiet;
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors before = {0}, after = {0};
	struct ct_pictures s = {0};
	struct ct_tensor *p;
	double loss = 0;
	size_t n;

	env.stop = &stop;
	options(&o, &a);
	o.batch = 1;
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, &env, &err));
	must(ct_train_save(t, &before, &err));
	p = ct_tensors_find(&before, "weights");
	n = ct_tensor_count(p);
	p->data[n - 1] = 1e25f; /* its bias */
	for (size_t i = n - 1 - 32 * 9; i < n - 1; i++)
		p->data[i] = 1e16f;
	must(ct_train_restore(t, &before, &err));
	OK(ct_train_step(t, &loss, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "step 1: loss ") && isfinite(loss) && loss > 1e40,
		"no gradient: %s", err.msg);
	must(ct_train_save(t, &after, &err));
	OK(same_state(&before, &after), "the weights are those before");
	p->data[n - 1] = 1;
	memset(p->data + n - 1 - 32 * 9, 0, 32 * 9 * sizeof *p->data);
	must(ct_train_restore(t, &before, &err));
	stop = 1;
	OK(ct_train_step(t, &loss, &err) == -1 && err.code == CT_ESTOP, "stopped: %s", err.msg);
	OK(ct_train_validate(t, &s, 1, &loss, &err) == -1 && err.code == CT_ESTOP,
		"validation too");
	ct_tensors_free(&after);
	must(ct_train_save(t, &after, &err));
	OK(same_state(&before, &after), "the weights are those before");
	ct_tensors_free(&before);
	ct_tensors_free(&after);
	ct_train_free(t);
	ct_pictures_free(&s);
}

static void no_training(const struct ct_train_opts *o, const struct ct_unet_arch *a,
	const struct ct_pictures *s, const struct ct_env *env, enum ct_code code, const char *what)
{
	struct ct_train *t = NULL;
	int rc = ct_train_alloc(&t, a, o, s, env, &err);

	OK(rc == -1 && err.code == code, "no training: %s: %s", what, err.msg);
	ct_train_free(rc ? NULL : t);
}

static void bad_options(const struct ct_env *env)
{
	struct ct_train_opts good, o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_pictures s = {0};

	options(&good, &a);
	picture(&s, SIZE, SIZE);
	good.batch = 1;
	good.adam.lr = 0;
	good.ema = 0;
	OK(ct_train_alloc(&t, &a, &good, &s, env, &err) == 0 && ct_train_rate(t) == 0,
		"a picture of one piece, a rate of 0");
	ct_train_free(t);
	o = good;
	o.patches.channels = 2;
	no_training(&o, &a, &s, env, CT_EINPUT, "pictures of two channels");
	a.in_channels = 2;
	no_training(&o, &a, &s, env, CT_EINPUT, "two channels in, one out");
	a.out_channels = 2;
	o.patches.size = 2 * SIZE;
	no_training(&o, &a, &s, env, CT_EGEOM, "a piece larger than the picture");
	ct_pictures_free(&s);
}

/* The metadata of what was learnt, and what is used when nothing is said. */
static void result(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors w = {0};
	struct ct_pictures s = {0};
	double loss, v = 0;

	options(&o, &a);
	o.ema = 0.75;
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	must(ct_train_step(t, &loss, &err));
	must(ct_train_result(t, &w, &err));
	OK(strcmp(ct_meta_get(&w.meta, CT_META_BETA_SCHEDULE), "linear") == 0 &&
			strcmp(ct_meta_get(&w.meta, CT_META_STEP), "1") == 0 &&
			ct_meta_numbers(&w.meta, CT_META_EMA, 1, &v, &err) == 0 && v == 0.75,
		"a result says its schedule, step and average");
	ct_tensors_free(&w);
	ct_train_free(t);
	ct_pictures_free(&s);
	ct_train_default(&o);
	OK(o.patches.size == 64 && o.patches.channels == 1 && o.patches.scales == 1 &&
			o.patches.scale[0] == 1 && o.batch == 16 && o.steps == 10000 &&
			o.warmup == 0 && !o.cosine,
		"defaults: pieces of 64, 16 at a time");
	OK(o.ema == 0.9999 && o.clip == 0 && o.adam.lr == 1e-4 && o.adam.beta1 == 0.9 &&
			o.adam.beta2 == 0.999 && o.adam.eps == 1e-8 && o.adam.decay == 0,
		"and Adam's own");
}

int main(void)
{
	struct ct_env env = {0};

	must(ct_par_alloc(&env.par, 2, &err));
	resumed(&env);
	bad_states(&env);
	failed_steps(&env);
	bad_options(&env);
	result(&env);
	ct_par_free(env.par);
	return tap_done();
}
