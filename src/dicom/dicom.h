/* dicom.h: DICOM series in and out, for any command.
 *
 * The DICOM library is loaded when one of these is called first: see module.h. Without it they fail
 * with CT_EINPUT.
 */
#ifndef CT_DICOM_DICOM_H
#define CT_DICOM_DICOM_H
#include "dicom/series.h"

/* One series: of a folder, an archive, files, or the folder of one file. */
struct ct_dicom_in {
	const char *const *paths;
	size_t n;
	const char *series; /* UID or number in the list; NULL: the only one, or that of the file */
	enum ct_tilt tilt;
	enum ct_gaps gaps;
	enum ct_units units;
	bool skip_damaged;
	json_t *about;                    /* the object of a sidecar, or NULL */
	const struct series_taker *taker; /* or NULL */
};

struct ct_dicom_out {
	const struct ct_dicom_in *source; /* the series the volume was made of, or NULL */
	const char *template, *series;    /* whose patient and study; NULL: those of the source */
	bool deid;
};

/* As series_read. */
int ct_dicom_read(
	struct ct_vol *v, const struct ct_dicom_in *in, const struct ct_env *env, struct ct_err *e);
/* A volume in HU whose axes are at right angles: a series if path is a folder, else one file.
 * CT_EINPUT: a template that cannot be used; CT_ENUMERIC, CT_EOUTPUT. */
int ct_dicom_write(const char *path, const struct ct_vol *v, const struct ct_dicom_out *out,
	const struct ct_env *env, struct ct_err *e);
/* As inspect_print. */
int ct_dicom_inspect(
	const struct ct_dicom_in *in, json_t *into, const struct ct_env *env, struct ct_err *e);
/* As radiograph_read. */
int ct_dicom_radiograph(struct ct_vol *v, double mm[2], const char *path, struct ct_err *e);
/* Names of the files of a series that is written, as for fnmatch. */
#define CT_DICOM_OWN "ctsr[0-9]*.dcm"

#endif
