/* pairs.h: for ct-train, projections of truths beside those of what was refined in their
 * place. */
#ifndef CT_TRAIN_PAIRS_H
#define CT_TRAIN_PAIRS_H
#include "core/meta.h"
#include "core/stack.h"
#include "diffusion/patches.h"
#include "diffusion/prior.h"

struct train_pairs {
	size_t n, cap;
	struct train_pair {
		char *name;                  /* owned, of the truth */
		struct ct_stack truth, base; /* owned */
		double octave, lack;         /* RMS of the octave, and of what is missing */
	} * pair;
};

/* Add what `path` names, stacks or a folder of them, each with the one of the same name in the
 * folder `base`. The key "input" of *meta becomes the name and a hash of the truths. CT_EINPUT,
 * CT_EGEOM, CT_ENUMERIC naming the file. */
int train_pairs_read(struct train_pairs *s, const char *path, const char *base, size_t factor,
	struct ct_meta *meta, struct ct_err *e);
/* The same key, of the truths from pair `first` on or of what is beside them. */
int train_pairs_name(const struct train_pairs *s, size_t first, bool base, const char *name,
	struct ct_meta *meta, struct ct_err *e);
void train_pairs_free(struct train_pairs *s);
/* What is missing for each part of the octave: the mean of the logarithms. */
double train_pairs_missing(const struct train_pairs *s);
/* Planes of all views: what is missing, and the condition (residual.h). */
int train_pairs_pictures(struct ct_pictures *to, const struct train_pairs *s,
	const struct ct_residual *r, struct ct_err *e);
/* What the prior of these weights, which are moved, is worth on every eighth view: both weights of
 * r become the least of the best ones of the stacks that they are for, so that none of them loses,
 * if there are such stacks, and are told. */
int train_pairs_weigh(struct ct_residual *r, const struct train_pairs *s,
	struct ct_tensors *weights, const struct ct_env *env, struct ct_err *e);

#endif
