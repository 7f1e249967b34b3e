/* sr.h: the parts of ct-sr. */
#ifndef CT_TOOLS_SR_H
#define CT_TOOLS_SR_H
#include "cli/chain.h"
#include "core/words.h"

#include <stdbool.h>

#define QUALITIES(X)                                                                               \
	X(DRAFT, "draft")                                                                          \
	X(FAST, "fast")                                                                            \
	X(BALANCED, "balanced")                                                                    \
	X(BEST, "best")
enum quality { QUALITIES(CT_WORD_VALUE) };

/* What the command line says. */
struct sr {
	const char *in, *out, *keep, *plan, *prior, *slices, *arch, *window, *series, *crop,
		*template;
	const char *factor, *spacing, *sigma, *memory;
	double noise;
	int decimate, label, quality, views, iterations, gaussians, tilt, gaps, jobs;
	bool paper, release, resume, dry_run, skip_damaged, deid;
};

/* The published method? */
static inline bool sr_published(const struct sr *p)
{
	return p->paper || p->release;
}

/* All files by name. */
struct sr_files {
	char *template; /* the series that DICOM of OUT belongs to, or NULL */
	char *in, *out, *keep, *prior, *slices, *lr, *up, *up_proj, *lr_proj, *sr_proj, *res, *sr;
	const char *result; /* what the method makes: sr if OUT is made of that */
};

/* Those of the user; a prior is named only if something is left to it, that of projections if they
 * are of a scan `scale` times coarser, and there are some. CT_EUSAGE for what only DICOM has; codes
 * of the readers. */
int sr_files_given(struct sr_files *f, const struct sr *p, int scale, const struct ct_env *env,
	struct ct_err *e);
/* Those between the steps. */
int sr_files_kept(struct sr_files *f, const struct ct_chain *c, struct ct_err *e);
/* CT_EOUTPUT if IN or OUT is a file of the folder that holds those between them. */
int sr_files_check(const struct sr_files *f, const struct sr *p, struct ct_err *e);
/* All of them from the root, "-" excepted: for commands that run elsewhere. CT_ENOMEM. */
int sr_files_absolute(struct sr_files *f, struct ct_err *e);
void sr_files_free(struct sr_files *f);

/* Do the first step of the chain, and write the others as jobs: those that refine and that draw the
 * `views` projections in p->jobs parts, into plan.json and plan.mk of its folder (sr-plan.c). */
int sr_plan(struct ct_chain *c, const struct sr *p, size_t views, const struct ct_env *env,
	struct ct_err *e);

#endif
