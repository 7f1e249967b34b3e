/* sr-jobs.c: the chain of ct-sr divided: the same steps, those in parts that can be, each part made
 * by its own command, and one more to join them; see sr.h. */
#include "config.h"
#include "cli/memory.h"
#include "core/mem.h"
#include "tools/lib/expect.h"
#include "tools/sr.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PARTS_MOST = 256 };

double sr_jobs_told(const struct sr_jobs *x, const char *key)
{
	return json_number_value(json_object_get(x->told, key));
}

/* What does not fit into memory is on disk until the job is done. */
static struct sr_takes bounded(struct sr_takes t, double most)
{
	if (t.memory > most) {
		t.disk += t.memory;
		t.memory = most;
	}
	return t;
}

/* Of slab n of m, all in memory. */
static struct sr_takes slab_takes(const struct sr_jobs *x, size_t n, size_t m)
{
	const double fixed = sr_jobs_told(x, EXPECT_FIXED), need = sr_jobs_told(x, EXPECT_NEED);
	struct brick b = x->brick;
	double share;

	brick_slab(&b, n, m);
	share = (double)(b.hi - b.lo) / (double)b.of;
	return (struct sr_takes){.seconds = sr_jobs_told(x, "seconds") * share,
		.memory = fixed + (need - fixed) * share,
		.disk = sr_jobs_told(x, "disk-bytes") * (double)(b.to - b.from) / (double)b.of};
}

struct sr_takes sr_jobs_slabs(const struct sr_jobs *x, size_t m)
{
	struct sr_takes all = {0};

	for (size_t n = 1; n <= m; n++) {
		const struct sr_takes t = slab_takes(x, n, m);

		all.seconds += t.seconds;
		all.disk += t.disk;
		all.memory = fmax(all.memory, t.memory);
	}
	return all;
}

size_t sr_jobs_can(struct sr_jobs *x)
{
	size_t can;

	if (!json_object_get(x->told, EXPECT_AXIS) || sr_jobs_told(x, EXPECT_AXIS) < 0)
		return 0;
	x->brick = (struct brick){.axis = (int)sr_jobs_told(x, EXPECT_AXIS),
		.factor = (size_t)sr_jobs_told(x, EXPECT_FACTOR),
		.of = (size_t)sr_jobs_told(x, EXPECT_VOXELS)};
	can = brick_most(&x->brick);
	return can < PARTS_MOST ? can : PARTS_MOST;
}

size_t sr_jobs_fewest(const struct sr_jobs *x, size_t can)
{
	for (size_t m = 1; m <= can; m++)
		if (CT_MEMORY_SPARE * sr_jobs_slabs(x, m).memory <= x->most)
			return m;
	return 0;
}

/* A name STEM-N.END of a file between the steps, or NULL. */
static const char *name_part(
	struct sr_jobs *x, const char *stem, size_t n, const char *end, struct ct_err *e)
{
	char file[64], **room;

	if (ct_grow(&x->name, &x->names_cap, x->names + 1, sizeof *x->name, e))
		return NULL;
	room = &x->name[x->names];
	snprintf(file, sizeof file, "%s-%zu.%s", stem, n, end);
	*room = ct_folder_file(x->folder, file);
	if (!*room) {
		ct_fail(e, CT_ENOMEM, "no memory for a file name");
		return NULL;
	}
	x->names++;
	return *room;
}

/* Is it "--option=NAME"? */
static bool gives(const char *word, const char *name)
{
	const char *equals = strchr(word, '=');

	return name && equals && strcmp(equals + 1, name) == 0;
}

/* Begin a job like step s, of other outputs, or of those; words of the caller may follow. */
static int add_job(struct sr_jobs *x, const struct ct_step *s, const char *output,
	const char *beside, struct sr_takes takes, struct ct_err *e)
{
	const bool slab = output != s->output && s == &x->c->step[1];
	const double iterations = sr_jobs_told(x, EXPECT_ITERATIONS);

	if (ct_grow(&x->takes, &x->cap, x->jobs.n + 1, sizeof *x->takes, e))
		return -1;
	x->takes[x->jobs.n] = takes;
	if (ct_chain_add(&x->jobs, e, s->resumable, output, s->tool, NULL))
		return -1;
	x->jobs.step[x->jobs.n - 1].beside = beside;
	for (size_t k = 1; k < s->argc; k++) {
		if (slab && strncmp(s->argv[k], "--tolerance=", 12) == 0)
			continue;
		if (gives(s->argv[k], s->beside)
				? ct_chain_word(&x->jobs, e, "%.*s=%s",
					  (int)strcspn(s->argv[k], "="), s->argv[k], beside)
				: ct_chain_word(&x->jobs, e, "%s",
					  strcmp(s->argv[k], s->output) == 0 ? output : s->argv[k]))
			return -1;
	}
	/* what each would find out for itself */
	return slab && iterations > 0 &&
			       (ct_chain_word(&x->jobs, e, "--iterations=%.0f", iterations) ||
				       ct_chain_word(&x->jobs, e, "--tolerance=0"))
		       ? -1
		       : 0;
}

/* The outputs of the steps first .. end, not included, or what these make besides, to `output`. */
static int add_merge(struct sr_jobs *x, const char *output, size_t first, size_t end, bool beside,
	struct sr_takes takes, struct ct_err *e)
{
	const size_t at = x->jobs.n;

	if (ct_grow(&x->takes, &x->cap, at + 1, sizeof *x->takes, e))
		return -1;
	x->takes[at] = takes;
	if (ct_chain_add(&x->jobs, e, false, output, "ct-merge", NULL))
		return -1;
	for (size_t i = first; i < end; i++)
		if (ct_chain_word(&x->jobs, e, "%s",
			    beside ? x->jobs.step[i].beside : x->jobs.step[i].output))
			return -1;
	return ct_chain_word(&x->jobs, e, "%s", output);
}

static int add_slabs(struct sr_jobs *x, const struct ct_step *s, struct ct_err *e)
{
	const size_t first = x->jobs.n, m = x->slabs;
	const double disk = sr_jobs_told(x, "disk-bytes") / (s->beside ? 2 : 1);
	const struct sr_takes merge = {x->pace * disk, CT_MEMORY_BASE, disk}; /* planes */

	for (size_t n = 1; n <= m; n++) {
		const char *part = name_part(x, "slab", n, "nii", e);
		const char *beside = s->beside ? name_part(x, "slab-std", n, "nii", e) : NULL;

		if (!part || (s->beside && !beside) ||
			add_job(x, s, part, beside, bounded(slab_takes(x, n, m), x->most), e) ||
			ct_chain_word(&x->jobs, e, "--brick=%zu/%zu", n, m))
			return -1;
	}
	return add_merge(x, s->output, first, first + m, false, merge, e) ||
			       (s->beside &&
				       add_merge(x, s->beside, first, first + m, true, merge, e))
		       ? -1
		       : 0;
}

static const struct sr_takes unknown = {NAN, NAN, NAN};

static int add_views(
	struct sr_jobs *x, const struct ct_step *s, size_t views, size_t m, struct ct_err *e)
{
	const size_t first = x->jobs.n;

	for (size_t n = 1; n <= m; n++) {
		const char *part = name_part(x, "views", n, "exr", e);

		if (!part || add_job(x, s, part, NULL, unknown, e) ||
			ct_chain_word(
				&x->jobs, e, "--views=%zu:%zu", views * (n - 1) / m, views * n / m))
			return -1;
	}
	return add_merge(x, s->output, first, first + m, false, unknown, e);
}

int sr_jobs_divide(struct sr_jobs *x, size_t views, size_t parts, struct ct_err *e)
{
	const struct sr_takes whole =
		bounded((struct sr_takes){sr_jobs_told(x, "seconds"), sr_jobs_told(x, EXPECT_NEED),
				sr_jobs_told(x, "disk-bytes")},
			x->most);

	for (size_t i = 0; i < x->c->sources; i++)
		ct_chain_source(&x->jobs, x->c->source[i]);
	ct_chain_source(&x->jobs, x->c->step[0].output);
	for (size_t i = 1; i < x->c->n; i++) {
		const struct ct_step *s = &x->c->step[i];
		int rc;

		if (i == 1 && x->slabs > 1)
			rc = add_slabs(x, s, e);
		else if (strcmp(s->tool, "ct-ddnm") == 0 && parts > 1)
			rc = add_views(x, s, views, parts, e);
		else
			rc = add_job(x, s, s->output, s->beside, i == 1 ? whole : unknown, e);
		if (rc)
			return -1;
		if (i == 1)
			x->behind = x->jobs.n;
	}
	return 0;
}

void sr_jobs_free(struct sr_jobs *x)
{
	json_decref(x->told);
	for (size_t i = 0; i < x->names; i++)
		free(x->name[i]);
	free(x->name);
	free(x->takes);
	ct_chain_close(&x->jobs);
}
