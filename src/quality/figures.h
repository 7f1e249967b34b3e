/* figures.h: the results of a comparison as a list of named figures. */
#ifndef CT_QUALITY_FIGURES_H
#define CT_QUALITY_FIGURES_H
#include "core/meta.h"
#include "quality/calibration.h"
#include "quality/data-residual.h"
#include "quality/edges.h"
#include "quality/fsc.h"
#include "quality/metrics.h"
#include "quality/structures.h"
#include "quality/tissue.h"

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
/* First number of a figure; NaN if there is no figure of that name. */
double ct_figures_get(const struct ct_figures *f, const char *name);
bool ct_figures_has(const struct ct_figures *f, const char *name);

/* Each appends the figures of one result. */
void ct_figures_metrics(
	struct ct_figures *f, const struct ct_metrics *m, const struct ct_metrics_rule *r);
void ct_figures_edges(struct ct_figures *f, const struct ct_edges *s);
/* With the operator that the header names. Its words are borrowed. */
void ct_figures_residual(
	struct ct_figures *f, const struct ct_data_residual *c, const struct ct_meta *lr);
/* For blobs of n sizes, sigma in voxels. If n > 1 the names end in -1, -2 ..., and sums follow. */
void ct_figures_structures(struct ct_figures *f, const struct ct_structures *s, size_t n,
	const double (*sigma)[3], const struct ct_vol *v);
/* The shares of ref and of test. */
void ct_figures_flat(struct ct_figures *f, size_t voxels, const double share[2]);
void ct_figures_hfen(struct ct_figures *f, double hfen);
void ct_figures_fsc(struct ct_figures *f, const struct ct_fsc *c);
void ct_figures_tissues(struct ct_figures *f, const struct ct_tissue_errors *t);
void ct_figures_calibration(struct ct_figures *f, const struct ct_calibration *c);

#endif
