/* Compressed pictures in fragments: whole, cut off, without an end, and the one that is mended. */
#include "config.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
extern "C" {
#include "tap.h"
}
#include "shim/fragments.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include <unistd.h>

using Bytes = std::vector<unsigned char>;

static char path[] = "/tmp/t-fragments-XXXXXX";

enum { OFFSET = 5 }; /* of the picture in the file */

static const char *const syntaxes[] = {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51",
	"1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.80",
	"1.2.840.10008.1.2.4.81"};
static const char *const j2k[] = {"1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.4.91",
	"1.2.840.10008.1.2.4.201", "1.2.840.10008.1.2.4.202", "1.2.840.10008.1.2.4.203"};
static const char *const rle = "1.2.840.10008.1.2.5";

static Bytes operator+(Bytes a, const Bytes &b)
{
	a.insert(a.end(), b.begin(), b.end());
	return a;
}

/* An item, or the delimiter at the end, of a sequence. */
static Bytes item(const Bytes &b, unsigned char tag = 0x00)
{
	const size_t n = b.size();

	return Bytes{0xfe, 0xff, tag, 0xe0, static_cast<unsigned char>(n),
		       static_cast<unsigned char>(n >> 8), 0, 0} +
	       b;
}

static const Bytes table = item({0, 0, 0, 0}), end = item({}, 0xdd);

/* 0 and the file to decode in *mended, or the code of the failure. */
static int check(
	const char *syntax, const Bytes &picture, const char *word = "", Bytes *mended = nullptr)
{
	const Bytes file = Bytes(OFFSET, 0x11) + picture;
	Mended m;
	int rc;

	std::ofstream(path, std::ios::binary)
		.write(reinterpret_cast<const char *>(file.data()),
			static_cast<std::streamsize>(file.size()));
	memset(&err, 0, sizeof err);
	rc = m.check(path, syntax, OFFSET, 1, &err);
	if (mended) {
		std::ifstream in(m.path(path), std::ios::binary);

		*mended = Bytes(
			(std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
		if (rc == 0 && m.path(path) == path)
			mended->clear();
	}
	if (rc)
		return strstr(err.msg, path) && strstr(err.msg, word) ? static_cast<int>(err.code)
								      : -1;
	return 0;
}

static void frames()
{
	const Bytes whole = {0xff, 0xd8, 1, 2, 0xff, 0xd9}, least = {0xff, 0xd8, 0xff, 0xd9};
	const Bytes half1 = {0xff, 0xd8, 1, 0xff}, half2 = {0xd9, 0, 0};
	int good = 0, cut = 0, none = 0;

	for (const char *s : syntaxes) {
		good += check(s, table + item(whole) + end) == 0;
		good += check(s, table + item(half1) + item({}) + item(half2) + end) == 0;
		good += check(s, table + item(least) + end + Bytes{9, 9}) == 0;
		cut += check(s, table + item(whole), "truncated") == CT_EINPUT;
		cut += check(s, item(whole) + end, "truncated") == CT_EINPUT; /* as the table */
		cut += check(s, table + item(whole) + Bytes{1, 2, 3, 4, 5, 6, 7, 8} + end,
			       "truncated") == CT_EINPUT;
		none += check(s, table + item({0xff, 0xd8, 1, 2}) + end, "no end mark") ==
			CT_EINPUT;
		none += check(s, table + item({0xff, 0xd7, 1, 0xff, 0xd9}) + end, "no end mark") ==
			CT_EINPUT;
		none += check(s, table + item({0xff, 0xd8, 0xd9}) + end, "no end mark") ==
			CT_EINPUT;
		none += check(s, table + item({0, 0, 0}) + end, "no end mark") == CT_EINPUT;
	}
	OK(good == 18, "JPEG, whole: %d", good);
	OK(cut == 18, "cut off: %d", cut);
	OK(none == 24, "without an end: %d", none);
}

/* The length of a fragment is believed up to the file's end, and not beyond. */
static void lengths()
{
	const Bytes whole = {0xff, 0xd8, 1, 2, 0xff, 0xd9};
	Bytes long_one = table + item(whole) + end;

	long_one[table.size() + 4] += 8;
	OK(check(syntaxes[0], long_one, "truncated") == CT_EINPUT, "a fragment over the end mark");
	long_one[table.size() + 4]++;
	OK(check(syntaxes[0], long_one, "truncated") == CT_EINPUT, "and over the end of the file");
	long_one[table.size() + 7] = 0xff;
	OK(check(syntaxes[0], long_one, "truncated") == CT_EINPUT, "by far");
	OK(check(syntaxes[0], table + end, "truncated") == CT_EINPUT, "no fragment");
	OK(check(syntaxes[0], {}, "truncated") == CT_EINPUT, "nothing");
	OK(check(rle, table + item({1, 2}) + end) == 0, "RLE has no marks");
	OK(check(rle, table + item({1, 2}), "truncated") == CT_EINPUT, "but an end");
	OK(check("1.2.840.10008.1.2.1", {}) == 0 && check("1.2.840.10008.1.2.4.500", {}) == 0 &&
			check("2.2.840.10008.1.2.4.50", {}) == 0,
		"others are not looked at");
}

/* A tile-part of `extra` bytes behind its header; the length that it states. */
static Bytes part(unsigned size, unsigned extra)
{
	return Bytes{0xff, 0x90, 0, 10, 0, 0, static_cast<unsigned char>(size >> 24),
		       static_cast<unsigned char>(size >> 16),
		       static_cast<unsigned char>(size >> 8), static_cast<unsigned char>(size), 0,
		       1, 0xff, 0x93} +
	       Bytes(extra, 0x55);
}

static const Bytes head = {0xff, 0x4f, 0xff, 0x51, 0, 6, 1, 2, 3, 4, 0xff, 0x52, 0, 2};
static const Bytes eoc = {0xff, 0xd9};

static void sound()
{
	const Bytes padded = head + part(20, 6) + eoc + Bytes(3, 0);
	Bytes m;
	int good = 0;

	for (const char *s : j2k) {
		good += check(s, table + item(head + part(20, 6) + eoc) + end, "", &m) == 0 &&
			m.empty();
		good += check(s, table + item(head + part(14, 0) + part(0, 9) + eoc) + end, "",
				&m) == 0 &&
			m.empty();
		good += check(s, table + item(padded) + end, "", &m) == 0 && m.empty();
	}
	OK(good == 15, "JPEG 2000, whole: %d, as they are", good);
	OK(check(j2k[0], table + item(head + part(13, 6) + eoc) + end, "tile-part") == CT_EINPUT,
		"a tile-part shorter than its header");
	OK(check(j2k[0], table + item(head + part(19, 6) + eoc) + end, "tile-part") == CT_EINPUT,
		"one that ends before the next");
	OK(check(j2k[0], table + item(head + eoc) + end, "tile-part") == CT_EINPUT, "none");
	OK(check(j2k[0], table + item(Bytes{0xff, 0x4e} + part(20, 6) + eoc) + end,
		   "no end mark") == CT_EINPUT,
		"another beginning");
}

/* Psot of the last part runs past the end: 0 instead, wherever its bytes lie in the fragments. */
static void mended()
{
	const unsigned too_long[] = {21, 300, 0x10203040, 0xffffffff};

	for (unsigned size : too_long) {
		const Bytes first = head + part(15, 1);
		const Bytes bad = first + part(size, 6) + eoc, want = first + part(0, 6) + eoc;
		int same = 0, cuts = 0;

		for (size_t cut = 1; cut < bad.size(); cut++, cuts++) {
			const auto at = static_cast<ptrdiff_t>(cut);
			const auto split = [&](const Bytes &b) {
				return Bytes(OFFSET, 0x11) + table +
				       item(Bytes(b.begin(), b.begin() + at)) +
				       item(Bytes(b.begin() + at, b.end())) + end;
			};
			const Bytes file = split(bad);
			Bytes m;

			same += check(j2k[cut % 5], Bytes(file.begin() + OFFSET, file.end()), "",
					&m) == 0 &&
				m == split(want);
		}
		OK(same == cuts, "a length of %u is mended: %d of %d", size, same, cuts);
	}
}

int main()
{
	const int fd = mkstemp(path);

	if (fd < 0)
		return 99;
	close(fd);
	frames();
	lengths();
	sound();
	mended();
	unlink(path);
	return tap_done();
}
