/* outline.h: how a DICOM file is laid out, found before any library parses it. (For the .cc files
 * of this folder only.)
 *
 * The file is walked once, from one element to the next, with limits on how deep sequences nest and
 * on how many elements are out of order: parsers recurse, copy each level into the one above it,
 * and sort. (DICOM PS3.5 chapter 7, PS3.10 chapter 7.)
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SHIM_OUTLINE_H
#define CT_SHIM_OUTLINE_H
#include <cstddef>
#include <cstdint>
#include <string>

enum : uint32_t {
	NO_LENGTH = 0xffffffff,
	PIXEL_DATA = 0x7fe00010,
	FLOAT_PIXEL_DATA = 0x7fe00008,
	DOUBLE_PIXEL_DATA = 0x7fe00009
};

struct Outline {
	bool dicom = false; /* begins as DICOM does, with its preamble or without */
	/* TransferSyntaxUID of the file meta information, where the first one counts; without one,
	 * that of the first element */
	std::string syntax;
	uint64_t uid = 0,
		 begin = 0;         /* where that UID lies, 0 if nowhere; where the data set does */
	std::string trouble;        /* why it must not be parsed, or empty */
	uint32_t pixel_data = 0;    /* the tag of one at the top level, or 0: */
	uint64_t pixels = 0;        /* where its value begins, */
	uint32_t length = 0;        /* its bytes, or NO_LENGTH */
	bool word_of_zeros = false; /* its last two bytes are */
};

/* Of what begins so; `size` are the bytes of the whole file. */
bool begins_as_dicom(const unsigned char *p, size_t n, uint64_t size);
/* Of a file; of one that cannot be read, and is not DICOM, nothing. What is deflated ends where its
 * data set begins. */
Outline outline_of(const char *path);

#endif
