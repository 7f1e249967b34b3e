/* exr.h: names of the attributes of an EXR stack, and the bytes of its ZIP chunks, for exr-*.c.
 *
 * A stack is one flat scanline part a view, named view.0000, view.0001, ..., with a channel Y,
 * FLOAT, ZIP, and if samples made it a channel "deviation" beside it. Every part carries the
 * geometry of its view (world mm, RAS+) as strings that keep doubles exactly: ct:beam, ct:angleDeg,
 * ct:source, ct:detCentre, ct:detU, ct:detV. The first part also carries ct:version and the
 * metadata, one string "ct:KEY" a key; keys that do not fit an attribute name stand in one JSON
 * object, ct:meta.
 *
 * A chunk's bytes are split into those at even and at odd places, replaced by differences
 * (plus 128, modulo 256), and deflated into a zlib stream; what does not shrink is stored as it is,
 * and a reader tells the two apart by the size alone. OpenEXRCore before 3.4.8 loses a chunk whose
 * deflated size equals the plain one, and leaves stale memory where a stream ends early; these
 * functions do neither. Pure but for libdeflate's own memory; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_EXR_H
#define CT_FORMATS_EXR_H
#include <stdbool.h>
#include <stddef.h>

#define CT_EXR_PREFIX "ct:"
#define CT_EXR_META "ct:meta"
#define CT_EXR_VERSION "ct:version"
#define CT_EXR_DEVIATION "deviation"
/* Longest attribute name that every EXR reader takes. */
enum { CT_EXR_NAME = 31, CT_EXR_VERSION_NOW = 1 };

/* Is this "ct:..." name geometry or ours for another reason, and so not a metadata key? */
bool ct_exr_reserved(const char *name);

/* Room that ct_exr_zip needs at dst for n bytes. */
size_t ct_exr_zip_room(size_t n);
/* Bytes of the chunk made of the n bytes at src, at most n, 0 if libdeflate has no memory. Scratch
 * holds n. The bytes at dst are to be written. */
size_t ct_exr_zip(unsigned char *dst, const unsigned char *src, size_t n, unsigned char *scratch);
/* The n bytes at dst from the m of a chunk at src; scratch holds n. 0, or -1 if they are damaged
 * (not exactly n) or libdeflate has no memory. */
int ct_exr_zip_undo(
	unsigned char *dst, size_t n, const unsigned char *src, size_t m, unsigned char *scratch);

#endif
