/* geometry-opts.h: the options that describe the geometry of projections: one table for all
 * commands that make projections. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_LIB_GEOMETRY_OPTS_H
#define CT_TOOLS_LIB_GEOMETRY_OPTS_H
#include "cli/cli.h"
#include "core/stack.h"
#include "core/vol.h"
#include "steps/window-rule.h"
#include "xray/geometry.h"

#include <math.h>

/* A value not given is NULL, NAN or 0. */
struct ct_geometry_opts {
	const char *beam, *det, *pitch, *offset, *scanner, *like;
	double arc, start, dso, dsd, sampling;
	int views;
	bool paper;
};

#define CT_GEOMETRY_DEFAULTS                                                                       \
	{                                                                                          \
		.arc = (double)NAN, .start = (double)NAN, .dso = (double)NAN, .dsd = (double)NAN,  \
		.sampling = (double)NAN                                                            \
	}

#define CT_GEOMETRY_IF(f) CT_WHEN(CT_UNLESS(f.like))
/* The rows for an option table of CT_PARAMS with a field f of this type. */
#define CT_GEOMETRY_OPTS(f)                                                                                   \
	CT_TEXT(f.beam, 0, "beam", CT_WORDS(CT_BEAM_LIST),                                                    \
		"shape of the beam (cone if nothing says otherwise)", CT_GEOMETRY_IF(f)),                     \
		CT_OPT(f.views, 'n', "views", "N", 0, CT_MAX_VIEWS,                                           \
			"number of views; 0 stands for 100, or what --scanner says",                          \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_OPT(f.arc, 0, "arc", "DEG", -1e6, 1e6,                                                     \
			"angle over which the views are spread, its end left out (180)",                      \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_EXPERT(f.start, "start", "DEG", -1e6, 1e6, "angle of the first view (0)",                  \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_EXPERT(f.dso, "dso", "MM", 1e-6, 1e8,                                                      \
			"source to isocentre (1000 F/256, F the largest extent of the volume)",               \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_EXPERT(f.dsd, "dsd", "MM", 1e-6, 1e8, "source to detector (1500 F/256)",                   \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_TEXT(f.det, 0, "det", "WxH",                                                               \
			"detector columns and rows; one number for both, or for the one row of a fan (the "   \
			"largest dimension of the volume)",                                                   \
			CT_WHEN(CT_UNLESS(f.like), CT_UNLESS(f.sampling))),                                   \
		CT_OPT(f.sampling, 0, "sampling", "X", 0.01, 100,                                             \
			"instead: X pixels a voxel of the largest dimension, rounded up to a multiple of 16", \
			CT_WHEN(CT_UNLESS(f.like), CT_UNLESS(f.det))),                                        \
		CT_EXPERT(f.pitch, "pitch", "MM[,MM]", 0, 0,                                                  \
			"size of a pixel along u and v (the detector's side over its pixels)",                \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_EXPERT(f.offset, "offset", "U,V", 0, 0,                                                    \
			"shift of the detector centre along u and v, mm (0,0)",                               \
			CT_GEOMETRY_IF(f)),                                                                   \
		CT_FLAG(f.paper, 0, "paper",                                                                  \
			"distances of 1000 and 1500 mm and a detector of 512 mm, whatever the volume",        \
			CT_WHEN(CT_UNLESS(f.like), CT_UNLESS(f.scanner))),                                    \
		CT_INPUT(f.scanner, 0, "scanner", "FILE",                                                     \
			"JSON scanner file, see ct-scans(5); other options override it",                      \
			CT_WHEN(CT_UNLESS(f.like), CT_UNLESS(f.paper))),                                      \
		CT_INPUT(f.like, 0, "like", "STACK", "take the whole geometry from this stack")

/* Stack with the geometry that the options ask for around the grid, data uninitialised, metadata
 * keys scan.*. CT_EUSAGE for options, CT_EINPUT for files, CT_EGEOM. *out must be zero. */
int ct_geometry_opts_make(struct ct_stack *out, const struct ct_geometry_opts *o,
	const struct ct_vol *grid, struct ct_err *e);
/* The geometry of the stack in this file, and the keys scan.* of its metadata. CT_EINPUT; *out must
 * be zero. */
int ct_geometry_opts_like(struct ct_stack *out, const char *path, struct ct_err *e);
/* --window LO:HI as it is asked for; NULL: not. CT_EUSAGE. */
int ct_geometry_opts_asked(struct ct_window_rule *r, const char *option, struct ct_err *e);
/* The density window: what the metadata says, else the option (NULL if not given), else -1024 to
 * 3071 HU. CT_EUSAGE if option and metadata contradict. m may be NULL. */
int ct_geometry_opts_window(
	double window[2], const char *option, const struct ct_meta *m, struct ct_err *e);
/* --grid of a reconstruction: a number of voxels, or the volume whose grid it is, into the zeroed
 * *like; NULL: neither. CT_EUSAGE, codes of the reader. */
int ct_geometry_opts_grid(int *voxels, struct ct_vol *like, const char *option, struct ct_err *e);

#endif
