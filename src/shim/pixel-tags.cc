/* pixel-tags.cc: see dicom-tags.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/fragments.h"
#include "shim/dicom-tags.h"

#include <vtkDICOMDictionary.h>
#include <vtkDICOMValue.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>

namespace
{

std::string text_of(vtkDICOMMetaData *m, vtkDICOMTag tag)
{
	const vtkDICOMValue &v = m->Get(tag);
	std::string text = v.IsValid() ? v.AsString() : std::string();

	return text.erase(text.find_last_not_of(std::string(" \0", 2)) + 1);
}

/* Bytes of all pictures, as the header has it; 0 if it does not say. */
double bytes_of(vtkDICOMMetaData *m, size_t frames)
{
	const std::string colours = text_of(m, DC::PhotometricInterpretation);
	const bool shared = colours == "YBR_FULL_422" || colours == "YBR_PARTIAL_422";
	double bits = static_cast<double>(frames);

	for (vtkDICOMTag tag : {DC::Rows, DC::Columns, DC::BitsAllocated})
		bits *= m->Get(tag).AsDouble();
	bits *= std::max(1.0, m->Get(DC::SamplesPerPixel).AsDouble());
	return std::ceil(shared ? bits / 12 : bits / 8);
}

/* Does an overlay lie in the bits of the numbers? */
bool has_overlay(vtkDICOMMetaData *m)
{
	for (unsigned short group = 0x6000; group <= 0x601e; group += 2)
		if (m->Get(vtkDICOMTag(group, 0x0102)).AsInt() > 0 &&
			!m->Has(vtkDICOMTag(group, 0x3000)))
			return true;
	return false;
}

bool is_lossy(const std::string &syntax)
{
	for (const char *end : {"50", "51", "81", "91", "203", "112"})
		if (syntax == std::string("1.2.840.10008.1.2.4.") + end)
			return true;
	return false;
}

/* Of floats. */
void describe_padding(vtkDICOMMetaData *m, ct_slice *s)
{
	const bool wide = s->allocated == 64;
	const vtkDICOMValue &value = m->Get(wide ? DC::DoubleFloatPixelPaddingValue
						 : DC::FloatPixelPaddingValue),
			    &limit = m->Get(wide ? DC::DoubleFloatPixelPaddingRangeLimit
						 : DC::FloatPixelPaddingRangeLimit);

	s->padded = value.IsValid();
	s->padding[0] = s->padding[1] = value.AsDouble();
	if (limit.IsValid())
		s->padding[1] = limit.AsDouble();
}

} // namespace

std::string wrong_pixels(vtkDICOMMetaData *m, Outline *o, uint64_t file_size, size_t frames)
{
	const Coding coding = coding_of(o->syntax);
	const bool native = coding == Coding::plain || coding == Coding::big_endian;
	const double want = bytes_of(m, frames), is = o->length;
	char text[120] = "";

	if (!(m->Get(DC::Rows).AsDouble() > 0 && m->Get(DC::Columns).AsDouble() > 0))
		return "Rows or Columns is 0 or absent: the size of the picture is not known";
	if (native && o->length == NO_LENGTH)
		std::snprintf(text, sizeof text,
			o->uid ? "TransferSyntaxUID %.30s is not compressed, but PixelData is in fragments"
			       : "PixelData is in fragments, but no TransferSyntaxUID says how compressed",
			o->syntax.c_str());
	if (o->length == NO_LENGTH || coding == Coding::other)
		return text;
	if (o->length > file_size - o->pixels || is < want)
		return "truncated: its picture is cut off";
	/* a word of zeros is no pixels: a wrong Rows or Columns leaves rows of them */
	if (want > 0 && is > want + std::fmod(want, 2) && !(is <= want + 2 && o->word_of_zeros))
		std::snprintf(text, sizeof text,
			"PixelData has %.0f bytes; by Rows, Columns, BitsAllocated, NumberOfFrames %.0f",
			is, want);
	if (!native)
		o->syntax = "1.2.840.10008.1.2.1";
	return text;
}

void describe_bits(vtkDICOMMetaData *m, const Outline &o, ct_slice *s)
{
	const vtkDICOMValue &high = m->Get(DC::HighBit);

	s->high = high.IsValid() && high.GetNumberOfValues() > 0 ? high.AsInt() : -1;
	s->overlaid = has_overlay(m);
	s->lossy = is_lossy(o.syntax) || text_of(m, DC::LossyImageCompression) == "01";
	s->table = m->Get(DC::ModalityLUTSequence).GetNumberOfValues() > 0;
	std::snprintf(s->colours, sizeof s->colours, "%s",
		text_of(m, DC::PhotometricInterpretation).c_str());
	std::snprintf(s->syntax, sizeof s->syntax, "%s", o.syntax.c_str());
	s->floats = o.pixel_data == FLOAT_PIXEL_DATA || o.pixel_data == DOUBLE_PIXEL_DATA;
	if (s->floats)
		describe_padding(m, s);
}
