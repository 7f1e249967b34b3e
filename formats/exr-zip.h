/* exr-zip.h: the bytes of a ZIP chunk of OpenEXR.
 *
 * A chunk's bytes are split into those at even and at odd places, replaced by differences
 * (plus 128, modulo 256), and deflated into a zlib stream; what does not shrink is stored as it is,
 * and a reader tells the two apart by the size alone. OpenEXRCore before 3.4.8 loses a chunk whose
 * deflated size equals the plain one, and leaves stale memory where a stream ends early; these
 * functions do neither. Pure but for libdeflate's own memory; thread-safe.
 */
#ifndef CT_FORMATS_EXR_ZIP_H
#define CT_FORMATS_EXR_ZIP_H
#include <stddef.h>

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
