/* train.h: what the parts of ct-train share: the command line, a subject that is trained, the loop
 * around it. */
#ifndef CT_TOOLS_TRAIN_H
#define CT_TOOLS_TRAIN_H
#include "cli/cli.h"
#include "cli/cost.h"
#include "cli/resume.h"

struct train_params {
	const char *out;
	struct ct_list data;
	const char *arch, *scales, *validate, *licence, *bytes, *window, *cache, *with, *base;
	int patch, batch, steps, warmup, validate_every, validate_pieces, patience,
		checkpoint_every, log_every;
	double lr, decay, ema, clip, minutes;
	bool cosine, no_flip, flip_vertical, resume, half;
	bool slices, thick, again;
	int factor, cubes, cube, depth, components, width;
	double noise;
};

/* A network in training: train-pictures.c, train-slices.c. */
struct train_subject {
	void *it;
	uint64_t (*steps)(const void *it); /* done */
	/* One step and its loss; CT_ESTOP: it was given up and has changed nothing. */
	int (*step)(void *it, double *loss, struct ct_err *e);
	int (*held)(void *it, double *loss, struct ct_err *e); /* on held-out data; may be NULL */
	ct_resume_pack *save;
	int (*restore)(void *it, const struct ct_tensors *w, struct ct_err *e);
	/* What was learned, its own metadata included. */
	int (*result)(const void *it, struct ct_tensors *w, struct ct_err *e);
	/* What else the prior needs, when it is written; `last`: for the last time. May be NULL. */
	int (*seal)(const void *it, struct ct_tensors *w, bool last, struct ct_err *e);
	/* What all of it takes, but seconds, of which one step takes some. */
	int (*cost)(const void *it, double seconds, struct ct_cost *cost, struct ct_err *e);
	void (*free)(void *it);
};

/* The names and hashes of DATA, one a DATA, which the run is of. */
struct train_data {
	size_t n;
	struct ct_meta *input; /* owned, and what is in it */
	struct ct_meta with;   /* of another prior that OUT holds too; owned */
	struct ct_meta held;   /* of --validate; owned */
	struct ct_meta base;   /* of --base; owned */
};

/* Read DATA and make the subject, before its first step. */
typedef int train_begin(struct train_subject *s, struct train_data *data,
	const struct train_params *p, const struct ct_env *env, struct ct_err *e);
train_begin train_pictures, train_slices;

/* Train it: from OUT.state if asked, to the end, a stop or the minutes; or say what that takes.
 * `asked` is the environment of the command line. */
int train_loop(struct train_subject *s, const struct train_data *data, struct ct_resume *resume,
	const struct train_params *p, const struct ct_env *asked, struct ct_err *e);

#endif
