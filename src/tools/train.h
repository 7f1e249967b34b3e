/* train.h: what the files of ct-train share: the command line, the network in training, the loop.
 */
#ifndef CT_TOOLS_TRAIN_H
#define CT_TOOLS_TRAIN_H
#include "cli/cli.h"
#include "cli/cost.h"
#include "cli/resume.h"

#define TRAIN_KIND_LIST(X)                                                                         \
	X(TRAIN_PICTURES, "pictures")                                                              \
	X(TRAIN_RESIDUAL, "residual")                                                              \
	X(TRAIN_SLICES, "slices")
enum train_kind { TRAIN_KIND_LIST(CT_WORD_VALUE) };

struct train_params {
	const char *out;
	struct ct_list data;
	const char *arch, *scales, *validate, *licence, *bytes, *window, *cache, *with, *refined;
	int patch, batch, steps, warmup, validate_every, validate_pieces, patience,
		checkpoint_every, log_every;
	double lr, decay, ema, clip, minutes;
	bool cosine, resume, half, thick, again;
	int kind, factor, cubes, cube, depth, components, width;
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
	/* The weights with their own metadata. */
	int (*result)(const void *it, struct ct_tensors *w, struct ct_err *e);
	/* Adds what else the prior needs; `last`: the training has ended. May be NULL. */
	int (*seal)(const void *it, struct ct_tensors *w, bool last, struct ct_err *e);
	/* The cost of the training, except its time. A step takes `seconds`. */
	int (*cost)(const void *it, double seconds, struct ct_cost *cost, struct ct_err *e);
	void (*free)(void *it);
};

/* The names and hashes of the inputs, which identify the run. */
struct train_data {
	size_t n;
	struct ct_meta *input;  /* of each DATA; owned */
	struct ct_meta with;    /* of --with; owned */
	struct ct_meta held;    /* of --validate; owned */
	struct ct_meta refined; /* of --refined; owned */
};

/* Read DATA and make the subject, before its first step. */
typedef int train_begin(struct train_subject *s, struct train_data *data,
	const struct train_params *p, const struct ct_env *env, struct ct_err *e);
train_begin train_pictures, train_slices;

/* Trains from OUT.state, if asked, to the last step, a signal or the limit of minutes. With
 * --dry-run it prints the cost instead. `asked` is the environment of the command line. */
int train_loop(struct train_subject *s, const struct train_data *data, struct ct_resume *resume,
	const struct train_params *p, const struct ct_env *asked, struct ct_err *e);

#endif
