/* operator.h: what is known of a low-resolution CT: the operator that made it, and its noise.
 *
 * The file's metadata say it (ct-degrade writes them), or the caller, or it is estimated: blur and
 * sampling from what DICOM says of the scanner (scanner.h) and on edges (estimate/profile.h), the
 * noise where the CT is flat (estimate/noise.h). An axis that is refined less than CT_SMALL times
 * is not estimated: D mixes neighbours there by where its cells happen to lie, and undoing that
 * would amplify the scan. Such an axis is interpolated. Slices too few for edges, of which DICOM
 * says nothing either, are as thick as far apart. A contradiction between the file and the caller
 * is an error.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_OPERATOR_H
#define CT_ESTIMATE_OPERATOR_H
#include "core/acquired.h"
#include "core/env.h"
#include "core/vol.h"
#include "core/words.h"
#include "estimate/noise.h"
#include "estimate/profile.h"
#include "operator/slice-profile.h"

/* A larger factor, and a larger blur in voxels of the result, are mistakes. */
enum { CT_SAID_TIMES = 1024, CT_SAID_SIGMA = 1000 };
/* The largest factor that is chosen where nothing says one. */
enum { CT_CHOSEN_TIMES = 8 };
/* An axis whose operator nobody says is inverted from this factor on. */
#define CT_SMALL 1.25

/* What the caller says. */
struct ct_said {
	double factor[3];   /* how many times finer the result is; 0: not said, see below */
	double spacing[3];  /* mm, voxels of the result, instead of a factor; 0: not said */
	double sigma[3];    /* Gaussian blur, in voxels of the result; NaN: not said */
	bool sigma_for_all; /* sigma is one number: an axis that is not refined has none */
	int decimate;       /* enum ct_decimate; -1: not said */
	double noise;       /* standard deviation, HU; NaN: not said */
	struct ct_slice_profile_said slice; /* of the slice axis, in place of the two */
	int third;                          /* that axis, where the factors do not tell it */
	int axis[3];                        /* of the scan as stored, which each above is of */
	bool estimate;                      /* ... the operator if nothing says it */
	bool trust;                         /* ... and take it as it was measured (soft.h) */
};
/* Nothing is said. */
#define CT_SAID_NOTHING                                                                            \
	{                                                                                          \
		.axis = {0, 1, 2}, .third = 2, .sigma = {(double)NAN, (double)NAN, (double)NAN},   \
		.decimate = -1, .noise = (double)NAN, .slice = CT_SLICE_PROFILE_NOTHING            \
	}

/* Who says it. */
#define CT_SOURCE_LIST(X)                                                                          \
	X(CT_BY_NOBODY, "assumed")                                                                 \
	X(CT_BY_FILE, "from the file")                                                             \
	X(CT_BY_CALLER, "given")                                                                   \
	X(CT_BY_MEASURE, "measured")                                                               \
	X(CT_BY_SCANNER, "from DICOM")                                                             \
	X(CT_BY_BOTH, "from DICOM and edges")
enum ct_by { CT_SOURCE_LIST(CT_WORD_VALUE) };

struct ct_operator {
	struct ct_degrade operator;
	bool known;              /* the operator, not only its factor */
	double noise;            /* HU */
	struct ct_noise texture; /* what was measured of it, if it was */
	double alike[3];         /* correlation of the noise of neighbours, if it was measured */
	bool correlated;         /* more than white noise shows */
	bool by_slices;          /* the caller said the profile of the slices */
	int slices;              /* ... along this axis */
	enum ct_by from, noise_from;
	/* What was measured, what DICOM lets expect, and both together, where the operator is
	 * estimated; of no spread (NaN) if there is none. */
	struct ct_profile seen[3], told[3], joint[3];
	struct ct_acquired scanner; /* what DICOM says, where it is used */
	bool apart[3];              /* the two contradict each other: what was measured counts */
	bool cubic[3];              /* axes to interpolate: factors below CT_SMALL */
	bool trusted;               /* it is taken as it was measured: not soft, nor less */
	bool soft;                  /* slices that are softer than a profile explains (soft.h) */
	double sure;                /* probability of operator.decimate, if it is estimated */
};

/* Was it estimated, at least in part? */
bool ct_operator_is_estimated(const struct ct_operator *r);
/* Was its noise measured, and none of it certain? */
static inline bool ct_operator_is_quiet(const struct ct_operator *r)
{
	return r->noise_from == CT_BY_MEASURE && !(r->noise > 0);
}
/* The spread of p that is assumed of it: that of least expected loss, unless it is trusted. */
double ct_operator_aim(const struct ct_operator *r, const struct ct_profile *p);
/* Axes that were estimated count as no wider than `most`, voxels of the CT. */
void ct_operator_narrow(struct ct_operator *r, double most, const struct ct_env *env);
/* Are all axes that are refined to be interpolated? */
bool ct_operator_is_cubic(const struct ct_operator *r);
/* *r gets what is known of `in`. Without a need for noise, it is not measured. A factor that
 * neither the caller nor the file says is chosen: an axis that is at least 1.5 times coarser than
 * the finest is refined to about the finest, a whole number of times up to 8, and the others not at
 * all; if there is none, all axes 2 times. CT_EUSAGE for a contradiction, and for a CT that was
 * refined already and no factor; CT_EINPUT for metadata that are wrong; codes of the measurements.
 * Messages do not name the file. */
int ct_operator_find(struct ct_operator *r, const struct ct_said *said, bool need_noise,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);

#endif
