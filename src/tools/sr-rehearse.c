/* sr-rehearse.c: what the steps behind the one that refines will take; see sr.h.
 *
 * What they read is not there yet, so they are gone through with stand-ins, files of the same sizes
 * and much the same content, which the same commands make of the scan in little time:
 *   the refined volume   the scan interpolated
 *   projections of it    those of the scan, on the same detector
 *   drawn ones           the coarse ones interpolated; or the others, where the prior adds nothing
 *   Gaussians            those that a fit begins with
 * Steps that take long are asked (--dry-run) what they expect of these. The others take little:
 * they are run, and tell what they took.
 */
#include "config.h"
#include "cli/cost.h"
#include "cli/journal.h"
#include "resolution/degrade.h"
#include "tools/lib/expect.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

struct rehearsal {
	const struct ct_chain *of, *c; /* the steps, and the chain that they are of */
	size_t first;                  /* of the steps behind */
	const struct ct_step *refine;
	const char *lr; /* the scan */
	double scale;
	size_t refined; /* voxels of the refined volume's longest side */
	bool adds;      /* the prior of projections, anything */
	struct ct_chain own;
	char **name; /* of the stand-ins of all outputs; then those of `refine`. Owned */
};

/* The stand-in of a file that a step makes, or the file. */
static const char *instead(const struct rehearsal *x, const char *file)
{
	const size_t n = x->of->n;

	for (size_t i = x->first; i < n; i++)
		if (strcmp(file, x->of->step[i].output) == 0)
			return x->name[i];
	if (x->refine->beside && strcmp(file, x->refine->beside) == 0)
		return x->name[n + 1];
	return strcmp(file, x->refine->output) == 0 ? x->name[n] : file;
}

/* The file of "--option=FILE", or the word. */
static const char *file_of(const char *word)
{
	const char *equals = strncmp(word, "--", 2) == 0 ? strchr(word, '=') : NULL;

	return equals ? equals + 1 : word;
}

static int put(struct rehearsal *x, const char *word, struct ct_err *e)
{
	const char *file = file_of(word);

	return ct_chain_word(&x->own, e, "%.*s%s", (int)(file - word), word, instead(x, file));
}

static bool is_tool(const struct ct_step *s, const char *tool)
{
	return strcmp(s->tool, tool) == 0;
}

/* The rest of a word after `option`, or NULL if it is another. */
static const char *value(const char *word, const char *option)
{
	const size_t n = strlen(option);

	return strncmp(word, option, n) == 0 ? word + n : NULL;
}

/* The words of a step, those but files that `keep` (up to a NULL) does not name left out; all of
 * them if that is NULL. */
static int add(struct rehearsal *x, const struct ct_step *s, const char *tool, const char *output,
	const char *const *keep, struct ct_err *e)
{
	if (ct_chain_add(&x->own, e, false, output, tool, NULL))
		return -1;
	for (size_t k = 1; k < s->argc; k++) {
		const char *word = s->argv[k];
		bool kept = !keep || word[0] != '-';

		for (const char *const *o = keep; o && *o; o++)
			kept |= value(word, *o) != NULL;
		if (kept && put(x, word, e))
			return -1;
	}
	return 0;
}

/* Run the last command. */
static int start(struct rehearsal *x, const struct ct_env *env, struct ct_err *e)
{
	return ct_chain_start(&x->own, x->own.n - 1, env, e);
}

/* The scan interpolated, of the operator of the refined volume. Only a method that inverts that
 * tells the error to expect. */
static int refine(struct rehearsal *x, const struct ct_env *env, struct ct_err *e)
{
	static const char *const keep[] = {"-x",
		"--spacing=", "--memory=", "--sigma=", "--estimate", "--decimate=", "--std=", NULL};
	const char *how = x->refine->beside ? "--iterations=1" : "--method=linear";

	return add(x, x->refine, "ct-upsample", x->name[x->of->n], keep, e) ||
			       ct_chain_word(&x->own, e, "%s", how) || start(x, env, e)
		       ? -1
		       : 0;
}

/* Of the scan: as many pixels, and S times fewer voxels along each axis. */
static int project(
	struct rehearsal *x, const struct ct_step *s, const char *output, struct ct_err *e)
{
	bool fine = false, sampled = false;

	if (ct_chain_add(&x->own, e, false, output, s->tool, NULL))
		return -1;
	for (size_t k = 1; k < s->argc; k++)
		fine |= strcmp(s->argv[k], x->refine->output) == 0;
	for (size_t k = 1; k < s->argc; k++) {
		const char *word = s->argv[k], *per = value(word, "--sampling=");

		sampled |= per != NULL;
		if (fine && per ? ct_chain_word(&x->own, e, "--sampling=%.17g",
					  x->scale * strtod(per, NULL))
			: strcmp(word, x->refine->output) == 0
				? ct_chain_word(&x->own, e, "%s", x->lr)
				: put(x, word, e))
			return -1;
	}
	return fine && !sampled ? ct_chain_word(&x->own, e, "--det=%zu", x->refined) : 0;
}

/* Without a network. */
static int draw(struct rehearsal *x, const struct ct_step *s, const char *output, struct ct_err *e)
{
	static const char *const keep[] = {"-x", "--views=", NULL};
	const char *base = NULL;

	for (size_t k = 1; k < s->argc && !base; k++)
		base = value(s->argv[k], "--base-projections=");
	return add(x, s, s->tool, output, keep, e) || ct_chain_word(&x->own, e, "--sampler=none") ||
			       (base && !x->adds &&
				       ct_chain_word(&x->own, e, "--init=%s", instead(x, base)))
		       ? -1
		       : 0;
}

static int fit(struct rehearsal *x, const struct ct_step *s, const char *output, struct ct_err *e)
{
	return add(x, s, s->tool, output, NULL, e) || ct_chain_word(&x->own, e, "--iterations=1")
		       ? -1
		       : 0;
}

static double number(const json_t *answer, const char *key)
{
	return json_number_value(json_object_get(answer, key));
}

static double told(const struct ct_step *s, const char *key)
{
	const char *text = ct_meta_get(&s->told, key);

	return text ? strtod(text, NULL) : 0;
}

/* What step s expects. */
static int ask(struct rehearsal *x, struct sr_takes *takes, const struct ct_step *s,
	const char *output, const struct ct_env *env, struct ct_err *e)
{
	void *answer = NULL;
	const struct ct_step *own;

	if (add(x, s, s->tool, output, NULL, e) ||
		ct_chain_ask(&answer, &x->own, x->own.n - 1, env, e))
		return -1;
	own = &x->own.step[x->own.n - 1];
	*takes = (struct sr_takes){.seconds = number(answer, "seconds"),
		.memory = number(answer, "memory-bytes") + told(own, CT_COST_PROGRAM),
		.disk = number(answer, "disk-bytes") + number(answer, "state-bytes")};
	if (json_object_get(answer, EXPECT_ADDS))
		x->adds = number(answer, EXPECT_ADDS) > 0;
	json_decref(answer);
	return 0;
}

static double size_of(const char *file)
{
	struct stat st;

	return stat(file, &st) == 0 ? (double)st.st_size : 0;
}

/* What it took to run it. */
static int take(struct rehearsal *x, struct sr_takes *takes, const struct ct_step *s,
	const char *output, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step *own;

	if (add(x, s, s->tool, output, NULL, e) || start(x, env, e))
		return -1;
	own = &x->own.step[x->own.n - 1];
	*takes = (struct sr_takes){.seconds = told(own, CT_COST_CPU) / strtod(x->own.threads, NULL),
		.memory = told(own, CT_COST_HELD),
		.disk = size_of(output)};
	return 0;
}

/* How many views a part of the projections has; 0 if it is none. */
static double part_of(const struct ct_step *s)
{
	double from, to;

	for (size_t k = 1; is_tool(s, "ct-ddnm") && k < s->argc; k++)
		if (sscanf(s->argv[k], "--views=%lf:%lf", &from, &to) == 2)
			return to - from;
	return 0;
}

static int go_through(struct rehearsal *x, struct sr_takes *takes, size_t i,
	const struct ct_env *env, struct ct_err *e)
{
	static const struct {
		const char *tool;
		int (*stand_in)(struct rehearsal *x, const struct ct_step *s, const char *output,
			struct ct_err *e);
	} asked[] = {{"ct-project", project}, {"ct-ddnm", draw}, {"ct-nabgs", fit}};
	const struct ct_step *s = &x->of->step[i];
	const double before = i > x->first ? part_of(s - 1) : 0;
	const size_t tools = sizeof asked / sizeof *asked;
	size_t k = 0;

	while (k < tools && !is_tool(s, asked[k].tool))
		k++;
	if (k == tools)
		return take(x, &takes[i], s, x->name[i], env, e);
	if (before > 0) { /* all parts are alike */
		takes[i] = takes[i - 1];
		takes[i].seconds *= part_of(s) / before;
	} else if (ask(x, &takes[i], s, x->name[i], env, e))
		return -1;
	if (asked[k].stand_in(x, s, x->name[i], e) || start(x, env, e))
		return -1;
	takes[i].disk = fmax(takes[i].disk, size_of(x->name[i])); /* none has a file, too */
	return 0;
}

/* How the name of a stand-in ends. A series would be a folder: one file of it takes as much. */
static const char *end_of(const struct ct_step *s, const char *file)
{
	const char *end = strrchr(file, '.');

	if (is_tool(s, "ct-convert"))
		return ".dcm";
	if (end && strcasecmp(end, ".gz") == 0)
		end -= strlen(".nii");
	return end ? end : ".nii";
}

static int open_rehearsal(struct rehearsal *x, const char *out, struct ct_err *e)
{
	const size_t n = x->of->n;

	x->own.tools = strdup(x->c->tools);
	x->own.threads = strdup(x->c->threads);
	x->name = calloc(n + 2, sizeof *x->name);
	if (!x->own.tools || !x->own.threads || !x->name)
		return ct_fail(e, CT_ENOMEM, "no memory");
	if (ct_folder_open_beside(&x->own.folder, out, e))
		return -1;
	for (size_t i = x->first; i < n + 2; i++) {
		const struct ct_step *s = i < n ? &x->of->step[i] : x->refine;
		const char *file = i <= n ? s->output : s->beside;
		char own[40];

		snprintf(own, sizeof own, "%zu%.8s", i, file ? end_of(s, file) : "");
		x->name[i] = ct_chain_path(&x->own, own);
		if (!x->name[i])
			return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	return 0;
}

static void close_rehearsal(struct rehearsal *x)
{
	for (size_t i = 0; x->name && i < x->of->n + 2; i++)
		free(x->name[i]);
	free(x->name);
	ct_chain_close(&x->own);
}

/* With projections the factor is one for all axes. */
static int measure(struct rehearsal *x, struct ct_err *e)
{
	struct ct_vol head = {0};
	size_t most = 0;

	for (size_t k = 1; k < x->refine->argc; k++)
		if (value(x->refine->argv[k], "-x"))
			x->scale = strtod(value(x->refine->argv[k], "-x"), NULL);

	if (sr_head(&head, x->lr, e))
		return -1;
	for (int a = 0; a < 3; a++)
		most = head.n[a] > most ? head.n[a] : most;
	ct_vol_free(&head);
	x->refined = ct_degrade_cover(most, x->scale);
	return 0;
}

static int go(struct rehearsal *x, struct sr_takes *takes, const char *out,
	const struct ct_env *env, struct ct_err *e)
{
	if (open_rehearsal(x, out, e) || measure(x, e) || refine(x, env, e))
		return -1;
	for (size_t i = x->first; i < x->of->n; i++)
		if (go_through(x, takes, i, env, e))
			return -1;
	return 0;
}

int sr_rehearse(struct sr_takes *takes, const struct ct_chain *of, size_t first,
	const struct ct_chain *c, const char *out, const struct ct_env *env, struct ct_err *e)
{
	struct rehearsal x = {.of = of,
		.c = c,
		.refine = &c->step[1],
		.lr = c->step[0].output,
		.first = first,
		.adds = true,
		.own.folder.lock = -1};
	const char *log = getenv(CT_JOURNAL_NAME);
	char *kept = log ? strdup(log) : NULL;
	struct ct_env own = *env;
	int rc;

	for (size_t i = first; i < of->n; i++)
		takes[i] = (struct sr_takes){NAN, NAN, NAN};
	if (first == of->n)
		return 0;
	own.verbose = -1;
	unsetenv(CT_JOURNAL_NAME); /* of the run, not of this */
	rc = go(&x, takes, out, &own, e);
	if (kept)
		setenv(CT_JOURNAL_NAME, kept, 1);
	free(kept);
	close_rehearsal(&x);
	if (rc == 0 || e->code == CT_ESTOP || e->code == CT_ENOMEM)
		return rc;
	ct_log(env, CT_WARN, "what some steps will take is not known: %s", e->msg);
	return 0;
}
