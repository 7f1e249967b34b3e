/* best.h: the best weights of a training so far, by the loss on held-out data. */
#ifndef CT_TRAIN_BEST_H
#define CT_TRAIN_BEST_H
#include "core/tensors.h"

#include <stdint.h>

struct train_best {
	float *v; /* the values of the tensors of the result, in their order; owned; NULL: none yet
		   */
	size_t n;
	double loss;
	uint64_t step, seen; /* of these weights; of the last that was judged */
	uint64_t worse;      /* judged since, none of them better */
};

void train_best_free(struct train_best *b);
/* The loss of the result w after a step: the best if it is smaller than that of all before. */
int train_best_judge(struct train_best *b, double loss, uint64_t step, const struct ct_tensors *w,
	struct ct_err *e);
/* The best in the place of w, a result of the same training; nothing if there is none yet.
 * CT_EINPUT if it is of another. */
int train_best_take(const struct train_best *b, struct ct_tensors *w, struct ct_err *e);
/* To a state and back; a state without is one in which nothing was judged. CT_EINPUT. */
int train_best_put(const struct train_best *b, struct ct_tensors *state, struct ct_err *e);
int train_best_get(struct train_best *b, const struct ct_tensors *state, struct ct_err *e);

#endif
