/* scan-source.c: see scan-source.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/any.h"
#include "formats/format.h"
#include "shim/arrays.h"
#include "shim/image-read.h"
#include "tools/scan-source.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void scan_source_free(struct scan_source *s)
{
	free(s->data);
	free(s->flat);
	free(s->dark);
	ct_geometry_free(&s->scan);
	ct_stack_free(&s->stack);
	*s = (struct scan_source){0};
}

/* A number of a file of MATLAB beside `of`; `also` is its other name, or NULL. */
static int number(
	double *x, const struct ct_arrays *a, const char *name, const char *also, struct ct_err *e)
{
	const struct ct_array *it = ct_arrays_find(a, name);

	it = it || !also ? it : ct_arrays_find(a, also);
	if (!it)
		return ct_fail(e, CT_EINPUT, "parameters.%s: is missing", name);
	if (it->count != 1 || !isfinite(it->first))
		return ct_fail(e, CT_EINPUT, "parameters.%s: is not one number", name);
	*x = it->first;
	return 0;
}

/* How many mm a unit of length of the file has. */
static int unit(double *mm, const struct ct_arrays *a, struct ct_err *e)
{
	static const struct {
		const char *word;
		double mm;
	} all[] = {{"mm", 1}, {"cm", 10}, {"m", 1000}};
	const struct ct_array *it = ct_arrays_find(a, "parameters.distanceUnit");

	*mm = 1;
	for (size_t k = 0; it && k < sizeof all / sizeof *all; k++)
		if (strcmp(it->text, all[k].word) == 0) {
			*mm = all[k].mm;
			return 0;
		}
	return it ? ct_fail(e, CT_EINPUT, "parameters.distanceUnit: '%s' is not mm, cm or m",
			    it->text)
		  : 0;
}

static int take_angles(struct ct_geometry *g, const struct ct_array *it, size_t views,
	double degrees, const char *name, struct ct_err *e)
{
	if (!it || it->count != views)
		return ct_fail(e, CT_EINPUT, "%s: has %zu angles for %zu views", name,
			it ? it->count : 0, views);
	if (ct_alloc(&g->angle, views, sizeof *g->angle, e))
		return -1;
	for (size_t k = 0; k < views; k++) {
		g->angle[k] = degrees * (double)it->data[k];
		if (!isfinite(g->angle[k]))
			return ct_fail(e, CT_EINPUT, "%s: angle %zu is not finite", name, k);
	}
	return 0;
}

static void take_data(struct scan_source *s, struct ct_array *x, size_t views, size_t h, size_t w)
{
	s->n[0] = views;
	s->n[1] = h;
	s->n[2] = w;
	s->data = x->data;
	x->data = NULL;
}

/* A fan-beam scan as of the Helsinki Tomography Challenge 2022: line integrals [views][columns]. */
static int read_htc(struct scan_source *s, struct ct_arrays *a, struct ct_err *e)
{
	struct ct_array *x = ct_arrays_find(a, "sinogram");
	const struct ct_array *twice;
	struct ct_arrays rest;
	struct ct_geometry *g = &s->scan;
	const struct ct_array *post = ct_arrays_find(a, "numDetectorsPost");
	double effective, mm;

	if (!x || x->dims != 2)
		return ct_fail(e, CT_EINPUT,
			"has no sinogram of views by columns: expected a struct as of the Helsinki "
			"Tomography Challenge 2022");
	rest = (struct ct_arrays){.a = x + 1, .n = (size_t)(a->a + a->n - (x + 1))};
	if ((twice = ct_arrays_find(&rest, "sinogram")))
		return ct_fail(e, CT_EINPUT, "has two scans, %s and %s: save each in its own file",
			x->name, twice->name);
	if (unit(&mm, a, e) || number(&g->dso, a, "distanceSourceOrigin", NULL, e) ||
		number(&g->dsd, a, "distanceSourceDetector", NULL, e) ||
		number(&g->pitch[0], a, "pixelSizePost", "pixelSize", e) ||
		take_angles(g, ct_arrays_find(a, "parameters.angles"), x->n[0], 1,
			"parameters.angles", e))
		return -1;
	if (post && post->count && post->first != (double)x->n[1])
		return ct_fail(e, CT_EINPUT,
			"parameters.numDetectorsPost: is %g, but sinogram has "
			"%zu columns",
			post->first, x->n[1]);
	if (!(g->dso > 0 && g->dsd > g->dso))
		return ct_fail(e, CT_EGEOM,
			"distanceSourceDetector of %g is not beyond distanceSourceOrigin of %g",
			g->dsd, g->dso);
	if (ct_arrays_find(a, "effectivePixelSizePost")) {
		if (number(&effective, a, "effectivePixelSizePost", NULL, e))
			return -1;
		if (!(fabs(effective * g->dsd / g->dso / g->pitch[0] - 1) < 0.01))
			return ct_fail(e, CT_EINPUT,
				"effectivePixelSizePost of %g is not pixelSizePost of %g over the "
				"magnification of %g: one of them is wrong, or their units",
				effective, g->pitch[0], g->dsd / g->dso);
	}
	take_data(s, x, x->n[0], 1, x->n[1]);
	g->beam = CT_FAN;
	g->views = s->n[0];
	g->h = 1;
	g->w = s->n[2];
	g->dso *= mm;
	g->dsd *= mm;
	g->pitch[0] *= mm;
	g->pitch[1] = g->pitch[0];
	s->placed = true;
	return 0;
}

/* Mean of the n pictures of h by w pixels. */
static int mean_of(float **mean, const float *x, size_t n, size_t pixels, struct ct_err *e)
{
	if (ct_alloc(mean, pixels, sizeof **mean, e))
		return -1;
	for (size_t i = 0; i < pixels; i++) {
		double sum = 0;

		for (size_t k = 0; k < n; k++)
			sum += (double)x[k * pixels + i];
		(*mean)[i] = (float)(sum / (double)n);
	}
	return 0;
}

/* Of several pictures, or of one, as some save their mean. */
static int exchange_field(
	float **mean, const struct ct_array *it, const size_t n[3], struct ct_err *e)
{
	const size_t *its;

	if (!it)
		return 0;
	its = it->n + (it->dims == 3);
	if ((it->dims != 2 && it->dims != 3) || its[0] != n[1] || its[1] != n[2])
		return ct_fail(e, CT_EINPUT,
			"exchange/%s: is not of %zux%zu pixels, as exchange/data", it->name, n[2],
			n[1]);
	return mean_of(mean, it->data, it->dims == 3 ? it->n[0] : 1, n[1] * n[2], e);
}

/* --pitch, or a pixel of 1 mm. */
static int pitch_of(
	double mm[2], const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	mm[0] = mm[1] = 1;
	if (!p->pitch) {
		ct_log(env, CT_WARN,
			"%s: states no size of a pixel: 1 mm is assumed; --pitch passes "
			"it",
			p->in);
		return 0;
	}
	if (ct_cli_numbers("pitch", p->pitch, ',', 2, true, mm, e))
		return -1;
	return mm[0] > 0 && mm[1] > 0
		       ? 0
		       : ct_fail(e, CT_EUSAGE, "--pitch: %s is not positive", p->pitch);
}

#define TURN 6.4 /* more than a turn in rad */

/* Counts of Data Exchange, seen by parallel rays. */
static int read_exchange(struct scan_source *s, const struct convert *p, struct ct_arrays *a,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_array *x = ct_arrays_find(a, "data");
	const struct ct_array *theta = ct_arrays_find(a, "theta");
	const struct ct_array *said = ct_arrays_find(a, "theta.units");
	const bool rad = said && strncasecmp(said->text, "rad", 3) == 0;
	struct ct_geometry *g = &s->scan;
	double most = 0;

	if (!x || x->dims != 3)
		return ct_fail(e, CT_EINPUT,
			"exchange/data: is missing, or not of views by rows by columns");
	if (said && !rad && strncasecmp(said->text, "deg", 3) != 0)
		return ct_fail(e, CT_EINPUT, "exchange/theta: the unit '%s' is not deg or rad",
			said->text);
	take_data(s, x, x->n[0], x->n[1], x->n[2]);
	s->counts = true;
	if (exchange_field(&s->flat, ct_arrays_find(a, "data_white"), s->n, e) ||
		exchange_field(&s->dark, ct_arrays_find(a, "data_dark"), s->n, e))
		return -1;
	if (!theta || p->scanner)
		return 0;
	if (take_angles(g, theta, s->n[0], rad ? 180 / M_PI : 1, "exchange/theta", e) ||
		pitch_of(g->pitch, p, env, e))
		return -1;
	for (size_t k = 0; k < s->n[0]; k++)
		most = fmax(most, fabs(g->angle[k]));
	if (!said && most < TURN)
		ct_log(env, CT_WARN,
			"%s: exchange/theta has no unit and reaches %.3g: degrees are assumed",
			p->in, most);
	g->beam = CT_PARALLEL;
	g->views = s->n[0];
	g->h = s->n[1];
	g->w = s->n[2];
	g->dso = 1000;
	g->dsd = 1500;
	s->placed = true;
	return 0;
}

/* --pitch is of files that state none. */
static int no_pitch(const struct convert *p, struct ct_err *e)
{
	return p->pitch ? ct_fail(e, CT_EUSAGE, "--pitch: %s states its own pixel size", p->in) : 0;
}

static void rescale(float *x, size_t n, const struct convert *p)
{
	for (size_t i = 0; x && i < n; i++)
		x[i] = (float)(p->slope * (double)x[i] + p->inter);
}

static int read_arrays(
	struct scan_source *s, const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_arrays a = {0};
	bool htc;
	int rc;

	if (ct_arrays_read(&a, p->in, e))
		return -1;
	htc = ct_arrays_find(&a, "sinogram") || !ct_arrays_find(&a, "data");
	rc = htc ? read_htc(s, &a, e) : read_exchange(s, p, &a, env, e);
	ct_arrays_free(&a);
	if (rc)
		return ct_blame(e, p->in);
	if (htc && no_pitch(p, e))
		return -1;
	rescale(s->data, s->n[0] * s->n[1] * s->n[2], p);
	rescale(s->flat, s->n[1] * s->n[2], p);
	rescale(s->dark, s->n[1] * s->n[2], p);
	return 0;
}

/* One of our own. */
static int read_stack(struct scan_source *s, const struct convert *p, struct ct_err *e)
{
	if (no_pitch(p, e) || ct_stack_read(p->in, &s->stack, e))
		return -1;
	s->n[0] = s->stack.views;
	s->n[1] = s->stack.h;
	s->n[2] = s->stack.w;
	s->data = s->stack.data;
	s->stack.data = NULL;
	rescale(s->data, s->n[0] * s->n[1] * s->n[2], p);
	s->placed = true;
	s->most = 0;
	return 0;
}

static int read_raw(
	struct scan_source *s, const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol v = {0};

	if (convert_read(p, &v, env, e))
		return -1;
	for (int d = 0; d < 3; d++)
		s->n[d] = v.n[2 - d];
	s->data = v.data;
	v.data = NULL;
	ct_vol_free(&v);
	return 0;
}

/* Are the numbers of a file of the type of `of`? Integers of pictures become 0 to 1. */
static int same_type(const char *path, double most, const char *of, double want, struct ct_err *e)
{
	return most == want ? 0
			    : ct_fail(e, CT_EINPUT,
				      "%s: its %.10g becomes 1, but of %s %.10g does: expected "
				      "pictures of the same type",
				      path, most, of, want);
}

/* View k is a picture; the first one says how large they all are. */
static int read_picture(struct scan_source *s, struct ct_reading *r, const struct convert *p,
	size_t k, struct ct_err *e)
{
	float *gray = NULL;
	double most = 0;
	size_t w, h;
	int rc = ct_image_read_next(r, p->files.v[k], &w, &h, &most, &gray, e);

	if (rc == 0 && k == 0) {
		s->n[1] = h;
		s->n[2] = w;
		s->most = most;
		rc = ct_alloc(&s->data, s->n[0] * h * w, sizeof *s->data, e);
	}
	if (rc == 0 && (h != s->n[1] || w != s->n[2]))
		rc = ct_fail(e, CT_EGEOM, "%s: has %zux%zu pixels, but %s has %zux%zu",
			p->files.v[k], w, h, p->in, s->n[2], s->n[1]);
	rc = ct_err_any(rc || same_type(p->files.v[k], most, p->in, s->most, e));
	if (rc == 0) {
		memcpy(s->data + k * h * w, gray, h * w * sizeof *gray);
		rescale(s->data + k * h * w, h * w, p);
	}
	free(gray);
	return rc;
}

/* A shell sorts names by letters: v1, v10, v2. */
static void warn_order(const struct convert *p, size_t views, const struct ct_env *env)
{
	const char *const *name = p->files.v;
	size_t early = 0;

	for (size_t k = 1; k < views; k++) {
		if (strcmp(name[k - 1], name[k]) > 0)
			return;
		if (early == 0 && strverscmp(name[k - 1], name[k]) > 0)
			early = k;
	}
	if (early)
		ct_log(env, CT_WARN,
			"%s is before %s: the names are in the order of letters, and so are the "
			"views; ls -v names them in that of numbers",
			name[early - 1], name[early]);
}

/* A picture a view, in the order in which they are named. */
static int read_pictures(
	struct scan_source *s, const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_reading reading = {0};
	int rc = 0;

	s->n[0] = p->files.n - 1;
	warn_order(p, s->n[0], env);
	for (size_t k = 0; rc == 0 && k < s->n[0]; k++)
		rc = ct_err_any(ct_check_stop(env, e) || read_picture(s, &reading, p, k, e));
	ct_reading_end(&reading);
	return rc;
}

static bool is_arrays(const char *path)
{
	unsigned char head[CT_SNIFF];
	const size_t n = ct_signature_read(head, path);

	return ct_signature_has("MATLAB", head, n) || ct_signature_has("HDF5", head, n);
}

int scan_source_read(
	struct scan_source *s, const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	if (!p->raw && convert_is_picture(p->in))
		return read_pictures(s, p, env, e);
	s->most = 1;
	if (p->files.n > 2)
		return ct_fail(e, CT_EUSAGE,
			"%s: is no picture: only of pictures several files make a stack", p->in);
	if (p->raw)
		return read_raw(s, p, env, e);
	if (strcmp(p->in, "-") != 0 && ct_signature_of(p->in) == CT_KIND_STACK)
		return read_stack(s, p, e);
	return strcmp(p->in, "-") != 0 && is_arrays(p->in)
		       ? read_arrays(s, p, env, e)
		       : ct_raw_npy(p->in, p->slope, p->inter, s->n, &s->data, e);
}

int scan_source_field(float **mean, const char *path, size_t h, size_t w, double most,
	const struct convert *p, struct ct_err *e)
{
	size_t n[3] = {1, 0, 0};
	double own = 1;
	float *x = NULL;
	int rc = convert_is_picture(path) ? ct_image_read(path, &n[2], &n[1], &own, &x, e)
					  : ct_raw_npy(path, p->slope, p->inter, n, &x, e);

	if (rc == 0 && convert_is_picture(path))
		rescale(x, n[1] * n[2], p);
	if (rc == 0 && n[1] == 1 && n[0] == h && n[2] == w && h > 1) { /* one picture of numpy */
		n[1] = n[0];
		n[0] = 1;
	}
	if (rc == 0 && (n[1] != h || n[2] != w))
		rc = ct_fail(e, CT_EGEOM, "%s: has %zux%zu pixels, but the views have %zux%zu",
			path, n[2], n[1], w, h);
	rc = ct_err_any(rc || (most > 0 && same_type(path, own, p->in, most, e)) ||
			mean_of(mean, x, n[0], h * w, e));
	free(x);
	return rc;
}
