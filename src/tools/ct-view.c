/* ct-view: slices and projections side by side in a PNG. */
#include "config.h"
#include "cli/cli.h"
#include "cli/modes.h"
#include "core/mem.h"
#include "formats/any.h"
#include "gs/gaussian.h"
#include "tools/cuts.h"
#include "tools/hu-window.h"
#include "tools/profile.h"
#include "tools/sheet.h"
#include "tools/view-picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct params {
	struct ct_list files;
	const char *out, *slice, *window, *error_window, *names, *profile, *csv, *gaussians;
	double zoom, thickness, surface;
	int plane, slices, slab, views, map;
	bool error, labels;
};

enum { GAP = 4 };             /* pixels between tiles */
#define LIBRARIES 100663296.0 /* bytes, of what writes pictures, beyond those of any command */

static const struct params defaults = {.slice = "0.5",
	.zoom = 1,
	.plane = SHEET_ALL_PLANES,
	.slices = 1,
	.views = 12,
	.thickness = NAN,
	.surface = NAN};

static const struct ct_opt opts[] = {
	CT_ARG_OUT(struct params, files, CT_READS_WRITES, "FILE", CT_ENDS_PICTURE,
		"NIfTI volumes or EXR stacks, or -; the last one is the PNG to write, or -, unless "
		"--output names it"),
	CT_OUTPUT(struct params, out, 'o', "output", "OUT", CT_ENDS_PICTURE, "PNG to write, or -"),
	CT_CHOICE(struct params, plane, 'p', "plane", CT_WORDS_TWO(MONTAGE_PLANE_LIST, SHEET_LIST),
		"which slices of a volume, one row of the picture each"),
	CT_OPT(struct params, slice, 0, "slice", "F,...", 0, 0,
		"where to cut a volume: 0 most inferior, posterior, left; 1 most superior, "
		"anterior, right; or in world coordinates, as 12.5mm",
		CT_WHEN(CT_UNLESS(struct params, surface))),
	CT_OPT(struct params, slices, 0, "slices", "N", 1, CUTS_MOST,
		"N slices of a plane, evenly spaced",
		CT_WHEN(CT_UNLESS(struct params, slice), CT_UNLESS(struct params, surface))),
	CT_CHOICE(struct params, slab, 0, "mip", CT_WORDS(SLAB_LIST),
		"the largest, least or mean value of many slices, in one",
		CT_WHEN(CT_UNLESS(struct params, surface))),
	CT_OPT(struct params, thickness, 0, "thickness", "MM", 1e-3, 1e6,
		"only of those within so many mm, around --slice or --slices",
		CT_WHEN(CT_UNLESS_WORD(struct params, slab, CT_BIT(SLAB_NONE)))),
	CT_OPT(struct params, surface, 0, "surface", "HU", 0, 0,
		"the surface of this value, shaded, as seen across the plane, in the place of "
		"slices"),
	CT_OPT(struct params, views, 0, "views", "N", 1, 10000,
		"show N views of a stack, evenly spaced"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"values drawn black and white, or of HU one of" HU_WINDOW_LIST(
			HU_WINDOW_SPACE) " (default -200:300 for HU, 0:1 for density, else the "
					 "range of what is shown)",
		CT_WHEN(CT_UNLESS(struct params, surface))),
	CT_OPT(struct params, zoom, 'z', "zoom", "N", 1.0 / 64, 64,
		"pixels for the finest voxel spacing that is shown"),
	CT_OPT(struct params, error, 'e', "error", NULL, 0, 0,
		"add maps of the absolute difference to the first file",
		CT_WHEN(CT_UNLESS(struct params, surface))),
	CT_CHOICE(struct params, map, 0, "error-map", CT_WORDS(COLOUR_ERROR_LIST),
		"colours of the maps; signed ones show the difference with its sign",
		CT_WHEN(CT_IF(struct params, error))),
	CT_OPT(struct params, error_window, 0, "error-window", "LO:HI", 0, 0,
		"differences at the ends of the map (default 0, or of signed ones minus a quarter "
		"of the window, to a quarter of it)",
		CT_WHEN(CT_IF(struct params, error))),
	CT_OPT(struct params, labels, 'l', "labels", NULL, 0, 0,
		"write names of the files, planes, positions, sides of the patient, a scale bar "
		"and colour bars on and around the picture"),
	CT_OPT(struct params, names, 0, "names", "TEXT,...", 0, 0,
		"what to write for the names of the files", CT_WHEN(CT_IF(struct params, labels))),
	CT_OPT(struct params, profile, 0, "profile", "X0,Y0,Z0:X1,Y1,Z1", 0, 0,
		"plot the values along this line, world coordinates in mm, under the picture, "
		"and draw it on the slices it lies in"),
	CT_OUTPUT_BESIDE(struct params, csv, 0, "profile-csv", "CSV", CT_ENDS_TABLE,
		"write them as a table too", CT_WHEN(CT_IF(struct params, profile))),
	CT_INPUT(struct params, gaussians, 'g', "gaussians", "FILE",
		"draw the Gaussians (PLY) that a slice cuts on it, as ellipses of one standard "
		"deviation: of positive density orange, of negative one light blue",
		CT_WHEN(CT_UNLESS(struct params, surface))),
	CT_OPT_END,
};

/* Of the options, those for volumes or for stacks alone. */
static int check_kind(const struct ct_any *a, const struct ct_given *given, struct ct_err *e)
{
	static const char *const of_volume[] = {"plane", "slice", "slices", "mip", "surface",
		"profile", "gaussians", NULL},
				 *const of_stack[] = {"views", NULL};

	for (const char *const *o = a->kind == CT_KIND_STACK ? of_volume : of_stack; *o; o++)
		if (ct_modes_given(given, *o))
			return ct_fail(
				e, CT_EUSAGE, "--%s is not for a %s", *o, ct_kind_name(a->kind));
	return 0;
}

/* What a run holds. */
struct job {
	size_t n;
	struct ct_any *file;
	struct cut *cut;
	const char **name;
	char *names;
	struct sheet sheet;
	struct view_picture picture;
	struct profile profile;
	struct ct_any scene; /* of Gaussians */
	struct ct_gaussian *gaussian;
};

static int read_files(struct ct_any *a, const struct params *p, size_t n, struct ct_err *e)
{
	for (size_t i = 0; i < n; i++) {
		const char *path = p->files.v[i];

		if (ct_any_read(path, &a[i], e))
			return -1;
		if (a[i].kind != CT_KIND_VOLUME && a[i].kind != CT_KIND_STACK)
			return ct_fail(e, CT_EINPUT, "%s: %s cannot be drawn", path,
				ct_kind_name(a[i].kind));
		if (a[i].kind != a[0].kind)
			return ct_fail(e, CT_EUSAGE, "%s is a %s and %s a %s", p->files.v[0],
				ct_kind_name(a[0].kind), path, ct_kind_name(a[i].kind));
	}
	return 0;
}

/* A window by name is of HU. */
static int check_unit(const struct ct_any *a, const struct params *p, const struct sheet_rule *r,
	struct ct_err *e)
{
	if (r->window_hu && !sheet_in_hu(a))
		return ct_fail(e, CT_EUSAGE, "--window=%s is of HU, and %s is not in HU", p->window,
			p->files.v[0]);
	return 0;
}

static int rule_of(struct sheet_rule *r, double window[2], double error[2], const struct params *p,
	struct ct_err *e)
{
	*r = (struct sheet_rule){.plane = p->plane,
		.zoom = p->zoom,
		.views = (size_t)p->views,
		.error = p->error,
		.map = (enum colour_map)p->map,
		.slab = (enum slab)p->slab,
		.thickness = isnan(p->thickness) ? 0 : p->thickness};
	r->surface = !isnan(p->surface);
	r->level = p->surface;
	if (p->window && hu_window_parse(window, &r->window_hu, "window", p->window, e))
		return -1;
	if (p->error_window && ct_cli_range("error-window", p->error_window, error, e))
		return -1;
	r->window = p->window ? window : NULL;
	r->error_window = p->error_window ? error : NULL;
	return 0;
}

static int cuts_of(struct cut **cut, struct sheet_rule *r, const struct params *p,
	const struct ct_given *given, struct ct_err *e)
{
	const bool even = ct_modes_given(given, "slices");

	if (r->slab && !(r->thickness > 0) && (even || ct_modes_given(given, "slice")))
		return ct_fail(e, CT_EUSAGE, "--%s: of --mip needs --thickness",
			even ? "slices" : "slice");

	r->cuts = (size_t)p->slices;
	if (even ? cuts_even(cut, r->cuts, e) : cuts_parse(cut, &r->cuts, "slice", p->slice, e))
		return -1;
	r->cut = *cut;
	return 0;
}

/* The names of n files, or what --names says, in text[], which *own is for. */
static int names_of(
	const char **name, char **own, size_t n, const struct params *p, struct ct_err *e)
{
	size_t got = 0;

	for (size_t i = 0; i < n; i++) {
		const char *slash = strrchr(p->files.v[i], '/');

		name[i] = slash ? slash + 1 : p->files.v[i];
	}
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
		return ct_fail(e, CT_EUSAGE, "--names: '%s' is not %zu name%s", p->names, n,
			n == 1 ? "" : "s");
	return 0;
}

/* Inputs and output of the command line. */
static int operands(const struct params *p, size_t *n, const char **out, struct ct_err *e)
{
	*n = p->files.n - (p->out ? 0 : 1);
	*out = p->out ? p->out : p->files.v[*n];
	if (*n == 0)
		return ct_fail(e, CT_EUSAGE, "missing OUT");
	if (p->error && *n < 2)
		return ct_fail(e, CT_EUSAGE, "--error needs two files or more");
	return 0;
}

static int read_gaussians(struct job *j, const char *path, struct ct_par *par, struct ct_err *e)
{
	if (ct_any_read(path, &j->scene, e))
		return -1;
	if (j->scene.kind != CT_KIND_GAUSS)
		return ct_fail(
			e, CT_EINPUT, "%s: a %s, not Gaussians", path, ct_kind_name(j->scene.kind));
	if (ct_gauss_check_finite(&j->scene.gauss, e))
		return ct_blame(e, path);
	if (ct_alloc(&j->gaussian, j->scene.gauss.n, sizeof *j->gaussian, e))
		return -1;
	ct_gaussian_resolve(j->gaussian, &j->scene.gauss, par);
	return 0;
}

static void job_free(struct job *j)
{
	for (size_t i = 0; j->file && i < j->n; i++)
		ct_any_free(&j->file[i]);
	free(j->file);
	free(j->cut);
	free(j->name);
	free(j->names);
	profile_free(&j->profile);
	ct_any_free(&j->scene);
	free(j->gaussian);
	sheet_free(&j->sheet);
}

static int make(struct job *j, const struct params *p, struct sheet_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = j->n;

	rule->par = env->par;
	if (cuts_of(&j->cut, rule, p, env->given, e) ||
		ct_alloc0(&j->file, n, sizeof *j->file, e) ||
		ct_alloc(&j->name, n, sizeof *j->name, e) || names_of(j->name, &j->names, n, p, e))
		return -1;
	if ((p->gaussians && read_gaussians(j, p->gaussians, env->par, e)) ||
		read_files(j->file, p, n, e) || check_kind(j->file, env->given, e) ||
		check_unit(j->file, p, rule, e) || sheet_make(&j->sheet, n, j->file, rule, e))
		return -1;
	j->picture = (struct view_picture){.sheet = &j->sheet,
		.gap = GAP,
		.name = j->name,
		.names = n,
		.gaussians = j->scene.gauss.n,
		.gaussian = j->gaussian,
		.profile = p->profile ? &j->profile : NULL,
		.unit = sheet_in_hu(j->file) ? "HU" : "",
		.labelled = p->labels,
		.shaded = rule->surface};
	return p->profile ? profile_make(&j->profile, n, j->file, e) : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct sheet_rule rule;
	struct job j = {0};
	double window[2], error[2];
	const char *out;
	int rc = -1;

	if (operands(p, &j.n, &out, e) || rule_of(&rule, window, error, p, e) ||
		(p->profile && profile_parse(j.profile.end, "profile", p->profile, e)))
		return -1;
	if (make(&j, p, &rule, env, e) == 0 &&
		(!p->csv || profile_write(&j.profile, j.name, p->csv, env, e) == 0))
		rc = view_picture_write(&j.picture, out, env, e);
	job_free(&j);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-view",
	.brief = "Draw slices of volumes or views of projections side by side.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
