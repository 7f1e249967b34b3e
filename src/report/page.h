/* page.h: the page that ct-report writes: what is on it, how it is measured, and how it is written.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REPORT_PAGE_H
#define CT_REPORT_PAGE_H
#include "core/env.h"
#include "core/vol.h"
#include "quality/calibration.h"
#include "quality/data-residual.h"
#include "quality/edges.h"
#include "quality/metrics.h"
#include "estimate/noise.h"
#include "estimate/profile.h"

#include <stdbool.h>
#include <stdio.h>

enum {
	CT_PAGE_BINS = 128,
	CT_PAGE_SAID = 40,                   /* most warnings of a log that are shown */
	CT_PAGE_WARNINGS = CT_PAGE_SAID + 9, /* with those of what is found */
};
#define CT_PAGE_LOWEST (-1024.0) /* HU where the histogram begins */
#define CT_PAGE_BIN 32.0         /* HU */

/* Where more is worth a warning. */
#define CT_PAGE_NOISE 30.0   /* HU of the scan */
#define CT_PAGE_APART 1.0    /* HU RMS of D x - y, beyond the noise */
#define CT_PAGE_POOR 100.0   /* HU of expected error, at more than */
#define CT_PAGE_SHARE 0.1    /* of the voxels of the body */
#define CT_PAGE_SMOOTH 2.5   /* voxels that an edge of the scan rises over */
#define CT_PAGE_SHARPER 0.97 /* of the width of edges before */

/* What the voxels are, by the HU of the result. */
enum ct_page_tissue { CT_PAGE_AIR, CT_PAGE_LUNG, CT_PAGE_SOFT, CT_PAGE_BONE, CT_PAGE_TISSUES };
struct ct_page_class {
	size_t voxels, poor;     /* of expected error above CT_PAGE_POOR */
	double expected, actual; /* RMS, HU; NaN if not known */
};

struct ct_page_volume {
	const char *name; /* without its folder, borrowed; NULL: there is none */
	struct ct_vol vol;
};

struct ct_page {
	struct ct_page_volume lr, hr, std, truth;
	struct ct_vol before; /* cubic, on the grid of hr */
	const char *log;      /* what the commands that ran have said, borrowed; or NULL */

	/* ct_page_measure */
	struct ct_degrade by;
	bool known;                        /* the operator, not only its factor */
	bool told;                         /* the header of the scan names it */
	double noise;                      /* HU, 0 if nothing tells of any */
	struct ct_noise texture;           /* of the scan, if no header tells its noise */
	struct ct_profile seen[3];         /* of the scan, along axes that were refined */
	struct ct_data_residual agrees;    /* if known */
	struct ct_edges edges;             /* if of 12 or more */
	bool small;                        /* too small for edges */
	struct ct_metrics was, is;         /* with truth: of before and of hr */
	struct ct_calibration calibration; /* with truth and std */
	size_t histogram[2]
			[CT_PAGE_BINS]; /* of before and of hr; what lies beyond is in the last */
	struct ct_page_class tissue[CT_PAGE_TISSUES];
	size_t warnings;
	char *warning[CT_PAGE_WARNINGS]; /* owned */
};

/* Fill p->before and what follows from what was read. CT_EGEOM if the volumes do not belong
 * together, codes of what measures. */
int ct_page_measure(struct ct_page *p, const struct ct_env *env, struct ct_err *e);
/* The page to f, laid out as the text `form` says, whose lines @WORD@ stand for parts of it.
 * CT_EINPUT for another word, CT_ENOMEM, CT_ESTOP. */
int ct_page_write(FILE *f, const char *form, const struct ct_page *p, const struct ct_env *env,
	struct ct_err *e);
void ct_page_free(struct ct_page *p);

/* The parts of ct_page_write. */
/* What the script reads of the pictures, and all of them (page-pictures.c). */
void ct_page_write_meta(FILE *f, const struct ct_page *p);
int ct_page_write_pictures(
	FILE *f, const struct ct_page *p, const struct ct_env *env, struct ct_err *e);
/* Where the words of what was assumed go on to that the result left the range of the scan ("; the
 * result ..."), or NULL. */
const char *ct_page_range(const struct ct_page *p);
/* The tables and curves (page-cards.c). */
void ct_page_write_cards(FILE *f, const struct ct_page *p);
/* What printf makes, as HTML shows it; longer than 1000 bytes it is cut. */
void ct_page_write_words(FILE *f, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
/* Names of files lose their folders, in place: they are nobody's business. */
void ct_page_forget_folders(char *text);

#endif
