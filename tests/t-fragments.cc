/* Compressed pictures in fragments: whole, cut off, without an end, many, and the one that is
 * mended. SPDX-License-Identifier: Apache-2.0 */
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

enum { ROWS = 2, COLUMNS = 3, PIXELS = 6 }; /* of a picture, 2 bytes each */

/* A JPEG stream: its header, of so many rows, columns and bits, and what is coded. */
static Bytes jpeg(const Bytes &coded, unsigned char rows = ROWS, unsigned char columns = COLUMNS,
	unsigned char bits = 16, unsigned char mark = 0xc3)
{
	return Bytes{0xff, 0xd8, 0xff, 0xe0, 0, 4, 0xff, 0xd9, /* what looks like an end is none */
		       0xff, mark, 0, 11, bits, 0, rows, 0, columns, 1, 1, 0x11, 0, 0xff, 0xda, 0,
		       8, 1, 1, 0, 1, 0, 0} +
	       coded;
}

/* 0 and the streams to decode, one after another, in *streams; or the code of the failure. */
static int check(const char *syntax, const Bytes &picture, const char *word = "",
	Bytes *streams = nullptr, size_t frames = 1)
{
	const Bytes file = Bytes(OFFSET, 0x11) + picture;
	const Coding coding = coding_of(syntax);
	std::vector<Parts> list;
	Bytes all;
	unsigned bits;
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
			rc = check_jpeg(one, coding, {ROWS, COLUMNS, 1, 16}, &bits, path, &err);
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
	const Bytes whole = jpeg({1, 2, 0xff, 0xd9}), least = jpeg({0xff, 0xd9});
	const Bytes half1 = jpeg({1, 0xff}), half2 = {0xd9, 0, 0};
	int good = 0, cut = 0, none = 0;

	for (const char *s : syntaxes) {
		good += check(s, table + item(whole) + end) == 0;
		good += check(s, table + item(half1) + item({}) + item(half2) + end) == 0;
		good += check(s, table + item(least) + end + Bytes{9, 9}) == 0;
		cut += check(s, table + item(whole), "truncated") == CT_EINPUT;
		cut += check(s, item(whole) + end, "truncated") == CT_EINPUT; /* as the table */
		cut += check(s, table + item(whole) + Bytes{1, 2, 3, 4, 5, 6, 7, 8} + end,
			       "truncated") == CT_EINPUT;
		none += check(s, table + item(jpeg({1, 2})) + end, "no end mark") == CT_EINPUT;
		none += check(s, table + item({0xff, 0xd7, 1, 0xff, 0xd9}) + end,
				"does not begin as JPEG") == CT_EINPUT;
		none += check(s, table + item({0xff, 0xd8, 0xff, 0xd9}) + end, "no end mark") ==
			CT_EINPUT;
		none += check(s, table + item({0, 0, 0}) + end, "does not begin as JPEG") ==
			CT_EINPUT;
	}
	OK(good == 18, "JPEG, whole: %d", good);
	OK(cut == 18, "cut off: %d", cut);
	OK(none == 24, "without an end: %d", none);
}

/* What stands behind the end mark is no part of the picture, unless it is another one. */
static void padded()
{
	const Bytes whole = jpeg({1, 2, 0xff, 0xd9});
	const Bytes pads[] = {{0xff}, {0x37}, {0}, {0x37, 0xff, 0, 0x12, 0x99}, Bytes(9, 0)};
	int good = 0, two = 0;
	Bytes m;

	for (const char *s : syntaxes) {
		for (const Bytes &pad : pads)
			good += check(s, table + item(whole + pad) + end, "", &m) == 0 &&
				m == whole;
		two += check(s, table + item(whole + whole) + end, "followed by another") ==
		       CT_EINPUT;
		two += check(s, table + item(whole) + item(whole) + end, "2 compressed pictures") ==
		       CT_EINPUT;
	}
	OK(good == 30, "JPEG, bytes of any number and kind behind the end mark are cut off: %d",
		good);
	OK(two == 12, "two pictures where one is announced are refused: %d", two);
}

/* The picture's own header must agree with that of the file. */
static void sizes()
{
	const Bytes rest = {1, 2, 0xff, 0xd9};
	int wrong = 0, other = 0;

	for (const char *s : syntaxes) {
		wrong += check(s, table + item(jpeg(rest, 2 * ROWS)) + end, "3x4 pixels") ==
			 CT_EINPUT;
		wrong += check(s, table + item(jpeg(rest, ROWS, COLUMNS - 1)) + end,
				 "2x2 pixels") == CT_EINPUT;
		wrong += check(s, table + item(jpeg(rest, ROWS, COLUMNS, 17)) + end, "17 bits") ==
			 CT_EINPUT;
		other += check(s, table + item(jpeg(rest, ROWS, COLUMNS, 12, 0xf7)) + end) == 0;
		other += check(s, table + item(jpeg(rest, 0)) + end) == 0; /* told at its end */
	}
	OK(wrong == 18, "JPEG of another size or more bits than the header says is refused: %d",
		wrong);
	OK(other == 12, "JPEG-LS, fewer bits, and rows that are told later: %d", other);
}

/* The length of a fragment is believed up to the file's end, and not beyond. */
static void lengths()
{
	const Bytes whole = jpeg({1, 2, 0xff, 0xd9});
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
	OK(check(rle, table + item(coded({0xfb, 9}, literal)) + end, "", &got) == 0 && got == nines,
		"a run");
	OK(rc(coded({0xf0, 9}, literal)) == CT_EINPUT && rc(coded(all, {0xfa, 7})) == CT_EINPUT,
		"a run that makes more than the pixels is refused");
	OK(rc(coded(all + Bytes{0xfb, 7}, all)) == CT_EINPUT &&
			rc(coded(all, literal + Bytes{0, 5})) == CT_EINPUT,
		"more runs than the pixels need are refused");
	OK(rc(coded(all + Bytes{0, 128, 0}, literal + Bytes(9, 0))) == 0,
		"zeros behind the pixels are padding");
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
	const Bytes a = jpeg({1, 0xff, 0xd9}), b = jpeg({2, 3, 4}), c = {5, 6, 0xff, 0xd9},
		    run = coded({0xfb, 7}, {0xfb, 8}),
		    numbers = {8, 7, 8, 7, 8, 7, 8, 7, 8, 7, 8, 7};
	const Bytes cut = jpeg({9});
	const char *const lossless = syntaxes[3];
	Bytes got;

	OK(check(lossless, table + item(a) + item(b) + item(c) + end, "", &got, 2) == 0 &&
			got == a + b + c,
		"two pictures in three fragments");
	OK(check(lossless, table + item(a) + item(b) + item(c) + end, "2 compressed pictures", &got,
		   3) == CT_EINPUT,
		"and not three");
	OK(check(lossless, table + item(a) + item(cut) + item(a) + end, "no end mark", &got, 3) ==
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

static const Bytes head = {0xff, 0x4f, 0xff, 0x51, 0, 41, 0, 0, 0, 0, 0, COLUMNS + 1, 0, 0, 0,
	ROWS + 2, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 15,
	1, 1, 0xff, 0x52, 0, 2};
static const Bytes eoc = {0xff, 0xd9};

static void sound()
{
	const Bytes parts[] = {head + part(20, 6) + eoc, head + part(14, 0) + part(0, 9) + eoc};
	Bytes m;
	int good = 0;

	for (const char *s : j2k)
		for (const Bytes &b : parts)
			for (const Bytes &pad : {Bytes{}, Bytes{0xff}, Bytes{9, 0xff, 0, 7}})
				good += check(s, table + item(b + pad) + end, "", &m) == 0 &&
					m == b;
	OK(good == 30, "JPEG 2000, whole: %d, as they are, but for what stands behind them", good);
	Bytes other = head;

	other[11]++;
	OK(check(j2k[0], table + item(other + part(20, 6) + eoc) + end, "4x2 pixels") == CT_EINPUT,
		"JPEG 2000 of another size than the header says");
	OK(check(j2k[0], table + item(parts[0] + parts[0]) + end, "followed by another") ==
			CT_EINPUT,
		"two of them where one is announced");
	OK(check(j2k[0], table + item(head + part(13, 6) + eoc) + end, "tile-part") == CT_EINPUT,
		"a tile-part shorter than its header");
	OK(check(j2k[0], table + item(head + part(19, 6) + eoc) + end, "tile-part") == CT_EINPUT,
		"one that ends before the next");
	OK(check(j2k[0], table + item(head + eoc) + end, "tile-part") == CT_EINPUT, "none");
	OK(check(j2k[0], table + item(Bytes{0xff, 0x4e} + part(20, 6) + eoc) + end,
		   "does not begin as JPEG 2000") == CT_EINPUT,
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
	padded();
	sizes();
	lengths();
	run_lengths();
	many();
	sound();
	mended();
	unlink(path);
	return tap_done();
}
