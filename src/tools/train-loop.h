/* train-loop.h: the command line of ct-train, and its loop. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_TRAIN_LOOP_H
#define CT_TOOLS_TRAIN_LOOP_H
#include "cli/cli.h"
#include "cli/resume.h"
#include "train/subject.h"

#define TRAIN_KIND_LIST(X)                                                                         \
	X(TRAIN_PICTURES, "pictures")                                                              \
	X(TRAIN_SUPERRES, "superres")                                                              \
	X(TRAIN_SLICES, "slices")                                                                  \
	X(TRAIN_VOLUMES, "volumes")
enum train_kind { TRAIN_KIND_LIST(CT_WORD_VALUE) };

struct train_params {
	const char *out;
	struct ct_list data;
	const char *arch, *scales, *validate, *licence, *bytes, *window, *cache, *with;
	int patch, batch, steps, warmup, validate_every, validate_pieces, patience,
		checkpoint_every, log_every;
	double lr, decay, ema, clip, minutes;
	bool cosine, resume, half, thick, again;
	int kind, factor, cubes, cube, depth, slices, components, width, hidden;
	double noise;
};

/* Trains from OUT.state, if asked, to the last step, a signal or the limit of minutes. With
 * --dry-run it prints the cost instead. `asked` is the environment of the command line. */
int train_loop(struct train_subject *s, const struct train_data *data, struct ct_resume *resume,
	const struct train_params *p, const struct ct_env *asked, struct ct_err *e);

#endif
