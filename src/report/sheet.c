/* sheet.c: see sheet.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "report/sheet.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { GAP = 4 }; /* pixels between tiles */
#define TINY 1e-4 /* voxels */

static size_t planes(const struct ct_sheet_rule *r)
{
	return r->plane == CT_SHEET_ALL_PLANES ? CT_MONTAGE_PLANES : 1;
}

/* Number of pictures of a file: slices of a volume, plane after plane, or views. */
static size_t pictures(const struct ct_any *a, const struct ct_sheet_rule *r)
{
	if (a->kind == CT_KIND_VOLUME)
		return planes(r) * r->cuts;
	return a->stack.views < r->views ? a->stack.views : r->views;
}

static enum ct_montage_plane plane_of(const struct ct_sheet_rule *r, size_t k)
{
	return (enum ct_montage_plane)(
		r->plane == CT_SHEET_ALL_PLANES ? (int)(k / r->cuts) : r->plane);
}

static void caption(char text[static 64], const struct ct_vol *v, enum ct_montage_plane p,
	double mm, const struct ct_sheet_rule *r)
{
	static const char across[] = "zyx";
	const char *plane = CT_WORD(CT_MONTAGE_PLANE_LIST, p);
	double at = ct_montage_centre(v, p, mm), spacing[3];

	ct_vol_spacing(v, spacing);
	if (fabs(at) < TINY * fmin(fmin(spacing[0], spacing[1]), spacing[2]))
		at = 0; /* an affine of float32 misses it by 1e-7 mm */
	if (r->slab == CT_MIP_NONE)
		snprintf(text, 64, "%s %c %.4g mm", plane, across[p], at);
	else if (r->thickness > 0)
		snprintf(text, 64, "%s %s of %.4g mm at %c %.4g mm", plane,
			CT_WORD(CT_MIP_LIST, r->slab), r->thickness, across[p], at);
	else
		snprintf(text, 64, "%s %s", plane, CT_WORD(CT_MIP_LIST, r->slab));
}

/* Slice of a volume where the first one is cut. Outside of the volume data stay NULL. */
static int picture_volume(struct ct_sheet *s, size_t at, const struct ct_vol *v,
	const struct ct_vol *first, const struct ct_sheet_rule *r, size_t k, struct ct_err *e)
{
	static const char *const side[] = {"APRL", "SIRL", "SIAP"};
	const struct ct_sheet_cut *c = &r->cut[k % r->cuts];
	const enum ct_montage_plane p = plane_of(r, k);
	const bool whole = r->slab && !(r->thickness > 0);
	const double mm = whole   ? ct_montage_position(v, p, 0.5)
			  : c->mm ? c->at
				  : ct_montage_position(first, p, c->at);
	struct ct_montage_slice *slice = &s->montage.tile[at].slice;
	int rc;

	if (r->slab)
		rc = ct_montage_slice_mip(slice, &s->own[at], v, p, mm, r->thickness, r->slab, e);
	else
		rc = ct_montage_slice_volume(slice, v, p, mm);
	if (rc) {
		*slice = (struct ct_montage_slice){0};
		return rc < 0 ? -1 : 0;
	}
	s->note[at].side = side[p];
	caption(s->note[at].caption, v, p, mm, r);
	return 0;
}

/* Picture k of a file. Data stay NULL if there is none. */
static int picture(struct ct_sheet *s, size_t at, const struct ct_any *a,
	const struct ct_any *first, const struct ct_sheet_rule *r, size_t k, struct ct_err *e)
{
	const size_t n = pictures(a, r),
		     view = a->kind == CT_KIND_STACK ? k * a->stack.views / n : 0;

	if (a->kind == CT_KIND_VOLUME)
		return picture_volume(s, at, &a->vol, &first->vol, r, k, e);
	if (k < n) {
		ct_montage_slice_view(&s->montage.tile[at].slice, &a->stack, view);
		snprintf(s->note[at].caption, sizeof s->note->caption, "view %zu", view);
	}
	return 0;
}

static int place(struct ct_sheet *s, size_t n, const struct ct_any *file, size_t each,
	const struct ct_sheet_rule *r, struct ct_err *e)
{
	for (size_t k = 0; k < each; k++)
		for (size_t i = 0; i < n; i++) {
			struct ct_montage_tile *first = &s->montage.tile[k * n], *t = first + i;
			struct ct_sheet_note *note = &s->note[k * n + i];

			if (picture(s, k * n + i, &file[i], &file[0], r, k, e))
				return -1;
			if (i == 0 && !t->slice.data)
				return ct_fail(e, CT_EGEOM,
					"%g mm lies outside of the first file: choose a place inside",
					r->cut[k % r->cuts].at);
			if (!r->error || i == 0 || !t->slice.data || !first->slice.data)
				continue;
			if (!ct_montage_slice_overlap(&t->slice, &first->slice))
				return ct_fail(e, CT_EGEOM,
					"file %zu does not overlap with the first: --error needs the same region",
					i + 1);
			t[each * n] = (struct ct_montage_tile){
				.slice = t->slice, .minus = first->slice, .error = r->map};
			note[each * n] = *note;
			memcpy(note[each * n].caption, "error ", 6);
			memcpy(note[each * n].caption + 6, note->caption, sizeof note->caption - 7);
		}
	return 0;
}

/* A file that is shown nowhere would be missing without a word. */
static int check_shown(const struct ct_sheet *s, size_t n, size_t each, struct ct_err *e)
{
	for (size_t i = 1; i < n; i++) {
		size_t k = 0;

		while (k < each && !s->montage.tile[k * n + i].slice.data)
			k++;
		if (k == each)
			return ct_fail(e, CT_EGEOM,
				"file %zu has no voxels where the first is cut: give files of the same "
				"region, or another --slice",
				i + 1);
	}
	return 0;
}

bool ct_sheet_in_hu(const struct ct_any *a)
{
	const char *quantity = ct_meta_get(ct_any_meta(a), CT_META_QUANTITY);

	return a->kind == CT_KIND_VOLUME &&
	       (!quantity || strcasecmp(quantity, CT_QUANTITY_HU) == 0);
}

/* The default window, by what the files hold. */
static void choose_window(double range[2], const struct ct_any *a)
{
	const char *quantity = ct_meta_get(ct_any_meta(a), CT_META_QUANTITY);

	if (ct_sheet_in_hu(a)) {
		range[0] = -200;
		range[1] = 300;
	} else if (quantity && strcmp(quantity, CT_QUANTITY_DENSITY) == 0) {
		range[0] = 0;
		range[1] = 1;
	} else if (!(range[0] < range[1])) { /* constant, or nothing finite */
		range[0] = isfinite(range[0]) ? range[0] : 0;
		range[1] = range[0] + 1;
	}
}

static void tone(struct ct_montage *m, const struct ct_any *first, const struct ct_sheet_rule *r)
{
	double range[2] = {(double)INFINITY, -(double)INFINITY}, error[2], fine = (double)INFINITY;

	for (size_t i = 0; i < m->rows * m->cols; i++) {
		const struct ct_montage_slice *slice = &m->tile[i].slice;

		if (!slice->data)
			continue;
		fine = fmin(fine, fmin(slice->mm[0], slice->mm[1]));
		ct_montage_slice_range(range, slice);
	}
	m->mm = fine / r->zoom;
	choose_window(range, first);
	if (r->window)
		memcpy(range, r->window, sizeof range);
	error[1] = (range[1] - range[0]) / 4;
	error[0] = r->map == CT_COLOUR_SIGNED ? -error[1] : 0;
	if (r->error_window)
		memcpy(error, r->error_window, sizeof error);
	for (size_t i = 0; i < m->rows * m->cols; i++)
		memcpy(m->tile[i].window, m->tile[i].minus.data ? error : range, sizeof range);
}

int ct_sheet_make(struct ct_sheet *s, size_t n, const struct ct_any *file,
	const struct ct_sheet_rule *rule, struct ct_err *e)
{
	struct ct_montage *m = &s->montage;
	size_t each = 0, tiles;

	for (size_t i = 0; i < n; i++)
		each = pictures(&file[i], rule) > each ? pictures(&file[i], rule) : each;
	*m = (struct ct_montage){.rows = each * (rule->error ? 2 : 1), .cols = n, .gap = GAP};
	if (n == 1 && file->kind == CT_KIND_VOLUME && planes(rule) > 1) {
		m->cols = rule->cuts;
		m->rows = planes(rule);
	} else if (n == 1) {
		m->cols = (size_t)ceil(sqrt((double)each));
		m->rows = (each + m->cols - 1) / m->cols;
	}
	tiles = m->rows * m->cols;
	if (ct_alloc0(&m->tile, tiles, sizeof *m->tile, e) ||
		ct_alloc0(&s->note, tiles, sizeof *s->note, e) ||
		ct_alloc0(&s->own, tiles, sizeof *s->own, e))
		return -1;
	/* with one file the tiles of k = 0, 1, ... follow one another in any layout */
	if (place(s, n, file, each, rule, e) || check_shown(s, n, each, e))
		return -1;
	tone(m, file, rule);
	return 0;
}

void ct_sheet_free(struct ct_sheet *s)
{
	for (size_t i = 0; s->own && i < s->montage.rows * s->montage.cols; i++)
		free(s->own[i]);
	free(s->own);
	free(s->montage.tile);
	free(s->note);
	*s = (struct ct_sheet){0};
}
