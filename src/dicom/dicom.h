/* dicom.h: DICOM series in and out, for any command.
 *
 * The DICOM library is loaded when one of these is called first: see module.h. Without it they fail
 * with CT_EINPUT.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DICOM_DICOM_H
#define CT_DICOM_DICOM_H
#include "core/env.h"
#include "core/vol.h"
#include "formats/units.h"
#include "series/layout.h"

#include <jansson.h>

/* Takes a volume plane by plane, so that it is never whole. */
struct ct_dicom_taker {
	/* Of v all is there but the data, and in the place of the hash of its values one as long;
	 * `whole`: are the values integers? 0, or 1 if it shall be a volume after all. */
	int (*begin)(void *ctx, const struct ct_vol *v, bool whole, struct ct_err *e);
	int (*plane)(void *ctx, const float *x, size_t n, struct ct_err *e);
	void *ctx;
};

/* One series: of a folder, an archive, files, or the folder of one file. */
struct ct_dicom_in {
	const char *const *paths;
	size_t n;
	const char *series; /* UID or number in the list; NULL: the only one, or that of the file */
	enum ct_tilt tilt;
	enum ct_gaps gaps;
	enum ct_units units;
	bool skip_damaged;
	const char *out;                    /* what is made of it, which is none of it; or NULL */
	json_t *about;                      /* the object of a sidecar, or NULL */
	const struct ct_dicom_taker *taker; /* or NULL */
	/* within the module (dicom_from): what the user calls it; of the file that stands for its
	 * series, as the scan names it */
	const char *name, *member;
};

struct ct_dicom_out {
	const struct ct_dicom_in *source; /* the series the volume was made of, or NULL */
	const char *template, *series;    /* whose patient and study; NULL: those of the source */
	bool other_patient;               /* the template may be of another patient or space */
	bool deid;
};

/* One series as a volume, RAS+, of finite numbers; without its data if the taker took them. *v must
 * be zero. CT_EINPUT: damaged files, values that are not HU; CT_EGEOM: places that make no grid;
 * CT_EUSAGE: no such series; CT_ENUMERIC. */
int ct_dicom_read(
	struct ct_vol *v, const struct ct_dicom_in *in, const struct ct_env *env, struct ct_err *e);
/* A volume in HU whose axes are at right angles: a series if path is a folder, else one file.
 * CT_EINPUT: a template that cannot be used; CT_ENUMERIC, CT_EOUTPUT. */
int ct_dicom_write(const char *path, const struct ct_vol *v, const struct ct_dicom_out *out,
	const struct ct_env *env, struct ct_err *e);
/* Before long work: could a volume of n voxels be written that has the axes and the values of v? Is
 * the library installed? Fails as ct_dicom_write would. */
int ct_dicom_may_write(
	const char *path, const struct ct_vol *v, const size_t n[static 3], struct ct_err *e);
/* Print the files and series of the paths, as text or, with env->command->json, as one JSON
 * document, which goes to the end of the array `into` instead if that is not NULL. 0 if
 * ct_dicom_read would take the series; else its failure, behind the report. */
int ct_dicom_inspect(
	const struct ct_dicom_in *in, json_t *into, const struct ct_env *env, struct ct_err *e);
/* The one picture of X rays on a detector that a file holds: grey values from 0, black, to 1,
 * white, row 0 on top: the range of the stored bits, turned where the file says that the lowest is
 * white, or its slope is negative; padding is black. No window is applied. *v, which must be zero,
 * gets its numbers and sizes; mm those between columns and rows of the detector, or NaN if the file
 * does not say. CT_EGEOM for several pictures; CT_EINPUT for what is no radiograph, or not grey. */
int ct_dicom_radiograph(struct ct_vol *v, double mm[2], const char *path, struct ct_err *e);
/* Names of the files of a series that is written, as for fnmatch. */
#define CT_DICOM_OWN "ctsr[0-9]*.dcm"

#endif
