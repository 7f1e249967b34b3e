/* convert-stack.c: projections of other programs: numbers of numpy, geometry of a scanner file. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/raw.h"
#include "xray/geometry.h"
#include "recon/scan-grid.h"
#include "tools/convert.h"
#include "tools/lib/geometry-json.h"
#include "tools/lib/geometry-opts.h"

#include <stdlib.h>
#include <string.h>

/* The scan of a file in its own unit, about the world's origin, for views of w by h pixels. */
static int scan_for(struct ct_geometry *s, struct ct_vol *named, const char *path,
	const size_t n[3], struct ct_err *e)
{
	struct ct_vol world = {
		.n = {1, 1, 1}, .affine = {{256, 0, 0, 0}, {0, 256, 0, 0}, {0, 0, 256, 0}}};

	ct_geometry_default(s, n[1] == 1 ? CT_FAN : CT_CONE, &world);
	s->views = n[0];
	s->h = n[1];
	s->w = n[2];
	if (ct_geometry_json_read(s, path, NULL, named, e))
		return -1;
	if (s->views != n[0] || s->h != n[1] || s->w != n[2])
		return ct_fail(e, CT_EGEOM,
			"%s says %zu views of %zux%zu pixels, but the array has %zu of %zux%zu",
			path, s->views, s->w, s->h, n[0], n[2], n[1]);
	return 0;
}

int convert_stack(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_stack s = {0};
	struct ct_meta read = {0};
	struct ct_vol named = {0};
	struct ct_geometry scan;
	float *data = NULL;
	size_t n[3];
	int rc = -1;

	if (ct_raw_npy(p->in, p->slope, p->inter, n, &data, e) ||
		scan_for(&scan, &named, p->scanner, n, e) || ct_geometry_fill(&s, &scan, e))
		goto out;
	memcpy(s.data, data, ct_stack_count(&s) * sizeof *s.data);
	if (ct_stack_check_finite(&s, e)) {
		ct_blame(e, p->in);
		goto out;
	}
	if (ct_meta_input(&read, p->in, 2,
		    (const struct ct_piece[]){
			    {n, sizeof n}, {s.data, ct_stack_count(&s) * sizeof *s.data}},
		    e) ||
		ct_meta_set(&s.meta, CT_META_QUANTITY, CT_QUANTITY_LINE_INTEGRAL, e) ||
		(named.n[0] && ct_scan_grid_put(&s.meta, &named, e)) ||
		ct_meta_step(&s.meta, env, 1, (const struct ct_meta *const[]){&read}, e))
		goto out;
	rc = ct_stack_write(p->out, &s, env, e);
out:
	free(data);
	ct_meta_free(&read);
	ct_stack_free(&s);
	return rc;
}
