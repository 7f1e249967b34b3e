/* profile.c: see profile.h. */
#include "config.h"
#include "tools/profile.h"
#include "cli/cli.h"
#include "core/mem.h"
#include "formats/io.h"
#include "tools/sample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TALL = 140, WIDE = 240, LEFT = 8 * TEXT_W };

int profile_parse(double end[2][3], const char *option, const char *text, struct ct_err *e)
{
	const char *colon = strchr(text, ':');
	char first[200];
	const size_t n = colon ? (size_t)(colon - text) : sizeof first;

	if (n >= sizeof first)
		return ct_fail(
			e, CT_EUSAGE, "--%s: '%.80s' is not X0,Y0,Z0:X1,Y1,Z1", option, text);
	memcpy(first, text, n);
	first[n] = '\0';
	if (ct_cli_numbers(option, first, ',', 3, false, end[0], e) ||
		ct_cli_numbers(option, colon + 1, ',', 3, false, end[1], e))
		return -1;
	return 0;
}

static double length(const struct profile *p)
{
	return hypot(hypot(p->end[1][0] - p->end[0][0], p->end[1][1] - p->end[0][1]),
		p->end[1][2] - p->end[0][2]);
}

void profile_place(double world[static 3], const struct profile *p, size_t i)
{
	const double t = p->n > 1 ? (double)i / (double)(p->n - 1) : 0;

	for (int a = 0; a < 3; a++)
		world[a] = p->end[0][a] + t * (p->end[1][a] - p->end[0][a]);
}

int profile_make(struct profile *p, size_t files, const struct ct_any *file, struct ct_err *e)
{
	double fine = (double)INFINITY, mm[3], n;
	size_t inside = 0;

	for (size_t f = 0; f < files; f++) {
		ct_vol_spacing(&file[f].vol, mm);
		fine = fmin(fine, fmin(mm[0], fmin(mm[1], mm[2])));
	}
	n = ceil(length(p) / (fine / 2) - 1e-9) + 1;
	if (!(n <= PROFILE_MOST))
		return ct_fail(
			e, CT_EUSAGE, "a profile of %.0f places, more than %d", n, PROFILE_MOST);
	p->n = (size_t)n;
	p->files = files;
	if (ct_alloc(&p->value, p->n * files, sizeof *p->value, e))
		return -1;
	for (size_t f = 0; f < files; f++)
		for (size_t i = 0; i < p->n; i++) {
			double world[3], ijk[3], *x = &p->value[f * p->n + i];

			profile_place(world, p, i);
			sample_index(ijk, &file[f].vol, world);
			*x = sample_linear(&file[f].vol, ijk);
			inside += (size_t)!isnan(*x);
		}
	return inside ? 0 : ct_fail(e, CT_EGEOM, "the profile is outside of the volumes");
}

void profile_free(struct profile *p)
{
	free(p->value);
	p->value = NULL;
}

/* A field of CSV: in quotes if it has commas or quotes. */
static int put_name(struct ct_out *o, const char *name, struct ct_err *e)
{
	const bool quoted = strpbrk(name, ",\"\n") != NULL;

	if (ct_put(o, ",\"", quoted ? 2 : 1, e))
		return -1;
	for (; *name; name++)
		if ((*name == '"' && ct_put(o, "\"", 1, e)) || ct_put(o, name, 1, e))
			return -1;
	return quoted ? ct_put(o, "\"", 1, e) : 0;
}

static int put_lines(
	struct ct_out *o, const struct profile *p, const char *const *name, struct ct_err *e)
{
	char text[200];

	if (ct_put(o, "mm,x,y,z", 8, e))
		return -1;
	for (size_t f = 0; f < p->files; f++)
		if (put_name(o, name[f], e))
			return -1;
	for (size_t i = 0; i < p->n; i++) {
		double w[3], at = p->n > 1 ? length(p) * (double)i / (double)(p->n - 1) : 0;
		int n;

		profile_place(w, p, i);
		n = snprintf(text, sizeof text, "\n%.9g,%.9g,%.9g,%.9g", at, w[0], w[1], w[2]);
		if (ct_put(o, text, (size_t)n, e))
			return -1;
		for (size_t f = 0; f < p->files; f++) {
			const double x = p->value[f * p->n + i];

			n = isnan(x) ? snprintf(text, sizeof text, ",")
				     : snprintf(text, sizeof text, ",%.9g", x);
			if (ct_put(o, text, (size_t)n, e))
				return -1;
		}
	}
	return ct_put(o, "\n", 1, e);
}

int profile_write(const struct profile *p, const char *const *name, const char *path,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_out o = {0};
	int rc = -1;

	if (ct_out_open(&o, path, env, e) == 0 && put_lines(&o, p, name, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	return rc;
}

const unsigned char *profile_colour(size_t file)
{
	/* M. Okabe and K. Ito, "Color Universal Design": told apart by all who see colours */
	static const unsigned char colour[PROFILE_COLOURS][3] = {{230, 159, 0}, {86, 180, 233},
		{0, 158, 115}, {240, 228, 66}, {204, 121, 167}, {213, 94, 0}, {0, 114, 178}};

	return colour[file % PROFILE_COLOURS];
}

void profile_size(size_t *h, size_t *w, size_t scale)
{
	*h = scale * TALL;
	*w = scale * WIDE;
}

/* Least and largest finite value, apart. */
static void range_of(double range[2], const struct profile *p)
{
	range[0] = (double)INFINITY;
	range[1] = -(double)INFINITY;
	for (size_t i = 0; i < p->n * p->files; i++)
		if (isfinite(p->value[i])) {
			range[0] = fmin(range[0], p->value[i]);
			range[1] = fmax(range[1], p->value[i]);
		}
	if (!(range[0] < range[1])) {
		range[0] = isfinite(range[0]) ? range[0] - 1 : 0;
		range[1] = range[0] + 2;
	}
}

void profile_draw(const struct profile *p, const char *const *name, const struct canvas *c,
	size_t top, size_t scale)
{
	static const unsigned char white[3] = {255, 255, 255}, grey[3] = {90, 90, 90};
	const double s = (double)scale, y0 = (double)top + s * (TEXT_H + 4), x0 = s * LEFT,
		     y1 = (double)c->h - s * (TEXT_H + 4), x1 = (double)c->w - s * 4;
	const ptrdiff_t below = (ptrdiff_t)y1 + 3 * (ptrdiff_t)scale;
	double range[2];
	char text[40];
	size_t x = (size_t)x0;

	range_of(range, p);
	canvas_line(c, y1, x0, y1, x1, grey);
	canvas_line(c, y0, x0, y1, x0, grey);
	for (int k = 0; k < 3; k++) {
		snprintf(text, sizeof text, "%.4g", range[1] + k * (range[0] - range[1]) / 2);
		text_draw(c, (ptrdiff_t)(y0 + k * (y1 - y0) / 2) - 4 * (ptrdiff_t)scale,
			2 * (ptrdiff_t)scale, scale, text, false, white);
	}
	text_draw(c, below, (ptrdiff_t)x0, scale, "0", false, white);
	snprintf(text, sizeof text, "%.4g mm", length(p));
	text_draw(c, below, (ptrdiff_t)(x1 - s * (double)text_width(text)), scale, text, false,
		white);
	for (size_t f = 0; f < p->files; f++) {
		const double *v = &p->value[f * p->n];

		text_draw(c, (ptrdiff_t)top + 2 * (ptrdiff_t)scale, (ptrdiff_t)x, scale, name[f],
			false, profile_colour(f));
		x += scale * (text_width(name[f]) + 2 * TEXT_W);
		for (size_t i = 1; i < p->n; i++) {
			const double n = (double)(p->n - 1),
				     from = x0 + (double)(i - 1) / n * (x1 - x0),
				     to = x0 + (double)i / n * (x1 - x0),
				     up = (y0 - y1) / (range[1] - range[0]);

			if (isfinite(v[i - 1]) && isfinite(v[i]))
				canvas_line(c, y1 + (v[i - 1] - range[0]) * up, from,
					y1 + (v[i] - range[0]) * up, to, profile_colour(f));
		}
	}
}
