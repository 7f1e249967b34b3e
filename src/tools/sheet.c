/* sheet.c: see sheet.h. */
#include "config.h"
#include "tools/sheet.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Pictures of one file: planes of a volume, views of a stack. */
static size_t pictures(const struct ct_any *a, const struct sheet_rule *r)
{
	if (a->kind == CT_KIND_VOLUME)
		return r->plane == SHEET_ALL_PLANES ? MONTAGE_PLANES : 1;
	return a->stack.views < r->views ? a->stack.views : r->views;
}

/* The k-th picture of a file, cut where the first file is; none leaves data NULL. */
static void picture(struct montage_slice *s, const struct ct_any *a, const struct ct_any *first,
	const struct sheet_rule *r, size_t k)
{
	const size_t n = pictures(a, r);

	if (a->kind == CT_KIND_VOLUME) {
		enum montage_plane p =
			(enum montage_plane)(r->plane == SHEET_ALL_PLANES ? (int)k : r->plane);

		if (montage_slice_volume(s, &a->vol, p, montage_position(&first->vol, p, r->slice)))
			*s = (struct montage_slice){0};
	} else if (k < n)
		montage_slice_view(s, &a->stack, k * a->stack.views / n);
}

static int place(struct sheet *s, size_t n, const struct ct_any *file, size_t each,
	const struct sheet_rule *r, struct ct_err *e)
{
	for (size_t k = 0; k < each; k++)
		for (size_t i = 0; i < n; i++) {
			struct montage_tile *t = &s->tile[k * n + i], *first = &s->tile[k * n];

			picture(&t->slice, &file[i], &file[0], r, k);
			if (!r->error || i == 0 || !t->slice.data || !first->slice.data)
				continue;
			if (!montage_slice_overlap(&t->slice, &first->slice))
				return ct_fail(e, CT_EGEOM,
					"file %zu does not cover the area of the first", i + 1);
			t[each * n].slice = t->slice;
			t[each * n].minus = first->slice;
		}
	return 0;
}

/* Black and white for what the files hold. */
static void choose_window(double range[2], const struct ct_any *a)
{
	const char *quantity = ct_meta_get(ct_any_meta(a), CT_META_QUANTITY);

	if (a->kind == CT_KIND_VOLUME && (!quantity || strcmp(quantity, "HU") == 0)) {
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

static void tone(struct sheet *s, const struct ct_any *first, const struct sheet_rule *r)
{
	double range[2] = {(double)INFINITY, -(double)INFINITY}, error[2], fine = (double)INFINITY;

	for (size_t i = 0; i < s->rows * s->cols; i++) {
		const struct montage_slice *slice = &s->tile[i].slice;

		if (!slice->data)
			continue;
		fine = fmin(fine, fmin(slice->mm[0], slice->mm[1]));
		montage_slice_range(range, slice);
	}
	s->mm = fine / r->zoom;
	choose_window(range, first);
	if (r->window)
		memcpy(range, r->window, sizeof range);
	error[0] = 0;
	error[1] = (range[1] - range[0]) / 4;
	if (r->error_window)
		memcpy(error, r->error_window, sizeof error);
	for (size_t i = 0; i < s->rows * s->cols; i++)
		memcpy(s->tile[i].window, s->tile[i].minus.data ? error : range, sizeof range);
}

int sheet_make(struct sheet *s, size_t n, const struct ct_any *file, const struct sheet_rule *rule,
	struct ct_err *e)
{
	size_t each = 0;

	for (size_t i = 0; i < n; i++)
		each = pictures(&file[i], rule) > each ? pictures(&file[i], rule) : each;
	s->cols = n;
	s->rows = each * (rule->error ? 2 : 1);
	if (n == 1 && file->kind == CT_KIND_STACK) {
		s->cols = (size_t)ceil(sqrt((double)each));
		s->rows = (each + s->cols - 1) / s->cols;
	}
	if (ct_alloc0(&s->tile, s->rows * s->cols, sizeof *s->tile, e))
		return -1;
	/* with one file the tiles of k = 0, 1, ... follow one another in either layout */
	if (place(s, n, file, each, rule, e))
		return -1;
	tone(s, file, rule);
	return 0;
}

void sheet_free(struct sheet *s)
{
	free(s->tile);
	*s = (struct sheet){0};
}
