/* pixels.h: the pictures of one DICOM file, each by itself. (For the .cc files of this folder
 * only.) SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_PIXELS_H
#define CT_SHIM_PIXELS_H
#include "shim/dicom-file.h"
#include "shim/fragments.h"
#include "shim/held.h"

#include <cstring>
#include <memory>

class PixelFile
{
      public:
	PixelFile() = default;
	PixelFile(const PixelFile &) = delete;
	PixelFile &operator=(const PixelFile &) = delete;
	~PixelFile();
	/* The file of that slice, which must outlive this. 0, or -1 after ct_fail; throws
	 * std::runtime_error. */
	int open(const ct_slice &s, ct_err *e);
	/* Is that the slice's file? */
	bool is_of(const ct_slice &s) const
	{
		return of && std::strcmp(of->path, s.path) == 0 && of->begin == s.begin;
	}
	/* Does a library decode it? Then reading may kill the process: see apart.h. */
	bool foreign() const
	{
		return coding == Coding::jpeg || coding == Coding::jpeg2000;
	}
	/* Stored values of the slice. */
	int read(const ct_slice &s, float *out, ct_err *e);
	ct_dicom_bits placed = {false, false}; /* of all that were read */

      private:
	int decode_jpeg(const ct_slice &s, ct_err *e);
	int get(const Parts &parts, ct_err *e);
	bool write_alone(const char *path, const ct_slice &s, int bits) const;
	int turn(const ct_slice &s, size_t bytes, ct_err *e);

	const ct_slice *of = nullptr; /* that was opened */
	std::unique_ptr<Held> held;
	int fd = -1;
	Coding coding = Coding::other;
	uint32_t tag = 0;            /* of the pixel data, */
	char vr[2] = {0, 0};         /* their VR */
	std::vector<Parts> pictures; /* of what is compressed */
	Bytes raw, unpacked;
};

#endif
