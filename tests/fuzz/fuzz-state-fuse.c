/* Hostile states of ct-fuse: refused, or the joint solver goes on from them and ends.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "state-run.h"
#include "recon/fuse.h"

const int fuzz_rounds = 1500;

enum { SIDE = 4, N = SIDE * SIDE * SIDE, VIEWS = 4, RAYS = VIEWS * SIDE * SIDE };

/* View v sees sums along an axis. */
static int forward(void *ctx, float *p, size_t views, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	(void)ctx, (void)env, (void)e;
	memset(p, 0, views * SIDE * SIDE * sizeof *p);
	for (size_t v = 0; v < views; v++)
		for (size_t i = 0; i < N; i++)
			p[v * SIDE * SIDE + (v % 2 ? i / SIDE : i % (SIDE * SIDE))] += x[i];
	return 0;
}

static int adjoint(void *ctx, float *x, size_t views, const float *p, const struct ct_env *env,
	struct ct_err *e)
{
	(void)ctx, (void)env, (void)e;
	memset(x, 0, N * sizeof *x);
	for (size_t v = 0; v < views; v++)
		for (size_t i = 0; i < N; i++)
			x[i] += p[v * SIDE * SIDE + (v % 2 ? i / SIDE : i % (SIDE * SIDE))];
	return 0;
}

static const struct ct_linear rays = {N, VIEWS, SIDE *SIDE, forward, adjoint, NULL};
static const float y[RAYS] = {1, 2, 3}, z[8] = {1, 0, 2};

static void solver(struct ct_joint *j)
{
	const struct ct_degrade half = {{2, 2, 2}, {0.85, 0.85, 0.85}, CT_DECIMATE_SINC, {0}};
	struct ct_env env = {0};
	struct ct_err e = {0};

	*j = (struct ct_joint){
		.rays = &rays, .cols = SIDE, .y = y, .gap = y, .rule = {{1, 1, 1}, 0, 2, 0}};
	if (ct_joint_alloc(j, &half, (size_t[3]){SIDE, SIDE, SIDE}, z, &env, &e))
		exit(99);
	memset(j->x, 0, N * sizeof *j->x);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_env env = {0};
	struct ct_err e = {0};
	struct ct_resume run;
	struct ct_fuse f = {0};
	int rc;

	solver(&f.joint);
	state_of(&run, data, size);
	rc = ct_resume_load(&run, ct_fuse_unpack, &f, &e);
	state_check(rc, &e);
	fuzz_taken += rc == 0;
	if (rc == 0 && !f.residual)
		state_check(ct_joint_run(&f.joint, &env, &e), &e);
	ct_resume_close(&run);
	free(f.residual);
	ct_joint_free(&f.joint);
	return 0;
}

/* A solver that has not begun, one that has, and one within a proximal point. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_env env = {0};
	struct ct_err e = {0};
	struct ct_resume run;
	struct ct_fuse f = {0};
	struct ct_joint j;
	size_t n;

	if (k > 2)
		return 0;
	solver(&j);
	if (k && ct_joint_run(&j, &env, &e))
		exit(99);
	for (size_t i = 0; !k && i < N; i++) /* all of it is set */
		j.ahead[i] = j.dual[i] = j.dual[N + i] = j.dual[2 * N + i] = 0;
	j.at.phase = k ? CT_JOINT_SOLVE : CT_JOINT_NEW;
	j.at.done = k > 0;
	for (size_t i = 0; k == 2 && i < N; i++)
		j.g[i] = j.x[i];
	j.at.sweeps = k == 2 ? 3 : 0;
	j.at.fista.next = k == 2 ? 1.5 : 0;
	state_run(&run, seed_path());
	f.joint = j;
	n = state_seed(data, ct_resume_save(&run, ct_fuse_pack, &f, &e));
	ct_resume_close(&run);
	ct_joint_free(&j);
	return n;
}
