/* convert.h: the parts of ct-convert. */
#ifndef CT_TOOLS_CONVERT_H
#define CT_TOOLS_CONVERT_H
#include "cli/cli.h"
#include "core/env.h"
#include "core/vol.h"

#include <jansson.h>

#define CONVERT_RADIOGRAPH_LIST(X)                                                                 \
	X(CONVERT_VOLUME, "no")                                                                    \
	X(CONVERT_INTENSITY, "intensity")                                                          \
	X(CONVERT_INTEGRAL, "integral")
enum convert_radiograph { CONVERT_RADIOGRAPH_LIST(CT_WORD_VALUE) };

struct convert {
	struct ct_list files; /* the last is OUT */
	const char *in, *out; /* the first and the last of them, for what reads one */
	const char *raw, *spacing, *orient, *series, *reorient, *scanner;
	double slope, inter, iso;
	int cube, type, tilt, gaps, units, radiograph;
	const char *sidecar;
	json_t *about; /* what goes into it */
	bool skip_damaged, inspect, compress;
};

/* Read whatever p->files but the last are. */
int convert_read(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e);
/* CT_EUSAGE for options that OUT has no use for, CT_EOUTPUT for files that cannot be written. */
int convert_check_out(const struct convert *p, const struct ct_env *env, struct ct_err *e);
int convert_write(const struct convert *p, const struct ct_vol *v, const struct ct_env *env,
	struct ct_err *e);
/* Print what is in the DICOM files and folders p->files. */
int convert_inspect(const struct convert *p, const struct ct_env *env, struct ct_err *e);
/* A numpy array with --scanner, to a stack. */
int convert_stack(const struct convert *p, const struct ct_env *env, struct ct_err *e);
/* One plane, to a stack of one view, where the plane lies. CT_EGEOM, CT_EINPUT. */
int convert_radiograph(const struct convert *p, const struct ct_vol *v, const struct ct_env *env,
	struct ct_err *e);
/* In place: other axes, other voxel size, another frame. */
int convert_reorient(struct ct_vol *v, const char *word, struct ct_err *e);
int convert_iso(struct ct_vol *v, double mm, const struct ct_env *env, struct ct_err *e);
int convert_cube(struct ct_vol *v, size_t n, struct ct_err *e);

#endif
