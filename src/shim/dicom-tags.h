/* dicom-tags.h: what the header of a picture says (for the .cc files of this folder only).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_DICOM_TAGS_H
#define CT_SHIM_DICOM_TAGS_H
#include "series/slice.h"
#include "shim/outline.h"

#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>

#include <string>

/* Parse the header of a file; false if that fails. Whether there is a picture, p knows. */
bool parse_header(const std::string &path, vtkDICOMMetaData *m, vtkDICOMParser *p);
/* Pictures of the file, 0 if the number is absurd; *wrong says so if it is none. */
size_t count_frames(vtkDICOMMetaData *m, std::string *wrong);
/* All of *s but its path, of one picture. *s must be zero. What is wrong with the first element
 * that should be a number and is none; empty if all are. */
std::string describe_frame(vtkDICOMMetaData *m, size_t frame, ct_slice *s);
/* Is the storage class one that holds pictures of CT, or screens, or not known? */
bool may_hold_picture(vtkDICOMMetaData *m);

/* Of the numbers of its pictures (pixel-tags.cc). Why PixelData is not what the header says, or
 * empty: its length, or what its syntax calls it. What has a length is not compressed, whatever the
 * file's syntax (PS3.5 A.4): then o's is changed.
 */
std::string wrong_pixels(vtkDICOMMetaData *m, Outline *o, uint64_t file_size, size_t frames);
/* How numbers lie in their bits, and what they are. */
void describe_bits(vtkDICOMMetaData *m, const Outline &o, ct_slice *s);

#endif
