/* pixel-tags.h: what a header says of the numbers of its pictures (for the .cc files of this folder
 * only). SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_PIXEL_TAGS_H
#define CT_SHIM_PIXEL_TAGS_H
#include "series/slice.h"
#include "shim/outline.h"

#include <vtkDICOMMetaData.h>

#include <string>

/* Why PixelData is not what the header says, or empty: its length, or what its syntax calls it.
 * What has a length is not compressed, whatever the file's syntax (PS3.5 A.4): then o's is changed.
 */
std::string wrong_pixels(vtkDICOMMetaData *m, Outline *o, uint64_t file_size, size_t frames);
/* How numbers lie in their bits, and what they are. */
void describe_bits(vtkDICOMMetaData *m, const Outline &o, ct_slice *s);

#endif
