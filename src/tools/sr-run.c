/* sr-run.c: the chain of ct-sr, run; see sr.h.
 *
 * Whether the step that refines goes in slabs is known when there is something for it to refine:
 * the first step is run, and if the result is large that step is asked what it will take. In a
 * folder that is kept what it said is noted, with the memory that was free: a run that goes on
 * makes the same slabs.
 *
 * What projections take is known before the refining is begun, from a rehearsal: what does not fit
 * is refused then. */
#include "config.h"
#include "cli/cost.h"
#include "cli/memory.h"
#include "core/clock.h"
#include "core/mem.h"
#include "tools/lib/expect.h"
#include "tools/lib/lowres.h"
#include "tools/sr.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#define MIB 0x1p20
#define LONG 8e6 /* voxels of a result whose projections take minutes */

struct run {
	struct ct_chain *c;
	const struct sr *p;
	const struct sr_files *f;
	const struct ct_env *env;
	struct sr_jobs jobs;
	struct ct_folder beside; /* OUT, of slabs; or not open */
};

/* Voxels of the result, and the most memory that it may take; NaN of a scan that cannot be refined,
 * which is for the step that refines to say. */
static double voxels(const struct run *r, double *memory)
{
	const char *path = r->c->step[0].output;
	const struct lowres lr = {.in = path,
		.factor = r->p->factor,
		.spacing = r->p->spacing,
		.decimate = -1,
		.skip_noise = true,
		.noise = (double)NAN};
	struct ct_vol head = {0};
	struct lowres_is is;
	struct ct_err why;
	double fine = (double)NAN;

	*memory = (double)NAN;
	if (sr_head(&head, path, &why) == 0 && lowres_find(&is, &lr, &head, r->env, &why) == 0) {
		fine = expect_fine(&head, is.by.factor);
		*memory = expect_most(&head, is.by.factor);
	}
	ct_vol_free(&head);
	return fine;
}

/* Does it fit, whatever way it is refined, and is soon made? */
static bool is_small(const struct run *r)
{
	double memory;
	const double fine = voxels(r, &memory);

	return isnan(fine) ||
	       (fine < EXPECT_LONG && ct_memory_fits(memory, r->p->memory, ct_memory_free("")));
}

/* What the step that refines will take; of a small scan nothing. */
static int ask(struct run *r, struct ct_err *e)
{
	void *answer = NULL;
	char *text;
	int rc;

	if (ct_chain_recall(&text, r->c, 1, r->env, e))
		return -1;
	r->jobs.told = text ? json_loads(text, 0, NULL) : NULL;
	free(text);
	if (r->jobs.told)
		return 0;
	if (is_small(r))
		answer = json_object();
	else if (ct_chain_ask(&answer, r->c, 1, r->env, e))
		return -1;
	r->jobs.told = answer;
	text = json_dumps(answer, JSON_COMPACT);
	rc = text ? ct_chain_note(r->c, 1, text, r->env, e) : ct_fail(e, CT_ENOMEM, "no memory");
	free(text);
	return rc;
}

static double mib(double bytes)
{
	return ceil(bytes / MIB);
}

/* How many slabs; 1: all at once. */
static size_t choose(struct run *r)
{
	struct sr_jobs *x = &r->jobs;
	const double need = sr_jobs_told(x, EXPECT_NEED), free = sr_jobs_told(x, EXPECT_FREE);
	const size_t can = sr_jobs_can(x);
	size_t m;

	x->most = ct_memory_most(r->p->memory, free);
	if (can == 0 || ct_memory_fits(need, r->p->memory, free))
		return 1;
	m = sr_jobs_fewest(x, can);
	if (m == 0) {
		ct_log(r->env, CT_WARN,
			"no slab fits into %.0f MiB, from %.0f on one would: the rest in files",
			mib(x->most), mib(CT_MEMORY_SPARE * sr_jobs_slabs(x, can).memory));
		return 1;
	}
	ct_log(r->env, CT_WARN,
		"refines in %zu slabs along %c: the whole takes %.0f MiB of memory, and %.0f are %s",
		m, "xyz"[x->brick.axis], mib(need), floor((r->p->memory ? x->most : free) / MIB),
		r -> p -> memory ? "given" : "free");
	return m;
}

#define OTHER_FOLDER ": --keep names another folder for them"

static int check_free(
	const char *folder, double need, const char *what, const char *hint, struct ct_err *e)
{
	struct statvfs v;
	double is;

	if (statvfs(folder, &v) != 0)
		return 0;
	is = (double)v.f_bavail * (double)v.f_frsize;
	return need <= is
		       ? 0
		       : ct_fail(e, CT_EOUTPUT, "%s: %s take %.0f MiB of disk, and %.0f are free%s",
				 folder, what, mib(need), floor(is / MIB), hint);
}

/* What is written: volumes in floats, and DICOM in 16 bits. */
struct writes {
	char *folder; /* NULL: nothing that could be told */
	double bytes;
	dev_t on;
};

/* Not into what is no file, and nobody knows how far something can be compressed. */
static void writes(struct writes *w, const char *path, double bytes)
{
	const char *end = path && strlen(path) > 3 ? path + strlen(path) - 3 : "";
	struct stat st;

	*w = (struct writes){.bytes = bytes};
	if (!path || strcmp(path, "-") == 0 || strcmp(end, ".gz") == 0 ||
		(lstat(path, &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode)))
		return;
	w->folder = ct_folder_of(path);
	if (w->folder && stat(w->folder, &st) == 0)
		w->on = st.st_dev;
}

/* Is there disk for the result, what tells its error, and DICOM of it? */
static int check_out(const struct run *r, struct ct_err *e)
{
	const struct ct_step *s = &r->c->step[1];
	const bool dicom = r->f->result != r->f->out;
	struct writes w[3];
	double memory;
	const double fine = voxels(r, &memory);
	int rc = 0;

	if (isnan(fine) || r->p->resume)
		return 0;
	writes(&w[0], s->output, 4 * fine);
	writes(&w[1], s->beside, 4 * fine);
	writes(&w[2], strcmp(r->f->out, s->output) == 0 ? NULL : r->f->out, (dicom ? 2 : 4) * fine);
	for (int i = 0; i < 3 && rc == 0; i++) {
		double all = 0;

		for (int k = 0; k < 3; k++)
			if (w[k].folder && w[i].folder && w[k].on == w[i].on)
				all += w[k].bytes;
		if (w[i].folder)
			rc = check_free(w[i].folder, all, "voxels",
				strcmp(w[i].folder, r->c->folder.path) == 0 ? OTHER_FOLDER : "", e);
	}
	for (int i = 0; i < 3; i++)
		free(w[i].folder);
	return rc;
}

/* Bytes of slabs that an earlier run has left. */
static double made(const struct run *r)
{
	struct stat st;
	double n = 0;

	for (size_t i = 0; r->c->resume && i < r->jobs.names; i++)
		if (stat(r->jobs.name[i], &st) == 0)
			n += (double)st.st_size;
	return n;
}

/* Is there disk for the slabs and for what is made of them? */
static int check_disk(const struct run *r, struct ct_err *e)
{
	const struct sr_jobs *x = &r->jobs;
	const char *out = r->c->step[x->slabs + 1].output, *folder = x->folder->path;
	const double whole = sr_jobs_told(x, "disk-bytes");
	const double slabs = fmax(sr_jobs_slabs(x, x->slabs).disk - made(r), 0);
	char *to = ct_folder_of(out);
	struct stat a, b;
	int rc;

	if (!to)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (strcmp(out, "-") == 0)
		rc = check_free(folder, slabs, "slabs", OTHER_FOLDER, e);
	else if (stat(folder, &a) == 0 && stat(to, &b) == 0 && a.st_dev == b.st_dev)
		rc = check_free(folder, slabs + whole, "slabs and their whole", OTHER_FOLDER, e);
	else
		rc = check_free(folder, slabs, "slabs", OTHER_FOLDER, e) ||
				     check_free(to, whole, "voxels", "", e)
			     ? -1
			     : 0;
	free(to);
	return rc;
}

/* Somebody who looks on hears what it will take. */
static void tell(const struct run *r)
{
	const struct sr_jobs *x = &r->jobs;
	const struct sr_takes takes = sr_jobs_slabs(x, x->slabs);
	const char *work = json_string_value(json_object_get(x->told, "work"));
	struct ct_cost cost = {.seconds = takes.seconds,
		.memory = takes.memory,
		.disk = sr_jobs_told(x, "disk-bytes"),
		.state = takes.disk};

	snprintf(cost.work, sizeof cost.work, "%.100s in %zu slabs", work ? work : "", x->slabs);
	ct_cost_say(&cost, r->env);
}

/* The folder of the slabs: that of the whole, OUT or a file between the steps. */
static int open_folder(struct run *r, struct ct_err *e)
{
	const struct ct_folder *own = &r->c->folder;
	const char *out = r->c->step[1].output;
	const size_t n = strlen(own->path);

	r->jobs.folder = own;
	if (!own->temporary || (strncmp(out, own->path, n) == 0 && out[n] == '/'))
		return 0;
	r->jobs.folder = &r->beside;
	return ct_folder_open_beside(&r->beside, out, e);
}

/* The slabs are joined, or they are kept for somebody to join them. */
static int join(struct run *r, struct ct_err *e)
{
	const size_t merge = r->jobs.slabs + 1, end = merge + (r->c->step[1].beside ? 2 : 1);
	struct ct_folder *folder = r->beside.path ? &r->beside : &r->c->folder;
	struct ct_err why;

	if (ct_chain_run_some(r->c, merge, end, r->env, e)) {
		if (e->code == CT_ESTOP || !folder->temporary)
			return -1;
		why = *e;
		ct_folder_keep(folder);
		return ct_fail(
			e, why.code, "%.200s; the slabs are kept in %.200s", why.msg, folder->path);
	}
	for (size_t i = 0; folder->temporary && i < r->jobs.names; i++)
		unlink(r->jobs.name[i]);
	return 0;
}

static int run_slabs(struct run *r, struct ct_err *e)
{
	struct sr_jobs *x = &r->jobs;
	struct ct_chain *c = r->c;
	size_t joined;

	if (open_folder(r, e) || sr_jobs_divide(x, 0, 0, e) ||
		ct_chain_replace(c, 1, &x->jobs, e) ||
		(r->p->resume && sr_files_check_out(r->f, r->p, c, r->env, e)) || check_disk(r, e))
		return -1;
	joined = x->slabs + (c->step[1].beside ? 3 : 2);
	tell(r);
	if (ct_chain_run_some(c, 1, x->slabs + 1, r->env, e) || join(r, e))
		return -1;
	return joined < c->n ? ct_chain_run_some(c, joined, c->n, r->env, e) : 0;
}

/* Do all steps behind that which refines fit? *all: of all of them, and of that. */
static int check_fits(
	const struct run *r, struct sr_takes *all, const struct sr_takes *takes, struct ct_err *e)
{
	const double free = ct_memory_free("");
	const struct ct_chain *c = r->c;

	for (size_t i = 1; i < c->n; i++) {
		const double need = isnan(takes[i].memory) ? 0 : takes[i].memory;

		if (i > 1 && !ct_memory_fits(need, NULL, free))
			return ct_fail(e, CT_ENOMEM,
				"%s takes %.0f MiB of memory, and %.0f are free", c->step[i].tool,
				mib(need), floor(free / MIB));
		all->memory = fmax(all->memory, need);
		all->seconds += takes[i].seconds;
		if (strcmp(c->step[i].output, r->f->out) != 0 && !isnan(takes[i].disk))
			all->disk += takes[i].disk;
	}
	return check_free(c->folder.path, all->disk, "files between the steps", OTHER_FOLDER, e);
}

/* What the step that refines takes. */
static int refining(struct run *r, struct sr_takes *takes, struct ct_err *e)
{
	struct sr_jobs *x = &r->jobs;
	void *answer;

	if (!json_object_get(x->told, "seconds")) {
		if (ct_chain_ask(&answer, r->c, 1, r->env, e))
			return -1;
		json_decref(x->told);
		x->told = answer;
	}
	*takes = (struct sr_takes){sr_jobs_told(x, "seconds"),
		sr_jobs_told(x, "memory-bytes") + CT_MEMORY_BASE, sr_jobs_told(x, "disk-bytes")};
	return 0;
}

static bool is_long(const struct run *r)
{
	const double s = r->p->factor ? strtod(r->p->factor, NULL) : 1;
	struct ct_vol head = {0};
	struct ct_err why;
	bool is = false;

	if (r->f->prior && sr_head(&head, r->c->step[0].output, &why) == 0)
		is = expect_fine(&head, (const double[3]){s, s, s}) >= LONG;
	ct_vol_free(&head);
	return is;
}

/* Of a chain with projections that is long, and begins: what all of it will take. */
static int expect_chain(struct run *r, struct ct_err *e)
{
	const struct ct_chain *c = r->c;
	struct ct_cost cost = {.work = "all steps"};
	struct sr_takes *takes = NULL, all = {0};
	int rc = -1;

	if (r->p->resume || !is_long(r))
		return 0;
	if (ct_alloc0(&takes, c->n, sizeof *takes, e) || refining(r, &takes[1], e) ||
		sr_rehearse(takes, c, 2, c, r->f->out, r->env, e) || check_fits(r, &all, takes, e))
		goto out;
	cost.seconds = all.seconds;
	cost.memory = all.memory;
	cost.disk = takes[c->n - 1].disk;
	cost.state = all.disk;
	if (!isnan(all.seconds))
		ct_cost_say(&cost, r->env);
	rc = 0;
out:
	free(takes);
	return rc;
}

int sr_run(struct ct_chain *c, struct sr *p, const struct sr_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	struct run r = {.c = c,
		.p = p,
		.f = f,
		.env = env,
		.jobs = {.c = c, .p = p, .f = f, .jobs = {.folder.lock = -1}},
		.beside = {.lock = -1}};
	const double began = ct_clock_wall();
	int rc = -1;

	r.jobs.slabs = 1;
	if (ct_chain_run_some(c, 0, 1, env, e) == 0 && sr_scale_settle(c, p, e) == 0 &&
		check_out(&r, e) == 0 && (sr_published(p) || ask(&r, e) == 0) &&
		expect_chain(&r, e) == 0) {
		r.jobs.slabs = sr_published(p) ? 1 : choose(&r);
		rc = r.jobs.slabs > 1 ? run_slabs(&r, e) : ct_chain_run_some(c, 1, c->n, env, e);
	}
	if (rc == 0)
		sr_say(c, r.jobs.slabs, ct_clock_wall() - began, env);
	ct_folder_close(&r.beside);
	sr_jobs_free(&r.jobs);
	return rc;
}
