/* fragments.cc: see fragments.h. SPDX-License-Identifier: Apache-2.0 */
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

enum { SOI = 0xffd8, SOS = 0xffda, SOC = 0xff4f, SIZ = 0xff51, SOT = 0xff90, EOI = 0xffd9 };

/* The first FF D9 from `at` on, or 0. It cannot stand among what is coded: behind FF, that has
 * other numbers there. */
uint64_t find_end(const Bytes &b, uint64_t at)
{
	for (; at + 2 <= b.size(); at++)
		if (be(b, at, 2) == EOI)
			return at;
	return 0;
}

/* Is the marker at the head of a JPEG picture one that holds its size? */
bool is_frame(unsigned mark)
{
	return mark == 0xfff7 || (mark >= 0xffc0 && mark <= 0xffcf && mark != 0xffc4 &&
					 mark != 0xffc8 && mark != 0xffcc);
}

/* The segments of a JPEG stream up to its end mark, at *end. */
bool follow_jpeg(const Bytes &b, Frame *is, uint64_t *end)
{
	uint64_t at = 2;

	while (at + 4 <= b.size() && be(b, at, 2) != SOS) {
		const unsigned mark = be(b, at, 2), size = be(b, at + 2, 2);

		if (mark == 0xffff) { /* FF may be repeated before a marker */
			at++;
			continue;
		}
		if (mark < 0xff00 || size < 2)
			return false;
		if (is_frame(mark) && size >= 8 && at + 10 <= b.size())
			*is = {be(b, at + 5, 2), be(b, at + 7, 2), b[at + 9], b[at + 4]};
		at += 2 + size;
	}
	*end = at + 4 <= b.size() && be(b, at, 2) == SOS ? find_end(b, at) : 0;
	return *end > 0;
}

/* The tile-parts of a JPEG 2000 stream up to its end mark, at *end. 1 if the length at *psot of the
 * last one runs past the end; -1: lost the thread, or there is none. */
int follow_jpeg2000(const Bytes &b, Frame *is, uint64_t *end, uint64_t *psot)
{
	uint64_t at = 2;

	*end = *psot = 0;
	while (at + 4 <= b.size() && be(b, at, 2) != SOT) { /* the main header */
		if (be(b, at, 2) == SIZ && at + 41 <= b.size())
			*is = {be(b, at + 10, 4) - be(b, at + 18, 4),
				be(b, at + 6, 4) - be(b, at + 14, 4), be(b, at + 38, 2),
				(b[at + 40] & 0x7fu) + 1};
		at += 2 + std::max(be(b, at + 2, 2), 2u);
	}
	while (at + 12 <= b.size() && be(b, at, 2) == SOT) {
		const uint64_t size = be(b, at + 6, 4);

		*psot = at + 6;
		if (size == 0 || size > b.size() - 2 - at) {
			*end = find_end(b, at + 12);
			return *end == 0 ? -1 : size > 0;
		}
		if (size < 14)
			return -1;
		at += size;
	}
	*end = at;
	if (*psot == 0 || (at + 2 <= b.size() && be(b, at, 2) == EOI))
		return *psot > 0 ? 0 : -1;
	*end = find_end(b, *psot + 6);
	return *end > 0 && *end < at ? 1 : -1; /* into what stands behind it */
}

/* What stands behind the end of a picture: padding, not another picture. */
bool another_begins(const Bytes &b, uint64_t at, unsigned mark)
{
	for (; at + 3 <= b.size(); at++)
		if (be(b, at, 2) == mark && b[at + 2] == 0xff)
			return true;
	return false;
}

/* Behind what makes all numbers of a segment: nothing, or padding. */
bool is_padding(const unsigned char *p, const unsigned char *end)
{
	return std::all_of(p, end, [](unsigned char c) { return c == 0 || c == 128; });
}

/* The n bytes of a run-length coded segment, each `step` behind the one before; false if it makes
 * fewer, or more. */
bool unpack(
	const unsigned char *p, const unsigned char *end, size_t n, unsigned char *out, size_t step)
{
	size_t at = 0;

	while (at < n && p < end) {
		const size_t code = *p++, bytes = code < 128 ? code + 1 : 1,
			     made = code < 128 ? bytes : 257 - code;

		if (code == 128)
			continue;
		if (bytes > static_cast<size_t>(end - p) || made > n - at)
			return false;
		for (size_t i = 0; i < made; i++)
			out[step * at++] = p[code < 128 ? i : 0];
		p += bytes;
	}
	return at == n && is_padding(p, end);
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
	if (syntax == "1.2.840.113619.5.2") /* GE's: all is little-endian but the pixels */
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
			/* of RLE, one picture may lie in several */
			if (list.empty() || ((frames > 1 || coding != Coding::rle) &&
						    begins(head + 8, n, coding)))
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

int check_jpeg(
	Bytes &b, Coding coding, const Frame &want, unsigned *bits, const char *what, ct_err *e)
{
	const unsigned first = coding == Coding::jpeg ? SOI : SOC;
	uint64_t end = 0, psot = 0;
	Frame is = {0, 0, 0, 0};
	int state = -1;

	*bits = 0;
	if (b.size() < 4 || be(b, 0, 2) != first)
		return ct_fail(e, CT_EINPUT, "%s: the compressed picture does not begin as %s",
			what, coding == Coding::jpeg ? "JPEG" : "JPEG 2000");
	if (coding == Coding::jpeg)
		state = follow_jpeg(b, &is, &end) ? 0 : -1;
	else
		state = follow_jpeg2000(b, &is, &end, &psot);
	if (state < 0)
		return ct_fail(e, CT_EINPUT,
			coding == Coding::jpeg
				? "%s: the compressed picture has no end mark"
				: "%s: JPEG 2000 tile-part lengths are wrong, or there is no end mark",
			what);
	if (another_begins(b, end + 2, first))
		return ct_fail(e, CT_EINPUT,
			"%s: a compressed picture is followed by another: more than NumberOfFrames",
			what);
	if ((is.rows != 0 && is.rows != want.rows) || is.columns != want.columns ||
		is.samples != want.samples)
		return ct_fail(e, CT_EINPUT,
			"%s: the compressed picture has %zux%zu pixels of %u samples, but Columns, Rows and "
			"SamplesPerPixel are %zux%zu and %u",
			what, is.columns, is.rows, is.samples, want.columns, want.rows,
			want.samples);
	if (is.bits > want.bits)
		return ct_fail(e, CT_EINPUT,
			"%s: the compressed picture has numbers of %u bits, but BitsAllocated is %u",
			what, is.bits, want.bits);
	b.resize(end + 2);
	if (state > 0)
		std::fill_n(b.begin() + static_cast<ptrdiff_t>(psot), 4, 0);
	*bits = is.bits;
	return 0;
}
