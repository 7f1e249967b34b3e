/* convert-scan.c: measured projections to a stack: line integrals, and where their rays ran.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "recon/centre.h"
#include "recon/scan-grid.h"
#include "recon/water.h"
#include "tools/lib/geometry-json.h"
#include "tools/scan-source.h"
#include "xray/counts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The scan of a file in its own unit, about the world's origin, for views of w by h pixels. Nothing
 * is assumed of its angles. */
static int scan_for(struct ct_geometry *s, struct ct_vol *named, const char *path,
	const size_t n[3], struct ct_err *e)
{
	struct ct_vol world = {
		.n = {1, 1, 1}, .affine = {{256, 0, 0, 0}, {0, 256, 0, 0}, {0, 0, 256, 0}}};

	ct_geometry_default(s, n[1] == 1 ? CT_FAN : CT_CONE, &world);
	s->views = n[0];
	s->h = n[1];
	s->w = n[2];
	s->arc = (double)NAN;
	if (ct_geometry_json_read(s, path, NULL, named, e))
		return -1;
	if (isnan(s->arc)) {
		if (!s->angle && !s->view)
			return ct_fail(e, CT_EINPUT,
				"%s: no totalAngle, angles or vectors: it does not say how the scan "
				"turned",
				path);
		s->arc = 0;
	}
	if (s->views != n[0] || s->h != n[1] || s->w != n[2])
		return ct_fail(e, CT_EGEOM,
			"%s says %zu views of %zux%zu pixels, but the array has %zu of %zux%zu",
			path, s->views, s->w, s->h, n[0], n[2], n[1]);
	return 0;
}

/* What a stack of ours says besides where its rays ran. */
static int keep_rest(struct ct_stack *s, struct ct_stack *of, struct ct_err *e)
{
	static const char *const rays[] = {CT_META_SCAN_DSO, CT_META_SCAN_DSD, CT_META_SCAN_ARC,
		CT_META_SCAN_START, CT_META_SCAN_ISO, CT_META_VOLUME_SIZE, CT_META_VOLUME_AFFINE};

	for (size_t k = 0; k < sizeof rays / sizeof *rays; k++)
		ct_meta_drop(&of->meta, rays[k]);
	s->deviation = of->deviation;
	of->deviation = NULL;
	return ct_meta_add(&s->meta, &of->meta, e);
}

/* The geometry of the source, or of --scanner, into *s, which gets the data. */
static int place(
	struct ct_stack *s, struct scan_source *in, const struct convert *p, struct ct_err *e)
{
	struct ct_geometry scan = {0};
	struct ct_vol named = {0};
	int rc;

	if (!p->scanner && !in->placed)
		return ct_fail(e, CT_EUSAGE,
			"%s: does not say how its rays ran: pass a scanner file by --scanner, see "
			"ct-scans(5)",
			p->in);
	if (!p->scanner && in->stack.views) {
		*s = in->stack;
		in->stack = (struct ct_stack){0};
		s->data = in->data;
		in->data = NULL;
		return 0;
	}
	rc = p->scanner ? scan_for(&scan, &named, p->scanner, in->n, e) : 0;
	if (rc == 0 && (ct_geometry_fill(s, p->scanner ? &scan : &in->scan, e) ||
			       keep_rest(s, &in->stack, e) ||
			       (named.n[0] && ct_scan_grid_put(&s->meta, &named, e))))
		rc = ct_blame(e, p->scanner ? p->scanner : p->in);
	ct_geometry_free(&scan);
	if (rc)
		return -1;
	memcpy(s->data, in->data, ct_stack_count(s) * sizeof *s->data);
	return 0;
}

static int views_error(const struct convert *p, size_t views, struct ct_err *e)
{
	return ct_fail(e, CT_EUSAGE,
		"--views: '%s' is not FIRST:LAST[:STEP] within the %zu views from 0, LAST excluded",
		p->views, views);
}

/* Views of --views only. */
static int keep_views(struct ct_stack *s, const struct convert *p, struct ct_err *e)
{
	const size_t pixels = s->h * s->w;
	double x[3] = {0, 0, 1};
	const bool three = strchr(p->views, ':') != strrchr(p->views, ':');
	size_t n = 0;

	if (ct_cli_numbers("views", p->views, ':', three ? 3 : 2, false, x, e))
		return -1;
	for (int i = 0; i < 3; i++)
		if (!(x[i] >= 0 && x[i] <= (double)s->views) || x[i] != floor(x[i]))
			return views_error(p, s->views, e);
	if (!(x[0] < x[1] && x[2] >= 1))
		return views_error(p, s->views, e);
	for (size_t k = (size_t)x[0]; k < (size_t)x[1]; k += (size_t)x[2], n++) {
		s->view[n] = s->view[k];
		memmove(s->data + n * pixels, s->data + k * pixels, pixels * sizeof *s->data);
		if (s->deviation)
			memmove(s->deviation + n * pixels, s->deviation + k * pixels,
				pixels * sizeof *s->deviation);
	}
	s->views = n;
	ct_meta_drop(&s->meta, CT_META_SCAN_ARC);
	ct_meta_drop(&s->meta, CT_META_SCAN_START);
	return 0;
}

/* Line integrals are no whole numbers, and hardly above ten. */
static bool counted(const struct ct_stack *s)
{
	const size_t n = ct_stack_count(s);
	float most = 0;

	for (size_t i = 0; i < n; i++) {
		if (s->data[i] != floorf(s->data[i]))
			return false;
		most = fmaxf(most, s->data[i]);
	}
	return most > 50;
}

/* Counts to line integrals; what is bad. */
static int correct(struct ct_stack *s, struct scan_source *in, const struct convert *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_counts_rule rule = {.rings = (size_t)p->rings};
	struct ct_counts_report did;

	rule.counts = p->projections == CONVERT_COUNTS ||
		      (in->counts && p->projections != CONVERT_INTEGRALS);
	if (!rule.counts && (p->flat || p->dark))
		return ct_fail(e, CT_EUSAGE,
			"--flat, --dark: only with --projections counts: %s has "
			"line integrals",
			p->in);
	if (!rule.counts && p->projections != CONVERT_INTEGRALS && counted(s))
		ct_log(env, CT_WARN,
			"%s: whole numbers are taken for line integrals: --projections counts if "
			"the detector counted them",
			p->in);
	if (!p->projections && !rule.counts && !p->rings)
		return 0; /* as computed: nothing is bad */
	if (p->rings && p->rings % 2 == 0)
		return ct_fail(e, CT_EUSAGE, "--rings: %d is not odd", p->rings);
	if (p->flat) {
		free(in->flat);
		in->flat = NULL;
	}
	if (p->dark) {
		free(in->dark);
		in->dark = NULL;
	}
	if ((p->flat && scan_source_field(&in->flat, p->flat, s->h, s->w, in->most, p, e)) ||
		(p->dark && scan_source_field(&in->dark, p->dark, s->h, s->w, in->most, p, e)))
		return -1;
	if (rule.counts && !in->flat)
		return ct_fail(e, CT_EUSAGE,
			"%s: counts need a flat field, what the detector counts without an object: "
			"pass it by --flat",
			p->in);
	rule.flat = in->flat;
	rule.dark = in->dark;
	if (ct_counts_correct(s, &rule, &did, env, e))
		return ct_blame(e, p->in);
	if (did.bad)
		ct_log(env, CT_WARN,
			"%s: %zu of %zu pixels of the detector are bad: their neighbours replace them",
			p->in, did.bad, s->h * s->w);
	if (did.lost)
		ct_log(env, CT_WARN, "%s: %zu values are not finite: their neighbours replace them",
			p->in, did.lost);
	if (did.starved)
		ct_log(env, CT_WARN,
			"%s: %zu values are below 0.0001 of the flat field, and count as that",
			p->in, did.starved);
	return 0;
}

static int centre(
	struct ct_stack *s, const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	double columns;

	if (ct_centre_find(&columns, s, env, e) && ct_blame(e, "--find-centre"))
		return ct_blame(e, p->in);
	ct_centre_shift(s, columns);
	ct_log(env, CT_INFO, "%s: the detector is moved by %.3f columns along u", p->in, columns);
	return 0;
}

/* Beam hardening; the axis is right by now. */
static int harden(
	struct ct_stack *s, const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	double c[CT_WATER_TERMS] = {0};
	int n = 1;

	for (const char *at = p->water; *at; at++)
		n += *at == ',';
	if (strcmp(p->water, "auto") == 0) {
		if (ct_water_find(c, s, env, e) && ct_blame(e, "--water auto"))
			return ct_blame(e, p->in);
		ct_log(env, CT_INFO, "%s: --water %.6g,%.6g,%.6g,%.6g", p->in, c[0], c[1], c[2],
			c[3]);
	} else if (n > CT_WATER_TERMS) {
		return ct_fail(e, CT_EUSAGE, "--water: '%s' has more than %d coefficients",
			p->water, CT_WATER_TERMS);
	} else if (ct_cli_numbers("water", p->water, ',', n, false, c, e)) {
		return -1;
	}
	if (ct_water_apply(s, c, e))
		return ct_blame(e, p->in);
	return ct_meta_setf(
		&s->meta, e, CT_META_WATER, "%.9g,%.9g,%.9g,%.9g", c[0], c[1], c[2], c[3]);
}

/* HU of which density is attenuation in 1/mm. */
static int set_window(struct ct_meta *m, double mu_water, struct ct_err *e)
{
	return ct_meta_setf(m, e, CT_META_WINDOW, "-1000:%.9g", 1000 / mu_water - 1000);
}

int convert_scan(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	struct scan_source in = {0};
	struct ct_stack s = {0};
	struct ct_meta read = {0};
	int rc = -1;

	if (scan_source_read(&in, p, env, e) || place(&s, &in, p, e))
		goto out;
	if (ct_meta_copy(&read, &s.meta, e) ||
		ct_meta_input(&read, p->in, 2,
			(const struct ct_piece[]){
				{in.n, sizeof in.n}, {s.data, ct_stack_count(&s) * sizeof *s.data}},
			e) ||
		correct(&s, &in, p, env, e) || (p->views && keep_views(&s, p, e)))
		goto out;
	if (ct_stack_check_finite(&s, e)) {
		ct_blame(e, p->in);
		goto out;
	}
	if ((!p->find_centre || centre(&s, p, env, e) == 0) &&
		(!p->water || harden(&s, p, env, e) == 0) &&
		ct_meta_set(&s.meta, CT_META_QUANTITY, CT_QUANTITY_LINE_INTEGRAL, e) == 0 &&
		(isnan(p->mu_water) || set_window(&s.meta, p->mu_water, e) == 0) &&
		ct_meta_step(&s.meta, env, 1, (const struct ct_meta *const[]){&read}, e) == 0)
		rc = ct_stack_write(p->out, &s, env, e);
out:
	scan_source_free(&in);
	ct_meta_free(&read);
	ct_stack_free(&s);
	return rc;
}
