/* series-set.c: from files to a volume. See dicom.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/acquired.h"
#include "core/inflate.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "shim/dicom-file.h"
#include "dicom/image.h"
#include "dicom/module.h"
#include "dicom/series-set.h"
#include "dicom/sidecar.h"
#include "series/scales.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NONE_HU = -1024 }; /* what no pixel covers */

/* The slices that are read. */
struct reader {
	const struct ct_slice *s;
	struct ct_dicom_source *from;
	struct ct_scales scales;
	const struct ct_vol *to; /* what they make, */
	struct ct_hash hash;     /* and of it */
	const struct ct_dicom_in *in;
	const struct ct_dicom_taker *taker; /* who takes it, or NULL */
	float none;
	size_t failed; /* the slice that could not be decoded */
};

/* Pixels that are floats may be anything, and their scale tells less than that of whole numbers. */
static int check_floats(const struct ct_slice *s, const float *px, struct ct_err *e)
{
	const float least = -32768, most = 65535; /* as units.h has it */

	for (size_t i = 0, n = s->columns * s->rows; i < n && s->floats; i++)
		if (isfinite(px[i]) && (px[i] < least || px[i] > most))
			return ct_fail(e, CT_EINPUT,
				"%s: a pixel of %g HU: no CT reaches that far (but see --units)",
				s->path, (double)px[i]);
	return 0;
}

static int read_slice(void *ctx, size_t k, float *px, struct ct_err *e)
{
	struct reader *r = ctx;

	r->failed = k;
	if (ct_dicom_source_read(r->from, k, px, e) ||
		(r->in->units == CT_UNITS_AUTO && ct_slice_check_sign(&r->s[k], px, e)))
		return -1;
	ct_scales_take(&r->scales, k, px);
	ct_slice_scale(&r->s[k], r->none, px);
	return r->in->units == CT_UNITS_AUTO ? check_floats(&r->s[k], px, e) : 0;
}

static int take(void *ctx, size_t k, const float *x, struct ct_err *e)
{
	struct reader *r = ctx;
	const size_t area = r->to->n[0] * r->to->n[1];

	ct_hash_add(&r->hash, x, area * sizeof *x);
	if (ct_vol_check_plane(r->to, k, x, e))
		return ct_blame(e, r->in->name);
	return r->taker ? r->taker->plane(r->taker->ctx, x, area, e) : 0;
}

/* Some converters give every slice a frame of its own. */
static void warn_frames(const struct ct_slice *s, size_t n, const struct ct_env *env)
{
	for (size_t k = 1; k < n; k++)
		if (strcmp(s[k].space, s[0].space) != 0) {
			ct_log(env, CT_WARN,
				"slices of one series name several frames of reference; their "
				"positions are taken to be in one");
			return;
		}
}

/* Frames whose places nothing but SpacingBetweenSlices says. */
static void warn_counted(const struct ct_slice *s, size_t n, const struct ct_env *env)
{
	for (size_t k = 0; k < n; k++)
		if (s[k].counted) {
			ct_log(env, CT_WARN,
				"frames have no positions of their own: they are taken to follow the "
				"first, %.6g mm apart, along rows x columns",
				s[k].between);
			return;
		}
}

/* What changes the values of slices, and is not the same in all: zones of one scan, as a rule. */
static void warn_mixed(const struct ct_slice *s, size_t n, const struct ct_env *env)
{
	bool kvp = false, kernel = false, contrast = false;

	for (size_t k = 1; k < n; k++) {
		kvp |= fabs(s[k].kvp - s->kvp) > 0.5;
		kernel |= strcmp(s[k].kernel, s->kernel) != 0;
		contrast |= strcmp(s[k].contrast, s->contrast) != 0;
	}
	if (kvp || kernel || contrast)
		ct_log(env, CT_WARN,
			"slices of the series differ in%s%s%s: their values may not compare",
			kvp ? " KVP" : "", kernel ? " ConvolutionKernel" : "",
			contrast ? " ContrastBolusAgent" : "");
}

/* Numbers that are left out where no place is, and pictures that were announced. */
static void warn_numbers(
	const struct ct_slice *s, const struct ct_layout *l, const struct ct_env *env)
{
	const size_t n = l->slices;
	const int way = s[n - 1].instance > s[0].instance ? 1 : -1;
	long long step = 0;

	for (size_t k = 1; k < n; k++) {
		const long long by = way * ((long long)s[k].instance - s[k - 1].instance);

		if (by <= 0 || s[k].frames > 1)
			return; /* they do not follow the places */
		step = step == 0 || by < step ? by : step;
	}
	for (size_t k = 1; k < n; k++) {
		const long long by = way * ((long long)s[k].instance - s[k - 1].instance);

		if (by > step && by % step == 0 && !l->lost[k])
			ct_log(env, CT_WARN,
				"InstanceNumber %d is followed by %d%s%s%s: slices may be missing, "
				"though no place is",
				s[k - 1].instance, s[k].instance,
				ct_io_rule_of(env).deid ? "" : " (",
				ct_io_rule_of(env).deid ? "" : s[k].path,
				ct_io_rule_of(env).deid ? "" : ")");
	}
	if (s->announced > 0 && (size_t)s->announced > n && s->acquisition == s[n - 1].acquisition)
		ct_log(env, CT_WARN, "ImagesInAcquisition is %d, but %zu slices are here",
			s->announced, n);
}

static void warn_grid(const struct ct_slice *s, const struct ct_layout *l, const struct ct_env *env)
{
	const struct ct_spread *r = &l->spread;
	double a[3], b[3];

	if (l->moved && r->side > 2 * r->slip)
		ct_log(env, CT_WARN,
			"slices lie up to %.4g mm beside the first: they are moved in their planes, see "
			"ImagePositionPatient",
			r->side);
	else if (l->moved)
		ct_log(env, CT_WARN,
			"tilted by %.2f degrees: slices are moved in their planes, %.4g mm over %.4g mm",
			r->tilt, r->slip, r->length);
	else if (ct_layout_tilted(l, s))
		ct_log(env, CT_WARN, "tilted by %.2f degrees: the affine is sheared", r->tilt);
	if (!l->even)
		ct_log(env, CT_WARN,
			"gaps run from %.4g to %.4g mm: %zu slices are resampled to %zu planes, %.6g mm "
			"apart",
			r->least, r->most, l->slices, l->n[2], l->step);
	for (size_t k = 1; k < l->slices; k++)
		if (ct_layout_gap(l, s, k, a, b))
			ct_log(env, CT_WARN,
				"gap: %zu missing between %.6g,%.6g,%.6g and %.6g,%.6g,%.6g mm, "
				"interpolated",
				l->lost[k], a[0], a[1], a[2], b[0], b[1], b[2]);
}

/* The gaps that were filled, into the metadata. */
static int mark(
	struct ct_vol *v, const struct ct_slice *s, const struct ct_layout *l, struct ct_err *e)
{
	char text[400] = "";
	double a[3], b[3];
	size_t at = 0;

	for (size_t k = 1; k < l->slices; k++)
		if (at < sizeof text - 80 && ct_layout_gap(l, s, k, a, b))
			at += (size_t)snprintf(text + at, sizeof text - at,
				"%s%.6g,%.6g,%.6g:%.6g,%.6g,%.6g", at ? " " : "", a[0], a[1], a[2],
				b[0], b[1], b[2]);
	return at ? ct_meta_set(&v->meta, CT_META_FILLED, text, e) : 0;
}

/* Words behind a message. */
static void hint(struct ct_err *e, const char *words)
{
	const size_t at = strlen(e->msg);

	snprintf(e->msg + at, sizeof e->msg - at, "%s", words);
}

static int check_values(struct ct_slice *s, size_t n, enum ct_units units, struct ct_err *e)
{
	for (size_t k = 0; k < n; k++) {
		if (units == CT_UNITS_AUTO && ct_slice_check_hu(&s[k], e)) {
			hint(e, ct_slice_is_radiograph(&s[k])
					? "; --radiograph of ct-convert makes a stack of it"
					: " (but see --units)");
			return -1;
		}
		if (units != CT_UNITS_AUTO && !s[k].scaled) {
			s[k].scaled = true;
			s[k].slope = 1;
			s[k].intercept = 0;
		}
	}
	return 0;
}

int series_check_size(const struct ct_slice *s, size_t n, struct ct_err *e)
{
	double from = 0, to = 0;

	for (size_t k = 0; k < n; k++) {
		from += s[k].on_disk;
		to += s[k].claimed;
	}
	return ct_inflate_check((uint64_t)fmin(from, 1e18), (uint64_t)fmin(to, 1e18), e)
		       ? ct_blame(e, s->path)
		       : 0;
}

/* What the slices say of the scanner, if they are of one thickness and none was interpolated. Of
 * those that a program derived from others that does not hold. */
static int note_scanner(
	struct ct_vol *v, const struct ct_slice *s, const struct ct_layout *l, struct ct_err *e)
{
	const double mm = s->thickness > 0 ? s->thickness : 0;
	struct ct_acquired a = {.thickness = {0, 0, mm}};

	for (size_t k = 1; k < l->slices; k++)
		if (fabs((s[k].thickness > 0 ? s[k].thickness : 0) - mm) > 1e-3)
			return 0;
	ct_vol_spacing(v, a.spacing);
	ct_acquired_text(a.maker, s->maker);
	ct_acquired_text(a.kernel, s->kernel);
	a.collimation = s->collimation > 0 && s->collimation <= mm ? s->collimation : 0;
	return l->even && !ct_slice_is_type(s, 0, "DERIVED") && !ct_acquired_wrong(&a)
		       ? ct_acquired_put(&v->meta, &a, e)
		       : 0;
}

/* What is known of the volume beside its numbers. */
static int describe(
	struct ct_vol *v, const struct reader *r, const struct ct_layout *l, struct ct_err *e)
{
	const bool hu = r->in->units != CT_UNITS_OTHER;
	char space[DERIVE_SPACE];

	derive_space(space, r->s);
	return ct_err_any((*space && ct_meta_set(&v->meta, CT_META_SPACE, space, e)) ||
			  mark(v, r->s, l, e) || note_scanner(v, r->s, l, e) ||
			  ct_hash_input(&r->hash, &v->meta, r->in->name, e) ||
			  ct_meta_set(&v->meta, CT_META_QUANTITY,
				  hu ? CT_QUANTITY_HU : CT_QUANTITY_OTHER, e));
}

/* Do the slices make whole numbers of whole numbers, each plane of one? */
static bool is_whole(const struct ct_slice *s, const struct ct_layout *l)
{
	bool whole = l->even && !l->moved;

	for (size_t k = 0; k < l->slices; k++)
		whole = whole && !s[k].floats && s[k].slope == rint(s[k].slope) &&
			s[k].intercept == rint(s[k].intercept);
	return whole;
}

/* The grid is known: room for the volume, unless it is taken plane by plane. */
static int begin(struct ct_vol *v, struct reader *r, const struct ct_layout *l, struct ct_err *e)
{
	const struct ct_dicom_taker *t = r->in->taker;
	int rc = 1;

	memcpy(v->n, l->n, sizeof v->n);
	memcpy(v->affine, l->affine, sizeof v->affine);
	ct_hash_begin(&r->hash);
	ct_hash_add(&r->hash, v->affine, sizeof v->affine);
	if (t) {
		rc = describe(v, r, l, e) ? -1 : t->begin(t->ctx, v, is_whole(r->s, l), e);
		r->taker = rc == 0 ? t : NULL;
	}
	if (rc == 1) {
		rc = ct_vol_alloc(v, l->n, e);
		memcpy(v->affine, l->affine, sizeof v->affine);
	}
	return rc;
}

int series_check_bits(const struct ct_dicom_source *from, const struct ct_slice *s, size_t n,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_dicom_bits is = ct_dicom_source_bits(from);

	for (; n > 1 && s->high < s->stored; n--)
		s++; /* one that it is wrong for */
	if (is.low && is.high)
		return ct_fail(e, CT_EINPUT,
			"%s: HighBit is %d and BitsStored %d, but some slices have their numbers in "
			"the upper bits and some in the lower",
			s->path, s->high, s->stored);
	if (is.low)
		ct_log(env, CT_WARN,
			"HighBit is %d, but the numbers lie in the lower %d bits: taken as HighBit %d",
			s->high, s->stored, s->stored - 1);
	return 0;
}

/* The slices, in any order, to a volume; *failed is the slice, of their new order, that could not
 * be decoded, or n. */
static int assemble(struct ct_vol *v, struct ct_slice *s, size_t n, const struct ct_dicom_in *in,
	size_t *failed, const struct ct_env *env, struct ct_err *e)
{
	struct reader r = {
		.s = s, .to = v, .in = in, .none = in->units == CT_UNITS_OTHER ? 0 : NONE_HU};
	const struct ct_layout_source from = {read_slice, take, &r};
	struct ct_layout l = {0};
	int rc = -1;

	*failed = n;
	if (ct_layout_survey(&l, s, n, e) || ct_layout_grid(&l, s, in->tilt, in->gaps, e) ||
		(in->units == CT_UNITS_AUTO && ct_scales_begin(&r.scales, s, n, e)) ||
		begin(v, &r, &l, e) ||
		ct_dicom_source_open(&r.from, s, n, ct_par_threads(env->par), e))
		goto out;
	r.scales.nameless = ct_io_rule_of(env).deid;
	rc = ct_layout_fill(v->data, &l, s, r.none, &from, env, e);
	if (rc) {
		*failed = e->code == CT_EINPUT ? r.failed : n;
		goto out;
	}
	if (ct_scales_check(&r.scales, env, e) || series_check_bits(r.from, s, n, env, e)) {
		rc = -1;
		goto out;
	}
	warn_frames(s, n, env);
	warn_counted(s, n, env);
	warn_mixed(s, n, env);
	warn_numbers(s, &l, env);
	warn_grid(s, &l, env);
	rc = ct_err_any(
		describe(v, &r, &l, e) || (in->about && sidecar_series(in->about, s, &l, e)));
out:
	ct_dicom_source_close(r.from);
	ct_scales_free(&r.scales);
	ct_layout_free(&l);
	return rc;
}

/* A slice that cannot be decoded goes to the end, and its file is damaged. */
static void set_aside(struct series_set *set, struct ct_slice *s, size_t count, size_t k,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_slice bad = s[k];
	struct ct_file *f = &set->census.file[bad.file];

	ct_log(env, CT_WARN, "skipped: %s", e->msg);
	f->state = CT_FILE_DAMAGED;
	snprintf(f->why, sizeof f->why, "%s", "the picture cannot be decoded");
	memmove(s + k, s + k + 1, (count - k - 1) * sizeof *s);
	s[count - 1] = bad;
	*e = (struct ct_err){0};
}

int series_read(
	struct ct_vol *v, const struct ct_dicom_in *in, const struct ct_env *env, struct ct_err *e)
{
	struct series_set set = {0};
	struct ct_series *l;
	struct ct_slice *s;
	size_t pick, count, failed = 0;
	int rc = -1;

	if (series_open(&set, in, e))
		goto out;
	if (series_choose(&set, in, &pick, e)) {
		series_lines(&set, env);
		goto out;
	}
	series_tell(&set, in, pick, env);
	l = &set.list[pick];
	s = set.census.slice + l->first;
	count = l->count;
	if (series_apart(s, count, in->out, e) ||
		series_whole(&set, pick, in->skip_damaged, env, e) ||
		check_values(s, count, in->units, e) || series_check_size(s, count, e))
		goto out;
	while ((rc = assemble(v, s, count, in, &failed, env, e)) != 0 && failed < count &&
		in->skip_damaged && e->code != CT_ENOMEM) {
		ct_vol_free(v);
		set_aside(&set, s, count, failed, env, e);
		count--;
	}
	if (rc && failed < count && e->code != CT_ENOMEM)
		hint(e, "; ct-convert --skip-damaged goes on without it");
	if (rc == 0)
		series_account(&set, in, pick, l->count - count, env);
out:
	if (rc)
		ct_vol_free(v);
	series_close(&set);
	return rc;
}
