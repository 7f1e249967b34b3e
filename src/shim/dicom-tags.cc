/* dicom-tags.cc: see dicom-tags.h. */
#include "config.h"
#include "shim/dicom-tags.h"

#include <vtkDICOMDictionary.h>
#include <vtkDICOMValue.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace
{

template <size_t N> void put(char (&out)[N], const vtkDICOMValue &v)
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

double number(const vtkDICOMValue &v)
{
	double x;

	return numbers(v, &x, 1) ? x : NAN;
}

/* Seconds of the day of a time, HHMMSS.F, or of a date and time. */
double seconds(const vtkDICOMValue &v, size_t date)
{
	const std::string text = v.IsValid() ? v.AsString() : std::string();
	double s;
	int h, m;

	if (text.size() < date + 6 ||
		std::sscanf(text.c_str() + date, "%2d%2d%lf", &h, &m, &s) != 3)
		return NAN;
	return (h * 60 + m) * 60 + s;
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

/* The tags of one picture, in its own functional group if there are such. */
struct Tags {
	vtkDICOMMetaData *m;
	int frame;

	const vtkDICOMValue &operator()(vtkDICOMTag tag) const
	{
		return m->Get(0, frame, tag);
	}
};

void describe_place(const Tags &tag, ct_slice *s)
{
	double iop[6], spacing[2];

	s->placed = numbers(tag(DC::ImagePositionPatient), s->position, 3) &&
		    numbers(tag(DC::ImageOrientationPatient), iop, 6) &&
		    numbers(tag(DC::PixelSpacing), spacing, 2);
	if (!s->placed)
		return;
	std::copy_n(iop, 3, s->across);
	std::copy_n(iop + 3, 3, s->down);
	s->pitch[0] = spacing[1]; /* PixelSpacing: between rows, then between columns */
	s->pitch[1] = spacing[0];
}

void describe_values(const Tags &tag, ct_slice *s)
{
	double scale[2];

	s->scaled = numbers(tag(DC::RescaleSlope), scale, 1) &&
		    numbers(tag(DC::RescaleIntercept), scale + 1, 1);
	if (s->scaled) {
		s->slope = scale[0];
		s->intercept = scale[1];
	}
	put(s->unit, tag(DC::RescaleType));
	s->padded = tag(DC::PixelPaddingValue).IsValid();
	if (!s->padded)
		return;
	s->padding[0] = s->padding[1] =
		stored(tag(DC::PixelPaddingValue), s->is_signed, s->allocated);
	if (tag(DC::PixelPaddingRangeLimit).IsValid())
		s->padding[1] = stored(tag(DC::PixelPaddingRangeLimit), s->is_signed, s->allocated);
}

void describe_moment(const Tags &tag, ct_slice *s)
{
	s->acquisition = tag(DC::AcquisitionNumber).AsInt();
	s->moment = number(tag(DC::TemporalPositionIdentifier));
	if (std::isnan(s->moment))
		s->moment = number(tag(DC::TemporalPositionIndex));
	s->phase = number(tag(DC::NominalPercentageOfCardiacPhase));
	s->trigger = number(tag(DC::TriggerTime));
	s->acquired = seconds(tag(DC::AcquisitionTime), 0);
	if (std::isnan(s->acquired))
		s->acquired = seconds(tag(DC::FrameAcquisitionDateTime), 8);
	if (std::isnan(s->acquired))
		s->acquired = seconds(tag(DC::AcquisitionDateTime), 8);
	s->made = seconds(tag(DC::ContentTime), 0);
}

} // namespace

bool parse_header(const std::string &path, vtkDICOMMetaData *m, vtkDICOMParser *p)
{
	vtkObject::GlobalWarningDisplayOff();
	p->SetMetaData(m);
	p->SetFileName(path.c_str());
	p->Update();
	return p->GetErrorCode() == 0;
}

size_t count_frames(vtkDICOMMetaData *m)
{
	return count_of(m->Get(DC::NumberOfFrames), 1);
}

bool may_hold_picture(vtkDICOMMetaData *m)
{
	const vtkDICOMValue &own = m->Get(DC::SOPClassUID);
	const std::string uid =
		own.IsValid() ? own.AsString() : m->Get(DC::MediaStorageSOPClassUID).AsString();

	return uid.empty() || uid.compare(0, 27, "1.2.840.10008.5.1.4.1.1.2.1") == 0 ||
	       uid.compare(0, 26, "1.2.840.10008.5.1.4.1.1.7.") == 0 ||
	       uid == "1.2.840.10008.5.1.4.1.1.2" || uid == "1.2.840.10008.5.1.4.1.1.2.2" ||
	       uid == "1.2.840.10008.5.1.4.1.1.7";
}

void describe_frame(vtkDICOMMetaData *m, size_t frame, ct_slice *s)
{
	const Tags tag = {m, static_cast<int>(frame)};

	s->frame = frame;
	s->frames = count_frames(m);
	put(s->series, tag(DC::SeriesInstanceUID));
	put(s->study, tag(DC::StudyInstanceUID));
	put(s->object, tag(DC::SOPInstanceUID));
	put(s->space, tag(DC::FrameOfReferenceUID));
	put(s->patient, tag(DC::PatientID));
	put(s->name, tag(DC::PatientName));
	put(s->maker, tag(DC::Manufacturer));
	put(s->model, tag(DC::ManufacturerModelName));
	put(s->posture, tag(DC::PatientPosition));
	put(s->modality, tag(DC::Modality));
	put(s->about, tag(DC::SeriesDescription));
	put(s->storage, tag(DC::SOPClassUID));
	put(s->type, tag(DC::FrameType).IsValid() ? tag(DC::FrameType) : tag(DC::ImageType));
	put(s->kernel, tag(DC::ConvolutionKernel));
	s->number = tag(DC::SeriesNumber).AsInt();
	s->instance = tag(DC::InstanceNumber).AsInt();
	s->announced = tag(DC::ImagesInAcquisition).AsInt();
	s->kvp = number(tag(DC::KVP));
	s->thickness = number(tag(DC::SliceThickness));
	s->tilt = number(tag(DC::GantryDetectorTilt));
	s->between = number(tag(DC::SpacingBetweenSlices));
	s->diameter = number(tag(DC::ReconstructionDiameter));
	s->collimation = number(tag(DC::SingleCollimationWidth));
	s->columns = count_of(tag(DC::Columns), 0);
	s->rows = count_of(tag(DC::Rows), 0);
	s->samples = count_of(tag(DC::SamplesPerPixel), 1);
	s->claimed = static_cast<double>(s->columns) * static_cast<double>(s->rows) *
		     static_cast<double>(s->samples) *
		     static_cast<double>((count_of(tag(DC::BitsAllocated), 16) + 7) / 8);
	put(s->syntax, m->Get(DC::TransferSyntaxUID));
	s->allocated = m->Get(DC::BitsAllocated).AsInt();
	s->stored = m->Get(DC::BitsStored).AsInt();
	s->is_signed = m->Get(DC::PixelRepresentation).AsInt() != 0;
	describe_place(tag, s);
	describe_values(tag, s);
	describe_moment(tag, s);
}
