/* convert.h: the parts of ct-convert. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_CONVERT_H
#define CT_TOOLS_CONVERT_H
#include "cli/cli.h"
#include "core/env.h"
#include "core/vol.h"
#include "dicom/dicom.h"
#include "formats/raw.h"

#include <jansson.h>

#define CONVERT_RADIOGRAPH_LIST(X)                                                                 \
	X(CONVERT_VOLUME, "no")                                                                    \
	X(CONVERT_INTENSITY, "intensity")                                                          \
	X(CONVERT_INTEGRAL, "integral")
enum convert_radiograph { CONVERT_RADIOGRAPH_LIST(CT_WORD_VALUE) };

#define CONVERT_PROJECTIONS_LIST(X)                                                                \
	X(CONVERT_NO_PROJECTIONS, "no")                                                            \
	X(CONVERT_AS_SAID, "auto")                                                                 \
	X(CONVERT_INTEGRALS, "integral")                                                           \
	X(CONVERT_COUNTS, "counts")
enum convert_projections { CONVERT_PROJECTIONS_LIST(CT_WORD_VALUE) };

struct convert {
	struct ct_list files; /* the last is OUT */
	const char *in, *out; /* the first and the last of them, for what reads one */
	const char *raw, *rescale, *pitch, *orient, *series, *reorient, *scanner, *crop, *template,
		*grid, *flat, *dark, *views, *water;
	double slope, inter, iso, mu_water; /* the first two of rescale */
	int projections, rings, cube, type, tilt, gaps, units, radiograph;
	const char *sidecar;
	json_t *about; /* what goes into it */
	bool find_centre, skip_damaged, compress, deid, other_patient;
	struct convert_planes *planes; /* of the run */
};

/* OUT, if it is written plane by plane while IN is read: then there are no data of a volume. */
struct convert_planes {
	const struct convert *p;
	const struct ct_env *env;
	struct ct_nifti_planes *to;
	bool unfit; /* it was int16, and a voxel is none */
};

/* Read whatever p->files but the last are. */
int convert_read(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e);
/* Nothing is left of an OUT that is begun; legal if there is none. */
void convert_planes_drop(struct convert_planes *c, struct ct_err *e);
/* CT_EUSAGE for options that OUT has no use for, CT_EOUTPUT for files that cannot be written. */
int convert_check_out(const struct convert *p, const struct ct_env *env, struct ct_err *e);
int convert_write(const struct convert *p, const struct ct_vol *v, const struct ct_env *env,
	struct ct_err *e);
/* Planes, each of a file of its own, to a stack of as many views, where they lie. CT_EGEOM,
 * CT_EINPUT, CT_EUSAGE. */
int convert_radiograph(const struct convert *p, const struct ct_env *env, struct ct_err *e);
/* Projections, of any file that has them, to a stack. CT_EGEOM, CT_EINPUT, CT_EUSAGE. */
int convert_scan(const struct convert *p, const struct ct_env *env, struct ct_err *e);
/* Does a file begin as a picture? Never reads from a pipe. */
bool convert_is_picture(const char *path);

#endif
