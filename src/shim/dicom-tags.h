/* dicom-tags.h: what the header of a picture says (for the .cc files of this folder only).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_DICOM_TAGS_H
#define CT_SHIM_DICOM_TAGS_H
#include "series/slice.h"

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

#endif
