/* slice-profile.h: the profile of thick slices, from what a person or a scanner says, to the
 * operator D along the slice axis (degrade.h).
 *
 * A shape has a thickness T in mm:
 *
 *   gaussian   sigma = 0.371 T, sampled at points. That is what two reconstructions of one scan
 *              show, 5 mm and 1 mm thick; its full width at half maximum is 0.874 T
 *   box        all of T alike
 *   triangle   full width at half maximum T, base 2 T
 *   trapezoid  a box of T blurred by a box of T/2: top T/2, base 3 T/2, full width at half maximum
 * T. A beam of that width with a penumbra of half of it
 *
 * T may differ from the spacing: larger, slices overlap; smaller, there are gaps. A Gaussian, and
 * a box of the spacing, become sigma and decimate as ever where these can say it. All else
 * becomes samples.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_SLICE_PROFILE_H
#define CT_OPERATOR_SLICE_PROFILE_H
#include "operator/degrade.h"

#define CT_SLICE_SHAPE_LIST(X)                                                                     \
	X(CT_SLICE_GAUSSIAN, "gaussian")                                                           \
	X(CT_SLICE_BOX, "box")                                                                     \
	X(CT_SLICE_TRIANGLE, "triangle")                                                           \
	X(CT_SLICE_TRAPEZOID, "trapezoid")
enum ct_slice_shape { CT_SLICE_SHAPE_LIST(CT_WORD_VALUE) };

/* What is said of slices; nothing, if there is no shape, no thickness and no sample. */
struct ct_slice_profile_said {
	int shape;                       /* enum ct_slice_shape; -1: not said, a Gaussian */
	double mm;                       /* thickness; NaN: not said, the spacing */
	struct ct_slice_profile samples; /* first and step in mm; they say all */
};
#define CT_SLICE_PROFILE_NOTHING                                                                   \
	{                                                                                          \
		.shape = -1, .mm = (double)NAN                                                     \
	}

/* What `profile` (a shape, or NULL) and the thickness in mm (NaN: not given) say. *file: the
 * profile is no shape, so a file, which ct_slice_profile_parse reads. CT_EUSAGE if that is said
 * twice. */
int ct_slice_profile_say(struct ct_slice_profile_said *to, bool *file, const char *profile,
	double mm, struct ct_err *e);
bool ct_slice_profile_is_said(const struct ct_slice_profile_said *said);
/* The slice axis: the one that is refined most, or if there is none the third. */
int ct_slice_profile_axis(const double factor[static 3], int third);
/* Is no axis but this reduced? Then the profile says the sampling too. */
bool ct_slice_profile_is_alone(const double factor[static 3], int axis);
/* CT_EUSAGE naming the options if the blur of the axis, or its sampling, is said a second time. */
int ct_slice_profile_twice(const struct ct_slice_profile_said *said, int axis, bool blurred,
	bool sampled, struct ct_err *e);
/* Give the axis of d, whose LR voxels are `spacing` mm apart along it, what is said. The factors of
 * d are set; with other axes that are reduced, its decimate is too. CT_EUSAGE for a thickness that
 * is none, or is more than 16 times the spacing. */
int ct_slice_profile_set(struct ct_degrade *d, int axis, const struct ct_slice_profile_said *said,
	double spacing, struct ct_err *e);

/* Text, a line a sample: "mm weight", steps alike; what follows # is no part. The samples get sum
 * 1. CT_EINPUT naming line and field. */
int ct_slice_profile_parse(
	struct ct_slice_profile *p, const char *text, size_t n, struct ct_err *e);

/* Of degrade.c: the table of an axis, and the metadata key profile. _get also sets sigma and
 * decimate to those of the same spread. */
int ct_slice_profile_taps(struct ct_taps *t, size_t n, double factor,
	const struct ct_slice_profile *p, struct ct_err *e);
int ct_slice_profile_put(struct ct_meta *m, const struct ct_slice_profile *p, struct ct_err *e);
int ct_slice_profile_get(const struct ct_meta *m, struct ct_degrade *d, struct ct_err *e);
/* New axis a was axis[a]. */
int ct_slice_profile_permute(struct ct_meta *m, const int axis[static 3], struct ct_err *e);

#endif
