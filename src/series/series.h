/* series.h: the pictures of a folder as stacks that belong together.
 *
 * A series shares SeriesInstanceUID, patient, kind of picture, matrix, pixel size and orientation;
 * where places repeat, also the moment, and nowhere else: no exposure or acquisition divides a
 * stack.
 */
#ifndef CT_SERIES_SERIES_H
#define CT_SERIES_SERIES_H
#include "core/words.h"
#include "series/slice.h"

#define CT_PICTURE_LIST(X)                                                                         \
	X(CT_PICTURE_SLICES, "slices")                                                             \
	X(CT_PICTURE_LOCALIZER, "localizer")                                                       \
	X(CT_PICTURE_CAPTURE, "screen capture or dose page")                                       \
	X(CT_PICTURE_OTHER, "other modality")                                                      \
	X(CT_PICTURE_COPY, "repeated") /* of a picture at the same place, SOPInstanceUID and all   \
					*/
enum ct_picture { CT_PICTURE_LIST(CT_WORD_VALUE) };

struct ct_series {
	size_t first, count; /* slices */
	enum ct_picture role;
	/* what tells it from others of its UID at the same places: "AcquisitionNumber 2"; or empty
	 */
	char moment[40];
};

/* Order slices so that those of a series are adjacent, and list the series: by SeriesNumber, UID,
 * role, and then as they come. *list (free() it) and *n. CT_ENOMEM. */
int ct_series_list(
	struct ct_slice *s, size_t n, struct ct_series **list, size_t *series, struct ct_err *e);
/* The series that `which` names: by its place in the list counted from 1, or by UID. NULL is the
 * only one of slices, or the only one. CT_EGEOM if there are several, CT_EUSAGE if there is no
 * such, CT_EINPUT if there is none at all. */
int ct_series_pick(const struct ct_series *list, size_t series, const struct ct_slice *s,
	const char *which, size_t *pick, struct ct_err *e);

#endif
