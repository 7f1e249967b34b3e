/* sr.h: the parts of ct-sr. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_SR_H
#define CT_TOOLS_SR_H
#include "cli/cli.h"
#include "cli/kept.h"
#include "refine/refine.h"
#include "steps/step-paper.h"
#include "tools/ddnm-parts.h"
#include "tools/lib/said.h"

#include <jansson.h>

#define QUALITIES(X)                                                                               \
	X(DRAFT, "draft")                                                                          \
	X(FAST, "fast")                                                                            \
	X(BALANCED, "balanced")
enum quality { QUALITIES(CT_WORD_VALUE) };

/* What the command line says. */
struct sr {
	const char *in, *out, *report, *confidence, *keep, *prior, *series, *memory, *sidecar;
	struct said_opts said;
	int quality, views, iterations, gaussians;
	bool paper, release, deid;
};

/* HU RMS, of the inversion. */
#define SR_TOLERANCE 0.1
/* Where the commands of --dry-run put what lies between the steps, without --keep. */
#define SR_FOLDER "steps"

/* Files of the published method: those that are given, and, in the order in which steps make them,
 * those between. */
enum sr_file {
	SR_IN,
	SR_OUT,
	SR_PRIOR,
	SR_LR, /* from here on as in enum ct_step_paper_made */
	SR_UP,
	SR_UP_PROJ,
	SR_LR_PROJ,
	SR_SR_PROJ,
	SR_RESIDUAL,
	SR_SUM,
	SR_LOG,
	SR_PAGE,
	SR_SERIES, /* is none, but named by a word of its own likewise */
	SR_FILES
};

/* One command: words, word[0] being its name, and which file each names, SR_FILES: none. */
enum { SR_STEPS = CT_STEP_PAPER_STEPS + 2, SR_WORDS = 16 };
struct sr_command {
	enum sr_file output;
	size_t n;
	char *word[SR_WORDS]; /* owned */
	enum sr_file file[SR_WORDS];
};

/* The published method as words (sr-words.c): one command a step; behind those of enum
 * ct_step_paper_made ct-convert, if OUT is not NIfTI, and ct-report. */
struct sr_words {
	const struct sr *p;
	struct ct_step_paper_rule rule;
	struct ct_step_paper plan;
	size_t n;
	struct sr_command step[SR_STEPS];
	char *folder, *file[SR_FILES]; /* owned */
	enum sr_file result;           /* what ct-compose makes: OUT if that is NIfTI */
	char factor[96];               /* in words */
	bool of_study, no_memory;      /* OUT is DICOM of the study of IN */
};
/* *s is to be freed in any case. CT_EUSAGE, CT_EINPUT, CT_EOUTPUT, CT_ENOMEM. */
int sr_words_make(
	struct sr_words *s, const struct sr *p, const struct ct_env *env, struct ct_err *e);
/* The name of what command i makes. */
const char *sr_words_output(const struct sr_words *s, size_t i);
/* All to f as a shell reads them, a line each, with `last` at its end. */
void sr_words_print(const struct sr_words *s, const char *last, FILE *f);
/* A script of them to f, which runs from wherever it is called if it lies in the folder.
 * CT_EOUTPUT. */
int sr_words_script(const struct sr_words *s, FILE *f, struct ct_err *e);
/* Command i as env->history has it, to be freed. CT_ENOMEM. */
int sr_words_history(char **text, const struct sr_words *s, size_t i, struct ct_err *e);
void sr_words_free(struct sr_words *s);

/* The steps of a run, command i of the words being step i (sr-keep.c). */
struct sr_steps {
	struct sr_words w;
	const struct ct_env *env; /* of all of it; of a step: with its history */
	char *history[SR_STEPS];
	struct ct_kept kept;                 /* of --keep; without it folder is NULL */
	size_t left_out;                     /* steps that were done before */
	char content[SR_FILES][CT_HASH_HEX]; /* what the files hold, of those that are known */
	bool own[SR_FILES];                  /* a person's, not what a run made */
	/* of the step under way */
	struct ct_io_rule files;
	char key[CT_HASH_HEX];
	bool of_own, begun; /* it is made of a person's own; it had begun before */
	double began, cpu;
	struct ct_resume resume;
	struct ddnm_state views;
};
/* What IN as it was read, and the prior, hold: before the first step, if they are kept. */
int sr_steps_source(struct sr_steps *s, const struct ct_meta *in, struct ct_err *e);
/* Step i begins, in *own, a copy of s->env: 1 if what it makes is there. CT_EOUTPUT, CT_ENOMEM,
 * CT_ESTOP. */
int sr_steps_begin(struct sr_steps *s, size_t i, struct ct_env *own, struct ct_err *e);
/* It has made its output. */
int sr_steps_end(struct sr_steps *s, size_t i, struct ct_err *e);
/* *own <- what a file is written in as command i writes it; *of must outlive it. */
struct sr_writer {
	const struct ct_env *env;
	struct ct_io_rule files;
};
void sr_steps_writer(struct ct_env *own, struct sr_writer *of, const struct sr_steps *s, size_t i);
/* What keeps the steps of ct_step_paper_run. */
struct ct_step_paper_keeper sr_steps_keeper(struct sr_steps *s);
void sr_steps_free(struct sr_steps *s);

/* The published method (sr-paper.c). Codes of the steps, of what reads and writes. */
int sr_paper(const struct sr *p, const struct ct_env *env, struct ct_err *e);

/* CPU seconds of the published method, about (sr-ahead.c); *lr is then empty or as it was. Codes
 * of its steps. */
int sr_paper_seconds(double *cpu, const struct ct_step_paper *plan, struct ct_vol *lr,
	const struct ct_step_paper_keeper *keeper, const struct ct_env *env, struct ct_err *e);

/* What a run found and did (sr-result.c). */
struct sr_result {
	const struct ct_refine *plan; /* after its run */
	const struct ct_vol *in;
	double began;
};
/* On standard error: what was assumed, and a line of what was found and done. CT_ENOMEM. */
int sr_result_say(const struct sr_result *did, const struct ct_env *env, struct ct_err *e);
/* The same as JSON on standard output. CT_ENOMEM. */
int sr_result_json(const struct sr_result *did, const struct sr *p, struct ct_err *e);
/* An object, released here, with what every run has: seconds, memory and files. CT_ENOMEM. */
int sr_result_print(json_t *o, const struct sr *p, double began, struct ct_err *e);

#endif
