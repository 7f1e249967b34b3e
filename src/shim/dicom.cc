/* dicom.cc: see dicom.h. */
#include "config.h"
#include "shim/dicom.h"
#include "shim/apart.h"
#include "shim/dicom-tags.h"
#include "shim/guard.h"
#include "shim/held.h"
#include "shim/fragments.h"

#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMReader.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <string>

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
vtkStandardNewMacro(Reader)

	template <class T>
	void copy(const T *in, size_t n, float *out)
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

/* All pictures of a file, as they follow in it. */
int decode(const char *path, const ct_slice *s, float *out, ct_err *e)
{
	const size_t n = s->columns * s->rows * s->frames;
	vtkNew<Reader> r;
	vtkImageData *image;
	int dims[3];

	r->SetFileName(path);
	r->AutoRescaleOff();
	r->SortingOff();
	r->SetMemoryRowOrderToFileNative();
	r->Update();
	if (r->GetErrorCode() != 0 || r->undecoded)
		return ct_fail(e, CT_EINPUT, "%s: the picture cannot be decoded", s->path);
	image = r->GetOutput();
	image->GetDimensions(dims);
	if (static_cast<size_t>(dims[0]) != s->columns || static_cast<size_t>(dims[1]) != s->rows ||
		static_cast<size_t>(dims[2]) != s->frames ||
		image->GetNumberOfScalarComponents() != 1)
		return ct_fail(e, CT_EINPUT, "%s: not %zu grey pictures of %zux%zu", s->path,
			s->frames, s->columns, s->rows);
	switch (image->GetScalarType()) {
		vtkTemplateMacro(copy(static_cast<VTK_TT *>(image->GetScalarPointer()), n, out));
	default: return ct_fail(e, CT_EINPUT, "%s: pixels of an unknown type", s->path);
	}
	return 0;
}

} // namespace

extern "C" int ct_dicom_pixels(const struct ct_slice *s, float *out, struct ct_err *e)
{
	return guard(e, s->path, [&] {
		vtkNew<vtkDICOMMetaData> m;
		vtkNew<vtkDICOMParser> p;
		Mended mended;
		const Held held(*s);

		if (!parse_header(held.path(), m, p) || !p->GetPixelDataFound())
			return ct_fail(e, CT_EINPUT, "%s: damaged DICOM file", s->path);
		const std::string syntax = m->Get(DC::TransferSyntaxUID).AsString();
		if (mended.check(held.path(), syntax, static_cast<uint64_t>(p->GetFileOffset()),
			    s->frames, e))
			return -1;
		const std::string path = mended.path(held.path());
		if (is_plain(syntax))
			return decode(path.c_str(), s, out, e);
		return apart(out, s->columns * s->rows * s->frames, s->path, e,
			[&](float *to, ct_err *why) { return decode(path.c_str(), s, to, why); });
	});
}
