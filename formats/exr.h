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
#include <stdbool.h>

#define CT_EXR_PREFIX "ct:"
#define CT_EXR_META "ct:meta"
#define CT_EXR_VERSION "ct:version"
/* Longest attribute name that every EXR reader takes. */
enum { CT_EXR_NAME = 31, CT_EXR_VERSION_NOW = 1 };

/* Is this "ct:..." name geometry or ours for another reason, and so not a metadata key? */
bool ct_exr_reserved(const char *name);

#endif
