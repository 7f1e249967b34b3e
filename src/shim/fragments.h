/* fragments.h: is a compressed DICOM picture whole? (For the .cc files of this folder only.)
 *
 * Decoders fill what is missing with grey and do not tell, so the stream is checked before them:
 * its fragments must end with a sequence delimiter inside the file, a JPEG stream with its own end
 * mark and the size that the header says, and each segment of RLE must make as many bytes as the
 * picture has pixels, no more. (DICOM PS3.5
 * annexes A.4 and G; ITU-T T.81 and T.800 annex A for the marks.)
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SHIM_FRAGMENTS_H
#define CT_SHIM_FRAGMENTS_H
#include "core/err.h"

#include <cstdint>
#include <string>
#include <vector>

/* How the numbers of a transfer syntax lie; `other` is none that is read. */
enum class Coding { plain, big_endian, jpeg, jpeg2000, rle, other };
Coding coding_of(const std::string &syntax);

using Bytes = std::vector<unsigned char>;

/* Bytes of a file. */
struct Part {
	uint64_t from, size;
};
using Parts = std::vector<Part>;

/* The fragments of each picture of a compressed file, in which they begin at `offset`. 0, or -1
 * with CT_EINPUT naming `what` if they are cut off, or are not so many pictures. */
int list_pictures(std::vector<Parts> &list, int fd, uint64_t offset, Coding coding, size_t frames,
	const char *what, ct_err *e);
/* Numbers of so many bytes, at most 15, from a run-length coded picture (RLE: a header of 64 bytes,
 * then a segment for each byte of a number, the highest first), little-endian. 0, or -1 with
 * CT_EINPUT if it does not make all of them. */
int unpack_rle(
	Bytes &out, const Bytes &b, size_t pixels, size_t bytes, const char *what, ct_err *e);
/* What a picture holds, by the header of the file or its own. */
struct Frame {
	size_t rows, columns;
	unsigned samples, bits;
};
/* Is that the whole stream of one picture in JPEG or JPEG 2000, of the size that is wanted, with no
 * more bits? 0 and its bits, or -1 with CT_EINPUT. What stands behind its end mark is cut off: one
 * byte where their number is odd, but there are writers that put more, and not zeros.
 *
 * The one repair: the last tile-part of a JPEG 2000 stream may state a length (Psot) beyond the
 * end, where 0 means "up to the end". */
int check_jpeg(
	Bytes &b, Coding coding, const Frame &want, unsigned *bits, const char *what, ct_err *e);

#endif
