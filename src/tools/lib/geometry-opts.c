/* geometry-opts.c: see geometry-opts.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "tools/lib/geometry-json.h"
#include "tools/lib/geometry-opts.h"
#include "formats/format.h"
#include "xray/window.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static int detector(struct ct_geometry *s, const struct ct_geometry_opts *o, struct ct_err *e)
{
	double side = s->pitch[0] * (double)s->w;
	size_t n[2];

	if (o->det) {
		bool both = strchr(o->det, 'x') != NULL;

		if (ct_cli_dims("det", o->det, both ? 2 : 1, n, e))
			return -1;
		s->w = n[0];
		s->h = both ? n[1] : s->beam == CT_FAN ? 1 : n[0];
		s->pitch[0] = s->pitch[1] = side / (double)(s->w > s->h ? s->w : s->h);
	}
	if (!isnan(o->sampling)) {
		size_t n16 = (size_t)ceil(o->sampling * (double)(s->w > s->h ? s->w : s->h) / 16);

		s->w = 16 * n16;
		s->h = s->beam == CT_FAN ? 1 : s->w;
		s->pitch[0] = s->pitch[1] = side / (double)s->w;
	}
	if (o->pitch) {
		if (ct_cli_numbers("expert pitch", o->pitch, ',', 2, true, s->pitch, e))
			return -1;
		if (!(s->pitch[0] > 0 && s->pitch[1] > 0))
			return ct_fail(
				e, CT_EUSAGE, "--expert pitch: '%s' is not positive", o->pitch);
	}
	return o->offset ? ct_cli_numbers("expert offset", o->offset, ',', 2, false, s->offset, e)
			 : 0;
}

static int make_scan(struct ct_geometry *s, const struct ct_geometry_opts *o,
	const struct ct_vol *grid, struct ct_err *e)
{
	int beam = CT_CONE;

	if (o->beam && ct_words_take(&beam, CT_WORDS(CT_BEAM_LIST), "beam", o->beam, e)) {
		e->code = CT_EUSAGE;
		return ct_blame(e, "--beam");
	}
	(o->paper ? ct_geometry_paper : ct_geometry_default)(s, (enum ct_beam)beam, grid);
	if (o->scanner && ct_geometry_json_read(s, o->scanner, grid, NULL, e))
		return -1;
	if (o->beam && (int)s->beam != beam)
		return ct_fail(e, CT_EUSAGE, "--beam %s, but %s has mode %s", o->beam, o->scanner,
			CT_WORD(CT_BEAM_LIST, s->beam));
	if (s->beam == CT_PARALLEL && (o->paper || !isnan(o->dso) || !isnan(o->dsd)))
		return ct_fail(e, CT_EUSAGE,
			"--paper, --expert dso, dsd: not with parallel rays, which leave no source");
	if ((s->angle || s->view) && (o->views || !isnan(o->arc) || !isnan(o->start)))
		return ct_fail(e, CT_EUSAGE,
			"--views, --arc, --expert start: not with %s, which lists its views",
			o->scanner);
	if (s->view && (o->det || o->pitch || o->offset || !isnan(o->sampling) || !isnan(o->dso) ||
			       !isnan(o->dsd)))
		return ct_fail(e, CT_EUSAGE,
			"--det, --sampling, --expert dso, dsd, pitch, offset: not with %s, which "
			"gives vectors",
			o->scanner);
	if (detector(s, o, e))
		return -1;
	if (o->views)
		s->views = (size_t)o->views;
	s->arc = isnan(o->arc) ? s->arc : o->arc;
	s->start = isnan(o->start) ? s->start : o->start;
	s->dso = isnan(o->dso) ? s->dso : o->dso;
	s->dsd = isnan(o->dsd) ? s->dsd : o->dsd;
	return 0;
}

int ct_geometry_opts_like(struct ct_stack *out, const char *path, struct ct_err *e)
{
	struct ct_meta *m = &out->meta;

	if (ct_stack_read(path, out, e))
		return -1;
	for (size_t i = m->n; i-- > 0;)
		if (strncmp(m->pair[i].key, CT_META_SCAN, sizeof CT_META_SCAN - 1) != 0)
			ct_meta_drop(m, m->pair[i].key);
	return 0;
}

int ct_geometry_opts_make(struct ct_stack *out, const struct ct_geometry_opts *o,
	const struct ct_vol *grid, struct ct_err *e)
{
	struct ct_geometry s = {0};
	int rc;

	if (o->like)
		return ct_geometry_opts_like(out, o->like, e);
	rc = make_scan(&s, o, grid, e);
	if (rc == 0 && ct_geometry_fill(out, &s, e))
		rc = o->scanner ? ct_blame(e, o->scanner) : -1;
	ct_geometry_free(&s);
	return rc;
}

int ct_geometry_opts_asked(struct ct_window_rule *r, const char *option, struct ct_err *e)
{
	*r = (struct ct_window_rule){0};
	if (!option)
		return 0;
	if (ct_cli_range("window", option, r->range, e))
		return -1;
	if (!ct_window_is(r->range))
		return ct_fail(e, CT_EUSAGE, "--window: float32 does not hold %s", option);
	snprintf(r->words, sizeof r->words, "--window %.50s", option);
	return 0;
}

int ct_geometry_opts_window(
	double window[2], const char *option, const struct ct_meta *m, struct ct_err *e)
{
	struct ct_window_rule r;

	return ct_window_get(window, m, e) || ct_geometry_opts_asked(&r, option, e)
		       ? -1
		       : ct_window_rule_choose(window, &r, m, e);
}

int ct_geometry_opts_grid(int *voxels, struct ct_vol *like, const char *option, struct ct_err *e)
{
	double n = 0;

	*voxels = 0;
	if (option && !ct_number_read(&n, option))
		return ct_vol_read(option, like, e);
	if (option && (!(n >= 1 && n <= 1 << 16) || n != floor(n)))
		return ct_fail(e, CT_EUSAGE, "--grid: %s is no number of voxels", option);
	*voxels = (int)n;
	return 0;
}
