/* regressor.h: what lies in a cell beyond what its patch shows, by a small network.
 *
 * A patch x (patch.h) becomes F features: its K whitened principal components z = B (x - mean), and
 * CT_REGRESSOR_TOLD numbers about it (struct ct_told). Of them
 *
 *   out = W f + b + W3 a(W2 a(W1 f + b1) + b2) + b3,   a(t) = t / (1 + e^-t)
 *
 * is the mean of (truth - base) / s over what such a cell may hold: a conditional expectation, not
 * a sample; and, last, the logarithm of the mean square that is then still missing, over s^2.
 * Weights are learned by learn.h. Rows are patches; matrices by oneDNN (unet/dnn.h), on the calling
 * thread: between ct_dnn_enter and ct_dnn_leave.
 */
#ifndef CT_RESTORE_REGRESSOR_H
#define CT_RESTORE_REGRESSOR_H
#include "core/tensors.h"
#include "resolution/degrade.h"
#include "restore/patch.h"

enum { CT_REGRESSOR_TOLD = 8 };

/* What made the LR scan, along the coarse axes of a slice. */
struct ct_regime {
	double sigma; /* of the blur, in cells */
	double noise; /* HU of the LR scan */
	enum ct_decimate decimate;
};

/* One block of weights, `all`, holds every matrix; offsets by ct_regressor_part. */
enum ct_regressor_part {
	CT_PART_LINEAR, /* (out,F) */
	CT_PART_LINEAR_BIAS,
	CT_PART_1, /* (width,F) */
	CT_PART_1_BIAS,
	CT_PART_2, /* (width,width) */
	CT_PART_2_BIAS,
	CT_PART_3, /* (out,width) */
	CT_PART_3_BIAS,
	CT_PARTS
};

/* The square of the expected error of a voxel, HU^2: spread[0] v + spread[1] + spread[2] noise^2, v
 * the mean over the axes of what the cells say (0 where a cell is flat), noise that of the LR scan.
 * Found on held-out volumes; 1, 0, 0 before. */
enum { CT_SPREADS = 3 };

struct ct_regressor {
	struct ct_patch_shape shape;
	size_t components, width; /* K, neurons of a hidden layer */
	float *mean, *basis;      /* (inputs), (K,inputs); owned, one block at mean */
	float spread[CT_SPREADS]; /* what the error is, of what the slices say: see below */
	float *all;               /* owned */
	size_t at[CT_PARTS + 1];  /* of each part in `all`, and the count of all */
};

static inline size_t ct_regressor_features(const struct ct_regressor *r)
{
	return r->components + CT_REGRESSOR_TOLD;
}

/* Values of a cell, and those of `out`, the spread among them. */
static inline size_t ct_regressor_cell(const struct ct_regressor *r)
{
	return r->shape.cell * r->shape.cell;
}

static inline size_t ct_regressor_out(const struct ct_regressor *r)
{
	return ct_regressor_cell(r) + 1;
}

/* shape, components and width are set; the rest is allocated, zero. CT_EINPUT, CT_ENOMEM. */
int ct_regressor_alloc(struct ct_regressor *r, struct ct_err *e);
void ct_regressor_free(struct ct_regressor *r);

/* What is told of a patch of slice `across`, of which `cell` make a coarse one (1: none). */
void ct_regressor_tell(float told[static CT_REGRESSOR_TOLD], const struct ct_patch_pose *pose,
	const struct ct_regime *regime, size_t across, size_t cell);

/* Rows of work of n patches. */
struct ct_regressor_work {
	size_t most;                                      /* rows */
	float *patch, *feature, *a1, *h1, *a2, *h2, *out; /* owned, one block at patch */
};
int ct_regressor_work_alloc(
	struct ct_regressor_work *w, const struct ct_regressor *r, size_t most, struct ct_err *e);
void ct_regressor_work_free(struct ct_regressor_work *w);
/* The told numbers of row i. */
float *ct_regressor_told(struct ct_regressor_work *w, const struct ct_regressor *r, size_t i);
/* w->out of the first n patches of w->patch, told what they are. CT_EFAIL. */
int ct_regressor_run(
	const struct ct_regressor *r, struct ct_regressor_work *w, size_t n, struct ct_err *e);
/* The two steps of it: features of patches, and what follows from them with the weights `all`. */
int ct_regressor_see(
	const struct ct_regressor *r, struct ct_regressor_work *w, size_t n, struct ct_err *e);
int ct_regressor_think(const struct ct_regressor *r, const float *all, struct ct_regressor_work *w,
	size_t n, struct ct_err *e);

/* Tensors NAME.mean, NAME.basis, NAME.linear, ..., shapes among them. CT_EINPUT naming the one that
 * is missing, of another shape or not finite. */
int ct_regressor_put(
	const struct ct_regressor *r, struct ct_tensors *w, const char *name, struct ct_err *e);
int ct_regressor_get(
	struct ct_regressor *r, const struct ct_tensors *w, const char *name, struct ct_err *e);

#endif
