/* compare.h: all that ct-metrics measures, as a list of named figures.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_COMPARE_H
#define CT_QUALITY_COMPARE_H
#include "core/meta.h"
#include "quality/data-residual.h"
#include "quality/metrics.h"

#include <stdbool.h>

enum { CT_FIGURES = 192 };

/* A name with up to five numbers, or a word. */
struct ct_figure {
	char name[32];
	const char *word; /* borrowed, or NULL */
	size_t n;
	double v[5];
	char mark;  /* between the numbers */
	int digits; /* after the decimal point; negative: as many as needed */
};

struct ct_figures {
	size_t n;
	struct ct_figure at[CT_FIGURES];
};

/* "ssim-r2" ... */
const char *ct_figures_ssim(enum ct_ssim_kind kind);
/* Append a number; `digits` as in struct ct_figure. */
struct ct_figure *ct_figures_add(struct ct_figures *f, const char *name, double v, int digits);
/* *v <- the number of a figure that has one; false if there is none of that name. */
bool ct_figures_get(double *v, const struct ct_figures *f, const char *name);

enum { CT_COMPARE_SIZES = 4, CT_COMPARE_SURFACES = 4 };

struct ct_compare_rule {
	struct ct_metrics_rule metrics;
	bool edges, structures, tissues, harm; /* harm: all of them, and flat, HFEN, FSC */
	size_t sizes;                          /* of structures; 0: ct_compare_sizes chooses */
	double sigma[CT_COMPARE_SIZES][3];     /* of their Gaussians, voxels */
	double factor[3]; /* of a low-resolution voxel, for banding; 0: ct_compare_sizes finds it */
	size_t surfaces;  /* whose error is wanted */
	double surface[CT_COMPARE_SURFACES]; /* their thresholds, HU */
};

/* The volumes and their names for error messages. mask and std may be NULL. */
struct ct_compare_in {
	const struct ct_vol *ref, *test, *mask, *std;
	const char *ref_name, *test_name, *std_name;
};

/* Chooses the factor and the sizes of structures: 0.75 and 1.5 low-resolution voxels, at most 100
 * voxels. `factor`, or if it is NULL the header of an upsampled test, says how long these are.
 * Else 1.5 voxels. CT_EINPUT names the key. */
int ct_compare_sizes(struct ct_compare_rule *r, const double *factor, const struct ct_meta *test,
	struct ct_err *e);
/* Appends the figures. slice is as in ct_metrics, or NULL. Errors name the file. With harm alone, a
 * volume too small for edges gives a warning; so does one without a surface. */
int ct_compare(struct ct_figures *f, struct ct_metrics_slice **slice,
	const struct ct_compare_in *in, const struct ct_compare_rule *r, const struct ct_env *env,
	struct ct_err *e);
/* Appends those of the data residual, with the operator that the header names. Its words are
 * borrowed. */
void ct_compare_residual(
	struct ct_figures *f, const struct ct_data_residual *c, const struct ct_meta *lr);

#endif
