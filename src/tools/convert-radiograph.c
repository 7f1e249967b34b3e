/* convert-radiograph.c: a volume of one plane as a stack of one view. */
#include "config.h"
#include "core/stack.h"
#include "formats/format.h"
#include "tools/convert.h"

#include <math.h>
#include <string.h>

enum { FAR = 1000 }; /* mm from the plane to what stands for the source of parallel rays */

/* Rays cross the plane at right angles. */
static void place(struct ct_view *view, const struct ct_vol *v)
{
	double n[3], length;

	ct_vol_centre(v, view->centre);
	for (int r = 0; r < 3; r++) {
		const int s = (r + 1) % 3, t = (r + 2) % 3;

		view->u[r] = v->affine[r][0];
		view->v[r] = v->affine[r][1];
		n[r] = v->affine[s][0] * v->affine[t][1] - v->affine[t][0] * v->affine[s][1];
	}
	length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
	for (int r = 0; r < 3; r++)
		view->source[r] = view->centre[r] - FAR * n[r] / length;
}

static int check(const struct ct_vol *v, bool intensity, struct ct_err *e)
{
	if (v->n[2] != 1)
		return ct_fail(e, CT_EGEOM, "--radiograph: has %zu planes, not one", v->n[2]);
	for (size_t i = 0, n = ct_vol_count(v); i < n && intensity; i++)
		if (!(v->data[i] >= 0 && v->data[i] <= 1))
			return ct_fail(e, CT_EINPUT,
				"--radiograph: pixel %zu,%zu is %g, no grey value from 0 to 1",
				i % v->n[0], i / v->n[0], (double)v->data[i]);
	return 0;
}

int convert_radiograph(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const bool intensity = p->radiograph == CONVERT_INTENSITY;
	struct ct_stack s = {0};
	int rc = -1;

	if (check(v, intensity, e))
		return ct_blame(e, p->in);
	if (ct_stack_alloc(&s, 1, v->n[1], v->n[0], e))
		return -1;
	memcpy(s.data, v->data, ct_vol_count(v) * sizeof *s.data);
	s.beam = CT_PARALLEL;
	place(&s.view[0], v);
	if (ct_meta_set(&s.meta, CT_META_QUANTITY,
		    intensity ? CT_QUANTITY_INTENSITY : CT_QUANTITY_LINE_INTEGRAL, e) == 0 &&
		ct_meta_step(&s.meta, env, 1, (const struct ct_meta *const[]){&v->meta}, e) == 0)
		rc = ct_stack_write(p->out, &s, env, e);
	ct_stack_free(&s);
	return rc;
}
