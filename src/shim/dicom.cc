/* dicom.cc: see dicom.h. */
#include "config.h"
#include "shim/dicom.h"
#include "shim/apart.h"
#include "shim/guard.h"
#include "shim/fragments.h"

#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMReader.h>
#include <vtkDICOMUtilities.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace
{

namespace fs = std::filesystem;

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
vtkStandardNewMacro(Reader)

	template <size_t N>
	void put(char (&out)[N], const vtkDICOMValue &v)
{
	std::string text = v.IsValid() ? v.AsString() : std::string();

	text.erase(text.find_last_not_of(std::string(" \0", 2)) + 1);
	for (char &c : text)
		if (static_cast<unsigned char>(c) < ' ')
			c = ' '; /* a description is printed on one line */
	std::snprintf(out, N, "%s", text.c_str());
}

bool numbers(const vtkDICOMValue &v, double *out, size_t n)
{
	if (v.GetNumberOfValues() < n)
		return false;
	v.GetValues(out, n);
	return true;
}

size_t count_of(const vtkDICOMValue &v, size_t none)
{
	const int n = v.IsValid() ? v.AsInt() : static_cast<int>(none);

	return n > 0 ? static_cast<size_t>(n) : 0;
}

/* A padding value often has the other sign's VR. */
double stored(const vtkDICOMValue &v, bool is_signed, int bits)
{
	double x = v.AsDouble();

	if (is_signed && x >= std::ldexp(1.0, bits - 1))
		x -= std::ldexp(1.0, bits);
	if (!is_signed && x < 0)
		x += std::ldexp(1.0, bits);
	return x;
}

void describe(vtkDICOMMetaData *m, ct_slice *s)
{
	double iop[6], spacing[2], scale[2];

	put(s->series, m->Get(DC::SeriesInstanceUID));
	put(s->frame, m->Get(DC::FrameOfReferenceUID));
	put(s->patient, m->Get(DC::PatientID));
	put(s->modality, m->Get(DC::Modality));
	put(s->about, m->Get(DC::SeriesDescription));
	s->number = m->Get(DC::SeriesNumber).AsInt();
	s->instance = m->Get(DC::InstanceNumber).AsInt();
	s->columns = count_of(m->Get(DC::Columns), 0);
	s->rows = count_of(m->Get(DC::Rows), 0);
	s->frames = count_of(m->Get(DC::NumberOfFrames), 1);
	s->claimed = static_cast<double>(s->columns) * static_cast<double>(s->rows) *
		     static_cast<double>(s->frames) *
		     static_cast<double>(count_of(m->Get(DC::SamplesPerPixel), 1)) *
		     static_cast<double>((count_of(m->Get(DC::BitsAllocated), 16) + 7) / 8);
	s->placed = numbers(m->Get(DC::ImagePositionPatient), s->position, 3) &&
		    numbers(m->Get(DC::ImageOrientationPatient), iop, 6) &&
		    numbers(m->Get(DC::PixelSpacing), spacing, 2);
	if (s->placed) {
		std::copy_n(iop, 3, s->across);
		std::copy_n(iop + 3, 3, s->down);
		s->pitch[0] = spacing[1]; /* PixelSpacing: between rows, then between columns */
		s->pitch[1] = spacing[0];
	}
	s->scaled = numbers(m->Get(DC::RescaleSlope), scale, 1) &&
		    numbers(m->Get(DC::RescaleIntercept), scale + 1, 1);
	if (s->scaled) {
		s->slope = scale[0];
		s->intercept = scale[1];
	}
	s->padded = m->Has(DC::PixelPaddingValue);
	if (s->padded) {
		const bool is_signed = m->Get(DC::PixelRepresentation).AsInt() != 0;
		const int bits = m->Get(DC::BitsAllocated).AsInt();

		s->padding[0] = s->padding[1] =
			stored(m->Get(DC::PixelPaddingValue), is_signed, bits);
		if (m->Has(DC::PixelPaddingRangeLimit))
			s->padding[1] = stored(m->Get(DC::PixelPaddingRangeLimit), is_signed, bits);
	}
}

/* Parse one file; false if it holds no picture. */
bool look(const std::string &path, vtkDICOMMetaData *m, vtkDICOMParser *p)
{
	vtkObject::GlobalWarningDisplayOff();
	p->SetMetaData(m);
	p->SetFileName(path.c_str());
	p->Update();
	return p->GetErrorCode() == 0 && p->GetPixelDataFound();
}

struct Found {
	std::vector<ct_slice> s;

	~Found()
	{
		for (ct_slice &x : s)
			std::free(x.path);
	}
};

int add(Found &found, const std::string &path, bool named, ct_err *e)
{
	vtkNew<vtkDICOMMetaData> m;
	vtkNew<vtkDICOMParser> p;
	ct_slice s = {};

	if (!vtkDICOMUtilities::IsDICOMFile(path.c_str()))
		return named ? ct_fail(e, CT_EINPUT, "%s: not a DICOM file", path.c_str()) : 0;
	if (!look(path, m, p)) {
		/* no picture: a directory, a report, a plan */
		if (!named && p->GetErrorCode() == 0)
			return 0;
		return ct_fail(e, CT_EINPUT, "%s: %s", path.c_str(),
			p->GetErrorCode() ? "damaged DICOM file"
					  : "a DICOM file without a picture");
	}
	describe(m, &s);
	s.bytes = static_cast<double>(fs::file_size(path));
	s.path = strdup(path.c_str());
	if (!s.path)
		throw std::bad_alloc();
	found.s.push_back(s);
	return 0;
}

int scan(const char *path, Found &found, ct_err *e)
{
	std::vector<std::string> files;

	if (!fs::exists(path))
		return ct_fail(e, CT_EINPUT, "%s: %s", path, std::strerror(ENOENT));
	if (!fs::is_directory(path))
		return add(found, path, true, e);
	for (const fs::directory_entry &f : fs::recursive_directory_iterator(path))
		if (f.is_regular_file())
			files.push_back(f.path().string());
	std::sort(files.begin(), files.end()); /* a folder has no order */
	for (const std::string &f : files)
		if (add(found, f, false, e))
			return -1;
	return found.s.empty() ? ct_fail(e, CT_EINPUT, "%s: no DICOM pictures in this folder", path)
			       : 0;
}

template <class T> void copy(const T *in, size_t n, float *out)
{
	for (size_t i = 0; i < n; i++)
		out[i] = static_cast<float>(in[i]);
}

/* Does vtk-dicom itself read the numbers? */
bool is_plain(const std::string &syntax)
{
	return syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.10008.1.2.1" ||
	       syntax == "1.2.840.10008.1.2.2";
}

int decode(const char *path, const ct_slice *s, float *out, ct_err *e)
{
	const size_t n = s->columns * s->rows;
	vtkNew<Reader> r;
	vtkImageData *image;
	int dims[3];

	r->SetFileName(path);
	r->AutoRescaleOff();
	r->SetMemoryRowOrderToFileNative();
	r->Update();
	if (r->GetErrorCode() != 0 || r->undecoded)
		return ct_fail(e, CT_EINPUT, "%s: the picture cannot be decoded", s->path);
	image = r->GetOutput();
	image->GetDimensions(dims);
	if (static_cast<size_t>(dims[0]) != s->columns || static_cast<size_t>(dims[1]) != s->rows ||
		dims[2] != 1 || image->GetNumberOfScalarComponents() != 1)
		return ct_fail(e, CT_EINPUT, "%s: not one grey picture of %zux%zu", s->path,
			s->columns, s->rows);
	switch (image->GetScalarType()) {
		vtkTemplateMacro(copy(static_cast<VTK_TT *>(image->GetScalarPointer()), n, out));
	default: return ct_fail(e, CT_EINPUT, "%s: pixels of an unknown type", s->path);
	}
	return 0;
}

} // namespace

extern "C" int ct_dicom_scan(
	const char *const *paths, size_t n, struct ct_slice **s, size_t *count, struct ct_err *e)
{
	*s = nullptr;
	*count = 0;
	return guard(e, n ? paths[0] : "no path", [&] {
		Found found;

		for (size_t i = 0; i < n; i++)
			if (scan(paths[i], found, e))
				return -1;
		*s = static_cast<ct_slice *>(std::calloc(found.s.size() + 1, sizeof **s));
		if (!*s)
			throw std::bad_alloc();
		std::copy(found.s.begin(), found.s.end(), *s);
		*count = found.s.size();
		found.s.clear(); /* the paths have a new owner */
		return 0;
	});
}

extern "C" void ct_dicom_free(struct ct_slice *s, size_t count)
{
	for (size_t i = 0; i < count; i++)
		std::free(s[i].path);
	std::free(s);
}

extern "C" int ct_dicom_pixels(const struct ct_slice *s, float *out, struct ct_err *e)
{
	return guard(e, s->path, [&] {
		vtkNew<vtkDICOMMetaData> m;
		vtkNew<vtkDICOMParser> p;
		Mended mended;

		if (!look(s->path, m, p))
			return ct_fail(e, CT_EINPUT, "%s: damaged DICOM file", s->path);
		const std::string syntax = m->Get(DC::TransferSyntaxUID).AsString();
		if (mended.check(s->path, syntax, static_cast<uint64_t>(p->GetFileOffset()), e))
			return -1;
		const std::string path = mended.path(s->path);
		if (is_plain(syntax))
			return decode(path.c_str(), s, out, e);
		return apart(out, s->columns * s->rows, s->path, e,
			[&](float *to, ct_err *why) { return decode(path.c_str(), s, to, why); });
	});
}
