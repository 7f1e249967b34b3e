/* survey.h: what a file holds, in a few numbers: ranges, and the scan behind a stack. Pure;
 * thread-safe. */
#ifndef CT_REPORT_SURVEY_H
#define CT_REPORT_SURVEY_H
#include "core/gauss.h"
#include "core/stack.h"
#include "core/vol.h"

#include <stdbool.h>

struct ct_survey_range {
	size_t n, nan, inf;        /* values, and those that are not finite */
	double min, max, mean, sd; /* of the finite ones; NaN if there are none */
};

void ct_survey_range_of(struct ct_survey_range *r, size_t n, const float *x);

/* The geometry of a stack, from its vectors alone. The principal ray of a view leaves the source
 * along the normal of the detector (parallel: along the beam). */
struct ct_survey {
	double pitch[2], size[2]; /* of the first detector along u and v, mm */
	double angle[2], step;    /* of the first and last view, mean step, degrees */
	bool has_iso;             /* two principal rays that are not parallel; no parallel beam */
	double iso[3], miss;      /* point nearest to the principal rays, largest distance */
	/* least and largest of the views, mm: */
	double dso[2], dsd[2]; /* source to isocentre, source to detector */
	double offset[2][2];   /* of the detector's centre from the principal ray along u, v */
};

/* Geometry as ct_stack_check accepts it. */
void ct_survey_of(struct ct_survey *r, const struct ct_stack *s);

struct ct_survey_gauss {
	size_t positive, negative, bad; /* density above, below 0; not finite */
	double sigma[2], mean_sigma;    /* least, largest, geometric mean standard deviation, mm */
	double raw[2];                  /* least and largest raw density */
	double lo[3], hi[3];            /* box around the centres, mm */
};

/* Ranges over the finite Gaussians; NaN if there are none. */
void ct_survey_gauss_of(struct ct_survey_gauss *r, const struct ct_gauss *g);

/* "RAS", "LPS", ...: where the axes of the grid point, by the largest part of each column; "?" for
 * a letter if two columns share one. */
void ct_survey_orientation(char code[4], const double affine[3][4]);

#endif
