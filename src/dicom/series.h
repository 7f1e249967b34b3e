/* series.h: one series of a folder, or of files, as a volume; nothing of it is left out
 * silently. */
#ifndef CT_DICOM_SERIES_H
#define CT_DICOM_SERIES_H
#include "core/env.h"
#include "core/vol.h"
#include "formats/units.h"
#include "series/census.h"
#include "series/layout.h"
#include "series/series.h"

#include <jansson.h>

/* Takes a volume plane by plane, so that it is never whole. */
struct series_taker {
	/* Of v all is there but the data, and in the place of the hash of its values one as long;
	 * `whole`: are the values integers? 0, or 1 if it shall be a volume after all. */
	int (*begin)(void *ctx, const struct ct_vol *v, bool whole, struct ct_err *e);
	int (*plane)(void *ctx, const float *x, size_t n, struct ct_err *e);
	void *ctx;
};

struct series_rule {
	const char *in;     /* what the user calls it */
	const char *which;  /* as for ct_series_pick */
	const char *member; /* or the series of this file, as the scan names it */
	enum ct_tilt tilt;
	enum ct_gaps gaps;
	enum ct_units units;
	bool skip_damaged;
	json_t *about;                    /* the object of a sidecar, or NULL */
	const struct series_taker *taker; /* or NULL */
};

/* The census of the paths, as series. Zeroes are empty. */
struct series_set {
	struct ct_census census;
	struct ct_series *list;
	size_t n;
};

int series_open(struct series_set *set, const char *const *paths, size_t n, struct ct_err *e);
void series_close(struct series_set *set);
/* What series `pick` is made of, in one line for a list. */
void series_line(const struct series_set *set, size_t pick, char *out, size_t room);
/* The series of the rule. CT_EINPUT if there is none at all, saying what is the matter; else as
 * ct_series_pick. */
int series_choose(const struct series_set *set, const char *path, const struct series_rule *rule,
	size_t *pick, struct ct_err *e);
/* How the files are used if series `pick` is: one line in the log if not all are, with -v one line
 * a file. `without` slices at the end of the series are not. */
void series_account(
	const struct series_set *set, size_t pick, size_t without, const struct ct_env *env);
/* CT_EINPUT naming a file that may belong to the series and cannot be read; with `skip` they are
 * named in the log. */
int series_whole(const struct series_set *set, size_t pick, bool skip, const struct ct_env *env,
	struct ct_err *e);
/* One series as a volume, RAS+, of finite numbers; without its data if the taker took them. *v must
 * be zero. CT_EINPUT: damaged files,
 * values that are not HU; CT_EGEOM: places that make no grid; CT_EUSAGE: no such series;
 * CT_ENUMERIC. */
int series_read(const char *const *paths, size_t n, const struct series_rule *rule,
	struct ct_vol *v, const struct ct_env *env, struct ct_err *e);

#endif
