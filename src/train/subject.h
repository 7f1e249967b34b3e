/* subject.h: networks in training, of pictures, slices or volumes, with the data that they learn
 * from.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TRAIN_SUBJECT_H
#define CT_TRAIN_SUBJECT_H
#include "arssr/arssr-train.h"
#include "core/env.h"
#include "core/meta.h"
#include "core/tensors.h"
#include "diffusion/train.h"
#include "restore/example.h"
#include "restore/learn.h"

/* A network in training: pictures.c, slices.c, volumes.c. */
struct train_subject {
	void *it, *training; /* the latter with what it learns by: of step, save, restore */
	uint64_t steps;      /* done; of the loop */
	/* One step and its loss; CT_ESTOP: it was given up and has changed nothing. */
	int (*step)(void *training, double *loss, struct ct_err *e);
	int (*held)(void *it, double *loss, struct ct_err *e); /* on held-out data; may be NULL */
	int (*save)(const void *training, struct ct_tensors *state, struct ct_err *e);
	int (*restore)(void *training, const struct ct_tensors *w, struct ct_err *e);
	/* The weights with their own metadata. */
	int (*result)(const void *it, struct ct_tensors *w, struct ct_err *e);
	/* Adds what else the prior needs; `last`: the training has ended. May be NULL. */
	int (*seal)(const void *it, struct ct_tensors *w, bool last, struct ct_err *e);
	/* The cost of the training, except its time. A step takes `seconds`. */
	int (*cost)(const void *it, double seconds, struct ct_cost *cost, struct ct_err *e);
	void (*free)(void *it);
};

/* Where the data are: files and folders, borrowed. */
struct train_files {
	size_t n;
	const char *const *v;
	const char *validate; /* held out; NULL: none */
};

/* The names and hashes of the inputs, which identify the run. */
struct train_data {
	size_t n;
	struct ct_meta *input; /* [n]: of each file; owned */
	struct ct_meta with;   /* of the prior that OUT holds besides; owned */
	struct ct_meta held;   /* of what is held out; owned */
};

/* A noise predictor of pictures, or a network of super-resolution. */
struct train_pictures_rule {
	struct train_files files;
	size_t pieces; /* to validate on */
	bool half;     /* OUT is in half precision */
	struct ct_unet_arch arch;
	struct ct_train_opts opts;
};
/* The slice network of one factor. */
struct train_slices_rule {
	struct train_files files;
	const char *with, *cache; /* a prior whose networks go to OUT too; a folder; or NULL */
	bool again;               /* after the networks of `with` */
	bool half;                /* OUT is in half precision */
	size_t cubes;             /* examples of each CT */
	double bytes[2];          /* HU of the bytes 0 and 255; NaN: volumes are of HU */
	struct ct_example_rule examples;
	struct ct_slice_network network; /* its shape */
	struct ct_learn_rule learn;
};

/* ArSSR. */
struct train_volumes_rule {
	struct train_files files;
	size_t pieces;           /* to validate on */
	bool half;               /* OUT is in half precision */
	double bytes[2];         /* HU of the bytes 0 and 255; NaN: volumes are of HU */
	struct ct_arssr network; /* its shape and window */
	struct ct_arssr_train_rule train;
};

/* Read the data and make the subject, before its first step. The rule must stay as it is. */
int train_pictures(struct train_subject *s, struct train_data *data,
	const struct train_pictures_rule *p, const struct ct_env *env, struct ct_err *e);
int train_slices(struct train_subject *s, struct train_data *data,
	const struct train_slices_rule *p, const struct ct_env *env, struct ct_err *e);
int train_volumes(struct train_subject *s, struct train_data *data,
	const struct train_volumes_rule *p, const struct ct_env *env, struct ct_err *e);

#endif
