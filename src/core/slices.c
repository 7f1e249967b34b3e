/* slices.c: see slices.h. */
#include "config.h"
#include "core/slices.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normal(double n[3], const struct ct_slice *s)
{
	const double *a = s->across, *d = s->down;

	n[0] = a[1] * d[2] - a[2] * d[1];
	n[1] = a[2] * d[0] - a[0] * d[2];
	n[2] = a[0] * d[1] - a[1] * d[0];
}

static int by_series(const void *p, const void *q)
{
	const struct ct_slice *a = p, *b = q;
	int c = (a->number > b->number) - (a->number < b->number);

	if (!c)
		c = strcmp(a->series, b->series);
	if (!c)
		c = (a->instance > b->instance) - (a->instance < b->instance);
	return c ? c : strcmp(a->path, b->path);
}

void ct_slices_group(struct ct_slice *s, size_t n)
{
	qsort(s, n, sizeof *s, by_series);
}

size_t ct_slices_count(const struct ct_slice *s, size_t n, size_t first)
{
	size_t k = first;

	while (k < n && strcmp(s[k].series, s[first].series) == 0)
		k++;
	return k - first;
}

/* Are there slices of two patients? */
static bool two_patients(const struct ct_slice *s, size_t n)
{
	for (size_t i = 1; i < n; i++)
		if (strcmp(s[i].patient, s[0].patient) != 0)
			return true;
	return false;
}

int ct_slices_pick(const struct ct_slice *s, size_t n, const char *which, size_t *first,
	size_t *count, struct ct_err *e)
{
	char *end;
	const unsigned long want = which ? strtoul(which, &end, 10) : 0;
	size_t seen = 0;

	for (size_t k = 0; k < n; k += *count) {
		*first = k;
		*count = ct_slices_count(s, n, k);
		seen++;
		if (!which ? *count == n
			   : strcmp(which, s[k].series) == 0 || (*which && !*end && seen == want))
			return 0;
	}
	if (n == 0)
		return ct_fail(e, CT_EINPUT, "no DICOM pictures");
	if (which)
		return ct_fail(e, CT_EUSAGE, "--series %s: not among the %zu series", which, seen);
	return ct_fail(e, CT_EGEOM, "mixed: %zu series%s; --series takes one of them", seen,
		two_patients(s, n) ? " of different patients" : "");
}

/* Are a and b pictures of one stack? */
static int check_pair(const struct ct_slice *a, const struct ct_slice *b, struct ct_err *e)
{
	if (strcmp(a->patient, b->patient) != 0)
		return ct_fail(e, CT_EGEOM, "mixed patients: %s and %s", a->path, b->path);
	if (a->columns != b->columns || a->rows != b->rows)
		return ct_fail(e, CT_EGEOM, "mixed matrices: %zux%zu in %s and %zux%zu in %s",
			a->columns, a->rows, a->path, b->columns, b->rows, b->path);
	for (int i = 0; i < 3; i++)
		if (!(fabs(a->across[i] - b->across[i]) <= 1e-4) ||
			!(fabs(a->down[i] - b->down[i]) <= 1e-4))
			return ct_fail(e, CT_EGEOM,
				"mixed orientations: rows along (%.4f,%.4f,%.4f) in %s and "
				"(%.4f,%.4f,%.4f) in %s",
				a->across[0], a->across[1], a->across[2], a->path, b->across[0],
				b->across[1], b->across[2], b->path);
	for (int i = 0; i < 2; i++)
		if (!(fabs(a->pitch[i] - b->pitch[i]) <= 1e-4 * a->pitch[i]))
			return ct_fail(e, CT_EGEOM,
				"mixed pixel sizes: %g mm in %s and %g mm in %s", a->pitch[i],
				a->path, b->pitch[i], b->path);
	return 0;
}

static int check_one(const struct ct_slice *s, struct ct_err *e)
{
	if (strcmp(s->modality, "CT") != 0)
		return ct_fail(e, CT_EINPUT, "%s: modality is '%s', not CT", s->path, s->modality);
	if (s->frames != 1)
		return ct_fail(e, CT_EINPUT, "%s: %zu frames; one picture a file is read", s->path,
			s->frames);
	if (!s->placed)
		return ct_fail(e, CT_EGEOM,
			"%s: no ImagePositionPatient, ImageOrientationPatient or PixelSpacing",
			s->path);
	if (!s->scaled || !isfinite(s->slope) || !isfinite(s->intercept) || s->slope == 0)
		return ct_fail(e, CT_EINPUT,
			"%s: no usable RescaleSlope and RescaleIntercept: the HU are not known",
			s->path);
	for (int i = 0; i < 2; i++)
		if (!(s->pitch[i] > 1e-6 && s->pitch[i] < 1e4))
			return ct_fail(
				e, CT_EGEOM, "%s: PixelSpacing is %g mm", s->path, s->pitch[i]);
	if (!(fabs(dot(s->across, s->across) - 1) <= 1e-3 &&
		    fabs(dot(s->down, s->down) - 1) <= 1e-3 &&
		    fabs(dot(s->across, s->down)) <= 1e-4))
		return ct_fail(e, CT_EGEOM,
			"%s: ImageOrientationPatient is not two unit vectors at right angles",
			s->path);
	for (int i = 0; i < 3; i++)
		if (!isfinite(s->position[i]))
			return ct_fail(
				e, CT_EGEOM, "%s: ImagePositionPatient is not finite", s->path);
	return 0;
}

struct place {
	double at; /* mm along the normal */
	size_t from;
};

static int by_place(const void *p, const void *q)
{
	const struct place *a = p, *b = q;

	return a->at != b->at ? (a->at > b->at) - (a->at < b->at)
			      : (a->from > b->from) - (a->from < b->from);
}

/* Put the slices in order of their place along u; at[] gets the places. */
static int sort(struct ct_slice *s, size_t n, const double u[3], double *at, struct ct_err *e)
{
	struct place *p = calloc(n, sizeof *p);
	struct ct_slice *old = calloc(n, sizeof *old);

	if (!p || !old) {
		free(p);
		free(old);
		return ct_fail(e, CT_ENOMEM, "no memory for %zu slices", n);
	}
	for (size_t k = 0; k < n; k++)
		p[k] = (struct place){dot(s[k].position, u), k};
	memcpy(old, s, n * sizeof *s);
	qsort(p, n, sizeof *p, by_place);
	for (size_t k = 0; k < n; k++) {
		s[k] = old[p[k].from];
		at[k] = p[k].at;
	}
	free(p);
	free(old);
	return 0;
}

/* Millimetres by which slice b lies beside slice a, seen along u. */
static double drift(const struct ct_slice *a, const struct ct_slice *b, const double u[3])
{
	double d[3], along;

	for (int i = 0; i < 3; i++)
		d[i] = b->position[i] - a->position[i];
	along = dot(d, u);
	for (int i = 0; i < 3; i++)
		d[i] -= along * u[i];
	return sqrt(dot(d, d));
}

static int by_value(const void *p, const void *q)
{
	const double a = *(const double *)p, b = *(const double *)q;

	return (a > b) - (a < b);
}

static double median_gap(const double *at, size_t n, double *gap)
{
	for (size_t k = 1; k < n; k++)
		gap[k - 1] = at[k] - at[k - 1];
	qsort(gap, n - 1, sizeof *gap, by_value);
	return gap[(n - 1) / 2];
}

/* Sorted slices at places at[]: one spacing and no drift, or the reasons why not. */
static int check_stack(const struct ct_slice *s, size_t n, const double u[3], const double *at,
	double *gap, struct ct_err *e)
{
	const double step = (at[n - 1] - at[0]) / (double)(n - 1), mid = median_gap(at, n, gap);
	const double least = gap[0], most = gap[n - 2], slip = drift(&s[0], &s[n - 1], u);
	const double tilt = atan2(slip, at[n - 1] - at[0]) * 180 / 3.14159265358979324;
	double worst = 0, side = 0;

	for (size_t k = 1; k < n; k++) {
		if (at[k] - at[k - 1] < 1e-3)
			return ct_fail(e, CT_EGEOM, "two slices at one place: %s and %s",
				s[k - 1].path, s[k].path);
		worst = fmax(worst, fabs(at[k] - at[0] - (double)k * step));
		side = fmax(side, drift(&s[0], &s[k], u));
	}
	if (side > 0.1 * fmin(s->pitch[0], s->pitch[1]))
		return ct_fail(e, CT_EGEOM,
			"tilted gantry: slices drift sideways by %.4g mm over %.4g mm (%.1f degrees), and "
			"gaps along the normal run from %.4g to %.4g mm; rectify the series first",
			slip, at[n - 1] - at[0], tilt, least, most);
	for (size_t k = 1; k < n && worst > 0.05 * step; k++) {
		const double g = at[k] - at[k - 1], times = g / mid;

		if (least > 0.95 * mid && times > 1.5 && fabs(times - round(times)) < 0.1)
			return ct_fail(e, CT_EGEOM,
				"%.0f slices are missing: spacing is %.4g mm, but %.4g mm between %s and %s",
				round(times) - 1, mid, g, s[k - 1].path, s[k].path);
	}
	if (worst > 0.05 * step)
		return ct_fail(
			e, CT_EGEOM, "uneven slices: gaps run from %.4g to %.4g mm", least, most);
	return 0;
}

int ct_slices_grid(struct ct_slice *s, size_t n, double affine[3][4], struct ct_err *e)
{
	double u[3], *at = NULL;
	int rc = -1;

	if (n < 2)
		return ct_fail(e, CT_EGEOM, "%s: one slice is no volume", n ? s->path : "no file");
	for (size_t k = 0; k < n; k++)
		if (check_one(&s[k], e) || check_pair(&s[0], &s[k], e))
			return -1;
	normal(u, s);
	at = calloc(2 * n, sizeof *at);
	if (!at)
		return ct_fail(e, CT_ENOMEM, "no memory for %zu slices", n);
	if (sort(s, n, u, at, e) || check_stack(s, n, u, at, at + n, e))
		goto out;
	for (int r = 0; r < 3; r++) {
		const double ras = r < 2 ? -1 : 1; /* LPS to RAS */

		affine[r][0] = ras * s->across[r] * s->pitch[0];
		affine[r][1] = ras * s->down[r] * s->pitch[1];
		affine[r][2] = ras * u[r] * (at[n - 1] - at[0]) / (double)(n - 1);
		affine[r][3] = ras * s->position[r];
		for (int c = 0; c < 4; c++)
			affine[r][c] += 0.0; /* no negative zero */
	}
	rc = 0;
out:
	free(at);
	return rc;
}

void ct_slice_hu(const struct ct_slice *s, float *hu)
{
	const size_t n = s->columns * s->rows;
	const double lo = s->padded ? fmin(s->padding[0], s->padding[1]) : (double)INFINITY;
	const double hi = s->padded ? fmax(s->padding[0], s->padding[1]) : -(double)INFINITY;

	for (size_t i = 0; i < n; i++) {
		const double x = (double)hu[i];

		hu[i] = x >= lo && x <= hi ? -1024.0f : (float)(s->slope * x + s->intercept);
	}
}
