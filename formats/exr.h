/* exr.h: names of the attributes of an EXR stack, for exr-read.c and exr-write.c.
 *
 * A stack is one flat scanline part a view, named view.0000, view.0001, ..., with one channel Y,
 * FLOAT, ZIP. Every part carries the geometry of its view (world mm, RAS+) as strings that
 * keep doubles exactly: ct:beam, ct:angleDeg, ct:source, ct:detCentre, ct:detU, ct:detV. The
 * first part also carries ct:version and the metadata, one string "ct:KEY" a key; keys that
 * do not fit an attribute name stand in one JSON object, ct:meta.
 */
#ifndef CT_FORMATS_EXR_H
#define CT_FORMATS_EXR_H
#include "core/err.h"

#include <openexr.h>
#include <stdbool.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "pixels are copied as they are");

#define CT_EXR_PREFIX "ct:"
#define CT_EXR_META "ct:meta"
#define CT_EXR_VERSION "ct:version"
/* Longest attribute name that every EXR reader takes. */
enum { CT_EXR_NAME = 31, CT_EXR_VERSION_NOW = 1 };

/* What OpenEXRCore's callbacks need: the user_data of a context. */
struct ct_exr_file {
	unsigned char *data; /* the whole file, in memory */
	size_t n, cap;
	char msg[200];    /* the library's first complaint */
	struct ct_err *e; /* of the writer's memory */
	bool starved;     /* which it had none of */
};

/* Is this "ct:..." name geometry or ours for another reason, and so not a metadata key? */
bool ct_exr_reserved(const char *name);
/* The reader's callback that keeps the first message in struct ct_exr_file, so that nothing is
 * printed. */
void ct_exr_complaint(exr_const_context_t c, exr_result_t code, const char *msg);
/* CT code failure "PATH: words of the library". */
int ct_exr_fail(const struct ct_exr_file *f, const char *path, exr_result_t r, enum ct_code code,
	struct ct_err *e);

#endif
