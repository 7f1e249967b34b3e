/* derive.c: see image.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "dicom/image.h"
#include "core/vec3.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Widen the box by the corners of a picture. */
static void widen(double box[3][2], const struct ct_slice *s, size_t columns, size_t rows)
{
	for (int corner = 0; corner < 4; corner++)
		for (int d = 0; d < 3; d++) {
			const double i = corner & 1 ? (double)(columns - 1) * s->pitch[0] : 0;
			const double j = corner & 2 ? (double)(rows - 1) * s->pitch[1] : 0;
			const double x = s->position[d] + i * s->across[d] + j * s->down[d];

			box[d][0] = fmin(box[d][0], x);
			box[d][1] = fmax(box[d][1], x);
		}
}

int derive_check(const struct image *im, bool other_space, struct ct_err *e)
{
	const double none[2] = {(double)INFINITY, -(double)INFINITY};
	const size_t last = im->v->n[2] - 1;
	double theirs[3][2], own[3][2];
	struct ct_slice s = {0};

	for (int d = 0; d < 3; d++) {
		memcpy(theirs[d], none, sizeof none);
		memcpy(own[d], none, sizeof none);
	}
	for (size_t i = 0; i < im->n; i++) {
		if (strcmp(im->source[i].modality, "CT") != 0)
			return ct_fail(e, CT_EINPUT,
				"%s: modality is '%s', and DICOM is written of CT",
				im->source[i].path, im->source[i].modality);
		if (im->source[i].placed)
			widen(theirs, &im->source[i], im->source[i].columns, im->source[i].rows);
	}
	for (size_t k = 0; k <= last; k += last ? last : 1) {
		ct_slice_place(&s, im->v->affine, k);
		widen(own, &s, im->v->n[0], im->v->n[1]);
	}
	for (int d = 0; d < 3; d++)
		if (!other_space && (own[d][0] > theirs[d][1] || theirs[d][0] > own[d][1]))
			return ct_fail(e, CT_EGEOM,
				"%s: its slices lie beside the volume: they are not of one space; "
				"ct-convert --template-other-patient takes it all the same",
				im->source[0].path);
	return 0;
}

void derive_space(char out[static DERIVE_SPACE], const struct ct_slice *s)
{
	const char *uid = *s->space ? s->space : s->study;
	uint64_t bits[2];

	*out = '\0';
	if (!*uid && !*s->patient)
		return;
	ct_hash_pieces(bits, 2,
		(const struct ct_piece[]){
			{s->patient, strlen(s->patient) + 1}, {uid, strlen(uid)}});
	snprintf(out, DERIVE_SPACE, "%016" PRIx64 "%016" PRIx64, bits[0], bits[1]);
}

int derive_check_space(const struct image *im, struct ct_err *e)
{
	const char *own = ct_meta_get(&im->v->meta, CT_META_SPACE);
	char theirs[DERIVE_SPACE];

	derive_space(theirs, im->source);
	return !own || strcmp(own, theirs) == 0
		       ? 0
		       : ct_fail(e, CT_EGEOM,
				 "%s: is of another patient or space (%.8s) than IN (%.8s); ct-convert "
				 "--template-other-patient takes it all the same",
				 im->source->path, *theirs ? theirs : "not said", own);
}

bool derive_resampled(const struct image *im)
{
	const struct ct_vol *v = im->v;
	struct ct_slice own = {0};

	if (im->n == 0)
		return ct_meta_get(&v->meta, CT_META_UPSAMPLE) != NULL;
	ct_slice_place(&own, v->affine, 0);
	return ct_meta_get(&v->meta, CT_META_UPSAMPLE) || im->n != v->n[2] ||
	       fabs(own.pitch[0] - im->source[0].pitch[0]) > 1e-4 * own.pitch[0] ||
	       fabs(own.pitch[1] - im->source[0].pitch[1]) > 1e-4 * own.pitch[1];
}

void derive_put(struct ct_header *h, const struct image *im, const char *in)
{
	const bool resampled = derive_resampled(im);
	const char *line = ct_meta_get(&im->v->meta, CT_META_HISTORY);
	char text[900];
	size_t at = (size_t)snprintf(text, sizeof text, "ctsr %s:", PACKAGE_VERSION);

	while (line && *line && at < sizeof text - 80) {
		const size_t n = strcspn(line, "\n"), word = strcspn(line, " \n");

		if (word < 40 && strncmp(line, "ct-", 3) == 0)
			at += (size_t)snprintf(
				text + at, sizeof text - at, " %.*s", (int)word, line);
		line += n + (line[n] == '\n');
	}
	ct_header_put(h, in, "DerivationDescription", "%s", text);
	ct_header_code(h, in, "DerivationCodeSequence", resampled ? "113085" : "113091", "DCM",
		resampled ? "Spatial resampling"
			  : "Spatially-related frames extracted from the volume");
}

/* Item `in` that names a slice. */
static void put_reference(
	struct ct_header *h, const struct image *im, const char *in, const struct ct_slice *s)
{
	ct_header_put(h, in, "ReferencedSOPClassUID", "%s", s->storage);
	policy_put_uid(h, in, "ReferencedSOPInstanceUID", s->object, im->deid);
}

static void put_source(struct ct_header *h, const struct image *im, const char *in, size_t item,
	const struct ct_slice *s)
{
	char at[200];

	snprintf(at, sizeof at, "%sSourceImageSequence.%zu.", in, item);
	put_reference(h, im, at, s);
	ct_header_code(h, at, "PurposeOfReferenceCodeSequence", "121322", "DCM",
		"Source image for image processing operation");
	if (s->frames > 1)
		ct_header_put(h, at, "ReferencedFrameNumber", "%zu", s->frame + 1);
}

void derive_evidence(struct ct_header *h, const struct image *im)
{
	static const char study[] = "SourceImageEvidenceSequence.0.";
	static const char series[] = "SourceImageEvidenceSequence.0.ReferencedSeriesSequence.0.";
	char at[160];
	size_t item = 0;

	if (im->n == 0)
		return;
	policy_put_uid(h, series, "SeriesInstanceUID", im->source[0].series, im->deid);
	ct_header_put(
		h, study, "StudyInstanceUID", "%s", ct_header_get(&im->head, "StudyInstanceUID"));
	for (size_t i = 0; i < im->n; i++) {
		if (i > 0 && strcmp(im->source[i].object, im->source[i - 1].object) == 0)
			continue; /* another frame */
		snprintf(at, sizeof at, "%sReferencedSOPSequence.%zu.", series, item++);
		put_reference(h, im, at, &im->source[i]);
	}
}

/* How far slice s is from a plane, along its normal: 0 if on it. */
static double distance(
	const struct ct_slice *s, const struct ct_slice *plane, const double normal[3])
{
	const double at = ct_vec3_dot(normal, s->position) - ct_vec3_dot(normal, plane->position);

	return fabs(at) < 1e-3 ? 0 : at;
}

void derive_sources(struct ct_header *h, const struct image *im, const char *in, size_t k)
{
	double normal[3], theirs[3], mm[3], below = -(double)INFINITY, above = (double)INFINITY;
	struct ct_slice own = {0};
	size_t item = 0;
	bool parallel;

	if (im->n == 0)
		return;
	ct_slice_place(&own, im->v->affine, k);
	ct_slice_normal(&own, normal);
	ct_slice_normal(&im->source[0], theirs);
	parallel = fabs(ct_vec3_dot(normal, theirs)) > 0.999;
	ct_vol_spacing(im->v, mm);
	for (size_t i = 0; i < im->n; i++) {
		const double at = distance(&im->source[i], &own, normal);

		below = at <= 0 ? fmax(below, at) : below;
		above = at >= 0 ? fmin(above, at) : above;
	}
	for (size_t i = 0; i < im->n; i++) {
		const double at = distance(&im->source[i], &own, normal);

		if (!parallel || at == below || at == above || !(fabs(at) > mm[2] / 2))
			put_source(h, im, in, item++, &im->source[i]);
	}
}
