/* step-compare.h: how far a CT, or projections, are from a reference, and from the low-resolution
 * data that they were made of: all decisions once. quality/compare.h has the figures of volumes;
 * those of projections are of pixels, line integrals in density mm, and of each view.
 *
 *     ct_step_compare_plan, ct_step_compare_run
 *
 * HU, unless the range is given. The same figures for any number of threads.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_COMPARE_H
#define CT_STEPS_STEP_COMPARE_H
#include "core/stack.h"
#include "diffusion/measurement.h"
#include "quality/compare.h"
#include "steps/window-rule.h"

/* Behind the definitions of ssim.h. */
#define CT_STEP_COMPARE_SSIM(X)                                                                    \
	X(CT_STEP_COMPARE_ALL, "all")                                                              \
	X(CT_STEP_COMPARE_NONE, "none")
enum { CT_STEP_COMPARE_ALL = CT_SSIM_KINDS, CT_STEP_COMPARE_NONE };

/* What is asked. */
struct ct_step_compare_rule {
	const char *ref, *test, *mask, *std, *low; /* what messages call them */
	double window[2];                          /* HU of PSNR and SSIM; NaN: -512 to 3071 */
	double range;                /* instead; 0: the window; of projections the largest of ref */
	int ssim;                    /* enum ct_ssim_kind, or behind them; -1: r2, of views wang */
	bool padding;                /* that of ref does not count; then there is no mask */
	bool slices, map;            /* are wanted */
	const struct ct_degrade *by; /* made low; NULL: what the metadata say */
	struct ct_compare_rule figures; /* of a volume; its metrics are decided by the plan */
};
#define CT_STEP_COMPARE_DEFAULTS                                                                   \
	{                                                                                          \
		.ref = "reference", .test = "test", .mask = "mask", .low = "low", .ssim = -1,      \
		.window = {                                                                        \
			(double)NAN,                                                               \
			(double)NAN                                                                \
		}                                                                                  \
	}

/* What is compared, borrowed: volumes on one grid, or projections of one geometry. NULL: not given;
 * ref may be that if there is `low`. */
struct ct_step_compare_data {
	const struct ct_vol *ref, *test, *mask, *std, *low;
	const struct ct_stack *ref_rays, *test_rays, *low_rays;
};

/* What was decided. */
struct ct_step_compare {
	struct ct_step_compare_rule rule;
	const struct ct_step_compare_data *of;
	struct ct_vol mask;         /* of the padding */
	struct ct_degrade by;       /* made low, says */
	const struct ct_meta *from; /* this, or the rule: NULL */
	struct ct_measurement op;   /* made low_rays */
};

/* What was found. */
struct ct_step_compare_report {
	struct ct_figures figures; /* words of them are of the data */
	/* If asked for: of each axis, or of views the third, as in metrics.h. */
	struct ct_metrics_slice *slice[3];
	size_t slices[3];
	struct ct_vol map; /* D test - low, with the metadata of low, if asked for */
};

/* *p (zeroed struct) <- how the data are compared. CT_EINPUT for quantities that differ, for no
 * operator of low, and for a view of projections that is none of the other's; CT_EUSAGE for values
 * that are no HU without window and range, and for what projections do not have; CT_EGEOM;
 * CT_ENUMERIC. Naming the data. */
int ct_step_compare_plan(struct ct_step_compare *p, const struct ct_step_compare_rule *r,
	const struct ct_step_compare_data *d, const struct ct_env *env, struct ct_err *e);
/* Does the window of HU hold, so that the values must be HU? */
bool ct_step_compare_needs_hu(const struct ct_step_compare *p);
/* *out (zeroed struct) <- what is asked for. Codes of ct_compare and ct_data_residual. */
int ct_step_compare_run(struct ct_step_compare_report *out, const struct ct_step_compare *p,
	const struct ct_env *env, struct ct_err *e);
void ct_step_compare_report_free(struct ct_step_compare_report *out);
void ct_step_compare_free(struct ct_step_compare *p);

#endif
