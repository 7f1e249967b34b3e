/* dicom-tags.cc: see dicom-tags.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/dicom-tags.h"
#include "core/number.h"

#include <vtkDICOMDictEntry.h>
#include <vtkDICOMDictionary.h>
#include <vtkDICOMItem.h>
#include <vtkDICOMValue.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>

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

bool is_digits(const std::string &s, size_t at, size_t n)
{
	return s.size() >= at + n && std::all_of(s.begin() + static_cast<std::ptrdiff_t>(at),
					     s.begin() + static_cast<std::ptrdiff_t>(at + n),
					     [](char c) { return c >= '0' && c <= '9'; });
}

/* Seconds of the day of a time, HHMMSS.F, or of a date and time, behind which its zone may stand;
 * NaN if it is none. */
double seconds(const vtkDICOMValue &v, size_t date)
{
	const std::string text = v.IsValid() ? v.AsString() : std::string();
	double s;

	if (!is_digits(text, date, 6))
		return NAN;
	const std::string end = text.substr(date + 4, text.find_first_of("+-", date) - date - 4);
	if (!ct_number_field(&s, end.data(), end.size()))
		return NAN;
	return (std::stoi(text.substr(date, 2)) * 60 + std::stoi(text.substr(date + 2, 2))) * 60 +
	       s;
}

/* The bytes of text: of what has a VR of text, or none that is known. */
std::string text_of(const vtkDICOMValue &v)
{
	const char *chars = v.GetCharData();
	const void *bytes = chars ? chars : static_cast<const void *>(v.GetUnsignedCharData());
	std::string text;

	if (bytes)
		text.assign(static_cast<const char *>(bytes), v.GetVL());
	/* vtk-dicom makes odd lengths even, and does not set the byte behind a NUL */
	if (text.size() > 1 && text[text.size() - 2] == '\0')
		text.pop_back();
	text.erase(text.find_last_not_of(std::string(" \0", 2)) + 1);
	return text;
}

bool is_text(const vtkDICOMValue &v)
{
	return v.GetCharData() || v.GetUnsignedCharData();
}

/* The n numbers between bars. */
bool text_numbers(const std::string &text, double *out, size_t n)
{
	size_t at = 0;

	for (size_t i = 0; i < n; i++) {
		const size_t bar = std::min(text.find('\\', at), text.size());

		if (at > text.size() || (bar == text.size()) != (i + 1 == n) ||
			!ct_number_field(out + i, text.data() + at, bar - at))
			return false;
		at = bar + 1;
	}
	return true;
}

bool binary_numbers(const vtkDICOMValue &v, double *out, size_t n)
{
	if (v.GetSequenceData() || v.GetTagData() || v.GetNumberOfValues() != n)
		return false;
	v.GetValues(out, n);
	return std::all_of(out, out + n, [](double x) { return std::isfinite(x); });
}

/* "RescaleSlope (0028,1053) is '1,5', not a number" */
std::string wrong_number(vtkDICOMTag tag, const vtkDICOMValue &v, size_t n)
{
	const char *name = vtkDICOMDictionary::FindDictEntry(tag).GetName();
	std::string text = is_text(v) ? text_of(v) : std::string("?");
	char out[160];

	for (char &c : text)
		if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~')
			c = '?';
	std::snprintf(out, sizeof out,
		n > 1 ? "%s (%04x,%04x) is '%.40s', not %zu numbers"
		      : "%s (%04x,%04x) is '%.40s', not a number",
		name && *name ? name : "element", tag.GetGroup(), tag.GetElement(), text.c_str(),
		n);
	return out;
}

/* The tags of one picture, in its own functional group if there are such. Of the first value that
 * should be a number and is none, *wrong says what it is. */
struct Tags {
	vtkDICOMMetaData *m;
	int frame;
	std::string *wrong;

	const vtkDICOMValue &operator()(vtkDICOMTag tag) const
	{
		return m->Get(0, frame, tag);
	}

	void refuse(vtkDICOMTag tag, size_t n) const
	{
		if (wrong->empty())
			*wrong = wrong_number(tag, (*this)(tag), n);
	}

	/* All n, and no more; false if they are not there, or wrong. */
	bool numbers(vtkDICOMTag tag, double *out, size_t n) const
	{
		const vtkDICOMValue &v = (*this)(tag);
		const std::string text = text_of(v);

		if (!v.IsValid() || v.GetVL() == 0 || (is_text(v) && text.empty()))
			return false;
		if (is_text(v) ? text_numbers(text, out, n) : binary_numbers(v, out, n))
			return true;
		refuse(tag, n);
		return false;
	}

	double number(vtkDICOMTag tag) const
	{
		double x;

		return numbers(tag, &x, 1) ? x : NAN;
	}

	/* A whole number; `none` if it is not there, or wrong. */
	int whole(vtkDICOMTag tag, int none) const
	{
		double x;

		if (!numbers(tag, &x, 1))
			return none;
		if (x == std::floor(x) && std::fabs(x) <= INT_MAX)
			return static_cast<int>(x);
		refuse(tag, 1);
		return none;
	}

	size_t count(vtkDICOMTag tag, int none) const
	{
		const int n = whole(tag, none);

		return n > 0 ? static_cast<size_t>(n) : 0;
	}
};

/* A padding value often has the other sign's VR. */
double stored(double x, bool is_signed, int bits)
{
	if (is_signed && x >= std::ldexp(1.0, bits - 1))
		x -= std::ldexp(1.0, bits);
	if (!is_signed && x < 0)
		x += std::ldexp(1.0, bits);
	return x;
}

/* Frames without functional groups have one position: that of the first, and SpacingBetweenSlices
 * leads to the others along rows x columns, unless they are of one place, at several times. */
void count_frame(const Tags &tag, ct_slice *s)
{
	const vtkDICOMValue &by = tag(DC::FrameIncrementPointer);
	const vtkDICOMTag time = by.IsValid() ? by.AsTag() : vtkDICOMTag();
	double normal[3];

	s->placed = s->between > 0 && std::isfinite(s->between) && time != DC::FrameTime &&
		    time != DC::FrameTimeVector;
	s->counted = s->placed;
	ct_slice_normal(s, normal);
	for (int i = 0; i < 3 && s->placed; i++)
		s->position[i] += static_cast<double>(s->frame) * s->between * normal[i];
}

void describe_place(const Tags &tag, ct_slice *s)
{
	double iop[6], spacing[2];

	s->placed = tag.numbers(DC::ImagePositionPatient, s->position, 3) &&
		    tag.numbers(DC::ImageOrientationPatient, iop, 6) &&
		    tag.numbers(DC::PixelSpacing, spacing, 2);
	if (!s->placed)
		return;
	std::copy_n(iop, 3, s->across);
	std::copy_n(iop + 3, 3, s->down);
	s->pitch[0] = spacing[1]; /* PixelSpacing: between rows, then between columns */
	s->pitch[1] = spacing[0];
	if (s->frames > 1 && !tag.m->Get(DC::PerFrameFunctionalGroupsSequence).IsValid())
		count_frame(tag, s);
}

/* What DimensionIndexValues say of a frame beside its stack and its place in it. */
void describe_index(const Tags &tag, ct_slice *s)
{
	const vtkDICOMValue &dimensions = tag.m->Get(DC::DimensionIndexSequence);
	const vtkDICOMValue &values = tag(DC::DimensionIndexValues);
	const size_t n = std::min(dimensions.GetNumberOfValues(), values.GetNumberOfValues());
	std::string text;

	for (size_t k = 0; k < n; k++) {
		const vtkDICOMValue &of =
			dimensions.GetSequenceData()[k].Get(DC::DimensionIndexPointer);
		const vtkDICOMTag what = of.IsValid() ? of.AsTag() : vtkDICOMTag();

		if (what != DC::StackID && what != DC::InStackPositionNumber &&
			what != DC::ImagePositionPatient)
			text += (text.empty() ? "" : "\\") +
				std::to_string(values.GetInt(static_cast<unsigned>(k)));
	}
	std::snprintf(s->index, sizeof s->index, "%s", text.c_str());
}

void describe_values(const Tags &tag, ct_slice *s)
{
	double scale[2], padding;

	s->scaled = tag.numbers(DC::RescaleSlope, scale, 1) &&
		    tag.numbers(DC::RescaleIntercept, scale + 1, 1);
	if (s->scaled) {
		s->slope = scale[0];
		s->intercept = scale[1];
	}
	put(s->unit, tag(DC::RescaleType));
	s->padded = tag.numbers(DC::PixelPaddingValue, &padding, 1);
	if (!s->padded)
		return;
	s->padding[0] = s->padding[1] = stored(padding, s->is_signed, s->allocated);
	if (tag.numbers(DC::PixelPaddingRangeLimit, &padding, 1))
		s->padding[1] = stored(padding, s->is_signed, s->allocated);
}

void describe_moment(const Tags &tag, ct_slice *s)
{
	s->acquisition = tag.whole(DC::AcquisitionNumber, 0);
	s->moment = tag.number(DC::TemporalPositionIdentifier);
	if (std::isnan(s->moment))
		s->moment = tag.number(DC::TemporalPositionIndex);
	s->phase = tag.number(DC::NominalPercentageOfCardiacPhase);
	s->trigger = tag.number(DC::TriggerTime);
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

size_t count_frames(vtkDICOMMetaData *m, std::string *wrong)
{
	return Tags{m, 0, wrong}.count(DC::NumberOfFrames, 1);
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

std::string describe_frame(vtkDICOMMetaData *m, size_t frame, ct_slice *s)
{
	std::string wrong;
	const Tags tag = {m, static_cast<int>(frame), &wrong};

	s->frame = frame;
	s->frames = count_frames(m, &wrong);
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
	put(s->contrast, tag(DC::ContrastBolusAgent));
	put(s->stack, tag(DC::StackID));
	put(s->whole, tag(DC::ConcatenationUID));
	s->part = tag.whole(DC::InConcatenationNumber, 0);
	s->parts = tag.whole(DC::InConcatenationTotalNumber, 0);
	s->before = tag.count(DC::ConcatenationFrameOffsetNumber, 0);
	s->number = tag.whole(DC::SeriesNumber, 0);
	s->instance = tag.whole(DC::InstanceNumber, 0);
	s->announced = tag.whole(DC::ImagesInAcquisition, 0);
	s->kvp = tag.number(DC::KVP);
	s->thickness = tag.number(DC::SliceThickness);
	s->tilt = tag.number(DC::GantryDetectorTilt);
	s->between = tag.number(DC::SpacingBetweenSlices);
	s->diameter = tag.number(DC::ReconstructionDiameter);
	s->collimation = tag.number(DC::SingleCollimationWidth);
	s->columns = tag.count(DC::Columns, 0);
	s->rows = tag.count(DC::Rows, 0);
	s->samples = tag.count(DC::SamplesPerPixel, 1);
	s->claimed = static_cast<double>(s->columns) * static_cast<double>(s->rows) *
		     static_cast<double>(s->samples) *
		     static_cast<double>((tag.count(DC::BitsAllocated, 16) + 7) / 8);
	put(s->syntax, m->Get(DC::TransferSyntaxUID));
	s->allocated = tag.whole(DC::BitsAllocated, 0);
	s->stored = tag.whole(DC::BitsStored, 0);
	s->is_signed = tag.whole(DC::PixelRepresentation, 0) != 0;
	describe_place(tag, s);
	describe_values(tag, s);
	describe_moment(tag, s);
	describe_index(tag, s);
	return wrong;
}
