/* The trainer on a sum of squares: curve of the rate, average, clip, threads, its state.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "solve/trainer.h"
#include "tap.h"

#include <math.h>
#include <string.h>

enum { N = 70000, GROUPS = 3 }; /* more than two parts */

static struct ct_trainer_rule rule(void)
{
	struct ct_trainer_rule r = {
		.adam = ct_adamw_default(), .steps = 10, .cosine = true, .average = 0.5};

	r.adam.lr = 0.1;
	return r;
}

/* The gradient of |w - 1|^2 / 2, in GROUPS parts. */
static int step(struct ct_trainer *t)
{
	double loss = 0;

	for (size_t i = 0; i < t->n; i++) {
		const float d = t->weights[i] - 1;

		loss += (double)(d * d) / 2;
		for (size_t g = 0; g < GROUPS; g++)
			t->grad[g * t->n + i] = d;
	}
	return ct_trainer_step(t, loss, 1.0 / GROUPS, &err);
}

static void begin(
	struct ct_trainer *t, const struct ct_trainer_rule *r, size_t n, struct ct_par *par)
{
	must(ct_trainer_alloc(t, r, n, GROUPS, NULL, NULL, par, &err));
	ct_rng_normals(n, t->weights, 1, 2, 0);
	memcpy(t->average, t->weights, n * sizeof *t->average);
}

static bool same(const struct ct_trainer *a, const struct ct_trainer *b)
{
	const size_t bytes = a->n * sizeof(float);

	return a->steps == b->steps && memcmp(a->weights, b->weights, bytes) == 0 &&
	       memcmp(a->average, b->average, bytes) == 0 && memcmp(a->m, b->m, bytes) == 0 &&
	       memcmp(a->v, b->v, bytes) == 0;
}

static void curve(void)
{
	struct ct_trainer_rule r = rule();
	struct ct_trainer t = {.rule = r};

	NEAR(ct_trainer_rate(&t), 0.1, 1e-15, "the rate begins at its highest");
	t.steps = 5;
	NEAR(ct_trainer_rate(&t), 0.05, 1e-15, "half way along the cosine it is half");
	t.steps = 10;
	NEAR(ct_trainer_rate(&t), 0, 1e-15, "it ends at 0");
	t.steps = 11;
	NEAR(ct_trainer_rate(&t), 0, 1e-15, "and stays there");
	t.rule.warmup = 4;
	t.steps = 1;
	NEAR(ct_trainer_rate(&t), 0.05, 1e-15, "it rises over the warm-up");
	t.steps = 7;
	NEAR(ct_trainer_rate(&t), 0.05, 1e-15, "after which the cosine begins");
	t.rule.warmup = 10;
	t.steps = 12;
	NEAR(ct_trainer_rate(&t), 0.1, 1e-15, "a warm-up as long as the training: no cosine");
}

/* Of the average step k keeps (1 + k)/(10 + k), k = 1, 2, ..., and at most rule.average. */
static void average(void)
{
	const struct ct_trainer_rule r = rule();
	struct ct_trainer t = {0};
	double worst = 0;

	begin(&t, &r, 3, NULL);
	for (int k = 1; k <= 12; k++) {
		const double keep = fmin(0.5, (1.0 + k) / (10.0 + k));
		const float was = t.average[1];

		must(step(&t));
		worst = fmax(worst, fabs(keep * (double)was + (1 - keep) * (double)t.weights[1] -
					    (double)t.average[1]));
	}
	NEAR(worst, 0, 1e-6, "the average begins short: 2/11, 3/12, ..., 1/2");
	ct_trainer_free(&t);
}

/* Adam does not see the length of a gradient at its first step, but its moments do. */
static void clip(void)
{
	struct ct_trainer_rule r = rule();
	struct ct_trainer a = {0}, b = {0};
	double square = 0;

	begin(&a, &r, 100, NULL);
	r.clip = 0.25;
	begin(&b, &r, 100, NULL);
	must(step(&a));
	must(step(&b));
	for (size_t i = 0; i < 100; i++)
		square += (double)b.grad[i] * (double)b.grad[i];
	NEAR(sqrt(square), 0.25, 1e-6, "a longer gradient is cut to the largest norm");
	OK(fabsf(b.m[0]) < fabsf(a.m[0]) / 10, "before the moments have it");
	ct_trainer_free(&b);
	r.clip = 1e6;
	begin(&b, &r, 100, NULL);
	must(step(&b));
	OK(same(&a, &b), "a shorter one is left alone");
	ct_trainer_free(&a);
	ct_trainer_free(&b);
}

static void states(void)
{
	const struct ct_trainer_rule r = rule();
	struct ct_trainer a = {0}, b = {0};
	struct ct_tensors w = {0};
	struct ct_tensor *t;
	struct ct_par *par;

	must(ct_par_alloc(&par, 3, &err));
	begin(&a, &r, N, NULL);
	begin(&b, &r, N, par);
	for (int k = 0; k < 2; k++)
		must(step(&a) || step(&b));
	must(ct_trainer_save(&b, &w, &err));
	OK(same(&a, &b), "three threads: the same bytes");
	must(step(&a));
	must(ct_trainer_restore(&b, &w, &err) || step(&b));
	OK(same(&a, &b), "and after an interruption");
	t = ct_tensors_find(&w, "average");
	memcpy(t->name, "xverage", 7);
	OK(ct_trainer_restore(&b, &w, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "no tensor \"average\"; run again") && same(&a, &b),
		"a state of another version is refused, and changes nothing: %s", err.msg);
	memcpy(t->name, "average", 7);
	b.n--;
	OK(ct_trainer_restore(&b, &w, &err) == -1 && err.code == CT_EINPUT,
		"one of another network, too: %s", err.msg);
	b.n++;
	a.grad[N - 1] = NAN;
	OK(ct_trainer_step(&a, 1, 1, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "training diverged at step 4") && same(&a, &b),
		"a gradient that is not finite changes nothing: %s", err.msg);
	a.grad[N - 1] = 0;
	OK(ct_trainer_step(&a, (double)INFINITY, 1, &err) == -1 && err.code == CT_ENUMERIC &&
			same(&a, &b),
		"nor does a loss that is not");
	ct_tensors_free(&w);
	ct_trainer_free(&a);
	ct_trainer_free(&b);
	ct_par_free(par);
}

int main(void)
{
	curve();
	average();
	clip();
	states();
	return tap_done();
}
