/* radiograph.c: the one picture of X rays on a detector that a file holds; see dicom.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/words.h"
#include "series/header.h"
#include "shim/dicom-file.h"
#include "dicom/module.h"
#include "dicom/series-set.h"

#include <math.h>
#include <string.h>

static bool is_padding(const struct ct_slice *s, double x)
{
	return s->padded && x >= fmin(s->padding[0], s->padding[1]) &&
	       x <= fmax(s->padding[0], s->padding[1]);
}

/* Stored values to grey ones. */
static void to_gray(struct ct_vol *v, const struct ct_slice *s, bool turned)
{
	const double span = ldexp(1, s->stored) - 1;
	const double base = ct_slice_base(s);
	const double least = s->is_signed ? -ldexp(1, s->stored - 1) : 0;

	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double x = (double)v->data[i] + base,
			     g = fmin(fmax((x - least) / span, 0), 1);

		v->data[i] = is_padding(s, x) ? 0 : (float)(turned ? 1 - g : g);
	}
}

/* "ROWS\\COLUMNS" of the first of the fields that is there. */
static int read_pitch(
	double mm[2], const struct ct_header *h, const struct ct_slice *s, struct ct_err *e)
{
	static const char *const fields[] = {"ImagerPixelSpacing", "PixelSpacing"};

	double pitch[2];

	mm[0] = mm[1] = (double)NAN;
	for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
		const char *text = ct_header_get(h, fields[i]);

		if (!text)
			continue;
		if (ct_words_numbers(text, '\\', 2, false, pitch) && pitch[0] > 1e-6 &&
			pitch[1] > 1e-6 && pitch[0] < 1e4 && pitch[1] < 1e4) {
			mm[0] = pitch[1];
			mm[1] = pitch[0];
			return 0;
		}
		return ct_fail(e, CT_EGEOM, "%s: %s is '%.40s'", s->path, fields[i], text);
	}
	return 0;
}

/* Is its lowest value white? */
static int read_turn(
	bool *turned, const struct ct_header *h, const struct ct_slice *s, struct ct_err *e)
{
	const char *photometric = ct_header_get(h, "PhotometricInterpretation");
	const bool low_is_white = photometric && strcmp(photometric, "MONOCHROME1") == 0;

	if (!low_is_white && !(photometric && strcmp(photometric, "MONOCHROME2") == 0))
		return ct_fail(e, CT_EINPUT, "%s: PhotometricInterpretation is '%.40s', not grey",
			s->path, photometric ? photometric : "");
	if (ct_header_get(h, "ModalityLUTSequence"))
		return ct_fail(e, CT_EINPUT,
			"%s: ModalityLUTSequence: a table of values is not read", s->path);
	if (s->scaled && !(isfinite(s->slope) && s->slope != 0))
		return ct_fail(e, CT_EINPUT, "%s: RescaleSlope is %g", s->path, s->slope);
	*turned = low_is_white != (s->scaled && s->slope < 0);
	return 0;
}

static int check(const struct ct_slice *s, struct ct_err *e)
{
	if (!ct_slice_is_radiograph(s))
		return ct_fail(e, CT_EINPUT,
			"%s: modality is '%s', and --radiograph takes CR, DX and RF", s->path,
			s->modality);
	if (s->samples != 1)
		return ct_fail(e, CT_EINPUT, "%s: SamplesPerPixel is %zu: a picture in colour",
			s->path, s->samples);
	if (s->stored < 1 || s->stored > 32)
		return ct_fail(e, CT_EINPUT, "%s: BitsStored is %d", s->path, s->stored);
	return series_check_size(s, 1, e);
}

/* The one picture of all that was found. */
static int choose(const struct ct_slice **s, const struct series_set *set,
	const struct ct_dicom_in *in, struct ct_err *e)
{
	size_t pick;

	if (set->census.slices == 0)
		return series_choose(set, in, &pick, e);
	if (set->census.slices > 1)
		return ct_fail(e, CT_EGEOM,
			"%s: holds %zu pictures, and --radiograph takes one of a file",
			in->paths[0], set->census.slices);
	*s = set->census.slice;
	return 0;
}

int radiograph_read(struct ct_vol *v, double mm[2], const char *path, struct ct_err *e)
{
	static const char *const fields[] = {"PhotometricInterpretation", "ModalityLUTSequence",
		"ImagerPixelSpacing", "PixelSpacing"};
	const struct ct_dicom_in in = {.paths = &path, .n = 1};
	const struct ct_slice *s = NULL;
	struct series_set set = {0};
	struct ct_header h = {0};
	bool turned = false;
	int rc = -1;

	if (series_open(&set, &in, e) == 0 && choose(&s, &set, &in, e) == 0 && check(s, e) == 0 &&
		ct_dicom_header(&h, s, sizeof fields / sizeof *fields, fields, e) == 0 &&
		read_turn(&turned, &h, s, e) == 0 && read_pitch(mm, &h, s, e) == 0 &&
		ct_vol_alloc(v, (const size_t[]){s->columns, s->rows, 1}, e) == 0 &&
		ct_dicom_pixels(s, v->data, e) == 0) {
		to_gray(v, s, turned);
		rc = 0;
	}
	if (rc)
		ct_vol_free(v);
	ct_header_free(&h);
	series_close(&set);
	return rc;
}
