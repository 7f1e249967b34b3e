/* Compressed pictures in fragments: whole, cut off, without an end, many, and the one that is
 * mended. */
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

#include <fcntl.h>
#include <unistd.h>

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

enum { PIXELS = 6 }; /* of a picture, 2 bytes each */

/* 0 and the streams to decode, one after another, in *streams; or the code of the failure. */
static int check(const char *syntax, const Bytes &picture, const char *word = "",
	Bytes *streams = nullptr, size_t frames = 1)
{
	const Bytes file = Bytes(OFFSET, 0x11) + picture;
	const Coding coding = coding_of(syntax);
	std::vector<Parts> list;
	Bytes all;
	int rc, fd;

	std::ofstream(path, std::ios::binary)
		.write(reinterpret_cast<const char *>(file.data()),
			static_cast<std::streamsize>(file.size()));
	memset(&err, 0, sizeof err);
	fd = open(path, O_RDONLY);
	rc = list_pictures(list, fd, OFFSET, coding, frames, path, &err);
	close(fd);
	for (size_t k = 0; k < list.size() && rc == 0; k++) {
		Bytes one;

		for (const Part &p : list[k])
			one.insert(one.end(), file.begin() + static_cast<ptrdiff_t>(p.from),
				file.begin() + static_cast<ptrdiff_t>(p.from + p.size));
		if (coding == Coding::rle) {
			Bytes numbers;

			rc = unpack_rle(numbers, one, PIXELS, 2, path, &err);
			one = rc ? Bytes() : numbers;
		} else
			rc = check_jpeg(one, coding, path, &err);
		all = all + one;
	}
	if (streams)
		*streams = all;
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
	int known = 0;

	for (const char *name : syntaxes)
		known += coding_of(name) == Coding::jpeg;
	for (const char *name : j2k)
		known += coding_of(name) == Coding::jpeg2000;
	OK(known == 11 && coding_of(rle) == Coding::rle &&
			coding_of("1.2.840.10008.1.2") == Coding::plain &&
			coding_of("1.2.840.10008.1.2.1") == Coding::plain &&
			coding_of("1.2.840.10008.1.2.2") == Coding::big_endian,
		"what is read");
	OK(coding_of("1.2.840.10008.1.2.4.500") == Coding::other &&
			coding_of("2.2.840.10008.1.2.4.50") == Coding::other &&
			coding_of("1.2.840.10008.1.2.4") == Coding::other &&
			coding_of("") == Coding::other,
		"and what is not");
}

/* Run-length code of two segments. */
static Bytes coded(const Bytes &a, const Bytes &b, unsigned char count = 2)
{
	Bytes head(64, 0);

	head[0] = count;
	head[4] = 64;
	head[8] = static_cast<unsigned char>(64 + a.size());
	return head + a + b;
}

static void run_lengths()
{
	const Bytes all = {0xfb, 7}, literal = {5, 1, 2, 3, 4, 5, 6},
		    two = {0xfe, 7, 128, 2, 1, 2, 3};
	const auto rc = [](const Bytes &b) {
		return check(rle, table + item(b) + end, "damaged: its run-length code");
	};
	const Bytes mixed = {1, 7, 2, 7, 3, 7, 4, 1, 5, 2, 6, 3},
		    nines = {1, 9, 2, 9, 3, 9, 4, 9, 5, 9, 6, 9};
	Bytes far = coded(all, all), back = far, got;

	OK(check(rle, table + item(coded(two, literal)) + end, "", &got) == 0 && got == mixed,
		"RLE, the upper bytes and the lower ones");
	OK(check(rle, table + item(coded({0xf0, 9}, literal)) + end, "", &got) == 0 && got == nines,
		"a run that is too long is cut");
	OK(rc(coded(all, literal + Bytes{0})) == 0, "and padded");
	OK(rc(coded(all, {5, 1, 2, 3, 4, 5})) == CT_EINPUT, "numbers that are cut off");
	OK(rc(coded({0xfc, 7}, all)) == CT_EINPUT, "a run too few in the first segment");
	OK(rc(coded(all, {0xfc, 7})) == CT_EINPUT, "in the second");
	OK(rc(coded(all, {0xfb})) == CT_EINPUT, "a run of nothing");
	OK(rc(coded(all, all, 1)) == CT_EINPUT && rc(coded(all, all, 3)) == CT_EINPUT,
		"other segments than a pixel has bytes");
	far[8] = 200;
	back[8] = 63;
	OK(rc(far) == CT_EINPUT && rc(back) == CT_EINPUT && rc({1, 2}) == CT_EINPUT,
		"segments that begin elsewhere");
	OK(check(rle, table + item(coded(all, all)), "truncated") == CT_EINPUT, "no end");
}

/* Fragments as pictures. */
static void many()
{
	const Bytes a = {0xff, 0xd8, 0xff, 1, 0xff, 0xd9}, b = {0xff, 0xd8, 0xff, 2, 3, 4},
		    c = {5, 6, 0xff, 0xd9}, run = coded({0xfb, 7}, {0xfb, 8}),
		    numbers = {8, 7, 8, 7, 8, 7, 8, 7, 8, 7, 8, 7};
	const Bytes cut = {0xff, 0xd8, 0xff, 9};
	const char *const jpeg = syntaxes[3];
	Bytes got;

	OK(check(jpeg, table + item(a) + item(b) + item(c) + end, "", &got, 2) == 0 &&
			got == a + b + c,
		"two pictures in three fragments");
	OK(check(jpeg, table + item(a) + item(b) + item(c) + end, "2 compressed pictures", &got,
		   3) == CT_EINPUT,
		"and not three");
	OK(check(jpeg, table + item(a) + item(cut) + item(a) + end, "no end mark", &got, 3) ==
			CT_EINPUT,
		"one of them cut off");
	OK(check(rle, table + item(run) + item(run) + end, "", &got, 2) == 0 &&
			got == numbers + numbers,
		"a fragment of RLE is a picture");
	OK(check(rle, table + item(run) + item(run) + end, "2 compressed pictures", &got, 3) ==
			CT_EINPUT,
		"and only that");
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
	const Bytes parts[] = {head + part(20, 6) + eoc, head + part(14, 0) + part(0, 9) + eoc,
		head + part(20, 6) + eoc + Bytes(3, 0)};
	Bytes m;
	int good = 0;

	for (const char *s : j2k)
		for (const Bytes &b : parts)
			good += check(s, table + item(b) + end, "", &m) == 0 && m == b;
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
			const Bytes file = table + item(Bytes(bad.begin(), bad.begin() + at)) +
					   item(Bytes(bad.begin() + at, bad.end())) + end;
			Bytes m;

			same += check(j2k[cut % 5], file, "", &m) == 0 && m == want;
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
	run_lengths();
	many();
	sound();
	mended();
	unlink(path);
	return tap_done();
}
