/* evidence-files.c: see evidence-files.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "tools/lib/evidence-files.h"
#include "formats/format.h"
#include "formats/units.h"
#include "tools/lib/geometry-opts.h"

int ct_evidence_files_read(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_evidence_rule r = {.in = f->in,
		.base = f->base,
		.projections = f->projections,
		.std = f->std,
		.lr = f->lr};

	if (ct_stack_read(f->in, &d->in, e) || ct_vol_read_hu(f->base, &d->base, env, e) ||
		(f->lr && ct_vol_read_hu(f->lr, &d->lr, env, e)) ||
		(f->std && ct_stack_read(f->std, &d->weight, e)) ||
		(f->projections && ct_stack_read(f->projections, &d->base_proj, e)))
		return -1;
	return ct_err_any(ct_geometry_opts_asked(&r.window, f->window, e) ||
			  ct_evidence_check(d, &r, env, e));
}
