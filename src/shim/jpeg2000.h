/* jpeg2000.h: a grey picture in JPEG 2000 by OpenJPEG itself, since the reader of vtk-dicom starts
 * threads for every picture. (For the .cc files of this folder only.) */
#ifndef CT_SHIM_JPEG2000_H
#define CT_SHIM_JPEG2000_H
#include "shim/fragments.h"

#include <cstddef>

/* The numbers of the stream, of which the lower `bits` (8, 16 or 32) count, into
 * out[columns*rows]. False if it cannot be decoded, or is another picture, or this build has no
 * OpenJPEG. */
bool decode_jpeg2000(
	float *out, size_t columns, size_t rows, int bits, bool is_signed, const Bytes &stream);

#endif
