/* image.c: see image.h. */
#include "config.h"
#include "formats/hash.h"
#include "formats/voxels.h"
#include "core/mem.h"
#include "dicom/derive.h"
#include "dicom/image.h"
#include "dicom/policy.h"

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

static int put(struct ct_header *h, const struct fixed *f, size_t n, struct ct_err *e)
{
	for (size_t i = 0; i < n; i++)
		if (ct_header_put(h, e, "", f[i].keyword, "%s", f[i].text))
			return -1;
	return 0;
}
#define PUT(h, table, e) put(h, table, sizeof(table) / sizeof *(table), e)

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
static int new_uid(
	char out[CT_UID_TEXT], const struct image *im, const char *what, size_t k, struct ct_err *e)
{
	const uint64_t place = k;
	struct ct_hash *h;
	uint64_t bits[2];

	if (ct_hash_alloc(&h, e))
		return -1;
	CT_SIMD(ct_hash_add)(h, im->content, sizeof im->content);
	CT_SIMD(ct_hash_add)(h, what, strlen(what));
	CT_SIMD(ct_hash_add)(h, &place, sizeof place);
	ct_hash_digest(h, bits);
	free(h);
	ct_header_uid(out, bits);
	return 0;
}

static int put_uid(struct ct_header *h, const struct image *im, const char *keyword, size_t k,
	struct ct_err *e)
{
	char uid[CT_UID_TEXT];

	return new_uid(uid, im, keyword, k, e) || ct_header_put(h, e, "", keyword, "%s", uid) ? -1
											      : 0;
}

int image_program(char uid[CT_UID_TEXT], struct ct_err *e)
{
	static const struct image none;

	return new_uid(uid, &none, "ctsr", 0, e);
}

static int put_description(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	enum { LONGEST = 64 };
	const char *about = im->deid ? NULL : from(im, "SeriesDescription");
	const char *made = ct_meta_get(&im->v->meta, CT_META_UPSAMPLE) ? "SR" : "derived";
	char own[40], *text = NULL;
	double mm[3], times;
	int rc;

	ct_vol_spacing(im->v, mm);
	times = im->n ? im->source[0].pitch[0] / mm[0] : 0;
	snprintf(own, sizeof own, times > 1.2 ? "%s x%.3g" : "%s", made, times);
	if (about && strlen(about) + strlen(own) >= LONGEST)
		about = NULL;
	if (asprintf(&text, "%s%s%s", about ? about : "", about ? " " : "", own) < 0)
		return ct_fail(e, CT_ENOMEM, "no memory for a header");
	rc = ct_header_put(h, e, "", "SeriesDescription", "%s", text);
	free(text);
	return rc;
}

#define EQUIPMENT "ContributingEquipmentSequence."
static int put_equipment(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	bool scanner;
	const char *own;

	if (policy_take_machine(h, &im->from, EQUIPMENT "0.", im->deid, &scanner, e) ||
		(scanner && ct_header_code(h, e, EQUIPMENT "0.", "PurposeOfReferenceCodeSequence",
				    "109101", "DCM", "Acquisition Equipment")))
		return -1;
	own = scanner ? EQUIPMENT "1." : EQUIPMENT "0.";
	return ct_header_code(h, e, own, "PurposeOfReferenceCodeSequence", "109102", "DCM",
		       "Processing Equipment") ||
			       ct_header_put(h, e, own, "Manufacturer", "ctsr") ||
			       ct_header_put(h, e, own, "ManufacturerModelName", "%s", im->tool) ||
			       ct_header_put(h, e, own, "SoftwareVersions", PACKAGE_VERSION)
		       ? -1
		       : 0;
}

static int put_deid(struct ct_header *h, struct ct_err *e)
{
	static const struct fixed done[] = {
		{"PatientIdentityRemoved", "YES"},
		{"DeidentificationMethod",
			"PS3.15 Basic Application Level Confidentiality Profile"},
		{"LongitudinalTemporalInformationModified", "REMOVED"},
	};

	return PUT(h, done, e) ||
			       ct_header_code(h, e, "", "DeidentificationMethodCodeSequence",
				       "113100", "DCM", "Basic Application Confidentiality Profile")
		       ? -1
		       : 0;
}

/* The moment that SOURCE_DATE_EPOCH is. The picture of many has to say one of its content: that of
 * what it comes from, or some moment. */
static int put_dates(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	static const char *const dates[][2] = {{"InstanceCreationDate", "InstanceCreationTime"},
		{"SeriesDate", "SeriesTime"}, {"ContentDate", "ContentTime"}};
	const char *date = im->deid ? NULL : im->date;
	const char *known = im->deid ? NULL : from(im, POLICY_CONTENT);
	const char *content = date ? date : !im->frames ? NULL : known ? known : NO_DATE;

	for (size_t i = 0; i < 3; i++) {
		const char *text = i == 2 ? content : date;

		if (text && (ct_header_put(h, e, "", dates[i][0], "%.8s", text) ||
				    ct_header_put(h, e, "", dates[i][1], "%s", text + 8)))
			return -1;
	}
	return 0;
}

static int put_window(struct ct_header *h, const struct image *im, const char *in, struct ct_err *e)
{
	const char *c = from(im, "WindowCenter"), *w = from(im, "WindowWidth");
	const bool both = c && w;

	return ct_header_put(h, e, in, "WindowCenter", "%s", both ? c : "40") ||
			       ct_header_put(h, e, in, "WindowWidth", "%s", both ? w : "400")
		       ? -1
		       : 0;
}

/* What the pixels of all pictures are, and what they measure. */
static int put_pixels(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	const char *in[] = {"", "", "", ""};
	double mm[3], spacing[2], axes[6];
	struct ct_slice s = {0};

	if (im->frames) {
		in[0] = SHARED "PixelMeasuresSequence.0.";
		in[1] = SHARED "PlaneOrientationSequence.0.";
		in[2] = VALUES;
		in[3] = SHARED "FrameVOILUTSequence.0.";
	}
	ct_slice_place(&s, im->v->affine, 0);
	ct_vol_spacing(im->v, mm);
	spacing[0] = s.pitch[1];
	spacing[1] = s.pitch[0];
	memcpy(axes, s.across, sizeof s.across);
	memcpy(axes + 3, s.down, sizeof s.down);
	return ct_header_put(h, e, "", "Columns", "%zu", im->v->n[0]) ||
			       ct_header_put(h, e, "", "Rows", "%zu", im->v->n[1]) ||
			       ct_header_numbers(h, e, in[0], "PixelSpacing", 2, spacing) ||
			       ct_header_numbers(h, e, in[0], "SliceThickness", 1, &mm[2]) ||
			       ct_header_numbers(h, e, in[0], "SpacingBetweenSlices", 1, &mm[2]) ||
			       ct_header_numbers(h, e, in[1], "ImageOrientationPatient", 6, axes) ||
			       ct_header_put(h, e, in[2], "RescaleType", "%s", unit(im)) ||
			       put_window(h, im, in[3], e)
		       ? -1
		       : 0;
}

static int put_region(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	const char *part = from(im, "BodyPartExamined");
	const struct region *r = regions;

	while (r->word && !(part && strcmp(part, r->word) == 0))
		r++;
	return ct_header_code(h, e, SHARED "FrameAnatomySequence.0.", "AnatomicRegionSequence",
		r->code, "SCT", r->meaning);
}

/* All slices are of one event, whichever that was. */
static int put_event(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	const char *known = from(im, "IrradiationEventUID");
	char uid[CT_UID_TEXT];

	if (known ? policy_uid(uid, known, e) : new_uid(uid, im, "IrradiationEventUID", 0, e))
		return -1;
	return ct_header_put(h, e, SHARED "IrradiationEventIdentificationSequence.0.",
		"IrradiationEventUID", "%s", known && !im->deid ? known : uid);
}

static int put_frames(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	const char *type = derive_resampled(im) ? "DERIVED\\PRIMARY\\VOLUME\\RESAMPLED"
						: "DERIVED\\PRIMARY\\VOLUME\\NONE";

	return PUT(h, frames, e) || put_region(h, im, e) ||
			       ct_header_put(h, e, "", "ImageType", "%s", type) ||
			       ct_header_put(h, e, FRAME_TYPE, "FrameType", "%s", type) ||
			       ct_header_put(h, e, "", "NumberOfFrames", "%zu", im->v->n[2])
		       ? -1
		       : 0;
}

/* All but UIDs. */
static int put_head(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	const char *number = from(im, "SeriesNumber");
	const long before = number ? strtol(number, NULL, 10) : 0;

	if (policy_take(h, &im->from, im->deid, im->frames, e) || PUT(h, common, e) ||
		(im->frames ? put_frames(h, im, e) : PUT(h, single, e)) || put_pixels(h, im, e) ||
		put_description(h, im, e) || put_equipment(h, im, e) ||
		(!im->frames && derive_put(h, im, "", e)) || put_dates(h, im, e) ||
		(im->deid && put_deid(h, e)) ||
		ct_header_put(h, e, "", "ManufacturerModelName", "%s", im->tool) ||
		ct_header_put(h, e, "", "SeriesNumber", "%ld",
			number && before > 0 && before < 1000000 ? before + 1000 : 1))
		return -1;
	if (!im->frames && !from(im, "BodyPartExamined") && !from(im, "Laterality") &&
		ct_header_put(h, e, "", "Laterality", "%s", ""))
		return -1; /* not known whether there are two of it */
	if (!im->deid && ct_header_get(h, "PatientIdentityRemoved") &&
		!ct_header_get(h, "DeidentificationMethod") &&
		ct_header_put(h, e, "", "DeidentificationMethod", "not said by the source"))
		return -1;
	if (!ct_header_get(h, "LossyImageCompression") &&
		ct_header_put(h, e, "", "LossyImageCompression", "00"))
		return -1;
	return ct_header_get(h, "BurnedInAnnotation")
		       ? 0
		       : ct_header_put(h, e, "", "BurnedInAnnotation", "NO");
}

static void add_text(struct ct_hash *h, const char *text)
{
	CT_SIMD(ct_hash_add)(h, text, strlen(text) + 1);
}

/* Where the voxels lie, what they are, what is said of them and what they come from. */
static int hash_content(struct image *im, struct ct_err *e)
{
	const struct ct_vol *v = im->v;
	const size_t area = v->n[0] * v->n[1];
	struct ct_hash *h = NULL;
	int16_t *px = NULL;
	int rc = -1;

	if (ct_hash_alloc(&h, e) || ct_alloc(&px, area, sizeof *px, e))
		goto out;
	CT_SIMD(ct_hash_add)(h, v->n, sizeof v->n);
	CT_SIMD(ct_hash_add)(h, v->affine, sizeof v->affine);
	for (size_t k = 0; k < v->n[2]; k++) {
		ct_voxels_i16(area, px, v->data + k * area, false);
		CT_SIMD(ct_hash_add)(h, px, area * sizeof *px);
	}
	for (size_t i = 0; i < im->head.n; i++) {
		add_text(h, im->head.element[i].path);
		add_text(h, im->head.element[i].text);
	}
	for (size_t i = 0; i < im->n; i++)
		add_text(h, im->source[i].object);
	ct_hash_digest(h, im->content);
	rc = 0;
out:
	free(h);
	free(px);
	return rc;
}

/* The UIDs that all files share. */
static int put_uids(struct ct_header *h, const struct image *im, struct ct_err *e)
{
	static const char *const of_source[] = {"StudyInstanceUID", "FrameOfReferenceUID"};
	char uid[CT_UID_TEXT];

	for (size_t i = 0; i < 2; i++)
		if (!ct_header_get(h, of_source[i]) && put_uid(h, im, of_source[i], 0, e))
			return -1;
	if (put_uid(h, im, "SeriesInstanceUID", 0, e))
		return -1;
	if (!im->frames)
		return 0;
	return put_event(h, im, e) || new_uid(uid, im, "DimensionOrganizationUID", 0, e) ||
			       ct_header_put(h, e, "DimensionOrganizationSequence.0.",
				       "DimensionOrganizationUID", "%s", uid) ||
			       ct_header_put(h, e, "DimensionIndexSequence.0.",
				       "DimensionOrganizationUID", "%s", uid)
		       ? -1
		       : 0;
}

int image_head(struct image *im, struct ct_err *e)
{
	return put_head(&im->head, im, e) || hash_content(im, e) || put_uids(&im->head, im, e) ? -1
											       : 0;
}

static int put_frame(struct ct_header *h, const struct image *im, size_t k, struct ct_err *e)
{
	char in[80], group[160];
	struct ct_slice own = {0};

	ct_slice_place(&own, im->v->affine, k);
	snprintf(in, sizeof in, "PerFrameFunctionalGroupsSequence.%zu.", k);
	snprintf(group, sizeof group, "%sFrameContentSequence.0.", in);
	if (ct_header_put(h, e, group, "StackID", "1") ||
		ct_header_put(h, e, group, "InStackPositionNumber", "%zu", k + 1) ||
		ct_header_put(h, e, group, "DimensionIndexValues", "%zu", k + 1))
		return -1;
	snprintf(group, sizeof group, "%sPlanePositionSequence.0.", in);
	if (ct_header_numbers(h, e, group, "ImagePositionPatient", 3, own.position))
		return -1;
	if (im->n == 0)
		return 0;
	snprintf(group, sizeof group, "%s" DERIVATION, in);
	return derive_put(h, im, group, e) || derive_sources(h, im, group, k, e) ? -1 : 0;
}

int image_own(struct ct_header *h, const struct image *im, size_t k, struct ct_err *e)
{
	struct ct_slice own = {0};
	double normal[3], along = 0;

	if (put_uid(h, im, "SOPInstanceUID", k, e))
		return -1;
	if (im->frames) {
		if (derive_evidence(h, im, e))
			return -1;
		for (size_t i = 0; i < im->v->n[2]; i++)
			if (put_frame(h, im, i, e))
				return -1;
		return 0;
	}
	ct_slice_place(&own, im->v->affine, k);
	ct_slice_normal(&own, normal);
	for (int d = 0; d < 3; d++)
		along += normal[d] * own.position[d];
	return ct_header_put(h, e, "", "InstanceNumber", "%zu", k + 1) ||
			       ct_header_numbers(
				       h, e, "", "ImagePositionPatient", 3, own.position) ||
			       ct_header_numbers(h, e, "", "SliceLocation", 1, &along) ||
			       derive_sources(h, im, "", k, e)
		       ? -1
		       : 0;
}

void image_free(struct image *im)
{
	ct_header_free(&im->from);
	ct_header_free(&im->head);
}
