/* image.c: see image.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/acquired.h"
#include "core/number.h"
#include "formats/hash.h"
#include "formats/voxels.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "dicom/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CT_IMAGE "1.2.840.10008.5.1.4.1.1.2"
#define ENHANCED_CT_IMAGE "1.2.840.10008.5.1.4.1.1.2.1"
#define NO_DATE "19000101000000" /* where one has to be */

/* A row of a table of elements. */
struct fixed {
	const char *keyword, *text;
};

static void put(struct ct_header *h, const struct fixed *f, size_t n)
{
	for (size_t i = 0; i < n; i++)
		ct_header_put(h, "", f[i].keyword, "%s", f[i].text);
}
#define PUT(h, table) put(h, table, sizeof(table) / sizeof *(table))

static const struct fixed common[] = {
	{"Modality", "CT"},
	{"Manufacturer", "ctsr"},
	{"SoftwareVersions", PACKAGE_VERSION},
	{"SamplesPerPixel", "1"},
	{"PhotometricInterpretation", "MONOCHROME2"},
	{"BitsAllocated", "16"},
	{"BitsStored", "16"},
	{"HighBit", "15"},
	{"PixelRepresentation", "1"},
	{"ImageComments", "research use, not for diagnosis"},
};

static const struct fixed single[] = {
	{"SOPClassUID", CT_IMAGE},
	{"ImageType", "DERIVED\\SECONDARY\\AXIAL"},
	{"RescaleIntercept", "0"},
	{"RescaleSlope", "1"},
};

static const struct fixed anonymous[] = {
	{"PatientIdentityRemoved", "YES"},
	{"DeidentificationMethod", "PS3.15 Basic Application Level Confidentiality Profile"},
	{"LongitudinalTemporalInformationModified", "REMOVED"},
};

#define SHARED "SharedFunctionalGroupsSequence.0."
#define FRAME_TYPE SHARED "CTImageFrameTypeSequence.0."
#define DERIVATION "DerivationImageSequence.0."
#define VALUES SHARED "PixelValueTransformationSequence.0."
static const struct fixed frames[] = {
	{"SOPClassUID", ENHANCED_CT_IMAGE},
	{"InstanceNumber", "1"},
	{"DeviceSerialNumber", "0"},
	{"PixelPresentation", "MONOCHROME"},
	{"VolumetricProperties", "VOLUME"},
	{"VolumeBasedCalculationTechnique", "NONE"},
	{"ContentQualification", "RESEARCH"},
	{"PresentationLUTShape", "IDENTITY"},
	{"AcquisitionContextSequence", ""},
	{"DimensionOrganizationType", "3D"},
	{"DimensionIndexSequence.0.DimensionIndexPointer", "InStackPositionNumber"},
	{"DimensionIndexSequence.0.FunctionalGroupPointer", "FrameContentSequence"},
	{FRAME_TYPE "PixelPresentation", "MONOCHROME"},
	{FRAME_TYPE "VolumetricProperties", "VOLUME"},
	{FRAME_TYPE "VolumeBasedCalculationTechnique", "NONE"},
	{SHARED "FrameAnatomySequence.0.FrameLaterality", "U"},
	{VALUES "RescaleIntercept", "0"},
	{VALUES "RescaleSlope", "1"},
};

/* The codes of what BodyPartExamined calls in words; the last stands for the others. */
static const struct region {
	const char *word, *code, *meaning;
} regions[] = {
	{"HEAD", "69536005", "Head"},
	{"NECK", "45048000", "Neck"},
	{"CHEST", "51185008", "Chest"},
	{"ABDOMEN", "113345001", "Abdomen"},
	{"PELVIS", "12921003", "Pelvis"},
	{NULL, "38266002", "Entire body"},
};

static const char *from(const struct image *im, const char *keyword)
{
	return ct_header_get(&im->from, keyword);
}

static const char *unit(const struct image *im)
{
	const char *quantity = ct_meta_get(&im->v->meta, CT_META_QUANTITY);

	return quantity && strcmp(quantity, CT_QUANTITY_OTHER) == 0 ? "OTHER" : "HU";
}

/* What a hash of `what`, k and the content says. */
static void new_uid(char out[CT_UID_TEXT], const struct image *im, const char *what, size_t k)
{
	const uint64_t place = k;

	policy_uid(out, 3,
		(const struct ct_piece[]){{im->content, sizeof im->content}, {what, strlen(what)},
			{&place, sizeof place}});
}

static void put_uid(struct ct_header *h, const struct image *im, const char *keyword, size_t k)
{
	char uid[CT_UID_TEXT];

	new_uid(uid, im, keyword, k);
	ct_header_put(h, "", keyword, "%s", uid);
}

static void put_description(struct ct_header *h, const struct image *im)
{
	enum { LONGEST = 64 };
	const char *about = im->deid ? NULL : from(im, "SeriesDescription");
	const char *made = ct_meta_get(&im->v->meta, CT_META_UPSAMPLE) ? "SR" : "derived";
	char own[40];
	double mm[3], times;

	ct_vol_spacing(im->v, mm);
	times = im->n ? im->source[0].pitch[0] / mm[0] : 0;
	snprintf(own, sizeof own, times > 1.2 ? "%s x%.3g" : "%s", made, times);
	if (about && strlen(about) + strlen(own) >= LONGEST)
		about = NULL;
	ct_header_put(
		h, "", "SeriesDescription", "%s%s%s", about ? about : "", about ? " " : "", own);
}

#define EQUIPMENT "ContributingEquipmentSequence."
static void put_equipment(struct ct_header *h, const struct image *im)
{
	const char *own = EQUIPMENT "0.";

	if (policy_take_machine(h, &im->from, own, im->deid)) {
		ct_header_code(h, own, "PurposeOfReferenceCodeSequence", "109101", "DCM",
			"Acquisition Equipment");
		own = EQUIPMENT "1.";
	}
	ct_header_code(
		h, own, "PurposeOfReferenceCodeSequence", "109102", "DCM", "Processing Equipment");
	ct_header_put(h, own, "Manufacturer", "ctsr");
	ct_header_put(h, own, "ManufacturerModelName", "%s", im->tool);
	ct_header_put(h, own, "SoftwareVersions", PACKAGE_VERSION);
}

/* The moment that SOURCE_DATE_EPOCH is. The picture of many has to say one of its content: that of
 * what it comes from, or some moment. */
static void put_dates(struct ct_header *h, const struct image *im)
{
	static const char *const dates[][2] = {{"InstanceCreationDate", "InstanceCreationTime"},
		{"SeriesDate", "SeriesTime"}, {"ContentDate", "ContentTime"}};
	const char *date = im->deid ? NULL : im->date;
	const char *known = im->deid ? NULL : from(im, POLICY_CONTENT);
	const char *content = date ? date : !im->frames ? NULL : known ? known : NO_DATE;

	for (size_t i = 0; i < 3; i++) {
		const char *text = i == 2 ? content : date;

		if (!text)
			continue;
		ct_header_put(h, "", dates[i][0], "%.8s", text);
		ct_header_put(h, "", dates[i][1], "%s", text + 8);
	}
}

/* mm: slices that are where they were scanned are as thick as was said, others as they are apart.
 */
static double thickness(const struct image *im, double apart)
{
	double mm = im->n > 0 && !derive_resampled(im) ? im->source[0].thickness : 0;
	struct ct_acquired a;
	struct ct_err unused = {0};

	for (size_t k = 0; k < im->n; k++)
		if (im->source[k].thickness != im->source[0].thickness)
			return apart;
	if (im->n == 0 && ct_acquired_get(&a, &im->v->meta, &unused) == 0)
		for (int k = 0; k < 3; k++)
			if (fabs(a.spacing[k] - apart) < 1e-3 * apart)
				mm = fmax(mm, a.thickness[k]);
	return mm > 0 ? mm : apart;
}

/* What the pixels of all pictures are, and what they measure. */
static void put_pixels(struct ct_header *h, const struct image *im)
{
	static const char *const single_in[] = {"", "", "", ""};
	static const char *const frames_in[] = {SHARED "PixelMeasuresSequence.0.",
		SHARED "PlaneOrientationSequence.0.", VALUES, SHARED "FrameVOILUTSequence.0."};
	const char *const *in = im->frames ? frames_in : single_in;
	const char *centre = from(im, "WindowCenter"), *width = from(im, "WindowWidth");
	const bool both = centre && width;
	struct ct_slice s = {0};
	double mm[3], axes[6];

	ct_slice_place(&s, im->v->affine, 0);
	ct_vol_spacing(im->v, mm);
	memcpy(axes, s.across, sizeof s.across);
	memcpy(axes + 3, s.down, sizeof s.down);
	ct_header_put(h, "", "Columns", "%zu", im->v->n[0]);
	ct_header_put(h, "", "Rows", "%zu", im->v->n[1]);
	ct_header_numbers(h, in[0], "PixelSpacing", 2, (const double[]){s.pitch[1], s.pitch[0]});
	ct_header_numbers(h, in[0], "SliceThickness", 1, (const double[]){thickness(im, mm[2])});
	ct_header_numbers(h, in[0], "SpacingBetweenSlices", 1, &mm[2]);
	ct_header_numbers(h, in[1], "ImageOrientationPatient", 6, axes);
	ct_header_put(h, in[2], "RescaleType", "%s", unit(im));
	ct_header_put(h, in[3], "WindowCenter", "%s", both ? centre : "40");
	ct_header_put(h, in[3], "WindowWidth", "%s", both ? width : "400");
}

static void put_region(struct ct_header *h, const struct image *im)
{
	const char *part = from(im, "BodyPartExamined");
	const struct region *r = regions;

	while (r->word && !(part && strcmp(part, r->word) == 0))
		r++;
	ct_header_code(h, SHARED "FrameAnatomySequence.0.", "AnatomicRegionSequence", r->code,
		"SCT", r->meaning);
}

static void put_frames(struct ct_header *h, const struct image *im)
{
	const char *type = derive_resampled(im) ? "DERIVED\\PRIMARY\\VOLUME\\RESAMPLED"
						: "DERIVED\\PRIMARY\\VOLUME\\NONE";

	PUT(h, frames);
	put_region(h, im);
	ct_header_put(h, "", "ImageType", "%s", type);
	ct_header_put(h, FRAME_TYPE, "FrameType", "%s", type);
	ct_header_put(h, "", "NumberOfFrames", "%zu", im->v->n[2]);
}

bool image_has_writing(const struct image *im)
{
	const char *burned = from(im, POLICY_BURNED);

	return burned && strcmp(burned, "YES") == 0;
}

static void put_missing(struct ct_header *h, const char *keyword, const char *text)
{
	if (!ct_header_get(h, keyword))
		ct_header_put(h, "", keyword, "%s", text);
}

/* All but UIDs. */
static void put_head(struct ct_header *h, const struct image *im)
{
	const char *number = from(im, "SeriesNumber");
	long long before = 0;

	policy_take(h, &im->from, im->deid, im->frames);
	PUT(h, common);
	if (im->frames)
		put_frames(h, im);
	else
		PUT(h, single);
	put_pixels(h, im);
	put_description(h, im);
	put_equipment(h, im);
	if (!im->frames)
		derive_put(h, im, "");
	put_dates(h, im);
	if (im->deid) {
		PUT(h, anonymous);
		if (image_has_writing(im)) /* PS3.3 C.7.1.1: YES speaks of pixels, too */
			ct_header_put(h, "", "PatientIdentityRemoved", "NO");
		ct_header_code(h, "", "DeidentificationMethodCodeSequence", "113100", "DCM",
			"Basic Application Confidentiality Profile");
	}
	ct_header_put(h, "", "ManufacturerModelName", "%s", im->tool);
	ct_header_put(h, "", "SeriesNumber", "%ld",
		number && ct_number_whole(&before, number, 1, 999999) ? (long)before + 1000 : 1L);
	if (!im->frames && !from(im, "BodyPartExamined") && !from(im, "Laterality"))
		ct_header_put(h, "", "Laterality", "%s", ""); /* of what there may be two */
	if (!im->deid && ct_header_get(h, "PatientIdentityRemoved"))
		put_missing(h, "DeidentificationMethod", "not said by the source");
}

static void add_text(struct ct_hash *h, const char *text)
{
	ct_hash_add(h, text, strlen(text) + 1);
}

/* Where the voxels lie, what they are, what is said of them and what they come from. */
static int hash_content(struct image *im, struct ct_err *e)
{
	const struct ct_vol *v = im->v;
	const size_t area = v->n[0] * v->n[1];
	struct ct_hash h;
	int16_t *px;

	if (ct_alloc(&px, area, sizeof *px, e))
		return -1;
	ct_hash_begin(&h);
	ct_hash_add(&h, v->n, sizeof v->n);
	ct_hash_add(&h, v->affine, sizeof v->affine);
	for (size_t k = 0; k < v->n[2]; k++) {
		ct_voxels_i16(area, px, v->data + k * area, false);
		ct_hash_add(&h, px, area * sizeof *px);
	}
	for (size_t i = 0; i < im->head.n; i++) {
		add_text(&h, im->head.element[i].path);
		add_text(&h, im->head.element[i].text);
	}
	for (size_t i = 0; i < im->n; i++)
		add_text(&h, im->source[i].object);
	ct_hash_digest(&h, im->content);
	free(px);
	return 0;
}

/* The UIDs that all files share. All pictures are of one event, whichever that was. */
static void put_uids(struct ct_header *h, const struct image *im)
{
	static const char *const of_source[] = {"StudyInstanceUID", "FrameOfReferenceUID"};
	const char *event = from(im, "IrradiationEventUID");
	char uid[CT_UID_TEXT];

	for (size_t i = 0; i < 2; i++)
		if (!ct_header_get(h, of_source[i]))
			put_uid(h, im, of_source[i], 0);
	put_uid(h, im, "SeriesInstanceUID", 0);
	if (!im->frames)
		return;
	new_uid(uid, im, "IrradiationEventUID", 0);
	policy_put_uid(h, SHARED "IrradiationEventIdentificationSequence.0.", "IrradiationEventUID",
		event ? event : uid, event && im->deid);
	new_uid(uid, im, "DimensionOrganizationUID", 0);
	ct_header_put(h, "DimensionOrganizationSequence.0.", "DimensionOrganizationUID", "%s", uid);
	ct_header_put(h, "DimensionIndexSequence.0.", "DimensionOrganizationUID", "%s", uid);
}

int image_head(struct image *im, struct ct_err *e)
{
	static const struct image none;

	put_head(&im->head, im);
	if (hash_content(im, e))
		return -1;
	put_uids(&im->head, im);
	new_uid(im->program, &none, "ctsr", 0);
	return ct_header_check(&im->head, e);
}

static void put_frame(struct ct_header *h, const struct image *im, size_t k)
{
	char in[80], group[160];
	struct ct_slice own = {0};

	ct_slice_place(&own, im->v->affine, k);
	snprintf(in, sizeof in, "PerFrameFunctionalGroupsSequence.%zu.", k);
	snprintf(group, sizeof group, "%sFrameContentSequence.0.", in);
	ct_header_put(h, group, "StackID", "1");
	ct_header_put(h, group, "InStackPositionNumber", "%zu", k + 1);
	ct_header_put(h, group, "DimensionIndexValues", "%zu", k + 1);
	snprintf(group, sizeof group, "%sPlanePositionSequence.0.", in);
	ct_header_numbers(h, group, "ImagePositionPatient", 3, own.position);
	if (im->n == 0)
		return;
	snprintf(group, sizeof group, "%s" DERIVATION, in);
	derive_put(h, im, group);
	derive_sources(h, im, group, k);
}

int image_own(struct ct_header *h, const struct image *im, size_t k, struct ct_err *e)
{
	struct ct_slice own = {0};
	double normal[3], along;

	put_uid(h, im, "SOPInstanceUID", k);
	if (im->frames) {
		derive_evidence(h, im);
		for (size_t i = 0; i < im->v->n[2]; i++)
			put_frame(h, im, i);
		return ct_header_check(h, e);
	}
	ct_slice_place(&own, im->v->affine, k);
	ct_slice_normal(&own, normal);
	along = ct_vec3_dot(normal, own.position);
	ct_header_put(h, "", "InstanceNumber", "%zu", k + 1);
	ct_header_numbers(h, "", "ImagePositionPatient", 3, own.position);
	ct_header_numbers(h, "", "SliceLocation", 1, &along);
	derive_sources(h, im, "", k);
	return ct_header_check(h, e);
}

void image_free(struct image *im)
{
	ct_header_free(&im->from);
	ct_header_free(&im->head);
}
