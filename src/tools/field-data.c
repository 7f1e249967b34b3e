/* field-data.c: see field.h. */
#include "config.h"
#include "tools/field.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "tools/lib/evidence.h"
#include "tools/lib/geometry-opts.h"
#include "xray/window.h"

#include <string.h>

int field_is_stack(bool *stack, const char *in, bool rays, struct ct_err *e)
{
	static const unsigned char exr[4] = {0x76, 0x2f, 0x31, 0x01};
	unsigned char is[4] = {0};
	FILE *f;

	*stack = rays;
	if (strcmp(in, "-") == 0)
		return 0;
	if (ct_io_open(in, &f, e))
		return -1;
	*stack = fread(is, 1, sizeof is, f) == sizeof is && memcmp(is, exr, sizeof is) == 0;
	ct_io_close(f);
	return 0;
}

static int read_stack(struct field_input *i, const struct field_files *f, struct ct_err *e)
{
	if (f->factor)
		return ct_fail(
			e, CT_EUSAGE, "--factor: %s is a stack, whose grid --grid says", f->in);
	if (ct_evidence_stack(&i->rays, f->in, CT_QUANTITY_LINE_INTEGRAL, e) ||
		ct_geometry_opts_window(i->window, f->window, &i->rays.meta, e) ||
		ct_geometry_opts_grid(&i->fine, f->grid, &i->rays, e))
		return -1;
	i->out = i->fine;
	return 0;
}

static int find_grids(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_said said = CT_SAID_NOTHING;

	if (f->factor &&
		ct_cli_within("factor", f->factor, 3, true, 1, CT_SAID_TIMES, said.factor, e))
		return -1;
	if (ct_operator_find(&i->is, &said, false, &i->lr, env, e))
		return ct_blame(e, f->in);
	for (int a = 0; a < 3; a++)
		i->fine.n[a] = ct_degrade_cover(i->lr.n[a], i->is.by.factor[a]);
	ct_degrade_refine(
		i->fine.affine, (const double(*)[4])i->lr.affine, i->lr.n, i->is.by.factor);
	i->out = i->fine;
	if (!f->grid)
		return 0;
	if (ct_vol_read(f->grid, &i->like, e))
		return -1;
	memcpy(i->out.n, i->like.n, sizeof i->out.n);
	memcpy(i->out.affine, i->like.affine, sizeof i->out.affine);
	return ct_vol_check_grid(&i->out, e) ? ct_blame(e, f->grid) : 0;
}

static int read_volume(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_vol *v = &i->lr;

	if (ct_evidence_base(v, f->in, env, e) ||
		ct_geometry_opts_window(i->window, f->window, &v->meta, e) ||
		find_grids(i, f, env, e))
		return -1;
	ct_window_density_open(ct_vol_count(v), v->data, v->data, i->window);
	return 0;
}

int field_read(struct field_input *i, const struct field_files *f, bool stack,
	const struct ct_env *env, struct ct_err *e)
{
	return stack ? read_stack(i, f, e) : read_volume(i, f, env, e);
}

void field_free(struct field_input *i)
{
	ct_vol_free(&i->lr);
	ct_stack_free(&i->rays);
	ct_vol_free(&i->fine);
	ct_vol_free(&i->out);
	ct_vol_free(&i->like);
}

int field_finish(struct field_input *i, const struct field_files *f, const struct ct_env *env,
	struct ct_err *e)
{
	const bool rays = i->rays.views > 0;
	const struct ct_meta *const in[] = {
		rays ? &i->rays.meta : &i->lr.meta, i->like.data ? &i->like.meta : NULL};
	struct ct_vol *out = &i->out;
	const size_t n = ct_vol_count(out);

	for (size_t k = 0; k < n; k++)
		out->data[k] = out->data[k] < 0 ? 0 : out->data[k] > 1 ? 1 : out->data[k];
	if (rays ? ct_geometry_opts_volume(out, &i->rays, f->window, false, e)
		 : ct_meta_copy(&out->meta, &i->lr.meta, e) ||
				ct_window_put(&out->meta, i->window, e) ||
				ct_window_volume(out, false, i->window, e) ||
				(i->is.known && ct_degrade_put(&out->meta, &i->is.by, e)) ||
				ct_meta_set(&out->meta, CT_META_UPSAMPLE, "field", e))
		return -1;
	return ct_meta_step(&out->meta, env, 2, in, e);
}
