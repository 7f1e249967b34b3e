/* fragments.cc: see fragments.h. */
#include "config.h"
#include "shim/fragments.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include <unistd.h>

namespace
{

unsigned le(const unsigned char *p, int n)
{
	unsigned u = 0;

	for (int i = 0; i < n; i++)
		u |= static_cast<unsigned>(p[i]) << 8 * i;
	return u;
}

unsigned be(const Bytes &b, uint64_t at, int n)
{
	unsigned u = 0;

	for (int i = 0; i < n; i++)
		u = u << 8 | b[at + i];
	return u;
}

/* Does the stream of a picture begin in a fragment that begins so? */
bool begins(const unsigned char *p, uint64_t n, Coding coding)
{
	if (coding == Coding::rle)
		return true;
	if (coding == Coding::jpeg)
		return n >= 3 && p[0] == 0xff && p[1] == 0xd8 && p[2] == 0xff;
	return n >= 4 && p[0] == 0xff && p[1] == 0x4f && p[2] == 0xff && p[3] == 0x51;
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

/* The n bytes of a run-length coded segment, each `step` behind the one before; false if it makes
 * fewer. */
bool unpack(
	const unsigned char *p, const unsigned char *end, size_t n, unsigned char *out, size_t step)
{
	size_t at = 0;

	while (at < n && p < end) {
		const size_t code = *p++, bytes = code < 128 ? code + 1 : 1,
			     made = std::min(code < 128 ? bytes : 257 - code, n - at);

		if (code == 128)
			continue;
		if (bytes > static_cast<size_t>(end - p))
			return false;
		for (size_t i = 0; i < made; i++)
			out[step * at++] = p[code < 128 ? i : 0];
		p += bytes;
	}
	return at == n;
}

} // namespace

Coding coding_of(const std::string &syntax)
{
	static const std::string native = "1.2.840.10008.1.2", coded = native + ".4.";
	const auto is = [&](const std::string &head, std::initializer_list<const char *> tails) {
		return syntax.compare(0, head.size(), head) == 0 &&
		       std::find(tails.begin(), tails.end(), syntax.substr(head.size())) !=
			       tails.end();
	};

	if (is(native, {"", ".1"}))
		return Coding::plain;
	if (is(native, {".2"}))
		return Coding::big_endian;
	if (is(native, {".5"}))
		return Coding::rle;
	if (is(coded, {"50", "51", "57", "70", "80", "81"}))
		return Coding::jpeg;
	if (is(coded, {"90", "91", "201", "202", "203"}))
		return Coding::jpeg2000;
	return Coding::other;
}

int list_pictures(std::vector<Parts> &list, int fd, uint64_t offset, Coding coding, size_t frames,
	const char *what, ct_err *e)
{
	const off_t end = lseek(fd, 0, SEEK_END);
	const uint64_t size = end < 0 ? 0 : static_cast<uint64_t>(end);
	bool whole = false;

	list.clear();
	for (bool table = true; offset + 8 <= size && !whole; table = false) {
		unsigned char head[12] = {0};

		if (pread(fd, head, sizeof head, static_cast<off_t>(offset)) < 8)
			break;
		const unsigned tag = le(head, 2) << 16 | le(head + 2, 2);
		const uint64_t n = le(head + 4, 4);

		offset += 8;
		whole = tag == 0xfffee0dd;
		if (whole || tag != 0xfffee000 || n > size - offset)
			break;
		if (!table && n > 0) {
			if (list.empty() || (frames > 1 && begins(head + 8, n, coding)))
				list.emplace_back();
			list.back().push_back({offset, n});
		}
		offset += n;
	}
	if (!whole || list.empty())
		return ct_fail(
			e, CT_EINPUT, "%s: truncated: the compressed picture is cut off", what);
	if (list.size() != frames)
		return ct_fail(e, CT_EINPUT, "%s: %zu compressed pictures, NumberOfFrames is %zu",
			what, list.size(), frames);
	return 0;
}

int unpack_rle(Bytes &out, const Bytes &b, size_t pixels, size_t bytes, const char *what, ct_err *e)
{
	bool whole = b.size() >= 64 && le(b.data(), 4) == bytes;

	out.resize(pixels * bytes);
	for (size_t k = 0; k < bytes && whole; k++) { /* the highest byte comes first */
		const uint64_t from = le(&b[4 + 4 * k], 4),
			       next = k + 1 < bytes ? le(&b[8 + 4 * k], 4) : b.size();

		whole = from >= 64 && next >= from && next <= b.size() &&
			unpack(b.data() + from, b.data() + next, pixels, &out[bytes - 1 - k],
				bytes);
	}
	if (!whole)
		return ct_fail(e, CT_EINPUT,
			"%s: damaged: its run-length code does not make %zu pixels of %zu bytes",
			what, pixels, bytes);
	return 0;
}

int check_jpeg(Bytes &b, Coding coding, const char *what, ct_err *e)
{
	uint64_t end = b.size(), psot = 0;
	int state;

	if (!framed(b, coding == Coding::jpeg ? 0xffd8 : 0xff4f, &end))
		return ct_fail(e, CT_EINPUT, "%s: the compressed picture has no end mark", what);
	if (coding == Coding::jpeg)
		return 0;
	state = tile_parts(b, end, &psot);
	if (state < 0)
		return ct_fail(e, CT_EINPUT, "%s: JPEG 2000 tile-part lengths are wrong", what);
	if (state > 0)
		std::fill_n(b.begin() + static_cast<ptrdiff_t>(psot), 4, 0);
	return 0;
}
