/* outline.cc: see outline.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/outline.h"

#include <vtkDICOMDictionary.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

namespace
{

/* A report nests to 20; a dose report, to 10. */
enum { DEEPEST = 64, MOST_UNSORTED = 1000, LONGEST_SAID = 256 };

const uint64_t endless = UINT64_MAX;

enum : uint32_t {
	ITEM = 0xfffee000,
	ITEM_END = 0xfffee00d,
	SEQUENCE_END = 0xfffee0dd,
	TRANSFER_SYNTAX = 0x00020010
};

const char *const implicit_little = "1.2.840.10008.1.2",
		  *const explicit_little = "1.2.840.10008.1.2.1",
		  *const explicit_big = "1.2.840.10008.1.2.2";

uint32_t number(const unsigned char *p, int n, bool big)
{
	uint32_t u = 0;

	for (int i = 0; i < n; i++)
		u |= static_cast<uint32_t>(p[big ? n - 1 - i : i]) << 8 * i;
	return u;
}

uint32_t tag_of(const unsigned char *p, bool big)
{
	return number(p, 2, big) << 16 | number(p + 2, 2, big);
}

bool is_one_of(const unsigned char *vr, const char *list)
{
	for (; *list; list += 3)
		if (std::memcmp(vr, list, 2) == 0)
			return true;
	return false;
}

/* Of the two bytes where a VR is: one whose length has 16 bits, or 32, or none that is known. */
bool is_short(const unsigned char *vr)
{
	return is_one_of(vr, "AE AS AT CS DA DS DT FD FL IS LO LT PN SH SL SS ST TM UI UL US ");
}

bool is_long(const unsigned char *vr)
{
	return is_one_of(vr, "OB OD OF OL OV OW SQ SV UC UN UR UT UV ");
}

struct Element {
	uint32_t tag, head, length; /* bytes before its value, and of that */
	bool is_explicit;
	char vr[2];
};

/* From at least 12 bytes. */
Element element(const unsigned char *p, bool big, bool implicit)
{
	Element x = {tag_of(p, big), 8, number(p + 4, 4, big), false, {0, 0}};
	const unsigned char *vr = p + 4;
	const auto printable = [](unsigned char c) { return c >= 0x20 && c < 0x7f; };

	if (x.tag >> 16 == 0xfffe)
		return x;
	bool wide = is_long(vr);
	x.is_explicit = !implicit && (wide || is_short(vr));
	if (!implicit && !x.is_explicit && printable(vr[0]) && printable(vr[1])) {
		x.is_explicit = true; /* as the parser takes it: by its dictionary */
		wide = vtkDICOMDictionary::FindDictEntry(vtkDICOMTag(x.tag >> 16, x.tag & 0xffff))
			       .GetVR()
			       .HasLongVL() ||
		       !vtkDICOMDictionary::FindDictEntry(vtkDICOMTag(x.tag >> 16, x.tag & 0xffff))
				.IsValid();
	}
	if (!x.is_explicit) {
		if (implicit && (x.tag & 0xffff) == 0)
			x.length = 4; /* of a group's length; some are wrong */
		return x;
	}
	std::memcpy(x.vr, vr, 2);
	x.head = wide ? 12 : 8;
	x.length = wide ? number(p + 8, 4, big) : number(p + 6, 2, big);
	return x;
}

/* Bytes of a file, from the front to the back. */
class Window
{
      public:
	explicit Window(const char *path) : fd(open(path, O_RDONLY | O_CLOEXEC))
	{
		const off_t end = fd < 0 ? -1 : lseek(fd, 0, SEEK_END);

		size = end < 0 ? 0 : static_cast<uint64_t>(end);
	}
	Window(const Window &) = delete;
	Window &operator=(const Window &) = delete;
	~Window()
	{
		if (fd >= 0)
			close(fd);
	}
	/* n bytes, at most as many as it holds, from `at`, and zeros behind the end of the file;
	 * what was got before may be gone. */
	const unsigned char *get(uint64_t at, size_t n)
	{
		if (at < from || at + n > from + held) {
			ssize_t got = 0;

			std::fill(std::begin(bytes), std::end(bytes), 0);
			from = at;
			held = sizeof bytes;
			for (size_t k = 0; k < held; k += static_cast<size_t>(got)) {
				got = pread(fd, bytes + k, held - k, static_cast<off_t>(at + k));
				if (got <= 0)
					break;
			}
		}
		return bytes + (at - from);
	}
	uint64_t size = 0;

      private:
	int fd;
	uint64_t from = 0;
	size_t held = 0;
	unsigned char bytes[1 << 14];
};

/* Where the elements begin that such a file begins with: behind its magic word. */
size_t first_element(const unsigned char *p, size_t n)
{
	if (n >= 140 && std::memcmp(p + 128, "DICM", 4) == 0)
		return 132;
	return n >= 12 && std::memcmp(p, "DICM", 4) == 0 ? 4 : 0;
}

bool is_big(const unsigned char *p)
{
	return p[0] == 0 && p[1] != 0;
}

/* Without a VR, lengths are all that tells an element from noise. */
bool plausible(const Element &x)
{
	const uint32_t group = x.tag >> 16;

	return group > 0 && group <= 0x28 && group % 2 == 0 &&
	       (x.is_explicit || x.length <= 1024 || x.length == NO_LENGTH);
}

/* The walk through the data set. */
class Walk
{
      public:
	Walk(Window &w, Outline &o) : file(w), out(o), big(o.syntax == explicit_big)
	{
		/* the last one is GE's, with numbers of pixels turned */
		for (const char *s : {implicit_little, "1.2.840.10008.1.20", "1.2.840.113619.5.2"})
			implicit = implicit || o.syntax == s;
	}
	void run()
	{
		at = out.begin;
		while (out.trouble.empty() && at + 8 <= file.size)
			step();
	}

      private:
	struct Level {
		uint64_t end; /* at the latest */
		bool item, implicit, counts;
		uint32_t highest;                     /* tag */
		std::map<uint32_t, std::string> said; /* VR and value of a tag */
	};

	void step()
	{
		while (!level.empty() && level.back().end <= at)
			leave();
		const bool now = level.empty() ? implicit : level.back().implicit;
		const Element x = element(file.get(at, 12), big, now);

		if (x.tag >> 16 == 0xfffe)
			return mark(x);
		at += x.head;
		sort(x.tag);
		if (level.empty() && (x.tag == PIXEL_DATA || x.tag == FLOAT_PIXEL_DATA ||
					     x.tag == DOUBLE_PIXEL_DATA))
			see_pixels(x);
		else
			compare(x);
		const bool bytes = x.vr[0] == 'O' || (x.tag == PIXEL_DATA && x.vr[0] == 0);
		if (x.length == NO_LENGTH)
			return bytes ? skip_fragments(now)
				     : enter(endless, now || is(x, "UN"), x.tag);
		if (is(x, "SQ") || ((!x.is_explicit || is(x, "UN")) && holds_item(x)))
			return enter(at + x.length, now, x.tag);
		at += x.length;
	}
	static bool is(const Element &x, const char *vr)
	{
		return std::memcmp(x.vr, vr, 2) == 0;
	}
	bool holds_item(const Element &x)
	{
		return x.length >= 8 && tag_of(file.get(at, 8), big) == ITEM;
	}
	/* The pixels of the file. What lies behind them may be anything; a second one that fits
	 * into the file is meant. */
	void see_pixels(const Element &x)
	{
		const bool fits = x.length == NO_LENGTH || at + x.length <= file.size;

		if (out.pixel_data != 0) {
			if (fits && x.is_explicit == pixels_explicit)
				out.trouble = "it has two elements of pixels: which one is meant?";
			return;
		}
		out.pixel_data = x.tag;
		out.pixels = at;
		out.length = x.length;
		pixels_explicit = x.is_explicit;
		if (fits && x.length != NO_LENGTH && x.length >= 2)
			out.word_of_zeros = number(file.get(at + x.length - 2, 2), 2, false) == 0;
	}
	/* Is it in a group that says what, whose and where a picture is, and what its numbers mean?
	 */
	static bool counts(uint32_t tag)
	{
		static const uint32_t groups[] = {0x8, 0x10, 0x18, 0x20, 0x28, 0x5200};

		return (tag & 0xffff) != 0 && std::find(std::begin(groups), std::end(groups),
						      tag >> 16) != std::end(groups);
	}
	/* What counts is said once in an item, or twice the same: programs take the first, or the
	 * last. What is behind the pixels may be anything; with that tag and VR it is meant. */
	void compare(const Element &x)
	{
		auto &said = level.empty() ? top : level.back().said;

		if (!counts(x.tag) ||
			(!level.empty() && !(level.back().item && level.back().counts)))
			return;
		std::string text(x.vr, x.vr + 2);
		if (x.length != NO_LENGTH && at + x.length > file.size)
			return;
		if (x.length > LONGEST_SAID)
			text += std::to_string(at); /* not compared: its place tells them apart */
		else
			text.append(
				reinterpret_cast<const char *>(file.get(at, x.length)), x.length);
		text.erase(text.find_last_not_of(std::string(" \0", 2)) + 1);
		const auto before = said.emplace(x.tag, text);
		if (before.second || before.first->second == text)
			return;
		if (out.pixel_data != 0 && before.first->second.compare(0, 2, text, 0, 2) != 0)
			return;
		char words[80];
		std::snprintf(words, sizeof words,
			"element (%04x,%04x) is said twice, and not the same", x.tag >> 16,
			x.tag & 0xffff);
		out.trouble = words;
	}
	/* Elements ascend, in an item and in the whole. */
	void sort(uint32_t tag)
	{
		uint32_t &last = level.empty() ? highest : level.back().highest;

		if (tag < last && ++unsorted > MOST_UNSORTED)
			out.trouble = "more than " + std::to_string(MOST_UNSORTED) +
				      " of its elements are out of order";
		last = std::max(last, tag);
	}
	/* Of an item or a sequence. */
	void mark(const Element &x)
	{
		const uint64_t begin = at += 8;

		if (x.tag == ITEM && level.empty())
			at += x.length == NO_LENGTH ? 0 : x.length;
		else if (x.tag == ITEM)
			push(x.length == NO_LENGTH ? endless : begin + x.length, true,
				level.back().implicit, level.back().counts);
		else if (!level.empty() && (x.tag == ITEM_END || x.tag == SEQUENCE_END)) {
			if (level.back().item && x.tag == SEQUENCE_END)
				leave(); /* the end of an item is missing */
			if (!level.empty() && level.back().item == (x.tag == ITEM_END))
				leave();
		}
	}
	void enter(uint64_t end, bool without_vr, uint32_t tag)
	{
		const bool count =
			counts(tag) && tag >> 16 > 0x10 && (level.empty() || level.back().counts);

		if (++deep > DEEPEST)
			out.trouble = "its sequences are nested more than " +
				      std::to_string(DEEPEST) + " deep";
		push(end, false, without_vr, count);
	}
	void push(uint64_t end, bool item, bool without_vr, bool count)
	{
		if (!level.empty())
			end = std::min(end, level.back().end);
		if (level.size() > 4 * DEEPEST) /* items in items, without a sequence */
			out.trouble = "its items are nested in each other";
		level.push_back({end, item, without_vr, count, 0, {}});
	}
	void leave()
	{
		deep -= !level.back().item;
		level.pop_back();
	}
	/* Bytes in pieces, which end with a mark. */
	void skip_fragments(bool without_vr)
	{
		while (at + 8 <= file.size) {
			const unsigned char *p = file.get(at, 8);
			const uint32_t tag = tag_of(p, big), n = number(p + 4, 4, big);

			if (tag >> 16 != 0xfffe)
				return;
			if (tag == ITEM && n == NO_LENGTH) /* no piece; parsers follow it */
				return enter(endless, without_vr, 0);
			at += 8;
			if (tag != ITEM)
				return;
			at += n;
		}
	}

	Window &file;
	Outline &out;
	const bool big;
	bool implicit = false;
	uint64_t at = 0;
	std::vector<Level> level;
	size_t deep = 0, unsorted = 0; /* sequences, elements */
	uint32_t highest = 0;
	bool pixels_explicit = false;
	std::map<uint32_t, std::string> top; /* VR and value of a tag outside of sequences */
};

/* The group of the file's meta information: it says itself how long it is, but not always rightly.
 */
void walk_meta(Window &w, Outline &o)
{
	while (o.begin + 12 <= w.size) {
		const Element x = element(w.get(o.begin, 12), false, false);

		if (x.tag >> 16 != 2 || x.length > w.size - o.begin - x.head)
			return;
		if (x.tag == TRANSFER_SYNTAX && o.uid == 0 && x.length <= 64) {
			const char *text =
				reinterpret_cast<const char *>(w.get(o.begin + x.head, x.length));

			o.uid = o.begin + x.head;
			o.syntax.assign(text, x.length);
			o.syntax.erase(o.syntax.find_last_not_of(std::string(" \0", 2)) + 1);
		}
		o.begin += x.head + x.length;
	}
}

} // namespace

bool begins_as_dicom(const unsigned char *p, size_t n, uint64_t size)
{
	const size_t at = first_element(p, n);

	if (size < 132 || n < at + 24)
		return false;
	const bool big = is_big(p + at);
	const Element x = element(p + at, big, false);
	const uint64_t next = at + x.head + x.length;

	if (big && !x.is_explicit)
		return false;
	if (at > 0 && (x.tag >> 16 == 2 || (x.tag >> 16 == 8 && plausible(x))))
		return true;
	if (!plausible(x) || (x.tag >> 16 != 2 && x.tag >> 16 != 8) || next + 12 > n)
		return false;
	const Element y = element(p + next, big, false);
	return plausible(y) && y.tag > x.tag &&
	       (y.is_explicit == x.is_explicit || x.tag >> 16 == 2);
}

Outline outline_of(const char *path)
{
	Window w(path);
	Outline o;
	const unsigned char *p = w.get(0, 4096);
	const size_t n = static_cast<size_t>(std::min<uint64_t>(w.size, 4096));

	o.dicom = begins_as_dicom(p, n, w.size);
	if (!o.dicom)
		return o;
	o.begin = first_element(p, n);
	walk_meta(w, o);
	if (o.syntax.empty() && o.begin + 12 <= w.size) {
		p = w.get(o.begin, 12);
		o.syntax = is_big(p)                              ? explicit_big
			   : element(p, false, false).is_explicit ? explicit_little
								  : implicit_little;
	}
	if (o.syntax != "1.2.840.10008.1.2.1.99")
		Walk(w, o).run();
	return o;
}
