/* metrics-report.h: the figures of ct-metrics: in what order, under what names, and how written. */
#ifndef CT_TOOLS_METRICS_REPORT_H
#define CT_TOOLS_METRICS_REPORT_H
#include "quality/calibration.h"
#include "quality/certificate.h"
#include "quality/edges.h"
#include "quality/fsc.h"
#include "quality/metrics.h"
#include "quality/structures.h"
#include "quality/tissue.h"

#include <stdbool.h>

enum { METRICS_FIGURES = 192 };

/* One line: up to five numbers, or a word. */
struct metrics_figure {
	char name[32];
	const char *word; /* borrowed, or NULL */
	size_t n;
	double v[5];
	char mark;  /* between the numbers */
	int digits; /* behind the point; negative: as many as it takes */
};

struct metrics_figures {
	size_t n;
	struct metrics_figure at[METRICS_FIGURES];
};

/* "ssim-r2" ... */
const char *metrics_ssim_name(enum ct_ssim_kind kind);
/* Append the figures of a comparison, of edges, and of a residual with the header it comes from. */
void metrics_figures_metrics(
	struct metrics_figures *f, const struct ct_metrics *m, const struct ct_metrics_rule *r);
void metrics_figures_edges(struct metrics_figures *f, const struct ct_edges *s);
void metrics_figures_residual(
	struct metrics_figures *f, const struct ct_certificate *c, const struct ct_meta *lr);
/* Of blobs of n sizes, sigma in voxels; with more than one each name ends in -1, -2 ..., and the
 * sums over all follow. */
void metrics_figures_structures(struct metrics_figures *f, const struct ct_structures *s, size_t n,
	const double (*sigma)[3], const struct ct_vol *v);
/* The shares of ref and of test. */
void metrics_figures_flat(struct metrics_figures *f, size_t voxels, const double share[2]);
void metrics_figures_hfen(struct metrics_figures *f, double hfen);
void metrics_figures_fsc(struct metrics_figures *f, const struct ct_fsc *c);
void metrics_figures_tissues(struct metrics_figures *f, const struct ct_tissue_errors *t);
void metrics_figures_calibration(struct metrics_figures *f, const struct ct_calibration *c);
/* First number of a figure; NaN if there is none of the name. */
double metrics_figures_get(const struct metrics_figures *f, const char *name);
/* To standard output: a line a figure, or an object in which what is not finite is null. */
void metrics_figures_text(const struct metrics_figures *f);
int metrics_figures_json(const struct metrics_figures *f, struct ct_err *e);
/* Two lines of CSV: names, behind "test", and what they are, behind that name. What is not a number
 * is left empty. */
void metrics_figures_csv(const struct metrics_figures *f, const char *test);
/* CSV, a header and a line a slice of the three axes, or a line an axis. What is not a number is
 * left empty. CT_EOUTPUT. */
int metrics_per_slice(const char *path, struct ct_metrics_slice *const slice[3],
	const size_t n[static 3], const struct ct_metrics_rule *r, const struct ct_env *env,
	struct ct_err *e);
int metrics_per_axis(const char *path, const struct ct_metrics *m, const struct ct_vol *v,
	const struct ct_metrics_rule *r, const struct ct_env *env, struct ct_err *e);
/* A line a shell. */
int metrics_fsc(
	const char *path, const struct ct_fsc *c, const struct ct_env *env, struct ct_err *e);

#endif
