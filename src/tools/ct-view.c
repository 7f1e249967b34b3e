/* ct-view: slices and projections side by side in a picture. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/modes.h"
#include "core/mem.h"
#include "core/stream.h"
#include "formats/any.h"
#include "formats/png.h"
#include "formats/io.h"
#include "report/sheet.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* X(name, width, level): windows of HU.
 *
 * Width and level are those of the article "Windowing (CT)" of Radiopaedia.org: brain 80 at 40,
 * stroke 40 at 40, temporal bones 2800 at 600, lungs 1500 at -600, mediastinum 350 at 50, soft
 * tissues (abdomen) 400 at 50, liver 150 at 30, soft tissues of the spine 250 at 50, bone 1800 at
 * 400. A window reaches from level - width / 2 to level + width / 2.
 */
#define HU_WINDOWS(X)                                                                              \
	X("brain", 80, 40)                                                                         \
	X("stroke", 40, 40)                                                                        \
	X("temporal", 2800, 600)                                                                   \
	X("lung", 1500, -600)                                                                      \
	X("mediastinum", 350, 50)                                                                  \
	X("soft", 400, 50)                                                                         \
	X("liver", 150, 30)                                                                        \
	X("spine", 250, 50)                                                                        \
	X("bone", 1800, 400)
#define HU_WINDOW_SPACE(name, width, level) " " name

struct params {
	struct ct_list files;
	const char *out, *slice, *window, *error_window, *names;
	double zoom, thickness;
	int plane, slices, slab, views, map;
	bool error, labels;
};

static const struct params defaults = {.slice = "0.5",
	.zoom = 1,
	.plane = CT_SHEET_ALL_PLANES,
	.slices = 1,
	.views = 12,
	.thickness = (double)NAN};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG_OUT(files, CT_READS_WRITES, "FILE", CT_ENDS_PICTURE "|" CT_ENDS_DRAWING,
		"CT volumes, or EXR projections; the last name is the PNG or SVG to write, unless "
		"--output gives it"),
	CT_OUTPUT(out, 'o', "output", "OUT", CT_ENDS_PICTURE "|" CT_ENDS_DRAWING,
		"write the picture to OUT: PNG, or SVG with labels in real type; - is a PNG on "
		"standard output"),
	CT_CHOICE(plane, 'p', "plane", CT_WORDS_TWO(CT_MONTAGE_PLANE_LIST, CT_SHEET_LIST),
		"show these planes of a volume"),
	CT_TEXT(slice, 0, "slice", "F,...",
		"cut at these places: fractions of the first volume, or world coordinates as "
		"12.5mm"),
	CT_OPT(slices, 0, "slices", "N", 1, CT_SHEET_CUTS,
		"show N evenly spaced slices of each plane", CT_WHEN(CT_UNLESS(slice))),
	CT_CHOICE(slab, 0, "mip", CT_WORDS(CT_MIP_LIST),
		"project the largest, least or mean value along the rays across each plane"),
	CT_OPT(thickness, 0, "thickness", "MM", 1e-3, 1e6,
		"project a slab of MM mm around each slice, not the whole volume",
		CT_WHEN(CT_UNLESS_WORD(slab, CT_BIT(CT_MIP_NONE)))),
	CT_OPT(views, 0, "views", "N", 1, 10000, "show N evenly spaced views of the projections"),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"draw LO black and HI white, or use a named HU window:" HU_WINDOWS(
			HU_WINDOW_SPACE) " (default: -200:300 for HU, 0:1 for density, else the "
					 "range of what is shown)"),
	CT_OPT(zoom, 'z', "zoom", "N", 1.0 / 64, 64, "draw N pixels for the finest voxel spacing"),
	CT_FLAG(error, 'e', "error", "add maps of the absolute difference from the first file"),
	CT_CHOICE(map, 0, "error-map", CT_WORDS(CT_COLOUR_ERROR_LIST),
		"draw the maps in these colours; signed shows the sign of the difference",
		CT_WHEN(CT_IF(error))),
	CT_TEXT(error_window, 0, "error-window", "LO:HI",
		"differences at the ends of the colours (default: up to a quarter of the window)",
		CT_WHEN(CT_IF(error))),
	CT_FLAG(labels, 'l', "labels",
		"write names, positions, sides of the patient, a scale bar and colour bars"),
	CT_TEXT(names, 0, "names", "TEXT,...", "write these names instead of those of the files",
		CT_WHEN(CT_IF(labels))),
	CT_OPT_END,
};

/* Refuses options that do not apply to this kind of file. */
static int check_kind(const struct ct_any *a, const struct ct_given *given, struct ct_err *e)
{
	static const char *const of_volume[] = {"plane", "slice", "slices", "mip", NULL},
				 *const of_stack[] = {"views", NULL};

	for (const char *const *o = a->kind == CT_KIND_STACK ? of_volume : of_stack; *o; o++)
		if (ct_modes_given(given, *o))
			return ct_fail(e, CT_EUSAGE, "--%s: does not apply to a %s", *o,
				ct_kind_name(a->kind));
	return 0;
}

/* Everything that one run owns. */
struct view_job {
	size_t n;
	struct ct_any *file;
	struct ct_sheet_cut *cut;
	const char **name;
	char *names;
	struct ct_sheet sheet;
};

static int read_files(struct ct_any *a, const struct params *p, size_t n, struct ct_err *e)
{
	for (size_t i = 0; i < n; i++) {
		const char *path = p->files.v[i];

		if (ct_any_read(path, &a[i], e))
			return -1;
		if (a[i].kind != CT_KIND_VOLUME && a[i].kind != CT_KIND_STACK)
			return ct_fail(e, CT_EINPUT, "%s: is %s: expected a volume or projections",
				path, ct_kind_name(a[i].kind));
		if (a[i].kind != a[0].kind)
			return ct_fail(e, CT_EUSAGE,
				"%s is a %s but %s is a %s: give files of one kind", p->files.v[0],
				ct_kind_name(a[0].kind), path, ct_kind_name(a[i].kind));
	}
	return 0;
}

/* A named window needs values in HU. */
static int check_unit(const struct ct_any *a, const struct params *p, const struct ct_sheet_rule *r,
	struct ct_err *e)
{
	if (r->window_hu && !ct_sheet_in_hu(a))
		return ct_fail(e, CT_EUSAGE,
			"--window=%s needs values in HU, but %s is not in HU: give LO:HI",
			p->window, p->files.v[0]);
	return 0;
}

#define ROW(name, width, level) {name, {(level) - (width) / 2.0, (level) + (width) / 2.0}},
static const struct {
	const char *name;
	double window[2];
} windows[] = {HU_WINDOWS(ROW)};

/* "LO:HI" of any unit, or a name, which sets *hu. */
static int window_of(double window[2], bool *hu, const char *text, struct ct_err *e)
{
	*hu = isalpha((unsigned char)*text);
	if (!*hu)
		return ct_cli_range("window", text, window, e);
	for (size_t i = 0; i < sizeof windows / sizeof *windows; i++)
		if (strcmp(text, windows[i].name) == 0) {
			memcpy(window, windows[i].window, sizeof windows[i].window);
			return 0;
		}
	return ct_fail(e, CT_EUSAGE,
		"--window: '%s' is neither LO:HI nor one of" HU_WINDOWS(HU_WINDOW_SPACE), text);
}

static int rule_of(struct ct_sheet_rule *r, double window[2], double error[2],
	const struct params *p, struct ct_err *e)
{
	*r = (struct ct_sheet_rule){.plane = p->plane,
		.zoom = p->zoom,
		.views = (size_t)p->views,
		.error = p->error,
		.map = (enum ct_colour_map)p->map,
		.slab = (enum ct_mip)p->slab,
		.thickness = isnan(p->thickness) ? 0 : p->thickness};
	if (p->window && window_of(window, &r->window_hu, p->window, e))
		return -1;
	if (p->error_window && ct_cli_range("error-window", p->error_window, error, e))
		return -1;
	if (p->error_window && p->map == CT_COLOUR_SIGNED && error[0] != -error[1])
		return ct_fail(e, CT_EUSAGE,
			"--error-window: with --error-map=signed expected -X:X, whose middle is 0");
	if (p->error_window && p->map != CT_COLOUR_SIGNED && error[0] < 0)
		return ct_fail(
			e, CT_EUSAGE, "--error-window: absolute differences are not below 0");
	r->window = p->window ? window : NULL;
	r->error_window = p->error_window ? error : NULL;
	return 0;
}

/* The first of a list; *rest is behind it and its comma, NULL at the end. */
static bool one_cut(struct ct_sheet_cut *c, const char *text, const char **rest)
{
	const char *end;

	c->at = ct_number_begin(text, &end);
	c->mm = strncmp(end, "mm", 2) == 0;
	if (end == text || (!c->mm && !(c->at >= 0 && c->at <= 1)))
		return false;
	end += c->mm ? 2 : 0;
	if (*end && *end != ',')
		return false;
	*rest = *end ? end + 1 : NULL;
	return true;
}

/* "0.25,0.5" or "-12.5mm,40mm", also mixed. */
static int parse_cuts(struct ct_sheet_cut *cut, size_t *n, const char *text, struct ct_err *e)
{
	const char *at = text;

	for (*n = 0; at && *n < CT_SHEET_CUTS; ++*n)
		if (!one_cut(&cut[*n], at, &at))
			break;
	return at ? ct_fail(e, CT_EUSAGE,
			    "--slice: '%s' is not a list of numbers in [0, 1] or of places like "
			    "-12.5mm, at most %d",
			    text, CT_SHEET_CUTS)
		  : 0;
}

static int cuts_of(struct ct_sheet_cut **cut, struct ct_sheet_rule *r, const struct params *p,
	const struct ct_given *given, struct ct_err *e)
{
	const bool even = ct_modes_given(given, "slices");

	if (r->slab && !(r->thickness > 0) && (even || ct_modes_given(given, "slice")))
		return ct_fail(e, CT_EUSAGE, "--%s: with --mip it needs --thickness",
			even ? "slices" : "slice");
	if (ct_alloc0(cut, CT_SHEET_CUTS, sizeof **cut, e))
		return -1;
	r->cut = *cut;
	if (!even)
		return parse_cuts(*cut, &r->cuts, p->slice, e);
	r->cuts = (size_t)p->slices;
	for (size_t i = 0; i < r->cuts; i++) /* in the middles of as many equal parts */
		(*cut)[i].at = ((double)i + 0.5) / (double)r->cuts;
	return 0;
}

/* The names of n files, or those of --names, whose copy is *own. */
static int names_of(
	const char **name, char **own, size_t n, const struct params *p, struct ct_err *e)
{
	size_t got = 0;

	for (size_t i = 0; i < n; i++)
		name[i] = basename(p->files.v[i]);
	if (!p->names)
		return 0;
	if (ct_alloc(own, strlen(p->names) + 1, 1, e))
		return -1;
	memcpy(*own, p->names, strlen(p->names) + 1);
	for (char *at = *own; at; got++) {
		if (got < n)
			name[got] = at;
		at = strchr(at, ',');
		if (at)
			*at++ = '\0';
	}
	if (got != n)
		return ct_fail(e, CT_EUSAGE,
			"--names: expected %zu name%s, one for each file, not '%s'", n,
			n == 1 ? "" : "s", p->names);
	return 0;
}

/* Splits the operands into inputs and output. */
static int operands(const struct params *p, size_t *n, const char **out, struct ct_err *e)
{
	*n = p->files.n - (p->out ? 0 : 1);
	*out = p->out ? p->out : p->files.v[*n];
	if (*n == 0)
		return ct_fail(e, CT_EUSAGE, "missing OUT: name the PNG or SVG to write");
	if (p->error && *n < 2)
		return ct_fail(e, CT_EUSAGE, "--error: needs at least two files");
	return 0;
}

static void job_free(struct view_job *j)
{
	for (size_t i = 0; j->file && i < j->n; i++)
		ct_any_free(&j->file[i]);
	free(j->file);
	free(j->cut);
	free(j->name);
	free(j->names);
	ct_sheet_free(&j->sheet);
}

static int make(struct view_job *j, const struct params *p, struct ct_sheet_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = j->n;

	if (cuts_of(&j->cut, rule, p, &env->command->given, e) ||
		ct_alloc0(&j->file, n, sizeof *j->file, e) ||
		ct_alloc(&j->name, n, sizeof *j->name, e) || names_of(j->name, &j->names, n, p, e))
		return -1;
	return ct_err_any(
		read_files(j->file, p, n, e) || check_kind(j->file, &env->command->given, e) ||
		check_unit(j->file, p, rule, e) || ct_sheet_make(&j->sheet, n, j->file, rule, e));
}

/* The sheet with its labels; what is written on it goes to *text if the picture is SVG. */
static int draw(unsigned char **rgb, size_t *h, size_t *w, char **text, const struct view_job *j,
	const struct params *p, bool svg, struct ct_err *e)
{
	struct ct_labels l = {.sheet = &j->sheet,
		.names = p->labels ? j->n : 0,
		.name = j->name,
		.unit = ct_sheet_in_hu(j->file) ? "HU" : ""};
	size_t n;
	int rc;

	if (!svg)
		return ct_labels_draw(rgb, h, w, &l, e);
	if (ct_stream_open(&l.svg, text, &n, e))
		return -1;
	rc = ct_labels_draw(rgb, h, w, &l, e);
	return ct_err_any(ct_stream_close(l.svg, text, e) || rc);
}

/* As a PNG, or as SVG around one. */
static int write_picture(const struct view_job *j, const struct params *p, const char *path,
	const struct ct_env *env, struct ct_err *e)
{
	const bool svg = ct_ends_match(path, CT_ENDS_DRAWING);
	unsigned char *rgb = NULL, *png = NULL;
	struct ct_out o = {0};
	char *text = NULL;
	size_t h, w, n;
	int rc = -1;

	if (draw(&rgb, &h, &w, &text, j, p, svg, e) == 0 &&
		ct_png_encode(&png, &n, w, h, 3, rgb, e) == 0 &&
		ct_out_open(&o, path, env, e) == 0 &&
		(svg ? ct_labels_svg(o.f, h, w, png, n, text, e) : ct_put(&o, png, n, e)) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(text);
	free(png);
	free(rgb);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_sheet_rule rule;
	struct view_job j = {0};
	double window[2], error[2];
	const char *out;
	int rc = -1;

	if (operands(p, &j.n, &out, e) || rule_of(&rule, window, error, p, e))
		return -1;
	if (make(&j, p, &rule, env, e) == 0)
		rc = write_picture(&j, p, out, env, e);
	job_free(&j);
	return rc;
}

CT_CLI_MAIN("ct-view", "Draw slices of CT volumes, or projections, side by side in a picture.", 0)
