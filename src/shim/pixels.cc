/* pixels.cc: see pixels.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/guard.h"
#include "shim/pixels.h"
#include "shim/outline.h"

#include <vtkDICOMCompiler.h>
#include <vtkDICOMDictionary.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMReader.h>
#include <vtkDICOMUtilities.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace
{

/* vtk-dicom does not look at what its decoder answers: a picture that was given up on is memory
 * as it was. So the buffer is painted first, and paint that is all there is left is a failure. */
class Reader : public vtkDICOMReader
{
      public:
	static Reader *New();
	vtkTypeMacro(Reader, vtkDICOMReader);
	bool undecoded = false;

      protected:
	bool ReadFileDelegated(
		const char *path, int index, unsigned char *buffer, vtkIdType size) override
	{
		const unsigned char paint = 0xa5;

		std::fill_n(buffer, size, paint);
		if (!vtkDICOMReader::ReadFileDelegated(path, index, buffer, size))
			undecoded = true;
		else
			undecoded = std::all_of(
				buffer, buffer + size, [](unsigned char c) { return c == paint; });
		return !undecoded;
	}
};
vtkStandardNewMacro(Reader);

/* The numbers of the one grey picture of a file. */
int decode(const char *path, const ct_slice &s, Bytes &out, ct_err *e)
{
	vtkNew<Reader> r;
	vtkImageData *image;
	int dims[3];

	r->SetFileName(path);
	r->AutoRescaleOff();
	r->SortingOff();
	r->SetMemoryRowOrderToFileNative();
	r->Update();
	if (r->GetErrorCode() != 0 || r->undecoded)
		Lack::check(path);
	if (r->GetErrorCode() != 0 || r->undecoded)
		return ct_fail(e, CT_EINPUT, "%s: the picture cannot be decoded", s.path);
	image = r->GetOutput();
	image->GetDimensions(dims);
	if (static_cast<size_t>(dims[0]) != s.columns || static_cast<size_t>(dims[1]) != s.rows ||
		dims[2] != 1 || image->GetNumberOfScalarComponents() != 1)
		return ct_fail(e, CT_EINPUT, "%s: not a grey picture of %zux%zu", s.path, s.columns,
			s.rows);
	const size_t bytes = static_cast<size_t>(image->GetScalarSize());
	const unsigned char *px = static_cast<const unsigned char *>(image->GetScalarPointer());
	if (8 * bytes != static_cast<size_t>(s.allocated) || image->GetScalarType() == VTK_FLOAT)
		return ct_fail(e, CT_EINPUT, "%s: pixels of an unknown type", s.path);
	out.assign(px, px + s.columns * s.rows * bytes);
	return 0;
}

const char *syntax_name(const std::string &uid)
{
	static const char *const name[][2] = {{"1.2.840.10008.1.2.4.110", "JPEG XL lossless"},
		{"1.2.840.10008.1.2.4.111", "JPEG XL recompressed"},
		{"1.2.840.10008.1.2.4.112", "JPEG XL"},
		{"1.2.840.10008.1.2.8.1", "deflated image frames"}};

	for (const auto &x : name)
		if (uid == x[0])
			return x[1];
	const char *known = vtkDICOMUtilities::GetUIDName(uid.c_str());
	return *known ? known : "not known";
}

/* Of a number, those that count. */
int bits_of(const ct_slice &s)
{
	return s.stored < 1 || s.stored > s.allocated ? s.allocated : s.stored;
}

/* The bytes of each number. */
void reverse(Bytes &b, size_t bytes)
{
	for (auto p = b.begin(); p < b.end(); p += static_cast<ptrdiff_t>(bytes))
		std::reverse(p, p + static_cast<ptrdiff_t>(bytes));
}

/* One of the items that a compressed picture is in, behind the others. */
void add_item(Bytes &to, unsigned element, const Bytes &b)
{
	for (unsigned x : {0xfffeu | element << 16, static_cast<unsigned>(b.size())})
		for (int i = 0; i < 4; i++)
			to.push_back(static_cast<unsigned char>(x >> 8 * i));
	to.insert(to.end(), b.begin(), b.end());
}

/* All bits that any of the numbers has. */
uint32_t bits_in(const Bytes &b, size_t bytes)
{
	uint32_t all = 0;

	for (size_t i = 0; i + bytes <= b.size(); i += bytes) {
		uint32_t u = 0;

		std::memcpy(&u, &b[i], bytes);
		all |= u;
	}
	return all;
}

/* Do the bits from `from` on differ between numbers? */
bool differ_above(const Bytes &b, size_t bytes, int from)
{
	uint32_t first = 0, u = 0;

	std::memcpy(&first, b.data(), std::min(bytes, b.size()));
	for (size_t i = 0; i + bytes <= b.size(); i += bytes) {
		std::memcpy(&u, &b[i], bytes);
		if ((u ^ first) >> from != 0)
			return true;
	}
	return false;
}

/* Which bits of the numbers count. What lies above BitsStored is of an overlay, if one says so, or
 * nothing, if it is the same in all numbers; else it is the sign, or the rest of a number that is
 * too large for them, as of metal: then all count. Numbers that use the bits below those that
 * HighBit names, and none above BitsStored, lie in the lower bits: *placed gets where they lie, if
 * that can be told. */
void choose_bits(ct_slice_bits *how, const ct_slice &s, const Bytes &b, ct_dicom_bits *placed)
{
	const int stored = bits_of(s);
	/* one that cannot be does not count */
	const int shift = s.high < stored || s.high >= s.allocated ? 0 : s.high + 1 - stored;
	const uint32_t all = stored < s.allocated ? bits_in(b, how->bytes) : 0;

	const bool low =
		shift > 0 && !s.overlaid && all >> stored == 0 && (all & ((1u << shift) - 1)) != 0;

	how->bits = stored;
	how->shift = low ? 0 : shift;
	placed->low |= low;
	placed->high |= shift > 0 && !low && all != 0;
	if (shift == 0 && !s.overlaid && stored < s.allocated && all >> stored != 0 &&
		differ_above(b, how->bytes, stored))
		how->bits = s.allocated;
}

/* The tag of the pixel data at the offset, and their VR where it is explicit; 0 if there are none.
 */
uint32_t pixel_data_at(int fd, uint64_t offset, char vr[2])
{
	unsigned char b[12]; /* tag, type and length; or a tag and a length */

	if (offset < sizeof b ||
		pread(fd, b, sizeof b, static_cast<off_t>(offset - sizeof b)) != sizeof b)
		return 0;
	std::memcpy(vr, b + 4, 2);
	for (int at = 0; at <= 4; at += 4)
		for (uint32_t tag : {PIXEL_DATA, FLOAT_PIXEL_DATA, DOUBLE_PIXEL_DATA})
			if ((b[at] == 0xe0 && b[at + 1] == 0x7f && b[at + 2] == (tag & 0xff) &&
				    b[at + 3] == 0) ||
				(b[at] == 0x7f && b[at + 1] == 0xe0 && b[at + 2] == 0 &&
					b[at + 3] == (tag & 0xff)))
				return tag;
	return 0;
}

template <class T> void take_floats(size_t n, float *out, const Bytes &raw, double base)
{
	for (size_t i = 0; i < n; i++) {
		T x;

		std::memcpy(&x, &raw[i * sizeof x], sizeof x);
		out[i] = static_cast<float>(static_cast<double>(x) - base);
	}
}

} // namespace

PixelFile::~PixelFile()
{
	if (fd >= 0)
		close(fd);
}

int PixelFile::open(const ct_slice &s, ct_err *e)
{
	const uint64_t offset = static_cast<uint64_t>(s.pixels);

	if (fd >= 0)
		close(fd);
	fd = -1; /* what follows may throw */
	of = nullptr;
	held.reset(new Held(s));
	fd = ::open(held->path(), O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return ct_fail(e, CT_EINPUT, "%s: %s", s.path, std::strerror(errno));
	coding = coding_of(s.syntax);
	if (s.samples != 1)
		return ct_fail(e, CT_EINPUT, "%s: SamplesPerPixel is %zu: a picture in colour",
			s.path, s.samples);
	tag = pixel_data_at(fd, offset, vr);
	if (tag == 0 ||
		(tag != PIXEL_DATA && coding != Coding::plain && coding != Coding::big_endian))
		return ct_fail(
			e, CT_EINPUT, "%s: no PixelData: other pictures are not read", s.path);
	if (tag != PIXEL_DATA && s.allocated != (tag == FLOAT_PIXEL_DATA ? 32 : 64))
		return ct_fail(e, CT_EINPUT, "%s: BitsAllocated is %d, but the pixels are floats",
			s.path, s.allocated);
	if (tag == PIXEL_DATA && s.allocated != 8 && s.allocated != 16 && s.allocated != 32)
		return ct_fail(e, CT_EINPUT, "%s: BitsAllocated is %d, not 8, 16 or 32", s.path,
			s.allocated);
	if (coding == Coding::other)
		return ct_fail(e, CT_EINPUT,
			"%s: TransferSyntaxUID %s is not one that is read: %s; recode it, as by "
			"dcmconv or gdcmconv --raw",
			s.path, s.syntax, syntax_name(s.syntax));
	if (foreign() && s.high >= bits_of(s) && s.high < s.allocated)
		return ct_fail(e, CT_EINPUT,
			"%s: HighBit is %d, but BitsStored is %d in a compressed picture", s.path,
			s.high, s.stored);
	pictures.clear();
	if (coding != Coding::plain && coding != Coding::big_endian &&
		list_pictures(pictures, fd, offset, coding, s.frames, s.path, e))
		return -1;
	of = &s;
	return 0;
}

/* These bytes of the file, into raw. */
int PixelFile::get(const Parts &parts, ct_err *e)
{
	uint64_t size = 0, done = 0;

	for (const Part &p : parts)
		size += p.size;
	raw.resize(size);
	for (const Part &p : parts)
		for (uint64_t from = p.from; from < p.from + p.size;) {
			const ssize_t n = pread(fd, raw.data() + done, p.from + p.size - from,
				static_cast<off_t>(from));

			if (n <= 0)
				return ct_fail(e, CT_EINPUT, "%s: %s", of->path,
					n ? std::strerror(errno)
					  : "truncated: its picture is cut off");
			done += static_cast<uint64_t>(n);
			from += static_cast<uint64_t>(n);
		}
	return 0;
}

/* A file of that picture alone, with what a decoder has to know of it; false if there is no room.
 */
bool PixelFile::write_alone(const char *path, const ct_slice &s, int bits) const
{
	const bool htj2k = std::strncmp(s.syntax, "1.2.840.10008.1.2.4.20", 22) == 0;
	const std::pair<vtkDICOMTag, int> known[] = {{DC::SamplesPerPixel, 1},
		{DC::Rows, static_cast<int>(s.rows)}, {DC::Columns, static_cast<int>(s.columns)},
		{DC::BitsAllocated, s.allocated}, {DC::BitsStored, bits}, {DC::HighBit, bits - 1},
		{DC::PixelRepresentation, s.is_signed}};
	vtkNew<vtkDICOMMetaData> m;
	vtkNew<vtkDICOMCompiler> c;
	Bytes items;

	m->Set(DC::SOPClassUID, "1.2.840.10008.5.1.4.1.1.2");
	m->Set(DC::SOPInstanceUID, "1.2");
	m->Set(DC::PhotometricInterpretation, "MONOCHROME2");
	for (const auto &x : known)
		m->Set(x.first, x.second);
	m->Set(DC::PixelData, vtkDICOMValue(vtkDICOMVR::OB));
	add_item(items, 0xe000, {}); /* the table */
	add_item(items, 0xe000, raw);
	add_item(items, 0xe0dd, {});
	c->SetSOPInstanceUID("1.2");
	c->SetSeriesInstanceUID("1.2");
	c->SetStudyInstanceUID("1.2");
	/* the decoder of JPEG 2000 knows HTJ2K, the library before it not its names */
	c->SetTransferSyntaxUID(htj2k ? "1.2.840.10008.1.2.4.90" : s.syntax);
	c->SetMetaData(m);
	c->SetFileName(path);
	c->WriteHeader();
	c->WritePixelData(items.data(), static_cast<vtkIdType>(items.size()));
	c->Close();
	return c->GetErrorCode() == 0;
}

/* The compressed picture in raw to its numbers. */
int PixelFile::decode_jpeg(const ct_slice &s, ct_err *e)
{
	const Frame want = {s.rows, s.columns, 1, static_cast<unsigned>(s.allocated)};
	std::string path;
	unsigned bits;
	int copy, rc;

	if (check_jpeg(raw, coding, want, &bits, s.path, e))
		return -1;
	raw.resize(raw.size() + raw.size() % 2);
	copy = memfd_create("ctsr-dicom", MFD_CLOEXEC);
	path = "/proc/self/fd/" + std::to_string(copy);
	if (copy < 0 || !write_alone(path.c_str(), s, std::max(bits_of(s), static_cast<int>(bits))))
		rc = ct_fail(
			e, CT_ENOMEM, "%s: no memory for a copy: %s", s.path, std::strerror(errno));
	else
		rc = decode(path.c_str(), s, unpacked, e);
	raw.swap(unpacked);
	if (copy >= 0)
		close(copy);
	return rc;
}

/* Big-endian numbers to little-endian ones. Those of VR OB are bytes, which have no order; where a
 * number is of several, programs turn them or not. The order is the one that leaves the bits above
 * BitsStored empty. Those of 32 bits in OW are two words, the lower first, or not. */
int PixelFile::turn(const ct_slice &s, size_t bytes, ct_err *e)
{
	const uint32_t none = static_cast<uint32_t>(UINT64_C(0xffffffff) << bits_of(s));
	const bool unsure = bytes > 1 && std::memcmp(vr, "OB", 2) == 0;
	const bool pairs = bytes > 2 && std::memcmp(vr, "OW", 2) == 0;
	const bool little = unsure && bits_of(s) < s.allocated && (bits_in(raw, bytes) & none) == 0;

	if (bytes == 1 && std::memcmp(vr, "OW", 2) == 0) { /* two of them are a word */
		raw.resize(raw.size() + raw.size() % 2);
		bytes = 2;
	}
	reverse(raw, bytes);
	const bool big = !unsure || (bits_of(s) < s.allocated && (bits_in(raw, bytes) & none) == 0);
	if (little == big || pairs)
		return ct_fail(e, CT_EINPUT,
			"%s: PixelData has the VR %.2s in a big-endian file of %d bits: the order of its "
			"bytes is not known",
			s.path, vr, s.allocated);
	if (little)
		reverse(raw, bytes);
	return 0;
}

int PixelFile::read(const ct_slice &s, float *out, ct_err *e)
{
	const size_t n = s.rows * s.columns, bytes = static_cast<size_t>(s.allocated) / 8;
	const uint64_t offset = static_cast<uint64_t>(s.pixels);
	ct_slice_bits how = {bytes, bits_of(s), s.is_signed, 0, ct_slice_base(&s)};

	if (get(pictures.empty() ? Parts{{offset + s.frame * n * bytes, n * bytes}}
				 : pictures[s.frame],
		    e))
		return -1;
	if (foreign() && decode_jpeg(s, e))
		return -1;
	if (coding == Coding::rle) {
		if (unpack_rle(unpacked, raw, n, bytes, s.path, e))
			return -1;
		raw.swap(unpacked);
	}
	if (coding == Coding::big_endian && turn(s, bytes, e))
		return -1;
	if (tag == FLOAT_PIXEL_DATA)
		return take_floats<float>(n, out, raw, how.base), 0;
	if (tag == DOUBLE_PIXEL_DATA)
		return take_floats<double>(n, out, raw, how.base), 0;
	choose_bits(&how, s, raw, &placed);
	ct_slice_widen(n, out, raw.data(), &how);
	return 0;
}
