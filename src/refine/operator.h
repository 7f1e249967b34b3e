/* operator.h: what is known of a low-resolution CT: the operator that made it, and its noise.
 *
 * The file's metadata say it (ct-degrade writes them), or the caller, or it is measured: the blur
 * on edges (resolution/blur.h), the noise where the CT is flat (resolution/noise.h). A
 * contradiction between the file and the caller is an error.
 */
#ifndef CT_REFINE_OPERATOR_H
#define CT_REFINE_OPERATOR_H
#include "core/env.h"
#include "core/vol.h"
#include "core/words.h"
#include "resolution/degrade.h"

/* A larger factor, and a larger blur in voxels of the result, are mistakes. */
enum { CT_SAID_TIMES = 1024, CT_SAID_SIGMA = 1000 };

/* What the caller says. */
struct ct_said {
	double factor[3];   /* how many times finer the result is; 0: not said */
	double spacing[3];  /* mm, voxels of the result, instead of a factor; 0: not said */
	double sigma[3];    /* Gaussian blur, in voxels of the result; NaN: not said */
	bool sigma_for_all; /* sigma is one number: an axis that is not refined has none */
	int decimate;       /* enum ct_decimate; -1: not said */
	double noise;       /* standard deviation, HU; NaN: not said */
	bool estimate;      /* measure the operator if nothing says it */
};
/* Nothing is said. */
#define CT_SAID_NOTHING                                                                            \
	{                                                                                          \
		.sigma = {(double)NAN, (double)NAN, (double)NAN}, .decimate = -1,                  \
		.noise = (double)NAN                                                               \
	}

/* Who says it. */
#define CT_SOURCE_LIST(X)                                                                          \
	X(CT_BY_NOBODY, "assumed")                                                                 \
	X(CT_BY_FILE, "from the file")                                                             \
	X(CT_BY_CALLER, "given")                                                                   \
	X(CT_BY_MEASURE, "measured")
enum ct_by { CT_SOURCE_LIST(CT_WORD_VALUE) };

struct ct_operator {
	struct ct_degrade by;
	bool known;      /* the operator, not only its factor */
	double noise;    /* HU */
	double alike[3]; /* correlation of the noise of neighbours, if it was measured */
	bool correlated; /* more than white noise shows */
	enum ct_by from, noise_from;
};

/* *r gets what is known of `in`. Without a need for noise, it is not measured. CT_EUSAGE for a
 * contradiction, for a factor that nothing says, and for a CT that was refined already; CT_EINPUT
 * for metadata that are wrong; codes of the measurements. Messages do not name the file. */
int ct_operator_find(struct ct_operator *r, const struct ct_said *said, bool need_noise,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);

#endif
