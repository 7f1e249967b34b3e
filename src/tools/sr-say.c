/* sr-say.c: what ct-sr did, in one line, from what its steps told (ct_env_tell); see sr.h. */
#include "config.h"
#include "core/meta.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "resolution/degrade.h"
#include "tools/lib/lowres.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

int sr_head(struct ct_vol *head, const char *path, struct ct_err *e)
{
	struct ct_nifti_in in = {0};
	FILE *f;
	int rc;

	if (ct_io_open(path, &f, e))
		return -1;
	rc = ct_nifti_open(&in, f, head, e);
	ct_source_close(&in.source);
	ct_io_close(f);
	return rc;
}

/* The last that any step told of it, or NULL. */
static const char *told(const struct ct_chain *c, const char *key)
{
	for (size_t i = c->n; i-- > 0;) {
		const char *s = ct_meta_get(&c->step[i].told, key);

		if (s)
			return s;
	}
	return NULL;
}

/* Three numbers, or one if they are equal; NaN if nobody told. */
static void three(double x[3], const struct ct_chain *c, const char *key)
{
	const char *s = told(c, key);

	if (!s || sscanf(s, "%lf,%lf,%lf", &x[0], &x[1], &x[2]) != 3)
		x[0] = x[1] = x[2] = (double)NAN;
}

static void put_three(FILE *f, const double x[3])
{
	const bool one = x[0] == x[1] && x[0] == x[2];

	for (int a = 0; a < (one ? 1 : 3); a++) {
		fprintf(f, "%s%.4g", a ? "," : "", x[a]);
	}
}

/* Sizes, and how many times finer. */
static void put_sizes(FILE *f, const struct ct_chain *c)
{
	struct ct_vol head = {0};
	struct ct_err why;
	double x[3];

	three(x, c, LOWRES_FACTOR);
	if (!isnan(x[0]) && sr_head(&head, c->step[0].output, &why) == 0) {
		fprintf(f, "%zux%zux%zu -> ", head.n[0], head.n[1], head.n[2]);
		fprintf(f, "%zux%zux%zu, ", ct_degrade_cover(head.n[0], x[0]),
			ct_degrade_cover(head.n[1], x[1]), ct_degrade_cover(head.n[2], x[2]));
		put_three(f, x);
		fputs("x, ", f);
	}
	ct_vol_free(&head);
}

/* How the scan was made, and who says so. */
static void put_scan(FILE *f, const struct ct_chain *c)
{
	const char *sampling = told(c, LOWRES_SAMPLING), *noise = told(c, LOWRES_NOISE);
	const char *from = told(c, LOWRES_FROM), *noise_from = told(c, LOWRES_NOISE_FROM);
	double sigma[3];

	three(sigma, c, LOWRES_SIGMA);
	if (!isnan(sigma[0]) && sampling && from) {
		fputs("blur ", f);
		put_three(f, sigma);
		fprintf(f, " voxels, %s (%s), ", sampling, from);
	} else if (noise)
		fputs("blur unknown, ", f);
	if (noise && noise_from)
		fprintf(f, "noise %.3g HU%s (%s), ", strtod(noise, NULL),
			told(c, LOWRES_NOISE_ALIKE) ? " correlated" : "", noise_from);
}

/* The largest of those that the last command told that told one: its slabs. */
static double residual(const struct ct_chain *c)
{
	const char *tool = NULL;
	double most = (double)NAN;

	for (size_t i = c->n; i-- > 0;) {
		const char *s = ct_meta_get(&c->step[i].told, LOWRES_RESIDUAL);

		if (!s || (tool && strcmp(tool, c->step[i].tool) != 0))
			continue;
		tool = c->step[i].tool;
		most = fmax(strtod(s, NULL), most);
	}
	return most;
}

static void put_method(FILE *f, const struct ct_chain *c, size_t slabs)
{
	const char *method = told(c, LOWRES_METHOD), *steps = told(c, LOWRES_ITERATIONS);
	const char *why = told(c, LOWRES_WHY);
	const double differs = residual(c);
	const char *prior = told(c, LOWRES_PRIOR);

	if (method && steps && strcmp(steps, "0") != 0)
		fprintf(f, "solver %s %s iterations (%s)", method, steps, why ? why : "asked for");
	else if (method)
		fprintf(f, "by %s", method);
	if (prior)
		fprintf(f, " + prior of slices%s", strcmp(prior, "1") == 0 ? "" : ", twice");
	if (method && slabs > 1)
		fprintf(f, " in %zu slabs", slabs);
	for (size_t i = 0; method && i < c->n; i++)
		if (strcmp(c->step[i].tool, "ct-compose") == 0)
			fputs(" + residual of projections", f);
	if (!isnan(differs))
		fprintf(f, ", consistent to %.2g HU RMS", differs);
	fputs(method ? ", " : "refined before, ", f);
}

void sr_say(const struct ct_chain *c, size_t slabs, double seconds, const struct ct_env *env)
{
	struct rusage r;

	if (env->verbose < 0)
		return;
	fprintf(stderr, "%s: ", env->tool);
	put_sizes(stderr, c);
	put_scan(stderr, c);
	put_method(stderr, c, slabs);
	fprintf(stderr, "%.*f s", seconds < 10, seconds);
	if (getrusage(RUSAGE_CHILDREN, &r) == 0 && r.ru_maxrss > 0)
		fprintf(stderr, ", %.0f MiB", ceil((double)r.ru_maxrss / 1024));
	fputc('\n', stderr);
}
