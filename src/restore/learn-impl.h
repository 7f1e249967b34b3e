/* learn-impl.h: what learn.c and learn-begin.c share. */
#ifndef CT_RESTORE_LEARN_IMPL_H
#define CT_RESTORE_LEARN_IMPL_H
#include "restore/learn.h"

/* Pieces of a batch at most, and those of a check. Streams of random numbers. */
enum { CT_LEARN_PIECES = 64 };
#define CT_LEARN_STREAM ((uint64_t)1 << 32)
#define CT_LEARN_BEGIN_STREAM ((uint64_t)1 << 31)
#define CT_LEARN_CHECK_STREAM ((uint64_t)1 << 30)

/* Work of a thread: CT_LEARN_PIECE patches. */
struct ct_learn_side {
	struct ct_slice_network_work w;
	float *target, *weight; /* (piece,cell), (piece); owned, one block at target */
	float *d1, *d2;         /* (piece,width) */
	double loss, whole;
};

struct ct_learn {
	struct ct_learn_rule rule;
	struct ct_env env;
	const struct ct_example *pairs;
	size_t n, sides;
	struct ct_slice_network r; /* all: the average */
	struct ct_patch_turns turns;
	float *all, *moment, *grad; /* the weights, their two moments, the gradients of pieces */
	uint64_t steps;
	struct ct_learn_side *side; /* [sides] */
	struct ct_err *failed;      /* [CT_LEARN_PIECES] */
	double *sums;               /* [2 CT_LEARN_PIECES] */
};

/* A piece of patches of the pairs, their features, targets and weights. */
int ct_learn_draw(const struct ct_learn *l, struct ct_learn_side *d, const struct ct_example *pairs,
	size_t n, uint64_t stream, struct ct_err *e);

#endif
