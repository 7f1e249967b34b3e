/* metrics-report.h: how ct-metrics writes its figures. */
#ifndef CT_TOOLS_METRICS_REPORT_H
#define CT_TOOLS_METRICS_REPORT_H
#include "core/env.h"
#include "quality/compare.h"

/* To standard output: a line for each figure, or an object in which null is no number. */
void metrics_text(const struct ct_figures *f);
int metrics_json(const struct ct_figures *f, struct ct_err *e);
/* Two lines of CSV: "test" and the names, then the name of the file and the values. A value that is
 * no number is empty. */
void metrics_csv(const struct ct_figures *f, const char *test);
/* CSV with a line for each slice across the three axes. CT_EOUTPUT. */
int metrics_per_slice(const char *path, struct ct_metrics_slice *const slice[3],
	const size_t n[static 3], const struct ct_metrics_rule *r, const struct ct_env *env,
	struct ct_err *e);

#endif
