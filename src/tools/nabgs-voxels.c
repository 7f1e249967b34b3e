/* nabgs-voxels.c: see nabgs-voxels.h. */
#include "config.h"
#include "tools/nabgs-voxels.h"
#include "core/clock.h"
#include "core/mem.h"
#include "formats/format.h"
#include "recon/band.h"
#include "recon/joint.h"
#include "xray/project.h"
#include "resolution/upsample.h"
#include "tools/nabgs-state.h"
#include "tools/lib/scan-opts.h"

#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { ITERATIONS = 15, BLOCK = 16 }; /* views between two looks whether to stop */

struct job {
	struct nabgs_data *d;
	const struct nabgs_voxels *how;
	const struct ct_env *env;
	struct ct_projector g;
	struct ct_rays rays;
	struct ct_joint joint;
	char *run; /* names all that can change the result */
	double hu; /* of density 1 above density 0 */
};

static int forward(
	void *ctx, float *p, size_t first, size_t count, const float *x, struct ct_err *e)
{
	struct job *j = ctx;
	size_t view = j->rays.rows * j->rays.cols;

	ct_projector_load(&j->g, x, j->env->par);
	for (size_t k = 0; k < count; k += BLOCK) {
		if (ct_check_stop(j->env, e))
			return -1;
		ct_project(&j->g, first + k, count - k < BLOCK ? count - k : BLOCK, p + k * view,
			NULL, j->env->par);
	}
	return 0;
}

static int adjoint(
	void *ctx, float *x, size_t first, size_t count, const float *p, struct ct_err *e)
{
	struct job *j = ctx;
	size_t view = j->rays.rows * j->rays.cols;

	for (size_t k = 0; k < count; k += BLOCK) {
		if (ct_check_stop(j->env, e))
			return -1;
		ct_project_adjoint(&j->g, first + k, count - k < BLOCK ? count - k : BLOCK, x,
			p + k * view, j->env->par);
	}
	return 0;
}

/* Place of view k in an order whose every beginning is spread evenly: by its bits, reversed. */
struct place {
	uint64_t key;
	size_t view;
};

static int compare(const void *a, const void *b)
{
	const struct place *p = a, *q = b;

	return (p->key > q->key) - (p->key < q->key);
}

static int spread(struct place **out, size_t views, struct ct_err *e)
{
	if (ct_alloc(out, views, sizeof **out, e))
		return -1;
	for (size_t k = 0; k < views; k++) {
		uint64_t key = 0;

		for (int b = 0; b < 64; b++)
			key |= ((uint64_t)k >> b & 1) << (63 - b);
		(*out)[k] = (struct place){key, k};
	}
	qsort(*out, views, sizeof **out, compare);
	return 0;
}

static int reorder(struct ct_stack *s, const struct place *order, struct ct_err *e)
{
	struct ct_stack to = {0};

	if (!s->data)
		return 0;
	if (ct_stack_like(&to, s, 1, e)) {
		ct_stack_free(&to);
		return -1;
	}
	for (size_t k = 0; k < s->views; k++) {
		to.view[k] = s->view[order[k].view];
		memcpy(ct_stack_view(&to, k), ct_stack_view(s, order[k].view),
			s->h * s->w * sizeof *s->data);
	}
	ct_stack_free(s);
	*s = to;
	return 0;
}

/* Views in order, and the projector of theirs. */
static int arrange(struct job *j, struct ct_err *e)
{
	struct nabgs_data *d = j->d;
	struct place *order = NULL;
	int rc = -1;

	if (spread(&order, d->in.views, e) == 0 && reorder(&d->in, order, e) == 0 &&
		reorder(&d->base_proj, order, e) == 0 && reorder(&d->weight, order, e) == 0 &&
		ct_projector_init(&j->g, &d->base, &d->in, e) == 0)
		rc = ct_projector_reserve(&j->g, e);
	j->rays = (struct ct_rays){d->in.views, d->in.h, d->in.w, forward, adjoint, j};
	free(order);
	return rc;
}

/* Frequency, cycles a pixel of a view, that the LR reaches; 0 if what it says is not a low band. */
static int band_of(double *f, const struct job *j, struct ct_err *e)
{
	const struct nabgs_data *d = j->d;
	const struct ct_view *v = d->in.view;
	double mm[3], middle[3], coarse = 0, pitch = 0, far = 0, near = 0;

	*f = 0;
	ct_vol_spacing(&d->lr, mm);
	ct_vol_centre(&d->base, middle);
	for (int a = 0; a < 3; a++) {
		double aliasing;

		if (ct_refine_aliasing(&aliasing, &d->by, d->base.n[a], a, e))
			return -1;
		if (aliasing > CT_REFINE_ALIAS)
			return 0;
		coarse = fmax(coarse, mm[a]);
		far += (v->centre[a] - v->source[a]) * (v->centre[a] - v->source[a]);
		near += (middle[a] - v->source[a]) * (middle[a] - v->source[a]);
	}
	for (int way = 0; way < 2; way++) {
		const double *u = way ? v->v : v->u;

		pitch = fmax(pitch, sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]));
	}
	if (d->in.beam != CT_PARALLEL && far > 0)
		pitch *= sqrt(near / far);
	*f = fmin(0.5, 0.5 * pitch / coarse);
	return 0;
}

/* x0: the base, made consistent. base_proj becomes the gap, what IN has beyond x0, and IN what P of
 * the solution should be. The gap's low band, which is that of D, can only contradict it (an
 * offset, a clipped LR): views see frequencies as they are, and x - x0 has none of these. */
static int compare_data(struct job *j, struct ct_err *e)
{
	struct nabgs_data *d = j->d;
	struct ct_joint *s = &j->joint;
	float *y = d->in.data, *gap = d->base_proj.data;
	size_t n = ct_stack_count(&d->in);
	double f;

	ct_dc_apply(&s->dc, s->x, s->scratch, j->env->par);
	if (band_of(&f, j, e) || forward(j, s->q, 0, d->in.views, d->base.data, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		y[i] += s->q[i] - gap[i];
	if (forward(j, s->q, 0, d->in.views, s->x, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		gap[i] = y[i] - s->q[i];
	if (f > 0 && ct_band_clear(gap, d->in.views, d->in.h, d->in.w, f, j->env->par, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		y[i] = s->q[i] + gap[i];
	return 0;
}

/* Has IN nothing that the base has not? */
static bool nothing(const struct nabgs_data *d)
{
	double gap = 0, all = 0;

	for (size_t i = 0, n = ct_stack_count(&d->in); i < n; i++) {
		double a = (double)d->in.data[i], b = a - (double)d->base_proj.data[i];

		gap += b * b;
		all += a * a;
	}
	return gap <= 1e-12 * all;
}

static int prepare(struct job *j, struct ct_err *e)
{
	struct nabgs_data *d = j->d;
	struct ct_joint *s = &j->joint;
	struct ct_separable down = {0};
	float *z = NULL;
	size_t m = ct_vol_count(&d->lr);
	double mm[3], least;
	int rc = -1;

	if (arrange(j, e))
		return -1;
	ct_vol_spacing(&d->base, mm);
	least = fmin(mm[0], fmin(mm[1], mm[2]));
	for (int a = 0; a < 3; a++)
		s->rule.weight[a] = least / mm[a];
	s->rule.mu = j->how->lambda > 0 ? 1 / (j->how->lambda * j->hu) : 0;
	s->rule.iterations = j->how->iterations ? j->how->iterations : ITERATIONS;
	s->rule.every = j->how->every;
	s->rays = &j->rays;
	s->y = d->in.data;
	s->gap = d->base_proj.data;
	s->weight = d->weight.data;
	if (ct_degrade_plan(&down, &d->by, d->base.n, j->env->par, e) ||
		ct_alloc(&z, m, sizeof *z, e))
		goto out;
	ct_separable_apply(&down, z, d->base.data, j->env->par);
	for (size_t i = 0; i < m; i++)
		z[i] += d->lr.data[i];
	rc = ct_joint_alloc(s, &d->by, d->base.n, z, j->env, e);
	if (rc == 0) {
		memcpy(s->x, d->base.data, s->n * sizeof *s->x);
		rc = j->env->dry_run ? 0 : compare_data(j, e);
	}
out:
	ct_separable_free(&down);
	free(z);
	return rc;
}

enum { SCALARS = 8, COUNTS = 3, VOLUMES = 3 };

static double *scalar(struct ct_joint_at *a, size_t k)
{
	double *const s[SCALARS] = {&a->norm, &a->first, &a->mu, &a->momentum, &a->misfit, &a->best,
		&a->chosen, &a->trust};

	return s[k];
}

static float *volume(const struct ct_joint *s, size_t k, const char **name, size_t *count)
{
	static const char *const names[VOLUMES] = {"x", "ahead", "dual"};
	float *const at[VOLUMES] = {s->x, s->ahead, s->dual};

	*name = names[k];
	*count = k == 2 ? CT_TV_DUAL * s->n : s->n;
	return at[k];
}

static int save(void *ctx, const struct ct_joint *s, struct ct_err *e)
{
	struct job *j = ctx;
	struct ct_env env = *j->env;
	struct ct_joint_at at = s->at;
	struct ct_tensors t = {0};
	char key[24];
	int rc = -1;

	if (!j->how->state)
		return 0;
	env.force = true; /* over the state before */
	if (ct_meta_set(&t.meta, "run", j->run, e) ||
		ct_meta_setf(&t.meta, e, "at", "%zu %zu %d", at.phase, at.done, (int)at.trusted))
		goto out;
	for (size_t k = 0; k < SCALARS; k++) {
		snprintf(key, sizeof key, "scalar.%zu", k);
		if (ct_meta_setf(&t.meta, e, key, "%a", *scalar(&at, k)))
			goto out;
	}
	for (size_t k = 0; k < VOLUMES; k++) {
		struct ct_tensor *to;
		const char *name;
		size_t count;
		const float *from = volume(s, k, &name, &count);

		if (ct_tensors_add(&t, name, 1, &count, &to, e))
			goto out;
		memcpy(to->data, from, count * sizeof *from);
	}
	rc = ct_tensors_write(j->how->state, &t, false, &env, e);
out:
	ct_tensors_free(&t);
	return rc;
}

static int unpack(struct job *j, const struct ct_tensors *t, struct ct_err *e)
{
	const char *run = ct_meta_get(&t->meta, "run"), *at = ct_meta_get(&t->meta, "at");
	struct ct_joint *s = &j->joint;
	struct ct_joint_at *to = &s->at;
	char key[24];
	int trusted;

	if (!run || strcmp(run, j->run) != 0)
		return ct_fail(e, CT_EINPUT, "%s: is of a run with other inputs or options",
			j->how->state);
	if (!at || sscanf(at, "%zu %zu %d", &to->phase, &to->done, &trusted) != COUNTS ||
		to->phase > CT_JOINT_DONE)
		goto broken;
	to->trusted = trusted != 0;
	for (size_t k = 0; k < SCALARS; k++) {
		const char *v;
		char *end;

		snprintf(key, sizeof key, "scalar.%zu", k);
		v = ct_meta_get(&t->meta, key);
		if (!v)
			goto broken;
		*scalar(to, k) = strtod(v, &end);
		if (*end || end == v)
			goto broken;
	}
	for (size_t k = 0; k < VOLUMES; k++) {
		const char *name;
		size_t count;
		float *x = volume(s, k, &name, &count);
		const struct ct_tensor *from = ct_tensors_find(t, name);

		if (!from || ct_tensor_count(from) != count)
			goto broken;
		memcpy(x, from->data, count * sizeof *x);
	}
	ct_log(j->env, CT_INFO, "%s: continuing", j->how->state);
	return 0;
broken:
	return ct_fail(e, CT_EINPUT, "%s: is not the state of such a run", j->how->state);
}

static int resume(struct job *j, struct ct_err *e)
{
	struct ct_tensors t = {0};
	int rc = -1;

	if (!j->how->resume || (access(j->how->state, F_OK) != 0 && errno == ENOENT))
		return 0;
	if (ct_tensors_read(j->how->state, &t, e) == 0)
		rc = unpack(j, &t, e);
	ct_tensors_free(&t);
	return rc;
}

static const char *input_of(const struct ct_meta *m)
{
	const char *s = ct_meta_get(m, "input");

	return s ? s : "-";
}

static int name_run(struct job *j, struct ct_err *e)
{
	const struct nabgs_data *d = j->d;

	if (asprintf(&j->run,
		    "voxels %s %s %s %s %s; window %.17g:%.17g; lambda %.17g, %zu iterations",
		    input_of(&d->in.meta), input_of(&d->base.meta), input_of(&d->base_proj.meta),
		    input_of(&d->weight.meta), input_of(&d->lr.meta), d->window[0], d->window[1],
		    j->how->lambda, j->how->iterations) >= 0)
		return 0;
	j->run = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory");
}

/* base <- the residual in HU, of which D makes what is wanted: x - base, or nothing. */
static int settle(struct job *j, bool keep, struct ct_err *e)
{
	struct nabgs_data *d = j->d;
	const struct ct_joint *s = &j->joint;
	struct ct_separable down = {0}, up = {0};
	size_t n = ct_vol_count(&d->base), m = ct_vol_count(&d->lr);
	float *lo = NULL, *hi = NULL;
	int rc = -1;

	for (size_t i = 0; i < n; i++)
		d->base.data[i] =
			keep ? (float)(j->hu * ((double)s->x[i] - (double)d->base.data[i])) : 0;
	for (size_t i = 0; i < m; i++)
		d->lr.data[i] = (float)(j->hu * (double)d->lr.data[i]);
	ct_joint_free(&j->joint);
	if (ct_alloc(&lo, m, sizeof *lo, e) || ct_alloc(&hi, n, sizeof *hi, e) ||
		ct_degrade_plan(&down, &d->by, d->base.n, j->env->par, e) ||
		ct_dc_pinv_plan(&up, &d->by, d->base.n, j->env->par, e))
		goto out;
	ct_dc_exact(d->base.data, d->lr.data, &down, &up, lo, hi, j->env->par);
	rc = 0;
out:
	ct_separable_free(&down);
	ct_separable_free(&up);
	free(lo);
	free(hi);
	return rc;
}

static int write_residual(struct job *j, struct ct_err *e)
{
	struct nabgs_data *d = j->d;
	const struct ct_meta *const in[] = {
		&d->in.meta, &d->base.meta, &d->base_proj.meta, &d->weight.meta, &d->lr.meta};
	struct ct_meta m = {0};
	int rc = -1;

	if (ct_meta_copy(&m, &d->base.meta, e) || ct_window_put(&m, d->window, e) ||
		ct_meta_set(&m, "quantity", "residual", e) ||
		ct_meta_step(&m, j->env, sizeof in / sizeof *in, in, e))
		goto out;
	ct_meta_free(&d->base.meta);
	d->base.meta = m;
	m = (struct ct_meta){0};
	rc = ct_vol_write(j->how->out, &d->base, j->env, e);
out:
	ct_meta_free(&m);
	return rc;
}

static int report(const struct job *j, const struct ct_joint_at *at, struct ct_err *e)
{
	const bool solved = at->first > 0 && at->trusted,
		   chosen = j->how->lambda == 0 && at->best < 1;
	const double lambda = solved ? 1 / (at->chosen * j->hu) : 0;
	const int iterations = solved ? (int)at->done : 0;
	const char *how = at->first == 0        ? "nothing to solve"
			  : !at->trusted        ? "not trusted"
			  : j->how->lambda == 0 ? "trusted"
						: "weighted as told";
	json_t *o;

	if (!j->env->json) {
		printf("iterations %d\nlambda-projections %.6g\nprojections %s\n", iterations,
			lambda, how);
		if (chosen)
			printf("prediction %.6g\n", at->best);
		return 0;
	}
	o = json_pack("{si sf ss sf}", "iterations", iterations, "lambda-projections", lambda,
		"projections", how, "prediction", at->best);
	if (!o)
		return ct_fail(e, CT_ENOMEM, "no memory");
	json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
	putchar('\n'); /* ct_cli_main checks standard output */
	json_decref(o);
	return 0;
}

/* From two views and one sweep of the real thing. */
static int estimate(struct job *j, struct ct_err *e)
{
	struct ct_joint *s = &j->joint;
	const struct ct_env quiet = {.par = j->env->par};
	struct ct_tv_rule rule = {{1, 1, 1}, 1, 1, 0};
	struct ct_tv_report did;
	size_t views = j->rays.views, some = views < 2 ? views : 2;
	double steps = (double)s->rule.iterations, start = ct_clock_wall(), ahead, back, sweep;
	const double choose = s->rule.mu > 0 ? 0 : 9;

	memset(s->g, 0, s->n * sizeof *s->g);
	if (forward(j, s->q, 0, some, s->x, e))
		return -1;
	ahead = (ct_clock_wall() - start) * (double)views / (double)some;
	start = ct_clock_wall();
	if (adjoint(j, s->g, 0, some, s->q, e))
		return -1;
	back = (ct_clock_wall() - start) * (double)views / (double)some;
	start = ct_clock_wall();
	if (ct_tv_near(
		    s->x, &s->dc, &rule, &(struct ct_tv_near){s->g, 1, s->dual}, &did, &quiet, e))
		return -1;
	sweep = ct_clock_wall() - start;
	printf("time %.0f s\nmemory %.0f MiB\ndisk %.1f MiB, a state of %.1f MiB if it is "
	       "stopped\n",
		(steps + choose + 1.25 + 2) * ahead + (steps + choose / 2 + 1.5) * back +
			8 * (steps + choose) * sweep,
		(28.0 * (double)s->n + 20.0 * (double)ct_stack_count(&j->d->in) +
			(double)ct_projector_bytes(&j->g)) /
			1048576,
		4.0 * (double)s->n / 1048576, 20.0 * (double)s->n / 1048576);
	return 0;
}

static int run(struct job *j, struct ct_err *e)
{
	struct ct_joint *s = &j->joint;
	struct ct_joint_at at;

	if (j->env->dry_run)
		return estimate(j, e);
	s->save = save;
	s->ctx = j;
	if (resume(j, e) || ct_joint_run(s, j->env, e))
		return -1;
	at = s->at;
	if (!at.trusted && at.first > 0)
		ct_log(j->env, CT_WARN,
			"projections do not predict each other: the base stays as it is "
			"(--lambda-projections to insist)");
	if (settle(j, at.trusted && at.first > 0, e) || write_residual(j, e))
		return -1;
	if (j->how->state)
		remove(j->how->state);
	return j->env->json || (j->how->state && j->env->verbose >= 0) ? report(j, &at, e) : 0;
}

int nabgs_voxels(struct nabgs_data *d, const struct nabgs_voxels *how, const struct ct_env *env,
	struct ct_err *e)
{
	struct job j = {.d = d, .how = how, .env = env, .hu = d->window[1] - d->window[0]};
	bool empty;
	int rc = -1;

	if (!d->lr.data)
		return ct_fail(e, CT_EUSAGE, "--voxels wants --lr");
	empty = nothing(d);
	if (name_run(&j, e) == 0 && prepare(&j, e) == 0) {
		if (empty) {
			j.joint.at.phase = CT_JOINT_DONE;
			j.joint.at.trusted = true;
		}
		rc = run(&j, e);
	}
	ct_joint_free(&j.joint);
	ct_projector_free(&j.g);
	free(j.run);
	return rc;
}
