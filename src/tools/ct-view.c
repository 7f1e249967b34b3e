/* ct-view: slices and projections side by side in a PNG. */
#include "config.h"
#include "cli/cli.h"
#include "cli/memory.h"
#include "cli/modes.h"
#include "core/mem.h"
#include "core/room.h"
#include "formats/any.h"
#include "formats/io.h"
#include "shim/image.h"
#include "tools/sheet.h"

#include <stdlib.h>
#include <string.h>

struct params {
	struct ct_list files;
	const char *out, *window, *error_window, *memory;
	double zoom, slice;
	int plane, views;
	bool error;
};

enum { GAP = 4 };             /* pixels between tiles */
#define LIBRARIES 100663296.0 /* bytes, of what writes pictures, beyond those of any command */

static const struct params defaults = {
	.zoom = 1, .slice = 0.5, .plane = SHEET_ALL_PLANES, .views = 12};

static const struct ct_opt opts[] = {
	CT_ARG_OUT(struct params, files, CT_READS_WRITES, "FILE", CT_ENDS_PICTURE,
		"NIfTI volumes or EXR stacks, or -; the last one is the PNG to write, or -, unless "
		"--output names it"),
	CT_OUTPUT(struct params, out, 'o', "output", "OUT", CT_ENDS_PICTURE, "PNG to write, or -"),
	CT_CHOICE(struct params, plane, 'p', "plane", CT_WORDS_TWO(MONTAGE_PLANE_LIST, SHEET_LIST),
		"which slices of a volume, one row of the picture each"),
	CT_OPT(struct params, slice, 0, "slice", "F", 0, 1,
		"where to cut a volume: 0 most inferior, posterior, left; 1 most superior, "
		"anterior, right"),
	CT_OPT(struct params, views, 0, "views", "N", 1, 10000,
		"show N views of a stack, evenly spaced"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"values drawn black and white (default -200:300 for HU, 0:1 for density, else the "
		"range of what is shown)"),
	CT_OPT(struct params, zoom, 'z', "zoom", "N", 1.0 / 64, 64,
		"pixels for the finest voxel spacing that is shown"),
	CT_OPT(struct params, error, 'e', "error", NULL, 0, 0,
		"add maps of the absolute difference to the first file"),
	CT_OPT(struct params, error_window, 0, "error-window", "LO:HI", 0, 0,
		"differences drawn black and white (default 0 to a quarter of the window)",
		CT_WHEN(CT_IF(struct params, error))),
	CT_MEMORY(struct params, memory),
	CT_OPT_END,
};

static int draw(const struct sheet *s, const char *out, const struct ct_env *env, struct ct_err *e)
{
	unsigned char *rgb = NULL, *png = NULL;
	struct ct_out o = {0};
	size_t h, w, n;
	int rc = -1;

	if (montage_size(&h, &w, s->rows, s->cols, s->tile, s->mm, GAP, e) ||
		ct_alloc(&rgb, h * w, 3, e))
		return -1;
	montage_draw(rgb, h, w, s->rows, s->cols, s->tile, s->mm, GAP);
	if (ct_image_encode_png(&png, &n, w, h, 3, rgb, e) == 0 &&
		ct_out_open(&o, out, env, e) == 0 && ct_put(&o, png, n, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(png);
	free(rgb);
	return rc;
}

/* Of the options, those for volumes or for stacks alone. */
static int check_kind(const struct ct_any *a, const struct ct_given *given, struct ct_err *e)
{
	static const char *const of_volume[] = {"plane", "slice", NULL}, *const of_stack[] = {
										 "views", NULL};

	for (const char *const *o = a->kind == CT_KIND_STACK ? of_volume : of_stack; *o; o++)
		if (ct_modes_given(given, *o))
			return ct_fail(
				e, CT_EUSAGE, "--%s is not for a %s", *o, ct_kind_name(a->kind));
	return 0;
}

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

/* The files are what takes it. */
static int settle_memory(struct ct_memory *m, const struct ct_any *a, size_t n,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t view[3] = {a->stack.w, a->stack.h, 1};
	const bool stack = a->kind == CT_KIND_STACK;
	double bytes = 0;

	for (size_t i = 0; i < n; i++)
		bytes +=
			4 * (double)(stack ? ct_stack_count(&a[i].stack) : ct_vol_count(&a[i].vol));
	return ct_memory_settle(m, bytes, stack ? view : a->vol.n, LIBRARIES, env, e);
}

static int rule_of(struct sheet_rule *r, double window[2], double error[2], const struct params *p,
	struct ct_err *e)
{
	*r = (struct sheet_rule){.plane = p->plane,
		.slice = p->slice,
		.zoom = p->zoom,
		.views = (size_t)p->views,
		.error = p->error};
	if (p->window && ct_cli_range("window", p->window, window, e))
		return -1;
	if (p->error_window && ct_cli_range("error-window", p->error_window, error, e))
		return -1;
	r->window = p->window ? window : NULL;
	r->error_window = p->error_window ? error : NULL;
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

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_any *a = NULL;
	struct ct_memory memory;
	struct sheet_rule rule;
	struct sheet s = {0};
	double window[2], error[2];
	const char *out;
	size_t n;
	int rc = -1;

	if (operands(p, &n, &out, e) || rule_of(&rule, window, error, p, e) ||
		ct_memory_begin(&memory, p->memory, out, (double)n, e) ||
		ct_alloc0(&a, n, sizeof *a, e))
		return -1;
	if (read_files(a, p, n, e) == 0 && check_kind(a, env->given, e) == 0 &&
		settle_memory(&memory, a, n, env, e) == 0 && sheet_make(&s, n, a, &rule, e) == 0)
		rc = draw(&s, out, env, e);
	for (size_t i = 0; i < n; i++)
		ct_any_free(&a[i]);
	free(a);
	sheet_free(&s);
	ct_room_close();
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
