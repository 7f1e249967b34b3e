/* slice.c: see slice.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/order.h"
#include "core/vec3.h"
#include "series/slice.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LEAST_HU = -1024, MOST_HU = 3071 }; /* of 12 bits, which most scanners have */
enum { LEAST_RANGE = 100 };                /* HU that the numbers of a CT cover at least */

void ct_slice_normal(const struct ct_slice *s, double n[3])
{
	ct_vec3_cross(n, s->across, s->down);
}

static int by_rank(const void *p, const void *q)
{
	const struct ct_slice *a = p, *b = q;
	const int c = CT_ORDER_OF(a->rank, b->rank), d = CT_ORDER_OF(a->at, b->at);

	return c ? c : d ? d : CT_ORDER_OF(a->from, b->from);
}

void ct_slice_sort(struct ct_slice *s, size_t n)
{
	for (size_t i = 0; i < n; i++)
		s[i].from = i;
	qsort(s, n, sizeof *s, by_rank);
}

void ct_slice_place(struct ct_slice *s, const double affine[3][4], size_t k)
{
	double along;

	for (int d = 0; d < 3; d++) {
		const double sign = d < 2 ? -1 : 1; /* RAS to LPS */

		s->across[d] = sign * affine[d][0];
		s->down[d] = sign * affine[d][1];
		s->position[d] = sign * (affine[d][2] * (double)k + affine[d][3]);
	}
	s->pitch[0] = ct_vec3_length(s->across);
	s->pitch[1] = ct_vec3_length(s->down);
	ct_vec3_unit(s->across, s->across);
	along = ct_vec3_dot(s->across, s->down);
	for (int d = 0; d < 3; d++)
		s->down[d] -= along * s->across[d];
	ct_vec3_unit(s->down, s->down);
	s->placed = true;
}

int ct_slice_check(const struct ct_slice *s, struct ct_err *e)
{
	char name[CT_SLICE_NAME];

	ct_slice_name(name, s);
	if (!s->placed && s->frames > 1)
		return ct_fail(e, CT_EGEOM,
			"%s: frame %zu has no position: neither a functional group with "
			"ImagePositionPatient, nor SpacingBetweenSlices for all",
			s->path, s->frame + 1);
	if (!s->placed)
		return ct_fail(e, CT_EGEOM,
			"%s: no ImagePositionPatient, ImageOrientationPatient or PixelSpacing",
			name);
	if (s->samples != 1)
		return ct_fail(e, CT_EINPUT, "%s: SamplesPerPixel is %zu: a picture in colour",
			name, s->samples);
	if (s->colours[0] && strncasecmp(s->colours, "MONOCHROME", 10) != 0)
		return ct_fail(e, CT_EINPUT,
			"%s: PhotometricInterpretation is '%s': colours, not HU (MONOCHROME2)",
			name, s->colours);
	if (s->table)
		return ct_fail(e, CT_EINPUT,
			"%s: ModalityLUTSequence: a table of values is not read", name);
	if (!s->scaled || !isfinite(s->slope) || !isfinite(s->intercept) || s->slope == 0)
		return ct_fail(e, CT_EINPUT,
			"%s: no usable RescaleSlope and RescaleIntercept: the HU are not known",
			name);
	for (int i = 0; i < 2; i++)
		if (!(s->pitch[i] > 1e-6 && s->pitch[i] < 1e4))
			return ct_fail(e, CT_EGEOM, "%s: PixelSpacing is %g mm", name, s->pitch[i]);
	if (!(fabs(ct_vec3_dot(s->across, s->across) - 1) <= 1e-3 &&
		    fabs(ct_vec3_dot(s->down, s->down) - 1) <= 1e-3 &&
		    fabs(ct_vec3_dot(s->across, s->down)) <= 1e-4))
		return ct_fail(e, CT_EGEOM,
			"%s: ImageOrientationPatient is not two unit vectors at right angles",
			name);
	for (int i = 0; i < 3; i++)
		if (!isfinite(s->position[i]))
			return ct_fail(e, CT_EGEOM, "%s: ImagePositionPatient is not finite", name);
	return 0;
}

bool ct_slice_parallel(const struct ct_slice *a, const struct ct_slice *b)
{
	if (a->columns != b->columns || a->rows != b->rows || a->placed != b->placed)
		return false;
	for (int i = 0; i < 3 && a->placed; i++)
		if (!(fabs(a->across[i] - b->across[i]) <= 1e-4) ||
			!(fabs(a->down[i] - b->down[i]) <= 1e-4))
			return false;
	for (int i = 0; i < 2 && a->placed; i++)
		if (!(fabs(a->pitch[i] - b->pitch[i]) <= 1e-4 * fabs(a->pitch[i])))
			return false;
	return true;
}

CT_ORDER(by_value, double)

/* The most slices in a row none of which is further than that from the next; *span gets the
 * largest distance from the first to the last of a row. */
static size_t most_in_a_row(const struct ct_slice *s, size_t n, double gap, double *span)
{
	size_t most = 1, count = 1;

	*span = 0;
	for (size_t k = 1; k < n; k++) {
		count = s[k].at - s[k - 1].at <= gap ? count + 1 : 1;
		most = count > most ? count : most;
		*span = fmax(*span, s[k].at - s[k + 1 - count].at);
	}
	return most;
}

double ct_slice_near(const struct ct_slice *s, size_t n, double *gap)
{
	enum { FINE = 20, PART = 4, LEAST = 3 };
	const double least = 1e-3;
	double span;

	for (size_t k = 1; k < n; k++)
		gap[k - 1] = s[k].at - s[k - 1].at;
	qsort(gap, n > 0 ? n - 1 : 0, sizeof *gap, by_value);
	/* a step from small gaps to large ones, by which there are more places than slices at one:
	 * else it is stacks that are far from one another */
	for (size_t k = n > 0 ? n - 1 : 0; k-- > 1 && gap[k - 1] > least;) {
		const size_t places = n - k;
		const double usual = gap[(k + n - 2) / 2]; /* of the large ones */

		if (!isfinite(usual) || places < LEAST || !(gap[k] >= 2 * gap[k - 1]) ||
			most_in_a_row(s, n, gap[k - 1], &span) > places)
			continue;
		if (gap[k] >= FINE * gap[k - 1])
			return gap[k] / FINE;
		/* all that lie together do within a part of a gap: no zone of thin slices */
		if (span <= usual / PART)
			return fmin(1.5 * gap[k - 1], gap[k]);
	}
	return least;
}

bool ct_slice_together(const struct ct_slice *a, const struct ct_slice *b, double near)
{
	double d = 0;

	for (int i = 0; i < 3; i++)
		d = fmax(d, fabs(a->position[i] - b->position[i]));
	return d < near;
}

const char *ct_slice_name(char out[CT_SLICE_NAME], const struct ct_slice *s)
{
	const size_t n = strlen(s->path), room = CT_SLICE_NAME - 40;
	const char *path = n > room ? s->path + (n - room) : s->path; /* its end tells more */

	if (s->frames > 1)
		snprintf(out, CT_SLICE_NAME, "%s (frame %zu)", path, s->frame + 1);
	else
		snprintf(out, CT_SLICE_NAME, "%s", path);
	return out;
}

bool ct_slice_is_type(const struct ct_slice *s, int k, const char *word)
{
	const char *at = s->type;
	const size_t n = strlen(word);

	for (; k > 0 && at; k--) {
		at = strchr(at, '\\');
		at = at ? at + 1 : NULL;
	}
	return at && strncmp(at, word, n) == 0 && (at[n] == '\\' || at[n] == '\0');
}

/* The bits that do not count go; that of the sign, if it is set, is subtracted twice. */
static inline void widen(size_t n, float *restrict out, const unsigned char *restrict in,
	const struct ct_slice_bits *how, size_t bytes)
{
	const uint32_t mask = UINT32_MAX >> (32 - how->bits),
		       sign = how->is_signed ? UINT32_C(1) << (how->bits - 1) : 0;
	const int64_t less = (int64_t)sign + (int64_t)how->base;
	const int shift = how->shift;

	_Pragma("omp simd") for (size_t i = 0; i < n; i++)
	{
		uint32_t u = in[i];
		uint16_t half;

		if (bytes == 2) {
			memcpy(&half, in + 2 * i, sizeof half);
			u = half;
		} else if (bytes == 4)
			memcpy(&u, in + 4 * i, sizeof u);
		u = (u >> shift & mask) ^ sign;
		out[i] = bytes < 4 ? (float)((int32_t)u - (int32_t)sign)
				   : (float)((int64_t)u - less);
	}
}

void ct_slice_widen(
	size_t n, float *restrict out, const void *restrict in, const struct ct_slice_bits *how)
{
	if (how->bytes == 1)
		widen(n, out, in, how, 1);
	else if (how->bytes == 2)
		widen(n, out, in, how, 2);
	else
		widen(n, out, in, how, 4);
}

double ct_slice_base(const struct ct_slice *s)
{
	const double zero = s->scaled ? rint(-s->intercept / s->slope) : 0;

	return s->allocated == 32 && fabs(zero) <= 0x1p32 ? zero : 0;
}

/* The stored values that are padding, less `base`: none if *lo > *hi. */
static void padding_of(double *lo, double *hi, const struct ct_slice *s, double base)
{
	const double from = s->slope * s->padding[0] + s->intercept,
		     to = s->slope * s->padding[1] + s->intercept,
		     below = LEAST_HU - fmax(from, to), above = fmin(from, to) - MOST_HU,
		     beside = fmax(fmax(below, above), 0) / 2 / fabs(s->slope);

	*lo = s->padded ? fmin(s->padding[0], s->padding[1]) - base : (double)INFINITY;
	*hi = s->padded ? fmax(s->padding[0], s->padding[1]) - base : -(double)INFINITY;
	if (s->lossy && strcmp(s->modality, "CT") == 0 && beside > 0) {
		*lo -= beside;
		*hi += beside;
	}
}

void ct_slice_scale(const struct ct_slice *s, float none, float *x)
{
	const size_t n = s->columns * s->rows;
	const double base = ct_slice_base(s), zero = s->slope * base + s->intercept;
	double lo, hi;

	padding_of(&lo, &hi, s, base);
	_Pragma("omp simd") for (size_t i = 0; i < n; i++)
	{
		const double v = (double)x[i];
		const float y = (float)(s->slope * v + zero);

		x[i] = v >= lo && v <= hi ? none : y;
	}
}

bool ct_slice_is_radiograph(const struct ct_slice *s)
{
	return strcmp(s->modality, "CR") == 0 || strcmp(s->modality, "DX") == 0 ||
	       strcmp(s->modality, "RF") == 0;
}

/* Can what is stored be HU of a CT, by its scale? */
static int check_scale(const struct ct_slice *s, struct ct_err *e)
{
	const int bits = s->stored > 0 && s->stored < s->allocated ? s->stored : s->allocated;
	const double steps = ldexp(1, s->allocated) - 1, meant = ldexp(1, bits) - 1,
		     first = s->is_signed ? -ldexp(1, s->allocated - 1) : 0,
		     a = s->slope * first + s->intercept, b = a + s->slope * steps;

	if (!s->scaled || s->floats || s->allocated < 8)
		return 0;
	if (!(fabs(s->slope) * meant >= LEAST_RANGE))
		return ct_fail(e, CT_EINPUT,
			"%s: RescaleSlope is %g: all numbers of %d bits lie within %g HU, and air and "
			"water are 1000 apart",
			s->path, s->slope, bits, fabs(s->slope) * meant);
	if (!(fabs(s->slope) <= MOST_HU - LEAST_HU))
		return ct_fail(e, CT_EINPUT,
			"%s: RescaleSlope is %g: two numbers are further apart than air and bone",
			s->path, s->slope);
	if (!(fmin(a, b) <= MOST_HU && fmax(a, b) >= LEAST_HU))
		return ct_fail(e, CT_EINPUT,
			"%s: RescaleIntercept is %g: numbers of %d bits are from %g to %g HU, which no CT "
			"is",
			s->path, s->intercept, s->allocated, fmin(a, b), fmax(a, b));
	return 0;
}

int ct_slice_check_sign(const struct ct_slice *s, const float *x, struct ct_err *e)
{
	const float beyond = 0x1p15f, least = -0x1p12f + 0x1p16f, most = 0x1p16f - 1;
	const size_t n = s->columns * s->rows;
	float found = 0;

	if (s->is_signed || s->allocated != 16 || s->floats)
		return 0;
	for (size_t i = 0; i < n; i++) {
		if (x[i] < beyond || x[i] == most ||
			(s->padded && (double)x[i] >= fmin(s->padding[0], s->padding[1]) &&
				(double)x[i] <= fmax(s->padding[0], s->padding[1])))
			continue;
		if (x[i] < least)
			return 0; /* numbers of all sizes */
		found = x[i];
	}
	if (found == 0)
		return 0;
	return ct_fail(e, CT_EINPUT,
		"%s: PixelRepresentation is 0, but its number %g is %g with a sign: negative, or padding "
		"that PixelPaddingValue should name",
		s->path, (double)found, (double)found - 0x1p16);
}

int ct_slice_check_hu(const struct ct_slice *s, struct ct_err *e)
{
	static const char *const none[] = {
		"", "HU", "US"}; /* US: unspecified, which for CT are HU */

	if (strcasecmp(s->modality, "CT") != 0)
		return ct_fail(e, CT_EINPUT, "%s: modality is '%s', not CT", s->path, s->modality);
	for (size_t i = 0; i < sizeof none / sizeof *none; i++)
		if (strcasecmp(s->unit, none[i]) == 0)
			return check_scale(s, e);
	return ct_fail(
		e, CT_EINPUT, "%s: RescaleType is '%s': the values are not HU", s->path, s->unit);
}
