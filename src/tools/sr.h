/* sr.h: the parts of ct-sr. */
#ifndef CT_TOOLS_SR_H
#define CT_TOOLS_SR_H
#include "cli/chain.h"
#include "core/vol.h"
#include "core/words.h"
#include "tools/lib/brick.h"

#include <jansson.h>
#include <stdbool.h>

#define QUALITIES(X)                                                                               \
	X(DRAFT, "draft")                                                                          \
	X(FAST, "fast")                                                                            \
	X(BALANCED, "balanced")                                                                    \
	X(BEST, "best")
enum quality { QUALITIES(CT_WORD_VALUE) };

enum { SR_SCALE = 96 };

/* What the command line says. */
struct sr {
	const char *in, *out, *report, *confidence, *keep, *plan, *prior, *slices, *arch, *window,
		*series, *crop, *template;
	const char *factor, *spacing, *sigma, *memory;
	double noise;
	int decimate, label, quality, views, iterations, gaussians, tilt, gaps, jobs;
	bool projections, paper, release, resume, dry_run, skip_damaged, deid;
	/* where neither factor nor spacing is given (sr-scale.c) */
	char said[SR_SCALE]; /* what `factor` points to then */
	bool assumed;        /* by no header that could be read */
};

/* The published method? */
static inline bool sr_published(const struct sr *p)
{
	return p->paper || p->release;
}

/* The factor where neither that nor a spacing is given: that which the header of IN says, and 4 if
 * it says none, or cannot be read twice, as a pipe. */
void sr_scale_find(struct sr *p);
/* The factors, of which at least one refines. CT_EUSAGE. */
int sr_scale_check(double x[static 3], const struct sr *p, struct ct_err *e);
/* The first step is done: what the header says that IN had, into the step that refines, where only
 * now it can be read. CT_EUSAGE, where projections depend on it. */
int sr_scale_settle(struct ct_chain *c, struct sr *p, struct ct_err *e);

/* All files by name. */
struct sr_files {
	char *template; /* the series that DICOM of OUT belongs to, or NULL */
	char *in, *out, *keep, *prior, *slices, *lr, *up, *up_proj, *lr_proj, *sr_proj, *res, *sr;
	char *report, *confidence, *log; /* report and confidence: NULL if not wanted */
	const char *result;              /* what the method makes: sr if OUT is made of that */
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

/* May OUT, and what is written besides, be written, now that the folder between is there, which may
 * lie in it? */
int sr_files_check_out(const struct sr_files *f, const struct sr *p, const struct ct_chain *c,
	const struct ct_env *env, struct ct_err *e);

/* What a job takes; NaN: nobody can tell before its inputs are there. */
struct sr_takes {
	double seconds, memory, disk; /* on the threads of the run; bytes */
};

/* The chain as jobs that do not wait for each other where they need not (sr-jobs.c). */
struct sr_jobs {
	const struct ct_chain *c;
	const struct sr *p;
	const struct sr_files *f;
	const struct ct_folder *folder; /* of the parts */
	double most;                    /* bytes of memory that a job may take */
	json_t *told;                   /* by the step that refines; owned */
	struct brick brick;             /* of that */
	size_t slabs;                   /* chosen by the caller */
	double pace;                    /* CPU seconds a byte of a merge; a plan measures it */
	struct ct_chain jobs;           /* steps, parts and joins; in no folder */
	size_t behind;                  /* the first of them that is not for refining */
	struct sr_takes *takes;         /* of each */
	size_t cap;
	char **name; /* of parts, owned */
	size_t names, names_cap;
};

/* A number of those that the step that refines has told. */
double sr_jobs_told(const struct sr_jobs *x, const char *key);
/* x->brick, and the most slabs that there can be; 0 if the scan cannot be cut. */
size_t sr_jobs_can(struct sr_jobs *x);
/* Of m slabs, all in memory: the seconds and the disk of all of them, the memory of the largest. */
struct sr_takes sr_jobs_slabs(const struct sr_jobs *x, size_t m);
/* The fewest slabs, up to `can`, that each fit into x->most; 0 if they do not. */
size_t sr_jobs_fewest(const struct sr_jobs *x, size_t can);
/* x->jobs: all steps but the first, which is done: that which refines in x->slabs slabs, that which
 * draws projections in `parts` parts of its `views`. CT_ENOMEM. */
int sr_jobs_divide(struct sr_jobs *x, size_t views, size_t parts, struct ct_err *e);
void sr_jobs_free(struct sr_jobs *x);

/* takes[i] <- what the steps `first` and those behind it of `of` will take, which are those of the
 * chain c, or of its jobs, behind the step that refines; only the first step of c is done.
 * Stand-ins of their files lie beside `out` meanwhile (sr-rehearse.c). If one of them fails a
 * warning says so, and what it and those behind it take is NaN. CT_ESTOP, CT_ENOMEM. */
int sr_rehearse(struct sr_takes *takes, const struct ct_chain *of, size_t first,
	const struct ct_chain *c, const char *out, const struct ct_env *env, struct ct_err *e);

/* Do the first step of the chain, and write the others as jobs: those that refine and that draw the
 * `views` projections in p->jobs parts, into plan.json and plan.mk of its folder (sr-plan.c). */
int sr_plan(struct ct_chain *c, struct sr *p, const struct sr_files *f, size_t views,
	const struct ct_env *env, struct ct_err *e);
/* Run the chain; the step that refines in slabs, where it does not fit into the memory that it may
 * take and the scan can be cut (sr-run.c). */
int sr_run(struct ct_chain *c, struct sr *p, const struct sr_files *f, const struct ct_env *env,
	struct ct_err *e);

/* Read the header of a volume in NIfTI. Codes of the reader. */
int sr_head(struct ct_vol *head, const char *path, struct ct_err *e);
/* Say in one line what the steps did that were run, `slabs` of them those that refine (sr-say.c).
 */
void sr_say(const struct ct_chain *c, size_t slabs, double seconds, const struct ct_env *env);

#endif
