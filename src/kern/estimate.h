/* estimate.h: how a CT was sampled, measured from the CT itself.
 *
 * Who refines a volume must know how it was blurred; a clinical scan has no header that says so. Of
 * each axis the sharpest strong edges are looked at; the noise is that of the flattest tissue.
 */
#ifndef CT_KERN_ESTIMATE_H
#define CT_KERN_ESTIMATE_H
#include "core/vol.h"
#include "core/par.h"

#include <stdbool.h>
#include <stddef.h>

/* What the blur means for who refines the axis. */
enum ct_sampling {
	CT_SAMPLING_UNKNOWN, /* too few edges: nothing can be said */
	CT_SAMPLING_ALIASED, /* point sampled or nearly: do not force consistency (protocol 3) */
	CT_SAMPLING_SHARP,   /* some aliasing (protocol 2) */
	CT_SAMPLING_WELL,    /* a Gaussian of full width about one voxel or more (protocol 1) */
};

struct ct_estimate_axis {
	double measured; /* standard deviation of the Gaussian seen, voxels of v; NaN if unknown */
	double sigma;    /* the safe one to assume, voxels of v, <= measured; 0 if unknown */
	double aliasing; /* in [0, 1]: power of an edge at the Nyquist frequency, 1 = point sampled
	                    step; NaN if unknown */
	size_t edges;    /* it rests on so many */
	enum ct_sampling sampling;
};

struct ct_estimate {
	struct ct_estimate_axis axis[3];
	double noise; /* standard deviation, HU; 0 if none can be seen */
};

/* Measure v, which will be refined factor[a] >= 1 times along axis a: sigma counts what a voxel of
 * the finer grid itself cannot resolve as no blur, so in voxels of the finer grid the blur is
 * axis[a].sigma * factor[a]. CT_ENUMERIC for NaN and infinite voxels, CT_EINPUT for a factor of 0,
 * CT_ENOMEM. The same for any number of threads. */
int ct_estimate_of(struct ct_estimate *out, const struct ct_vol *v, const size_t factor[static 3],
	struct ct_par *par, struct ct_err *e);
/* "unknown", "aliased", "sharp", "well". */
const char *ct_sampling_name(enum ct_sampling s);

#endif
