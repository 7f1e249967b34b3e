/* profile.h: the values of volumes along a straight line of the world. */
#ifndef CT_TOOLS_PROFILE_H
#define CT_TOOLS_PROFILE_H
#include "formats/any.h"
#include "core/env.h"
#include "tools/text.h"

enum { PROFILE_MOST = 100000, PROFILE_COLOURS = 7 };

/* Trilinear (sample.h), at n evenly spaced places, the ends among them, no further apart than half
 * of the least spacing of the volumes. */
struct profile {
	double end[2][3]; /* mm, RAS+ */
	size_t n, files;
	double *value; /* [files][n], NaN outside of a volume; owned */
};

/* "X0,Y0,Z0:X1,Y1,Z1". CT_EUSAGE naming the option. */
int profile_parse(double end[2][3], const char *option, const char *text, struct ct_err *e);
/* Of volumes alone. CT_EGEOM if the line misses all of them, CT_EUSAGE if it is longer than
 * PROFILE_MOST places. */
int profile_make(struct profile *p, size_t files, const struct ct_any *file, struct ct_err *e);
void profile_free(struct profile *p);
/* Place i of the line. */
void profile_place(double world[static 3], const struct profile *p, size_t i);
/* A line a place: mm from the first end, x, y, z, and a column a file, empty outside of it. */
int profile_write(const struct profile *p, const char *const *name, const char *path,
	const struct ct_env *env, struct ct_err *e);
/* The colour of a file. */
const unsigned char *profile_colour(size_t file);
/* Pixels of a plot at that scale of letters: rows, and the least columns. */
void profile_size(size_t *h, size_t *w, size_t scale);
/* In rows `top` up to the end of the picture. */
void profile_draw(const struct profile *p, const char *const *name, const struct canvas *c,
	size_t top, size_t scale);

#endif
