/* fragments.cc: see fragments.h. */
#include "config.h"
#include "shim/fragments.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

namespace
{

using Bytes = std::vector<unsigned char>;

struct Stream {
	Bytes bytes;                /* the fragments, one after another */
	std::vector<uint64_t> from; /* where in the file each fragment begins */
	std::vector<uint64_t> upto; /* where in `bytes` each ends */

	uint64_t in_file(uint64_t at) const
	{
		size_t k = 0;
		uint64_t begin = 0;

		for (; at >= upto[k]; k++)
			begin = upto[k];
		return from[k] + at - begin;
	}
};

unsigned le(const Bytes &b, uint64_t at, int n)
{
	unsigned u = 0;

	for (int i = 0; i < n; i++)
		u |= static_cast<unsigned>(b[at + i]) << 8 * i;
	return u;
}

unsigned be(const Bytes &b, uint64_t at, int n)
{
	unsigned u = 0;

	for (int i = 0; i < n; i++)
		u = u << 8 | b[at + i];
	return u;
}

/* The fragments of the picture, without the offset table; false if they run past the file. */
bool gather(const Bytes &file, uint64_t at, Stream &s)
{
	for (bool table = true; at + 8 <= file.size(); table = false) {
		const unsigned tag = le(file, at, 2) << 16 | le(file, at + 2, 2);
		const uint64_t size = le(file, at + 4, 4);

		at += 8;
		if (tag == 0xfffee0dd)
			return true;
		if (tag != 0xfffee000 || size > file.size() - at)
			return false;
		if (!table && size) {
			s.from.push_back(at);
			s.bytes.insert(s.bytes.end(), file.begin() + at, file.begin() + at + size);
			s.upto.push_back(s.bytes.size());
		}
		at += size;
	}
	return false;
}

/* Begins with the mark, and ends with FF D9 but for padding. */
bool framed(const Bytes &b, unsigned first, uint64_t *end)
{
	*end = b.size();
	while (*end > 0 && b[*end - 1] == 0)
		--*end;
	return *end >= 4 && be(b, 0, 2) == first && be(b, *end - 2, 2) == 0xffd9;
}

enum { SOT = 0xff90, EOC = 0xffd9 };

/* Follow the tile-parts of a JPEG 2000 stream that ends at `end`. 0: sound; 1: the length at *psot
 * of the last one runs past the end; -1: lost the thread, or there is none. *psot must be 0. */
int tile_parts(const Bytes &b, uint64_t end, uint64_t *psot)
{
	uint64_t at = 2;

	while (at + 4 <= end && be(b, at, 2) != SOT) /* the main header */
		at += 2 + std::max(be(b, at + 2, 2), 2u);
	while (at + 12 <= end && be(b, at, 2) == SOT) {
		const uint64_t size = be(b, at + 6, 4);

		*psot = at + 6;
		if (size == 0)
			return 0;
		if (size > end - 2 - at)
			return 1;
		if (size < 14)
			return -1;
		at += size;
	}
	return *psot > 0 && at + 2 == end && be(b, at, 2) == EOC ? 0 : -1;
}

bool is_one_of(const std::string &s, std::initializer_list<const char *> tails)
{
	const std::string jpeg = "1.2.840.10008.1.2.4.";

	return s.compare(0, jpeg.size(), jpeg) == 0 &&
	       std::find(tails.begin(), tails.end(), s.substr(jpeg.size())) != tails.end();
}

int write_all(int fd, const Bytes &b)
{
	size_t done = 0;

	while (done < b.size()) {
		const ssize_t n = write(fd, b.data() + done, b.size() - done);

		if (n <= 0)
			return -1;
		done += static_cast<size_t>(n);
	}
	return 0;
}

} // namespace

Mended::~Mended()
{
	if (fd >= 0)
		close(fd);
}

std::string Mended::path(const char *original) const
{
	return fd < 0 ? original : "/proc/self/fd/" + std::to_string(fd);
}

int Mended::check(
	const char *path, const std::string &syntax, uint64_t offset, size_t frames, ct_err *e)
{
	const bool jpeg = is_one_of(syntax, {"50", "51", "57", "70", "80", "81"});
	const bool jpeg2000 = is_one_of(syntax, {"90", "91", "201", "202", "203"});
	Stream s;
	uint64_t end, psot = 0;
	int state;

	if (!jpeg && !jpeg2000 && syntax != "1.2.840.10008.1.2.5")
		return 0; /* not encapsulated: the reader counts the bytes */
	std::ifstream in(path, std::ios::binary);
	Bytes file((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
	if (!gather(file, offset, s) || s.bytes.empty())
		return ct_fail(
			e, CT_EINPUT, "%s: truncated: the compressed picture is cut off", path);
	if ((jpeg && !framed(s.bytes, 0xffd8, &end)) ||
		(jpeg2000 && !framed(s.bytes, 0xff4f, &end)))
		return ct_fail(e, CT_EINPUT, "%s: the compressed picture has no end mark", path);
	if (!jpeg2000 || frames > 1)
		return 0;
	state = tile_parts(s.bytes, end, &psot);
	if (state < 0)
		return ct_fail(e, CT_EINPUT, "%s: JPEG 2000 tile-part lengths are wrong", path);
	if (state == 0)
		return 0;
	for (uint64_t i = 0; i < 4; i++)
		file[s.in_file(psot + i)] = 0;
	fd = memfd_create("ctsr-dicom", MFD_CLOEXEC);
	if (fd < 0 || write_all(fd, file))
		return ct_fail(e, CT_ENOMEM, "%s: no memory for a corrected copy: %s", path,
			std::strerror(errno));
	return 0;
}
