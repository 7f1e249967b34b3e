/* fragments.h: is a compressed DICOM picture whole? (For the .cc files of this folder only.) */
#ifndef CT_SHIM_FRAGMENTS_H
#define CT_SHIM_FRAGMENTS_H
#include "core/err.h"

#include <cstdint>
#include <string>

/* Decoders fill what is missing with grey and do not tell, so the stream is checked before them:
 * its fragments must end with a sequence delimiter inside the file, and the stream with its own
 * end mark. (DICOM PS3.5 annex A.4; ITU-T T.81 and T.800 annex A for the marks.)
 *
 * The one repair: the last tile-part of a JPEG 2000 stream may state a length (Psot) beyond the
 * end, where 0 means "up to the end". The corrected file lives in memory, at path(). */
class Mended
{
      public:
	Mended() = default;
	Mended(const Mended &) = delete;
	Mended &operator=(const Mended &) = delete;
	~Mended();
	/* The picture, or that many, at byte `offset` of a file of that transfer syntax. 0, or -1
	 * with CT_EINPUT. */
	int check(const char *path, const std::string &syntax, uint64_t offset, size_t frames,
		ct_err *e);
	/* The file to decode instead. */
	std::string path(const char *original) const;

      private:
	int fd = -1;
};

#endif
