/* pixels.cc: see pixels.h. */
#include "config.h"
#include "shim/guard.h"
#include "shim/pixels.h"

#include <vtkDICOMCompiler.h>
#include <vtkDICOMDictionary.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMReader.h>
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

/* The one grey picture of a file. */
int decode(const char *path, const ct_slice &s, float *out, ct_err *e)
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
	const ct_slice_bits how = {
		bytes, static_cast<int>(8 * bytes), image->GetScalarTypeMin() < 0};
	if (bytes > 4 || image->GetScalarType() == VTK_FLOAT)
		return ct_fail(e, CT_EINPUT, "%s: pixels of an unknown type", s.path);
	ct_slice_widen(s.columns * s.rows, out, image->GetScalarPointer(), &how);
	return 0;
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

/* Does PixelData begin at the offset, behind its tag? Not FloatPixelData or DoubleFloatPixelData.
 */
bool is_pixel_data(int fd, uint64_t offset)
{
	static const unsigned char little[] = {0xe0, 0x7f, 0x10, 0x00},
				   big[] = {0x7f, 0xe0, 0x00, 0x10};
	unsigned char b[12]; /* tag, type and length; or a tag and a length */

	if (offset < sizeof b ||
		pread(fd, b, sizeof b, static_cast<off_t>(offset - sizeof b)) != sizeof b)
		return false;
	return std::memcmp(b, little, 4) == 0 || std::memcmp(b + 4, little, 4) == 0 ||
	       std::memcmp(b, big, 4) == 0 || std::memcmp(b + 4, big, 4) == 0;
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
	coding = s.syntax[0] ? coding_of(s.syntax) : Coding::plain;
	if (s.samples != 1)
		return ct_fail(e, CT_EINPUT, "%s: SamplesPerPixel is %zu: a picture in colour",
			s.path, s.samples);
	if (!is_pixel_data(fd, offset))
		return ct_fail(
			e, CT_EINPUT, "%s: no PixelData: other pictures are not read", s.path);
	if (s.allocated != 8 && s.allocated != 16 && s.allocated != 32)
		return ct_fail(e, CT_EINPUT, "%s: BitsAllocated is %d, not 8, 16 or 32", s.path,
			s.allocated);
	if (coding == Coding::other)
		return ct_fail(e, CT_EINPUT, "%s: TransferSyntaxUID %s is not one that is read",
			s.path, s.syntax);
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
bool PixelFile::write_alone(const char *path, const ct_slice &s) const
{
	const std::pair<vtkDICOMTag, int> known[] = {{DC::SamplesPerPixel, 1},
		{DC::Rows, static_cast<int>(s.rows)}, {DC::Columns, static_cast<int>(s.columns)},
		{DC::BitsAllocated, s.allocated}, {DC::BitsStored, bits_of(s)},
		{DC::HighBit, bits_of(s) - 1}, {DC::PixelRepresentation, s.is_signed}};
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
	c->SetTransferSyntaxUID(s.syntax);
	c->SetMetaData(m);
	c->SetFileName(path);
	c->WriteHeader();
	c->WritePixelData(items.data(), static_cast<vtkIdType>(items.size()));
	c->Close();
	return c->GetErrorCode() == 0;
}

int PixelFile::decode_jpeg(const ct_slice &s, float *out, ct_err *e)
{
	std::string path;
	int copy, rc;

	if (check_jpeg(raw, coding, s.path, e))
		return -1;
	raw.resize(raw.size() + raw.size() % 2);
	copy = memfd_create("ctsr-dicom", MFD_CLOEXEC);
	path = "/proc/self/fd/" + std::to_string(copy);
	if (copy < 0 || !write_alone(path.c_str(), s))
		rc = ct_fail(
			e, CT_ENOMEM, "%s: no memory for a copy: %s", s.path, std::strerror(errno));
	else
		rc = decode(path.c_str(), s, out, e);
	if (copy >= 0)
		close(copy);
	return rc;
}

int PixelFile::read(const ct_slice &s, float *out, ct_err *e)
{
	const size_t n = s.rows * s.columns, bytes = static_cast<size_t>(s.allocated) / 8;
	const uint64_t offset = static_cast<uint64_t>(s.pixels);
	const ct_slice_bits how = {bytes, bits_of(s), s.is_signed};

	if (get(pictures.empty() ? Parts{{offset + s.frame * n * bytes, n * bytes}}
				 : pictures[s.frame],
		    e))
		return -1;
	if (foreign())
		return decode_jpeg(s, out, e);
	if (coding == Coding::rle) {
		if (unpack_rle(unpacked, raw, n, bytes, s.path, e))
			return -1;
		raw.swap(unpacked);
	}
	if (coding == Coding::big_endian)
		reverse(raw, bytes);
	ct_slice_widen(n, out, raw.data(), &how);
	return 0;
}
