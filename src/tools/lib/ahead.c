/* ahead.c: see ahead.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "tools/lib/ahead.h"
#include "cli/cost-report.h"
#include "cli/files.h"
#include "core/clock.h"
#include "core/memory.h"

#include <libgen.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

#define MIB 0x1p20
#define SLOW_VOXELS 2e7 /* voxels of a result that takes seconds */

enum { FILES = 2 };
/* A file that will hold `bytes`; path NULL: none. */
struct file {
	const char *path;
	double bytes;
};

/* Not what is no file, nor what is compressed, as nobody knows how far it can be. */
static bool counts(const struct file *f)
{
	const size_t n = f->path ? strlen(f->path) : 0;
	struct stat st;

	return n > 0 && strcmp(f->path, "-") != 0 &&
	       !(n > 3 && strcmp(f->path + n - 3, ".gz") == 0) &&
	       !(lstat(f->path, &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode));
}

/* The disk of its folder, and the name of that; false if they are not known. */
static bool disk_of(struct stat *st, char folder[PATH_MAX], const struct file *f)
{
	char *own = counts(f) ? strdup(f->path) : NULL;

	if (own)
		snprintf(folder, PATH_MAX, "%s", dirname(own));
	free(own);
	return own && stat(folder, st) == 0;
}

/* All files on the disk of file i. */
static int check_disk(const struct file files[FILES], size_t i, struct ct_err *e)
{
	char folder[PATH_MAX], other[PATH_MAX];
	struct stat here, there;
	struct statvfs v;
	double need = 0, is;

	if (!disk_of(&here, folder, &files[i]) || statvfs(folder, &v) != 0)
		return 0;
	for (size_t k = 0; k < FILES; k++)
		if (disk_of(&there, other, &files[k]) && here.st_dev == there.st_dev)
			need += files[k].bytes;
	is = (double)v.f_bavail * (double)v.f_frsize;
	return need > is ? ct_fail(e, CT_EOUTPUT,
				   "%s: the result takes %.0f MiB of disk, %.0f are free", folder,
				   ceil(need / MIB), floor(is / MIB))
			 : 0;
}

int ahead_room(
	const char *path, double bytes, const char *more, double more_bytes, struct ct_err *e)
{
	const struct file files[FILES] = {{path, bytes}, {more, more_bytes}};

	for (size_t i = 0; i < FILES; i++)
		if (check_disk(files, i, e))
			return -1;
	return 0;
}

static json_t *three(const double x[3])
{
	return json_pack("[fff]", x[0], x[1], x[2]);
}

static json_t *operator_of(const struct ct_refine *r)
{
	const struct ct_operator *is = &r->scan;
	double times[3];

	ct_refine_times(times, r);
	if (!is->known)
		return json_pack("{so sn sn sb ss}", "factor", three(times), "sigma", "decimate",
			"profile", 0, "from", "not known");
	return json_pack("{so so ss sb ss}", "factor", three(times), "sigma",
		three(is->operator.sigma), "decimate",
		CT_WORD(CT_DECIMATE_LIST, is->operator.decimate), "profile",
		is->operator.profile.n> 0, "from", CT_WORD(CT_SOURCE_LIST, is->from));
}

static json_t *grid_of(const struct ct_refine *r, const struct ct_vol *in)
{
	double mm[3], times[3];

	ct_vol_spacing(in, mm);
	ct_refine_times(times, r);
	for (int a = 0; a < 3; a++)
		mm[a] /= times[a];
	return json_pack("{s[III] so}", "size", (json_int_t)r->n[0], (json_int_t)r->n[1],
		(json_int_t)r->n[2], "spacing-mm", three(mm));
}

json_t *ahead_plan(const struct ct_refine *r, const struct ct_vol *in)
{
	json_t *o = grid_of(r, in);

	if (json_object_set_new(o, "operator", operator_of(r)) ||
		json_object_set_new(o, "noise",
			json_pack("{sf sb ss}", "hu", r->scan.noise, "correlated",
				r->scan.correlated, "from",
				CT_WORD(CT_SOURCE_LIST, r->scan.noise_from))) ||
		(ct_frame_maps(&r->frame) &&
			json_object_set_new(o, "hu-per-unit", json_real(r->frame.times)))) {
		json_decref(o);
		return NULL;
	}
	return o;
}

/* The same in lines. */
static void print_plan(const struct ct_refine *r, const struct ct_vol *in)
{
	const double *sigma = r->scan.operator.sigma;
	double mm[3], x[3];

	ct_vol_spacing(in, mm);
	ct_refine_times(x, r);
	printf("size      %zux%zux%zu\n", r->n[0], r->n[1], r->n[2]);
	printf("spacing   %.4g,%.4g,%.4g mm\n", mm[0] / x[0], mm[1] / x[1], mm[2] / x[2]);
	printf("factor    %.4g,%.4g,%.4g\n", x[0], x[1], x[2]);
	if (r->scan.known)
		printf("blur      %.3g,%.3g,%.3g voxels of the result, %s (%s)\n", sigma[0],
			sigma[1], sigma[2], CT_WORD(CT_DECIMATE_LIST, r->scan.operator.decimate),
			CT_WORD(CT_SOURCE_LIST, r->scan.from));
	else
		puts("blur      not known");
	if (ct_operator_is_quiet(&r->scan))
		puts("noise     none that is certain (measured)");
	else
		printf("noise     %.3g HU%s (%s)\n", r->scan.noise,
			r->scan.correlated ? ", correlated" : "",
			CT_WORD(CT_SOURCE_LIST, r->scan.noise_from));
}

/* Of the code of the program, what a run will still load. */
#define CODE 524288.0

/* At least what it has held so far, with what it read. The program, its libraries and what these
 * keep are not known ahead: they are what it holds now beside volumes and networks. */
static double memory_of(const struct ct_refine *r, const struct ct_vol *in)
{
	const double fine = (double)r->n[0] * (double)r->n[1] * (double)r->n[2];
	const double volumes = 4 * ((double)ct_vol_count(in) + (r->rule.start ? fine : 0));
	const double networks = r->rule.prior ? ct_slice_prior_bytes(r->rule.prior) : 0;
	const double now = ct_memory_now();
	const double own = now > 0 ? now - volumes - networks + CODE : CT_MEMORY_BASE;

	return fmax(r->need - CT_MEMORY_BASE + fmax(own, 0), ct_memory_held());
}

int ahead_tell(const struct ct_refine *r, const struct ct_vol *in, const char *name,
	const char *out, const char *error, const struct ct_env *env, struct ct_err *e)
{
	const double voxels = (double)r->n[0] * (double)r->n[1] * (double)r->n[2];
	const struct file files[FILES] = {
		{out, (ct_files_is_dicom(out) ? 2 : 4) * voxels}, {error, 4 * voxels}};
	const double before = ct_clock_cpu(); /* it reads and plans likewise */
	struct ct_cost cost = {.memory = memory_of(r, in)};
	char slabs[40] = "";
	double cpu;

	if (*r->why_not)
		ct_log(env, CT_WARN, "%s: %s: the prior adds nothing", name, r->why_not);
	if (r->slabs > 1)
		ct_log(env, CT_INFO, "refines in %zu slabs: the whole takes %.0f MiB of memory",
			r->slabs, ceil(r->whole / MIB));
	if (!env->command->dry_run && ahead_room(out, files[0].bytes, error, files[1].bytes, e))
		return -1;
	if (!env->command->dry_run && (!ct_cost_heard(env) || voxels < SLOW_VOXELS))
		return 0;
	if (ct_refine_cost(&cpu, r, in, env, e))
		return -1;
	cost.seconds = (before + cpu) / (double)ct_par_threads(env->par);
	for (size_t i = 0; i < FILES; i++)
		cost.disk += files[i].path ? files[i].bytes : 0;
	if (r->slabs > 1)
		snprintf(slabs, sizeof slabs, " in %zu slabs", r->slabs);
	snprintf(cost.work, sizeof cost.work, "%s%s of %.0f voxels%s", ct_refine_name(r, false),
		r->adds ? " and the prior" : "", voxels, slabs);
	if (env->command->dry_run && env->command->json)
		return ct_cost_print_json(&cost, ahead_plan(r, in), env, e);
	if (env->command->dry_run) {
		print_plan(r, in);
		return ct_cost_print(&cost, env, e);
	}
	ct_cost_say(&cost, env);
	return 0;
}
