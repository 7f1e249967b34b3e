/* metrics-harm.h: the figures of ct-metrics that tell whether a CT does harm, which PSNR and SSIM
 * hardly see: structures, flat tissue, high frequencies, errors by tissue. */
#ifndef CT_TOOLS_METRICS_HARM_H
#define CT_TOOLS_METRICS_HARM_H
#include "tools/metrics-report.h"

enum { METRICS_SIZES = 4 };

struct metrics_harm {
	bool structures, flat, hfen, fsc, tissues; /* which */
	size_t sizes;                              /* of structures */
	double sigma[METRICS_SIZES][3];            /* voxels */
	double contrast, flat_step;                /* HU */
	size_t deep;                               /* voxels */
	const char *curve;                         /* CSV of the FSC, or NULL */
};

/* The sizes: those of `text`, "V,V,..." voxels, if it is not NULL; else .75 and 1.5 low-resolution
 * voxels of `factor`, "S" or "X,Y,Z", or if that is NULL of the header of test, if it says what it
 * was refined by; else 1.5 voxels. CT_EUSAGE naming the option, CT_EINPUT naming the key. */
int metrics_harm_sizes(struct metrics_harm *h, const char *text, const char *factor,
	const struct ct_meta *test, struct ct_err *e);
/* Volumes of the size of test that are held at a time besides, and bytes that lie in memory. */
double metrics_harm_volumes(const struct metrics_harm *h);
double metrics_harm_fixed(
	const struct metrics_harm *h, const size_t n[static 3], const struct ct_env *env);
/* Append what is wanted. An error is not yet said to be of which file. */
int metrics_harm(struct metrics_figures *f, const struct metrics_harm *h, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const struct ct_env *env,
	struct ct_err *e);

#endif
